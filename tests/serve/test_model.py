import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from serve_surface import PROFILE, standing

from cdhr_host.job.surface import JobState, Progress
from cdhr_host.serve.model import PRINT_STATES, View, changes, object_names, objects


def view(**changed: object) -> View:
    return View(replace(standing(), **changed), PROFILE, Path("/programs"), True, True, 0.02, "", 12.0)


PROGRESS = Progress("vase.gcode", 100, 40, 400, 1000, 2, 9, 60.0, 50.0, 30.0, 120.0, 2e-6, 8e-6)


def test_all_objects_are_json_without_nan() -> None:
    nan = np.full(9, math.nan)
    text = json.dumps(objects(view(tension=nan, pressure=math.nan, velocity=math.nan)), allow_nan=False)
    assert set(json.loads(text)) == set(object_names(PROFILE))


def test_numbers_are_in_the_units_of_clients() -> None:
    found = objects(
        view(
            state=JobState.PRINTING, progress=PROGRESS, nozzle_G=np.array([0.01, -0.02, 0.003]),
            velocity=0.05, buffered=9, flow=250e-9, pressure=148e3, feed_override=1.2,
        )
    )  # fmt: skip
    assert found["toolhead"]["position"][:3] == [10.0, -20.0, 3.0]
    assert found["motion_report"]["live_velocity"] == 50.0
    assert found["air"]["pressure_kpa"] == 148.0
    assert found["air"]["flow_mm3_s"] == 250.0
    assert found["gcode_move"]["speed_factor"] == 1.2
    assert found["gcode_move"]["speed"] == 1200.0
    assert found["toolhead"]["max_velocity"] == 100.0
    assert found["toolhead"]["axis_maximum"][:3] == [320.0, 320.0, 800.0]


def test_a_print_half_done() -> None:
    found = objects(view(state=JobState.PRINTING, progress=PROGRESS))
    assert found["print_stats"]["state"] == "printing"
    assert found["print_stats"]["info"] == {"total_layer": 9, "current_layer": 2}
    assert found["print_stats"]["filament_used"] == pytest.approx(2000.0, rel=1e-6)
    assert found["virtual_sdcard"]["file_path"] == "/programs/vase.gcode"
    assert found["virtual_sdcard"]["file_position"] == 400
    assert found["virtual_sdcard"]["is_active"]
    assert found["webhooks"]["state"] == "ready"


def test_every_state_of_a_job_has_a_word_clients_know() -> None:
    known = {"standby", "printing", "paused", "complete", "cancelled", "error"}
    assert set(PRINT_STATES) == set(JobState)
    assert set(PRINT_STATES.values()) == known


def test_a_fault_is_a_shutdown_with_its_reason() -> None:
    found = objects(view(state=JobState.FAULT, message="cable 2 is slack"), ["webhooks"])
    assert found == {"webhooks": {"state": "shutdown", "state_message": "cable 2 is slack"}}


def test_clients_find_a_round_bed_no_heater_and_no_extruder() -> None:
    found = objects(view())
    assert found["configfile"]["settings"]["printer"]["kinematics"] == "delta"
    assert found["heaters"]["available_heaters"] == []
    assert "extruder" not in found
    assert found["configfile"]["config"]["virtual_sdcard"]["path"] == "/programs"
    assert {"gcode_macro PAUSE", "gcode_macro RESUME", "gcode_macro CANCEL_PRINT"} <= set(found)


def test_unknown_objects_are_left_out() -> None:
    assert objects(view(), ["extruder", "gcode_macro NOBODY", "toolhead"]).keys() == {"toolhead"}


def test_only_changes_are_told() -> None:
    before = objects(view(), ["print_stats", "air"])
    after = objects(view(pressure=3e3), ["print_stats", "air"])
    assert changes(before, after) == {"air": {"pressure_kpa": 3.0}}
    assert changes(before, before) == {}
