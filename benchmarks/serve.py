"""Lines printed as they come over a pseudo-terminal, and what four clients' status costs.

python benchmarks/serve.py            20 000 lines of 0.02 mm at 100 mm/s, four in flight
python benchmarks/serve.py --smoke
"""

import argparse
import asyncio
import json
import math
import os
import subprocess
import sys
import tempfile
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import aiohttp

WINDOW = 4
STEP_MM, RADIUS_MM, FEED = 0.02, 40.0, 6000


@contextmanager
def served(folder: Path) -> Iterator[tuple[subprocess.Popen[str], dict[str, str]]]:
    """A server on the simulated drives in real time, and its addresses."""
    command = [sys.executable, "-m", "cdhr_host", "serve", "--json", "--http", "0"]
    command += ["--marlin", str(folder / "printer"), "--files", str(folder / "programs")]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        assert process.stdout is not None
        yield process, json.loads(process.stdout.readline())
    finally:
        process.terminate()
        process.wait()


def cpu(process: subprocess.Popen[str]) -> float:
    """User and system s of a process so far."""
    fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def lines(count: int) -> Iterator[bytes]:
    """A circle of short moves, out and round."""
    yield f"G1 X{RADIUS_MM} Y0 F{FEED}\n".encode()
    for k in range(count):
        angle = k * STEP_MM / RADIUS_MM
        x, y = RADIUS_MM * math.cos(angle), RADIUS_MM * math.sin(angle)
        yield f"G1 X{x:.6f} Y{y:.6f} E{k * 0.01:.4f}\n".encode()


def printed(path: str, count: int) -> int:
    """Send lines, some in flight; how many were answered."""
    fd = os.open(path, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(fd)
    source, flying, answered, rest = lines(count), 0, 0, b""
    over = False
    while not over or flying:
        batch = b""
        while flying < WINDOW and not over:
            line = next(source, None)
            over = line is None
            if line is not None:
                batch, flying = batch + line, flying + 1
        if batch:
            os.write(fd, batch)
        rest += os.read(fd, 65536)
        *whole, rest = rest.split(b"\n")
        oks = sum(line.startswith(b"ok") for line in whole)
        flying, answered = flying - oks, answered + oks
    os.close(fd)
    return answered


async def watched(url: str, seconds: float) -> int:
    """Four clients that subscribe to everything; how many messages they got."""
    heard = 0
    async with aiohttp.ClientSession() as session:
        sockets = [await session.ws_connect(f"{url}websocket") for _ in range(4)]
        names = ("print_stats", "toolhead", "gcode_move", "motion_report", "virtual_sdcard", "cables", "air")
        ask = {"jsonrpc": "2.0", "id": 1, "method": "printer.objects.subscribe"}
        for socket in sockets:
            await socket.send_json({**ask, "params": {"objects": dict.fromkeys(names)}})
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            for socket in sockets:
                try:
                    await socket.receive(timeout=0.1)
                    heard += 1
                except TimeoutError:
                    continue
    return heard


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--smoke", action="store_true", help="little input")
    smoke = parser.parse_args().smoke
    count, seconds = (500, 2.0) if smoke else (20_000, 20.0)
    with tempfile.TemporaryDirectory() as folder, served(Path(folder)) as (process, addresses):
        before, began = cpu(process), time.monotonic()
        answered = printed(addresses["marlin"], count)
        used, took = cpu(process) - before, time.monotonic() - began
        print(f"{answered} lines: {answered / took:.0f} lines/s, {used / answered * 1e6:.0f} µs CPU a line")
        time.sleep(0.0 if smoke else 5.0)
        before = cpu(process)
        time.sleep(seconds)
        idle = cpu(process) - before
        before = cpu(process)
        heard = asyncio.run(watched(addresses["http"], seconds))
        used = cpu(process) - before
        share, beside = (used - idle) / seconds, idle / seconds
        print(f"4 clients: {heard / seconds:.1f} messages/s, {share:.2%} of a core beside {beside:.2%}")


if __name__ == "__main__":
    main()
