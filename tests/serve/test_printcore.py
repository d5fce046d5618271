"""Printrun's printcore over the pseudo-terminal and over TCP."""

import json
import subprocess
from pathlib import Path

import pytest
from clients import CLIENTS, ROOT, free_port, served

PYTHON = CLIENTS / "python"
SCRIPT = Path(__file__).parent / "printcore_client.py"
PROGRAM = ROOT / "gcode" / "paper_ring_double.gcode"


def has_printrun() -> bool:
    return (
        PYTHON.exists()
        and not subprocess.run(
            [PYTHON, "-c", "import printrun.printcore"], check=False, capture_output=True
        ).returncode
    )


pytestmark = pytest.mark.skipif(not has_printrun(), reason="Printrun is not installed: bash .ci/run does")


@pytest.mark.parametrize("way", ["pty", "tcp"])
def test_printcore_prints_the_double_ring(tmp_path: Path, way: str) -> None:
    device, port = str(tmp_path / "printer"), free_port()
    with served(tmp_path, "--marlin", device, "--tcp", port):
        address = device if way == "pty" else f"127.0.0.1:{port}"
        run = subprocess.run(
            [PYTHON, SCRIPT, address, PROGRAM], capture_output=True, text=True, timeout=200, check=True
        )
    told = json.loads(run.stdout.splitlines()[-1])
    assert told["online"]
    assert told["sent"]
    assert told["stands"]
    assert told["errors"] == []
    assert told["where"].startswith("X:0.000 Y:0.000 Z:25.000 E:")
