"""Words that open and close the air, as the profile's [air] section says."""

from dataclasses import replace

from cdhr_host.profile.schema import Profile
from cdhr_host.program.block import Block
from cdhr_host.program.run import Run

FULL = 255.0
"""S of a fully open output"""


def _rule(air: Profile, code: str) -> str:
    rules = air.air
    if code in ("M106", "M107"):
        return rules.fan_words
    if code in ("M3", "M5"):
        return rules.spindle_words
    if code in ("M126", "M127"):
        return rules.valve_words
    return rules.solenoid_words if code in ("M380", "M381") else rules.pin_words


def output(run: Run, block: Block) -> None:
    """M106, M3, M126, M42: S of 0 to 255 opens in proportion; M380 fully; the others close."""
    level = FULL if block.code in ("M380", "M381") else block.get("S", FULL)
    if not 0 <= level <= FULL:
        run.refuse_word(
            block, "S", f"{block.code} S{level:g} is outside 0 to {FULL:g}", "0..255", "255 is fully open"
        )
        return
    if _rule(run.profile, block.code) == "ignore" or not _addressed(run, block):
        return
    closes = block.code in ("M107", "M5", "M127", "M381")
    share = 0.0 if closes else level / FULL
    run.flush()
    if run.profile.air.lays == "bead":
        run.modal = replace(run.modal, open=share)
    else:
        run.modal = replace(run.modal, air=share * run.profile.extruder.pressure_max)


def _addressed(run: Run, block: Block) -> bool:
    """Whether P means the air: the profile's pin, or the first fan or valve."""
    mine = run.profile.air.pin if block.code == "M42" else 0
    if block.get("P", mine) == mine:
        return True
    text = f"{block.code} P{block.get('P'):g} is not the air (P{mine}): ignored"
    run.warn(f"{block.code} P", block.line, text)
    return False
