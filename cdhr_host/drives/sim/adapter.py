"""The far end of a serial CAN adapter: the host's text to frames and back."""

from collections.abc import Iterable

from cdhr_host.drives.sim.node import Frame


class Adapter:
    """Reads the host's text character by character; ``flags`` is its status byte."""

    def __init__(self) -> None:
        self.open = False
        self.flags = 0
        self._text = ""
        self._answers = ""

    def frames(self, data: bytes) -> list[Frame]:
        """Frames the host wants on the bus."""
        found = []
        for character in data.decode("ascii", "replace"):
            if character != "\r":
                self._text += character
                continue
            text, self._text = self._text, ""
            if text[:1] == "t" and self.open:
                found.append((int(text[1:4], 16), bytes.fromhex(text[5 : 5 + 2 * int(text[4])])))
            else:
                self._command(text)
        return found

    def text(self, frames: Iterable[Frame]) -> bytes:
        """What the host reads: answers to its commands, then frames."""
        answers, self._answers = self._answers, ""
        if not self.open:
            return answers.encode()
        lines = (f"t{cob:03x}{len(data):d}" + "".join(f"{byte:02x}" for byte in data) for cob, data in frames)
        return (answers + "".join(line + "\r" for line in lines)).encode()

    def _command(self, text: str) -> None:
        if text in ("O", "C"):
            self.open = text == "O"
            self._answers += "\r"
        elif text == "F":
            self._answers += f"F{self.flags:02X}\r"
        elif text[:1] == "S":
            self._answers += "\r"
        else:
            self._answers += "\a"
