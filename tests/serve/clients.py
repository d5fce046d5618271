"""Other people's programs as processes of their own, and our server beside them."""

import http.client
import json
import os
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
VENVS = Path(os.environ.get("CDHR_CLIENTS", ROOT / "build"))
CLIENTS = VENVS / "clients" / "bin"
MOONRAKER = VENVS / "moonraker" / "bin"
TILE = ROOT / "gcode" / "cura_tile_volumetric.gcode"
SPEED = "20"


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def until(reached: Callable[[], Any], seconds: float = 60.0, what: str = "") -> Any:
    """Wait for another process: it has no clock to inject."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if found := reached():
            return found
        time.sleep(0.05)
    raise AssertionError(f"never reached: {what or reached}")


class Api:
    """JSON over HTTP."""

    def __init__(self, url: str, key: str = "") -> None:
        self.url = url.rstrip("/")
        self._headers = {"X-Api-Key": key} if key else {}

    def get(self, path: str) -> Any:
        return self._ask(urllib.request.Request(f"{self.url}{path}", headers=self._headers))

    def post(self, path: str, **body: object) -> Any:
        headers = {**self._headers, "Content-Type": "application/json"}
        return self._ask(urllib.request.Request(f"{self.url}{path}", json.dumps(body).encode(), headers))

    def upload(self, path: str, name: str, data: bytes, **fields: str) -> Any:
        """Multipart as libcurl writes it: fields first, the file last."""
        edge = "------------------------d74496d66958873e"
        parts = [
            f'--{edge}\r\nContent-Disposition: form-data; name="{key}"\r\n\r\n{value}\r\n'.encode()
            for key, value in fields.items()
        ]
        head = f'--{edge}\r\nContent-Disposition: form-data; name="file"; filename="{name}"\r\n'
        parts += [
            head.encode(),
            b"Content-Type: application/octet-stream\r\n\r\n",
            data,
            f"\r\n--{edge}--\r\n".encode(),
        ]
        headers = {**self._headers, "Content-Type": f"multipart/form-data; boundary={edge}"}
        return self._ask(urllib.request.Request(f"{self.url}{path}", b"".join(parts), headers))

    def alive(self, path: str) -> bool:
        try:
            self.get(path)
        except (OSError, ValueError, http.client.HTTPException):
            return False
        return True

    @staticmethod
    def _ask(request: urllib.request.Request) -> Any:
        with urllib.request.urlopen(request, timeout=60) as answer:
            text = answer.read()
        return json.loads(text) if text.strip() else None


@contextmanager
def running(*command: object, log: Path) -> Iterator[subprocess.Popen[bytes]]:
    with log.open("wb") as out:
        process = subprocess.Popen(
            [str(each) for each in command],
            stdout=out,
            stderr=out,
            stdin=subprocess.DEVNULL,
            env={**os.environ, "XDG_STATE_HOME": str(log.parent / "state")},
        )
        try:
            yield process
        finally:
            process.terminate()
            try:
                process.wait(30)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


@contextmanager
def served(folder: Path, *options: object, speed: str = SPEED) -> Iterator[dict[str, str]]:
    """``cdhr serve`` on the simulated drives, sped up; where its doors are."""
    command = [
        sys.executable,
        "-m",
        "cdhr_host",
        "serve",
        "--json",
        "--speed",
        speed,
        "--files",
        folder / "programs",
    ]
    command += ["--http", free_port(), *options]
    log = folder / "serve.log"
    with running(*command, log=log):
        line = until(
            lambda: next((each for each in log.read_text().splitlines() if each.startswith("{")), None)
        )
        yield json.loads(line)


def objects(api: Api, *names: str) -> Any:
    return api.get(f"/printer/objects/query?{'&'.join(names)}")["result"]["status"]
