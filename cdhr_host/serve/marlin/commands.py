"""What each command of a Marlin client does here, and its answer."""

import asyncio
import re
from collections.abc import Callable
from typing import Final

from cdhr_host.errors import JobError
from cdhr_host.job.surface import JobState
from cdhr_host.program.parse import parse_line
from cdhr_host.program.words import WORDS
from cdhr_host.serve.host import problem_text
from cdhr_host.serve.marlin.bench import Bench
from cdhr_host.serve.marlin.reports import Reports, identity, position, temperatures
from cdhr_host.serve.marlin.sd import Card
from cdhr_host.serve.model import PAUSED
from cdhr_host.serve.names import shown
from cdhr_host.serve.script import HELP, HOLD_WORDS, LIMIT_WORDS
from cdhr_host.serve.words import code_of, number_after, rest_of

Wait = Callable[[], list[str] | None]
"""asked again and again; None while there is no answer yet"""
Answer = list[str] | Wait

OK: Final = ["ok"]
ACCEPTED: Final = frozenset(
    {"G10", "G11", "T0", "M17", "M75", "M76", "M77", "M78", "M104", "M108", "M109", "M110", "M120", "M121"}
    | {"M140", "M163", "M164", "M190", "M302", "M410", "M876"}
)
"""words that are answered and do nothing in the queue"""
PAUSES: Final = frozenset({"M0", "M1", "M600", "M601"})
MOTION: Final = frozenset({"G0", "G1", "G2", "G3", "G5", "G5.1", "G28"})
_M118: Final = re.compile(r"(?:([AEP]\d+)\s+)*", re.IGNORECASE)


class Commands:
    """One client's commands."""

    def __init__(self, bench: Bench, reports: Reports) -> None:
        self._bench = bench
        self._reports = reports
        self._card = Card(bench, reports)
        self._table: dict[str, Callable[[str], Answer]] = {
            "M105": lambda _: [f"ok {temperatures(bench.status())}"],
            "M112": lambda _: [],
            "M113": self._busy,
            "M114": lambda _: [position(bench), *OK],
            "M115": lambda _: [*identity(bench.host.profile.machine.name), *OK],
            "M117": self._display,
            "M118": self._echo,
            "M119": lambda _: ["Reporting endstop status", *OK],
            "M154": lambda line: self._every("position", line),
            "M155": lambda line: self._every("temperature", line),
            "M73": lambda _: OK,
            "M220": self._feed,
            "M221": self._flow,
            "M400": lambda _: self._drained,
            "M524": lambda line: self._script("CANCEL_PRINT", line),
            "M999": lambda line: self._script("FIRMWARE_RESTART", line),
            **self._card.table(),
        }

    def at_once(self, code: str, line: str) -> None:
        """Words that act when they are received."""
        if code == "M112":
            self._bench.host.emergency_stop(self._bench.name)
        elif code == "M410":
            self._tried(lambda: self._bench.host.surface.hold(f"M410 from {self._bench.name}"))
        elif code == "M108" and self._bench.state() in PAUSED:
            self._tried(self._bench.host.surface.resume)
        elif code == "M876":
            self._prompt(line)

    def answer(self, line: str, *, numbered: bool) -> Answer:
        """One line without number, checksum and comment."""
        code = code_of(line)
        known = self._table.get(code)
        if known is not None:
            return known(line)
        if code in ACCEPTED:
            return OK
        if code in WORDS and self._bench.state() is JobState.FAULT:
            return ["echo:halted: M999 acknowledges the fault", *OK]
        return self._other(code, line, numbered=numbered)

    def _other(self, code: str, line: str, *, numbered: bool) -> Answer:
        if code in LIMIT_WORDS:
            return [f"echo:{code} is ignored: the machine's limits come from its profile", *OK]
        if code in HOLD_WORDS:
            return [f"echo:{code}: motors stay on, they hold the cables' tension", *OK]
        if code in HELP or code in self._bench.host.profile.serve.macros:
            return self._bench.script(line)
        if code in WORDS:
            return self._program_word(code, line, numbered=numbered)
        if code in MOTION or (self._bench.streaming and numbered and code[:1] == "G"):
            return self._stream(line, typed=False)
        return [f'echo:Unknown command: "{shown(line)}"', *OK]

    def _program_word(self, code: str, line: str, *, numbered: bool) -> Answer:
        """A word of programs: refused at once when it is typed alone, else the stream's to judge."""
        if code == "G28" and not self._bench.status().referenced:
            return self._home()
        alone = not numbered and not self._bench.pending
        if alone and (problems := parse_line(line, 1)[1]):
            return [*(f"echo:{problem_text(problem)}" for problem in problems[:3]), *OK]
        if code in PAUSES:
            return self._pause(line)
        return self._stream(line, typed=alone)

    def _home(self) -> Answer:
        """Drives that know no reference pose find it before anything is streamed; until then no ok."""
        running = asyncio.ensure_future(self._bench.host.run("G28"))

        def over() -> list[str] | None:
            if not running.done():
                return None
            reply = running.result()
            return OK if reply.ok else [*(f"echo:{text}" for text in reply.lines), *OK]

        return over

    def _stream(self, line: str, *, typed: bool) -> Answer:
        def taken() -> list[str] | None:
            try:
                return OK if self._bench.offer(line, typed=typed) else None
            except JobError as error:
                still_moves = error.problems[0].kind == "busy"
                return None if still_moves else [f"echo:{problem_text(error.problems[0])}", *OK]

        return taken() or taken

    def _pause(self, line: str) -> Answer:
        entered: list[str] | None = None

        def over() -> list[str] | None:
            nonlocal entered
            entered = entered or self._now(line)
            return None if entered is None else self._drained()

        return over

    def _now(self, line: str) -> list[str] | None:
        try:
            return OK if self._bench.offer(line, typed=False) else None
        except JobError as error:
            self._bench.host.say(problem_text(error.problems[0]))
            return OK

    def _drained(self) -> list[str] | None:
        """The answer once all motion of this client has ended."""
        return (
            None if self._bench.pending or (self._bench.streaming and self._bench.state() in PAUSED) else OK
        )

    def _busy(self, line: str) -> Answer:
        self._reports.set_busy(number_after(line, "S", 2.0) or 0.0)
        return OK

    def _every(self, what: str, line: str) -> Answer:
        self._reports.set_every(what, number_after(line, "S", 0.0) or 0.0)
        return OK

    def _display(self, line: str) -> Answer:
        self._bench.host.display = rest_of(line)[:200]
        return OK

    def _echo(self, line: str) -> Answer:
        text = rest_of(line)
        options = _M118.match(text)
        said = text[options.end() :] if options else text
        action = bool(re.match(r"(?i)(?:[EP]\d+\s+)*A1\b", text))
        return [f"//{said}" if action else f"echo:{said}", *OK]

    def _feed(self, line: str) -> Answer:
        return self._factor("feed", line)

    def _flow(self, line: str) -> Answer:
        return self._factor("flow", line)

    def _factor(self, what: str, line: str) -> Answer:
        percent = number_after(line, "S")
        status = self._bench.status()
        if percent is None:
            now = status.feed_override if what == "feed" else status.flow_override
            return [f"echo:{'FR' if what == 'feed' else 'Flow'}:{now * 100:.0f}%", *OK]
        if not 1.0 <= percent <= 300.0:
            return [f"echo:{shown(line)}: 1 to 300 percent", *OK]
        self._tried(lambda: self._bench.host.surface.override(**{what: percent / 100.0}))
        return OK

    def _script(self, script: str, _: str) -> Answer:
        return self._bench.script(script)

    def _prompt(self, line: str) -> None:
        choice = number_after(line, "S")
        self._reports.prompts = self._reports.prompts or number_after(line, "P") == 1
        if choice is None or self._bench.state() not in PAUSED:
            return
        surface = self._bench.host.surface
        self._tried(surface.resume if choice == 0 else lambda: surface.abort("chosen by the operator"))

    def _tried(self, act: Callable[[], None]) -> None:
        try:
            act()
        except JobError as error:
            self._bench.host.say(problem_text(error.problems[0]))
