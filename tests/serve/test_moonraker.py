"""The real Moonraker in front of Klipper's socket, and moonraker-api following a print."""

import json
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from clients import CLIENTS, MOONRAKER, ROOT, Api, free_port, objects, running, served, until

RING = ROOT / "gcode" / "paper_ring_double.gcode"
CONFIG = """\
[server]
host: 127.0.0.1
port: {port}
klippy_uds_address: {socket}
[machine]
provider: none
validate_service: False
[authorization]
trusted_clients:
  127.0.0.1
[history]
[octoprint_compat]
"""
FOLLOW = """
import asyncio, json, sys
from moonraker_api import MoonrakerClient, MoonrakerListener
seen = []
class Listener(MoonrakerListener):
    async def on_notification(self, method, data):
        if method == "notify_status_update":
            state = data[0].get("print_stats", {}).get("state")
            if state: seen.append(state)
async def main():
    client = MoonrakerClient(Listener(), "127.0.0.1", int(sys.argv[1]))
    assert await client.connect()
    info = await client.call_method("printer.info")
    listed = await client.get_supported_modules() if hasattr(client, "get_supported_modules") else []
    await client.call_method("printer.objects.subscribe", objects={"print_stats": None})
    await client.call_method("printer.print.start", filename=sys.argv[2])
    for _ in range(600):
        await asyncio.sleep(0.1)
        if "complete" in seen: break
    await client.disconnect()
    print(json.dumps({"state": info["state"], "seen": seen}))
asyncio.run(main())
"""


@contextmanager
def moonraker(folder: Path, socket: str) -> Iterator[Api]:
    data, port = folder / "moonraker", free_port()
    (data / "config").mkdir(parents=True, exist_ok=True)
    (data / "config" / "moonraker.conf").write_text(CONFIG.format(port=port, socket=socket))
    command = [MOONRAKER / "python", "-m", "moonraker", "-d", data, "-n"]
    with running(*command, log=folder / "moonraker.log"):
        api = Api(f"http://127.0.0.1:{port}")
        until(lambda: api.alive("/server/info"), 60.0, "Moonraker starts")
        yield api


def stats(api: Api) -> dict[str, object]:
    return dict(objects(api, "print_stats")["print_stats"])


def latest_job(api: Api) -> dict[str, object]:
    return dict(api.get("/server/history/list")["result"]["jobs"][0])


@pytest.mark.skipif(
    not (MOONRAKER / "moonraker").exists(), reason="Moonraker is not installed: bash .ci/run does"
)
def test_the_real_moonraker_prints_holds_and_stops(tmp_path: Path) -> None:
    socket = str(tmp_path / "klippy.sock")
    gcodes = tmp_path / "moonraker" / "gcodes"
    with served(tmp_path, "--klippy-socket", socket, "--files", gcodes), moonraker(tmp_path, socket) as api:
        until(lambda: api.get("/server/info")["result"]["klippy_state"] == "ready", 30.0, "ready")
        answer = api.upload(
            "/server/files/upload", "ring.gcode", RING.read_bytes(), root="gcodes", print="true"
        )
        assert answer["print_started"]
        assert api.get("/server/files/metadata?filename=ring.gcode")["result"]["size"] == RING.stat().st_size
        until(lambda: stats(api)["state"] == "printing", 30.0, "printing")
        api.post("/printer/print/pause")
        until(lambda: stats(api)["state"] == "paused", 30.0, "paused")
        api.post("/printer/print/resume")
        until(lambda: stats(api)["state"] == "complete", 60.0, "complete")
        # Moonraker keeps history by the status it is sent, which follows the answer to a question.
        until(lambda: latest_job(api)["status"] != "in_progress", 10.0, "history")
        assert latest_job(api)["filename"] == "ring.gcode"
        assert latest_job(api)["status"] == "completed"
        api.post("/printer/emergency_stop")
        until(lambda: api.get("/printer/info")["result"]["state"] == "shutdown", 10.0, "shutdown")
        api.post("/printer/firmware_restart")
        until(lambda: api.get("/printer/info")["result"]["state"] == "ready", 30.0, "ready again")
    assert "Traceback" not in (tmp_path / "serve.log").read_text()


@pytest.mark.skipif(
    not (CLIENTS / "python").exists(), reason="moonraker-api is not installed: bash .ci/run does"
)
def test_moonraker_api_follows_a_print(tmp_path: Path) -> None:
    (tmp_path / "programs").mkdir()
    (tmp_path / "programs" / "ring.gcode").write_bytes(RING.read_bytes())
    with served(tmp_path) as doors:
        port = doors["http"].rstrip("/").rpartition(":")[2]
        run = subprocess.run(
            [CLIENTS / "python", "-c", FOLLOW, port, "ring.gcode"],
            capture_output=True,
            text=True,
            timeout=120,
            check=True,
        )
    told = json.loads(run.stdout)
    assert told["state"] == "ready"
    assert told["seen"][-1] == "complete"
    assert "printing" in told["seen"]
