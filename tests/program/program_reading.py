"""Reading programs in tests, and showing commands as text: mm, mm/s, mm³, kPa, degrees."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from cdhr_host.errors import Problem, ProgramError
from cdhr_host.profile import Profile, read_table, validate
from cdhr_host.program import Interpreter
from cdhr_host.values import Arc, Blend, Command, Dwell, Moves, Notice, Pause, Plane, Prime, Spline, Stop

ROOT = Path(__file__).resolve().parents[2]


def profile(**sections: dict[str, Any]) -> Profile:
    table = read_table(ROOT / "profiles" / "paper-wide.toml")
    for section, values in sections.items():
        table[section] |= values
    made, problems = validate(table)
    assert not problems
    return made


PAPER_WIDE = profile()
ALL_AIR = profile(
    air={"fan_words": "air", "valve_words": "air", "solenoid_words": "air", "pin_words": "air", "pin": 4}
)


def raw(text: str | bytes) -> bytes:
    return text if isinstance(text, bytes) else text.encode()


def read(
    text: str | bytes, machine: Profile = PAPER_WIDE, at: Iterable[float] | None = None
) -> list[Command]:
    start = None if at is None else np.array(list(at)) / 1e3
    return list(Interpreter(machine, at_G=start).commands([raw(text)]))


def refused(text: str | bytes, machine: Profile = PAPER_WIDE) -> ProgramError:
    try:
        read(text, machine)
    except ProgramError as error:
        return error
    raise AssertionError("the text was not refused")


def only_problem(text: str | bytes, machine: Profile = PAPER_WIDE) -> Problem:
    error = refused(text, machine)
    assert error.total == 1, error.problems
    return error.problems[0]


def warnings(commands: Iterable[Command]) -> list[str]:
    return [item.text for item in commands if isinstance(item, Notice) and item.kind == "warning"]


def moves(commands: Iterable[Command]) -> list[list[float]]:
    """End points in mm of all straight moves."""
    return [
        (np.round(row * 1e3, 9) + 0.0).tolist()
        for item in commands
        if isinstance(item, Moves)
        for row in item.end_G
    ]


def column(commands: Iterable[Command], name: str, unit: float = 1.0) -> list[float]:
    """One column of all straight moves."""
    return [
        round(value / unit, 9)
        for item in commands
        if isinstance(item, Moves)
        for value in getattr(item, name)
    ]


def _point(values: Iterable[float]) -> str:
    return " ".join(_plain(value * 1e3) for value in values)


def _plain(value: float) -> str:
    return f"{round(value, 6) + 0.0:g}" if abs(value) < 1e-4 else f"{round(value, 6):.10g}"


def _load(clay: float, air: float) -> str:
    clay_text = f" clay {_plain(clay * 1e9)}" if clay else ""
    return clay_text + (f" air {_plain(air / 1e3)}" if air else "")


def shown(commands: Iterable[Command]) -> list[str]:
    """One line for each command or straight move."""
    return [line for command in commands for line in _shown(command)]


def _shown(command: Command) -> list[str]:
    match command:
        case Moves():
            rows = zip(command.line, command.end_G, command.speed, command.clay, command.air, strict=True)
            return [
                f"{line} move to {_point(end)} at {_plain(speed * 1e3)}{_load(clay, air)}"
                for line, end, speed, clay, air in rows
            ]
        case Arc():
            return [
                f"{command.line} arc to {_point(command.end_G)} about {_point(command.centre_G)} "
                f"by {_plain(np.degrees(command.sweep))} deg at {_plain(command.speed * 1e3)}"
                f"{_load(command.clay, command.air)}"
                f"{'' if command.plane is Plane.XY else f' in {command.plane.name}'}"
            ]
        case Spline():
            _, first, second, end = command.control_G
            return [
                f"{command.line} curve by {_point(first[:2])} and {_point(second[:2])} to {_point(end)} "
                f"at {_plain(command.speed * 1e3)}{_load(command.clay, command.air)}"
            ]
        case Blend():
            within = "" if command.tolerance is None else f" within {_plain(command.tolerance * 1e3)}"
            return [f"{command.line} {'exact stops' if command.exact else f'blend{within}'}"]
        case Dwell():
            return [f"{command.line} dwell {_plain(command.duration)} s"]
        case Prime():
            return [f"{command.line} prime clay {_plain(command.clay * 1e9)} at {_plain(command.flow * 1e9)}"]
        case Pause():
            return [f"{command.line} pause {command.message!r}"]
        case Stop():
            return [f"{command.line} stop"]
        case Notice():
            return [f"{command.line} {command.kind} {command.text!r}"]
