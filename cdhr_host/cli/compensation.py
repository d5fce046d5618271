"""``cdhr compensation``: what the pulleys would cost."""

import json
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from cdhr_host.cli.machine import open_machine
from cdhr_host.cli.options import Json, ProfileName, examples
from cdhr_host.cli.refusals import about, emit
from cdhr_host.units import MM

if TYPE_CHECKING:
    from cdhr_host.profile import Profile
    from cdhr_host.report.compensation import StretchEffect
    from cdhr_host.values import Array

STRIDE = 10
"""samples of a trajectory from one look at the stretch to the next"""

EXAMPLES = examples(
    "cdhr compensation",
    "cdhr compensation --trajectory 36 --profile paper",
    "cdhr compensation --models",
    "cdhr compensation --stretch --profile paper",
    "cdhr compensation --json",
)


class Equation(StrEnum):
    """The paper's trajectories."""

    E15 = "15"
    E35 = "35"
    E36 = "36"


def compensation(
    trajectory: Annotated[
        Equation,
        typer.Option("--trajectory", "-t", metavar="EQ", help="Equation of the paper: 15, 35 or 36."),
    ] = Equation.E15,
    step: Annotated[
        float, typer.Option(metavar="S", help="Time between two samples.", min=1e-4, max=10)
    ] = 0.01,
    profile: ProfileName = "paper-simulation",
    *,
    models: Annotated[
        bool, typer.Option("--models", help="Setpoints by each pulley model on a machine like each other.")
    ] = False,
    stretch: Annotated[
        bool, typer.Option("--stretch", help="What elastic cables do, and what is not known of them.")
    ] = False,
    json_: Json = False,
) -> None:
    """The nozzle's greatest error along a trajectory of the paper, with and without compensated pulleys."""
    from cdhr_host.report.compensation import compensation as compare
    from cdhr_host.report.compensation import models as compare_models
    from cdhr_host.report.compensation import stretch_effect
    from cdhr_host.samples import LAWS

    law = LAWS[trajectory.value]
    drawn = f"Eq. ({trajectory.value}) on {profile}: {law.drawing}, 0 <= t < {law.duration:g} s by {step:g} s"
    with about(profile):
        machine, position = open_machine(profile), law.position(law.times(step)[:-1])
        if models:
            emit(_models(drawn, compare_models(machine, position), json_))
            return
        if stretch:
            emit(_stretch(drawn, machine, stretch_effect(machine, position[::STRIDE]), json_))
            return
        found = compare(machine, position)
    if json_:
        record = {
            "profile": profile,
            "trajectory": trajectory.value,
            "duration_s": law.duration,
            "step_s": step,
            "uncompensated_mm": (found.uncompensated / MM).tolist(),
            "compensated_mm": (found.compensated / MM).tolist(),
        }
        emit(json.dumps(record))
        return
    emit(
        f"{drawn}\n"
        f"greatest nozzle error, mm          x            y            z\n"
        f"setpoints |BA| (straight cable)    {_row(found.uncompensated, '.5f')}\n"
        f"setpoints round the pulleys        {_row(found.compensated, '.2e')}"
    )


def _stretch(drawn: str, machine: "Profile", found: "StretchEffect", json_: bool) -> str:
    soft = machine.stretch
    if json_:
        record = {"ignored_mm": (found.ignored / MM).tolist(), "doubt_mm": (found.doubt / MM).tolist()}
        return json.dumps({"stiffness_n": soft.stiffness, "stiffness_doubt": soft.stiffness_doubt, **record})
    return (
        f"{drawn}\n"
        f"cables of EA = {soft.stiffness:g} N, known to {100 * soft.stiffness_doubt:g} %\n"
        f"greatest nozzle error, mm          x            y            z\n"
        f"stretch not allowed for            {_row(found.ignored, '.5f')}\n"
        f"allowed for, EA as far off         {_row(found.doubt, '.5f')}"
    )


def _models(drawn: str, found: "dict[tuple[str, str], Array]", json_: bool) -> str:
    if json_:
        return json.dumps(
            {f"{one} on {other}": (error / MM).tolist() for (one, other), error in found.items()}
        )
    rows = [f"{one:<12} {other:<12} {_row(error, '.5f')}" for (one, other), error in found.items()]
    head = "setpoints by on a machine  greatest nozzle error in x, y, z, mm"
    return "\n".join([drawn, head, *rows])


def _row(error: "Array", form: str) -> str:
    return "  ".join(f"{value / MM:<11{form}}" for value in error).rstrip()
