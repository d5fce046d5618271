"""The real OctoPrint on the pseudo-terminal."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from clients import CLIENTS, TILE, Api, free_port, objects, running, served, until

pytestmark = pytest.mark.skipif(
    not (CLIENTS / "octoprint").exists(), reason="OctoPrint is not installed: bash .ci/run does"
)
KEY = "0123456789ABCDEF0123456789ABCDEF"
CONFIG = """\
accessControl: {{salt: abcdefghijklmnop}}
api: {{key: {key}}}
server:
  firstRun: false
  onlineCheck: {{enabled: false}}
  pluginBlacklist: {{enabled: false}}
  seenWizards: {{backup: null, classicwebcam: null, corewizard: 4, tracking: null}}
plugins:
  _disabled:
    [announcements, backup, classicwebcam, discovery, errortracking, firmware_check, pluginmanager,
    softwareupdate, tracking]
serial: {{additionalPorts: ['{device}'], log: true, autoconnect: false}}
webcam: {{webcamEnabled: false, timelapseEnabled: false}}
"""


@contextmanager
def octoprint(folder: Path, device: str) -> Iterator[Api]:
    base, port = folder / "octoprint", free_port()
    base.mkdir()
    (base / "config.yaml").write_text(CONFIG.format(key=KEY, device=device))
    command = [
        CLIENTS / "octoprint",
        "serve",
        "--iknowwhatimdoing",
        "--basedir",
        base,
        "--host",
        "127.0.0.1",
        "--port",
        port,
    ]
    with running(*command, log=folder / "octoprint.log"):
        api = Api(f"http://127.0.0.1:{port}", KEY)
        until(lambda: api.alive("/api/version"), 90.0, "OctoPrint starts")
        yield api


def state(api: Api) -> str:
    return str(api.get("/api/connection")["current"]["state"])


def connected(api: Api, device: str) -> None:
    api.post("/api/connection", command="connect", port=device, baudrate=115200, printerProfile="_default")
    until(lambda: state(api) == "Operational", 30.0, "OctoPrint connects")


def test_octoprint_prints_a_slicer_file_pauses_resumes_and_cancels(tmp_path: Path) -> None:
    device = str(tmp_path / "printer")
    with served(tmp_path, "--marlin", device) as doors, octoprint(tmp_path, device) as api:
        machine = Api(doors["http"])
        connected(api, device)
        api.upload("/api/files/local", "tile.gcode", TILE.read_bytes(), print="true")
        until(lambda: state(api) == "Printing", 30.0, "the print begins")
        until(lambda: (api.get("/api/job")["progress"]["completion"] or 0.0) > 20.0, 60.0, "a fifth is sent")
        api.post("/api/job", command="pause", action="pause")
        until(lambda: state(api) == "Paused", 60.0, "paused")
        until(
            lambda: objects(machine, "motion_report")["motion_report"]["live_velocity"] == 0.0,
            30.0,
            "at rest",
        )
        api.post("/api/job", command="pause", action="resume")
        until(lambda: state(api) == "Operational", 120.0, "the print ends")
        progress = api.get("/api/job")["progress"]
        assert progress["completion"] == 100.0

        api.post("/api/job", command="start")
        until(lambda: state(api) == "Printing", 30.0, "a second print begins")
        until(lambda: (api.get("/api/job")["progress"]["completion"] or 0.0) > 10.0, 60.0, "a tenth is sent")
        api.post("/api/job", command="cancel")
        until(lambda: state(api) == "Operational", 60.0, "cancelled")
        until(
            lambda: objects(machine, "motion_report")["motion_report"]["live_velocity"] == 0.0,
            30.0,
            "at rest",
        )
        assert objects(machine, "webhooks")["webhooks"]["state"] == "ready"

    log = (tmp_path / "octoprint" / "logs" / "serial.log").read_text()
    assert "Resend" not in log
    assert "communication timeout" not in log.lower()
    serve_log = (tmp_path / "serve.log").read_text()
    assert "Traceback" not in serve_log
