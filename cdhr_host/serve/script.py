"""Scripts of clients: several lines as one, in one go, with nobody else's line in between."""

import asyncio
import difflib
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from cdhr_host.errors import JobError, Problem
from cdhr_host.job.surface import JobState
from cdhr_host.program.words import WORDS
from cdhr_host.serve.host import Host
from cdhr_host.serve.model import ACTIVE, PAUSED
from cdhr_host.serve.words import Modes, bare, code_of, number_after, parameters, rest_of
from cdhr_host.units import MM
from cdhr_host.values import Array

SCRIPT_MAX: Final = 1 << 16
"""characters of one script"""
PATIENCE: Final = 5.0
"""s a client is kept waiting while its program is proven; then it goes on without it"""
HELP: Final = {
    "PAUSE": "Hold the print on its path",
    "RESUME": "Go on with a held print",
    "CANCEL_PRINT": "Stop for good: rest on the path, air off, lift",
    "SDCARD_PRINT_FILE": "Prove a program of the upload folder, then print it: FILENAME=vase.gcode",
    "SDCARD_RESET_FILE": "Unload the program",
    "SAVE_GCODE_STATE": "Remember G90/G91, M82/M83, F and the position: NAME=...",
    "RESTORE_GCODE_STATE": "Back to what was remembered: NAME=... MOVE=1",
    "FIRMWARE_RESTART": "Acknowledge a fault: the machine may move again",
    "RESTART": "As FIRMWARE_RESTART",
    "RESPOND": "Say something to all clients: MSG=...",
    "STATUS": "Where the machine is",
    "HELP": "This list",
    "CLEAR_PAUSE": "Nothing to clear here: use RESUME or CANCEL_PRINT",
}
LIMIT_WORDS: Final = frozenset({"M92", "M201", "M203", "M204", "M205", "M204.1", "SET_VELOCITY_LIMIT"})
HOLD_WORDS: Final = frozenset({"M84", "M18"})
AT_ONCE: Final = frozenset({"M112", "PAUSE", "RESUME", "CANCEL_PRINT", "M220", "M221", "M24", "M25", "M524"})
"""words that need not wait for a script that is running"""


@dataclass(frozen=True, slots=True)
class Saved:
    """A place and the modes at it."""

    modes: Modes
    nozzle_G: Array


class ScriptError(JobError):
    """A script that was refused; what came before the refused line was done."""


class Executor:
    """Runs scripts, one after the other."""

    def __init__(self, host: Host) -> None:
        self._host = host
        self._lock = asyncio.Lock()
        self._saved: dict[str, Saved] = {}
        self._waiting: list[str] = []
        self._words: dict[str, Callable[[str], Awaitable[None]]] = {
            "PAUSE": self._pause,
            "M25": self._pause,
            "RESUME": self._resume,
            "M24": self._resume,
            "CANCEL_PRINT": self._cancel,
            "M524": self._cancel,
            "M112": self._stop,
            "M220": self._feed,
            "M221": self._flow,
            "SDCARD_PRINT_FILE": self._print,
            "SDCARD_RESET_FILE": self._unload,
            "SAVE_GCODE_STATE": self._save,
            "RESTORE_GCODE_STATE": self._restore,
            "RESTART": self._acknowledge,
            "FIRMWARE_RESTART": self._acknowledge,
            "RESPOND": self._respond,
            "M118": self._respond,
            "M117": self._display,
            "STATUS": self._tell,
            "M114": self._tell,
            "M115": self._tell,
            "M105": self._tell,
            "HELP": self._help,
            "CLEAR_PAUSE": self._help,
        }

    def help(self) -> dict[str, str]:
        """Every script with its meaning."""
        own = {name: text.strip().splitlines()[0] for name, text in self._host.profile.serve.macros.items()}
        return {**HELP, **own}

    async def run(self, script: str) -> None:
        """Do a script; raises ScriptError at its first line that is refused."""
        if len(script) > SCRIPT_MAX:
            raise _refused(f"a script has {SCRIPT_MAX} characters at most, this one {len(script)}")
        lines = [line for line in map(bare, script.splitlines()) if line]
        for line in lines:
            self._host.say(line, kind="command")
        try:
            if len(lines) == 1 and code_of(lines[0]) in AT_ONCE:
                await self._words[code_of(lines[0])](lines[0])
                return
            async with self._lock:
                self._waiting.clear()
                await self._lines(lines, depth=0)
        except ScriptError:
            raise
        except JobError as error:
            raise ScriptError(error.problems) from error

    async def _lines(self, lines: list[str], depth: int) -> None:
        for line in lines:
            code = code_of(line)
            macro = self._host.profile.serve.macros.get(code)
            if macro is not None:
                await self._macro(code, macro, depth)
            elif code in self._words:
                await self._flush()
                await self._words[code](line)
            elif code in LIMIT_WORDS:
                self._host.say(f"echo: {code} is ignored: the machine's limits come from its profile")
            elif code in HOLD_WORDS:
                self._host.say(f"echo: {code}: motors stay on, they hold the cables' tension")
            elif code in WORDS:
                self._waiting.append(line)
            else:
                raise _unknown(line, code, [*self._words, *self._host.profile.serve.macros])
        await self._flush()

    async def _macro(self, name: str, text: str, depth: int) -> None:
        if depth >= 4:
            raise _refused(f"the macro {name} calls itself, or macros are nested too deep")
        await self._lines([line for line in map(bare, text.splitlines()) if line], depth + 1)

    async def _flush(self) -> None:
        """Run the G-code that waits, after what sets the modes it relies on."""
        if not self._waiting:
            return
        lines, self._waiting = self._waiting, []
        modes = self._host.modes
        reply = await self._host.run("\n".join((*modes.preamble(), *lines)))
        for line in reply.lines if reply.ok else ():
            self._host.say(line)
        if not reply.ok:
            raise ScriptError(reply.problems or _problem("; ".join(reply.lines) or "refused"))
        for line in lines:
            modes = modes.after(line)
        self._host.modes = modes

    async def _pause(self, _: str) -> None:
        self._host.surface.hold("paused by a client")
        await self._stands()

    async def _resume(self, _: str) -> None:
        await self._stands()
        self._host.surface.resume()

    async def _stands(self) -> None:
        """A hold that is under way comes to its rest."""
        with suppress(TimeoutError):
            await asyncio.wait_for(self._host.until(lambda state: state is not JobState.HOLDING), PATIENCE)

    async def _cancel(self, _: str) -> None:
        if self._host.state in ACTIVE:
            self._host.surface.abort("cancelled by a client")
        elif self._host.state in {JobState.READY, JobState.DONE, JobState.STOPPED}:
            self._host.surface.unload()

    async def _stop(self, _: str) -> None:
        self._host.emergency_stop("a client")

    async def _feed(self, line: str) -> None:
        self._host.surface.override(feed=_percent(line))

    async def _flow(self, line: str) -> None:
        self._host.surface.override(flow=_percent(line))

    async def _print(self, line: str) -> None:
        name = _parameters(line).get("FILENAME", "")
        if self._host.state in PAUSED:
            raise _refused("a print is held", "RESUME or CANCEL_PRINT first")
        try:
            await asyncio.wait_for(self._host.print_file(name.removeprefix("/")), PATIENCE)
        except TimeoutError:
            self._host.say(f"echo: {name} is still being proven; it starts when that is done")

    async def _unload(self, _: str) -> None:
        self._host.surface.unload()

    async def _save(self, line: str) -> None:
        name = _parameters(line).get("NAME", "default")
        if len(self._saved) >= 100 and name not in self._saved:
            raise _refused("100 states are remembered, no more", "use one NAME again")
        self._saved[name] = Saved(self._host.modes, self._host.status().nozzle_G)

    async def _restore(self, line: str) -> None:
        given = _parameters(line)
        saved = self._saved.get(given.get("NAME", "default"))
        if saved is None:
            raise _refused(
                f"nothing is remembered as '{given.get('NAME', 'default')}'", "SAVE_GCODE_STATE first"
            )
        if given.get("MOVE", "0") == "1":
            x, y, z = (value / MM for value in saved.nozzle_G.tolist())
            self._host.modes = Modes(feed=saved.modes.feed)
            self._waiting.append(f"G0 X{x:.6f} Y{y:.6f} Z{z:.6f}")
            await self._flush()
        self._host.modes = saved.modes

    async def _acknowledge(self, _: str) -> None:
        if self._host.state is JobState.FAULT:
            self._host.surface.acknowledge()

    async def _respond(self, line: str) -> None:
        named = _parameters(line) if code_of(line) == "RESPOND" else {}
        self._host.say(f"echo: {named.get('MSG', rest_of(line))}")

    async def _display(self, line: str) -> None:
        self._host.display = rest_of(line)[:200]

    async def _tell(self, _: str) -> None:
        status = self._host.status()
        x, y, z = (value / MM for value in status.nozzle_G.tolist())
        self._host.say(f"X:{x:.3f} Y:{y:.3f} Z:{z:.3f} {status.state.value} {status.message}".rstrip())

    async def _help(self, _: str) -> None:
        for name, text in self.help().items():
            self._host.say(f"{name}: {text}")


def _percent(line: str) -> float:
    value = number_after(line, "S")
    if value is None or not 1.0 <= value <= 300.0:
        raise _refused(f"'{line[:40]}' needs S1 to S300, percent", "100 is as sliced")
    return value / 100.0


def _parameters(line: str) -> dict[str, str]:
    try:
        return parameters(line)
    except ValueError as error:
        raise _refused(f"'{line[:80]}': {error}", 'write NAME="value"') from error


def _problem(message: str, hint: str | None = None) -> Problem:
    return Problem("script", message, hint=hint)


def _refused(message: str, hint: str | None = None) -> ScriptError:
    return ScriptError(_problem(message, hint))


def _unknown(line: str, code: str, scripts: list[str]) -> ScriptError:
    near = difflib.get_close_matches(code or line.upper(), [*scripts, *WORDS], n=1, cutoff=0.3)
    hint = f"did you mean {near[0]}?" if near else "HELP lists what there is"
    return _refused(f'Unknown command: "{line[:80]}"', hint)
