"""The upload folder as a Marlin client's memory card."""

from collections.abc import Callable

from cdhr_host.errors import JobError
from cdhr_host.serve.folder import Entry
from cdhr_host.serve.host import problem_text
from cdhr_host.serve.marlin.bench import Bench
from cdhr_host.serve.marlin.reports import Reports, sd_status
from cdhr_host.serve.model import ACTIVE, PAUSED
from cdhr_host.serve.names import shown
from cdhr_host.serve.words import number_after, rest_of

OK = ["ok"]


class Card:
    """M20 to M27, M30, M32, M33 of one client."""

    def __init__(self, bench: Bench, reports: Reports) -> None:
        self._bench = bench
        self._reports = reports
        self._selected: str | None = None

    def table(self) -> dict[str, Callable[[str], list[str]]]:
        """Commands by code."""
        return {
            "M20": self._list,
            "M21": lambda _: ["echo:SD card ok", *OK],
            "M22": lambda _: OK,
            "M23": self._select,
            "M24": self._start,
            "M25": self._hold,
            "M26": self._seek,
            "M27": self._progress,
            "M28": lambda line: self._refuse(line, "upload over HTTP, or print line by line"),
            "M29": lambda _: OK,
            "M30": self._delete,
            "M32": self._print,
        }

    def _list(self, _: str) -> list[str]:
        return ["Begin file list", *map(_listed, self._bench.folder.entries()), "End file list", *OK]

    def _select(self, line: str) -> list[str]:
        try:
            entry = self._bench.folder.entry(self._named(line))
        except JobError as error:
            return [f"echo:open failed, {problem_text(error.problems[0])}", *OK]
        self._selected = entry.name
        return [f"File opened: {entry.name} Size: {entry.size}", "File selected", *OK]

    def _start(self, _: str) -> list[str]:
        state = self._bench.state()
        if state in PAUSED:
            self._bench.script("RESUME")
        elif state not in ACTIVE and self._selected is not None:
            self._bench.print_file(self._selected)
        elif state not in ACTIVE:
            return self._refuse("M24", "select a file with M23 first")
        return OK

    def _print(self, line: str) -> list[str]:
        answer = self._select(line)
        return self._start(line) if "File selected" in answer else answer

    def _hold(self, _: str) -> list[str]:
        if self._bench.state() in ACTIVE - PAUSED:
            self._bench.script("PAUSE")
        return OK

    def _seek(self, line: str) -> list[str]:
        if number_after(line, "S", 0.0):
            return self._refuse(line, "a print begins at its first line; cdhr resume goes on with one")
        return OK

    def _progress(self, line: str) -> list[str]:
        every = number_after(line, "S")
        if every is not None:
            self._reports.set_every("sd", every)
            return OK
        if rest_of(line).upper().startswith("C"):
            return [f"Current file: {self._selected or '(no file)'}", *OK]
        return [sd_status(self._bench.status()), *OK]

    def _delete(self, line: str) -> list[str]:
        if not rest_of(line):
            return OK
        return self._refuse(line, "programs are deleted over HTTP")

    @staticmethod
    def _refuse(line: str, hint: str) -> list[str]:
        return [f"echo:{shown(line)} is refused: {hint}", *OK]

    def _named(self, line: str) -> str:
        """The file a client means; clients send the names of M20 in lower case, some with a slash."""
        wanted = rest_of(line).strip('"!').removeprefix("/")
        names = [entry.name for entry in self._bench.folder.entries()]
        short = {_short(name).lower(): name for name in names}
        lower = {name.lower(): name for name in names}
        return lower.get(wanted.lower()) or short.get(wanted.lower()) or wanted


def _listed(entry: Entry) -> str:
    return f'{_short(entry.name)} {entry.size} "{entry.name}"'


def _short(name: str) -> str:
    """A name without spaces, which would end it."""
    return name.replace(" ", "_")
