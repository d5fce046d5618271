import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from serve_surface import PROFILE, ScriptedSurface

from cdhr_host.errors import JobError
from cdhr_host.job.surface import JobState
from cdhr_host.serve.folder import Folder
from cdhr_host.serve.host import Host
from cdhr_host.serve.script import Executor
from cdhr_host.serve.words import Modes


class Desk:
    def __init__(self, tmp_path: Path) -> None:
        self.surface = ScriptedSurface()
        self.host = Host(self.surface, Folder(tmp_path / "programs"))
        self.host.open()
        self.executor = Executor(self.host)

    async def run(self, script: str) -> list[str]:
        """What was handed to the machine by a script."""
        before = len(self.surface.said)
        await self.executor.run(script)
        return [str(said[1]) for said in self.surface.said[before:] if said[0] == "run"]


def at_desk(tmp_path: Path, act: Callable[[Desk], Awaitable[None]]) -> None:
    async def run() -> None:
        desk = Desk(tmp_path)
        await act(desk)
        await desk.host.close()

    asyncio.run(run())


PREAMBLE = "G21\nG90\nM82\nG92 E0.000000\n"


def test_a_jog_of_a_web_page_is_one_text_and_leaves_no_mode_behind(tmp_path: Path) -> None:
    async def act(desk: Desk) -> None:
        jog = "SAVE_GCODE_STATE NAME=_ui_movement\nG91\nG1 X+10 F6000\nRESTORE_GCODE_STATE NAME=_ui_movement"
        assert await desk.run(jog) == [f"{PREAMBLE}G91\nG1 X+10 F6000"]
        assert desk.host.modes == Modes()
        assert await desk.run("G1 X5 F600") == [f"{PREAMBLE}G1 X5 F600"]

    at_desk(tmp_path, act)


def test_modes_go_on_from_script_to_script(tmp_path: Path) -> None:
    async def act(desk: Desk) -> None:
        await desk.run("G91\nM83\nG1 X1 E3 F600")
        (text,) = await desk.run("G1 X1")
        assert text.splitlines() == ["G21", "G91", "M83", "G92 E3.000000", "G1 F600.000000", "G1 X1"]
        assert not desk.host.view().absolute

    at_desk(tmp_path, act)


def test_restore_with_move_goes_back_to_the_place(tmp_path: Path) -> None:
    async def act(desk: Desk) -> None:
        desk.surface._status = replace(desk.surface._status, nozzle_G=np.array([0.01, -0.02, 0.03]))
        await desk.run("SAVE_GCODE_STATE NAME=there")
        (text,) = await desk.run("RESTORE_GCODE_STATE NAME=there MOVE=1")
        assert text == f"{PREAMBLE}G0 X10.000000 Y-20.000000 Z30.000000"
        with pytest.raises(JobError, match="nothing is remembered as 'elsewhere'"):
            await desk.run("RESTORE_GCODE_STATE NAME=elsewhere")

    at_desk(tmp_path, act)


def test_two_scripts_do_not_mix(tmp_path: Path) -> None:
    async def act(desk: Desk) -> None:
        first = desk.executor.run("G91\nM114\nG1 X1 F600\nM114\nG90")
        second = desk.executor.run("M114\nG1 X2 F600")
        await asyncio.gather(first, second)
        moves = [str(said[1]).splitlines()[-1] for said in desk.surface.said]
        assert moves == ["G91", "G1 X1 F600", "G90", "G1 X2 F600"]
        assert "G91" not in str(desk.surface.said[-1][1]).splitlines()

    at_desk(tmp_path, act)


def test_a_refused_line_ends_its_script_and_says_why(tmp_path: Path) -> None:
    async def act(desk: Desk) -> None:
        with pytest.raises(JobError, match="Unknown command") as refused:
            await desk.run("G1 X1 F600\nGO_HOME\nG1 X2")
        assert "did you mean" in str(refused.value.problems[0].hint)
        assert desk.surface.said == []
        assert await desk.run("G1 X3 F600") == [f"{PREAMBLE}G1 X3 F600"]

    at_desk(tmp_path, act)


def test_macros_of_the_profile_run_and_are_listed(tmp_path: Path) -> None:
    async def act(desk: Desk) -> None:
        assert "PARK" in desk.executor.help()
        assert await desk.run("park") == [f"{PREAMBLE}G91\nG1 Z20 F600\nG90"]

    at_desk(tmp_path, act)


def test_a_macro_that_calls_itself_is_refused(tmp_path: Path) -> None:
    async def act(desk: Desk) -> None:
        serve = PROFILE.serve.model_copy(update={"macros": {"LOOP": "LOOP"}})
        desk.surface.profile = PROFILE.model_copy(update={"serve": serve})
        with pytest.raises(JobError, match="calls itself"):
            await desk.run("LOOP")

    at_desk(tmp_path, act)


def test_limits_and_motors_stay_as_they_are(tmp_path: Path) -> None:
    async def act(desk: Desk) -> None:
        assert await desk.run("M203 X9000\nSET_VELOCITY_LIMIT VELOCITY=9000\nM84\nM18") == []
        said = "\n".join(message.text for message in desk.host.messages)
        assert said.count("limits come from its profile") == 2
        assert said.count("hold the cables' tension") == 2

    at_desk(tmp_path, act)


def test_factors_act_on_the_machine_at_once(tmp_path: Path) -> None:
    async def act(desk: Desk) -> None:
        assert await desk.run("M220 S80\nM221 S95") == []
        assert desk.surface.status().feed_override == 0.8
        assert desk.surface.status().flow_override == 0.95
        with pytest.raises(JobError, match="S1 to S300"):
            await desk.run("M220 S900")

    at_desk(tmp_path, act)


async def _print(desk: Desk, text: bytes) -> None:
    with desk.host.folder.receive("a.gcode") as upload:
        upload.write(text)
        upload.keep()
    printing = asyncio.create_task(desk.executor.run('SDCARD_PRINT_FILE FILENAME="a.gcode"'))
    while desk.surface.status().state is not JobState.PROVING:
        await asyncio.sleep(0)
    desk.surface.advance(0)
    await printing


def test_a_file_is_proven_then_printed_then_paused_and_cancelled(tmp_path: Path) -> None:
    async def act(desk: Desk) -> None:
        await _print(desk, b"G1 X1 F600\n" * 9)
        assert desk.surface.status().state is JobState.PRINTING
        with pytest.raises(JobError, match="printing"):
            await desk.run("G1 X5 F600")
        await desk.run("PAUSE")
        assert desk.host.objects(["pause_resume"]) == {"pause_resume": {"is_paused": True}}
        await desk.run("RESUME")
        await desk.run("CANCEL_PRINT")
        assert desk.host.objects(["print_stats"])["print_stats"]["state"] == "cancelled"

    at_desk(tmp_path, act)


def test_a_file_that_is_refused_is_not_printed(tmp_path: Path) -> None:
    async def act(desk: Desk) -> None:
        with pytest.raises(JobError, match="unknown word G77") as refused:
            await _print(desk, b"G1 X1 F600\nG77\n")
        assert refused.value.problems[0].line == 2
        assert desk.surface.status().state is JobState.IDLE

    at_desk(tmp_path, act)


def test_pause_and_emergency_stop_do_not_wait_for_a_running_script(tmp_path: Path) -> None:
    async def act(desk: Desk) -> None:
        async with desk.executor._lock:
            await asyncio.wait_for(desk.executor.run("M112"), 1.0)
        assert desk.surface.status().state is JobState.FAULT
        await desk.run("FIRMWARE_RESTART")
        assert desk.surface.status().state is JobState.IDLE

    at_desk(tmp_path, act)
