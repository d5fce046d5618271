"""``cdhr drives`` as an electrician meets it: against ``cdhr sim`` in a process of its own."""

import json
import select
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from cdhr_host.cli.app import app

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module", params=["slcan", "link"])
def url(request):
    """The far side's URL."""
    arguments = [sys.executable, "-m", "cdhr_host", "sim", "--bus", request.param]
    far = subprocess.Popen(arguments, cwd=ROOT, stdout=subprocess.PIPE, text=True)
    assert select.select([far.stdout], [], [], 60.0)[0]
    yield far.stdout.readline().strip()
    far.send_signal(signal.SIGTERM)
    far.wait(60.0)
    far.stdout.close()


def drives(*arguments):
    return CliRunner().invoke(app, ["drives", *arguments])


def test_scan_names_every_node(url):
    result = drives("scan", "--drives", url)
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    assert len(lines) == 7
    assert lines[0].strip() == "1  servo drive (CiA 402)  vendor 0x4C1  product 0x402  serial 101"
    assert "coupler (CiA 401)" in lines[6]
    nodes = json.loads(drives("scan", "--drives", url, "--json").stdout)
    assert [node["id"] for node in nodes] == [1, 2, 3, 4, 5, 6, 7]


def test_status_tells_state_position_and_error(url):
    lines = drives("status", "--drives", url).stdout.splitlines()
    assert len(lines) == 6
    assert lines[2].startswith("drive 3  switch-on disabled")
    assert lines[2].endswith("error none")


def test_read_and_write_with_names_and_sentences(url):
    assert drives("read", "3", "0x1018:4", "--drives", url).stdout == "0x1018:04 Serial number = 103 (0x67)\n"
    written = drives("write", "3", "0x6065", "5000", "--drives", url)
    assert written.stdout == "0x6065:00 Following error window = 5000 (0x1388)\n"
    again = drives("read", "3", "0x6065", "--drives", url)
    assert again.stdout == written.stdout
    refused = drives("write", "3", "0x6041", "1", "--drives", url)
    assert refused.exit_code == 6
    assert "0x6041:00 Statusword refuses 1" in refused.stderr
    assert "read only" in refused.stderr
    absent = drives("read", "3", "0x5FFF", "--drives", url)
    assert "Object does not exist" in absent.stderr


def test_reset_leaves_a_drive_switched_off(url):
    result = drives("reset", "3", "--drives", url)
    assert (result.exit_code, result.stdout) == (0, "drive 3: switch-on disabled\n")
    assert drives("reset", "7", "--drives", url).exit_code == 6


def test_numbers_and_places_are_checked(url):
    result = drives("read", "3", "0x60zz", "--drives", url)
    assert result.exit_code == 6
    assert "'0x60zz' is no object of drive 3" in result.stderr
    result = drives("write", "3", "0x6065", "ten", "--drives", url)
    assert result.exit_code == 2
    assert "'ten' is not a number" in result.stderr
    before = drives("read", "3", "following error window", "--drives", url).stdout
    result = drives("write", "3", "Following Error Window", "99999999999", "--drives", url)
    assert result.exit_code == 6
    assert "99999999999 does not fit 0x6065:00 Following error window: 0 to 4294967295" in result.stderr
    assert drives("read", "3", "0x6065", "--drives", url).stdout == before


@pytest.mark.parametrize("command", [["scan"], ["home"], ["reference"]])
def test_simulated_drives_in_this_process_have_no_bus(command):
    result = drives(*command, "--drives", "loopback:")
    assert result.exit_code == 2
    assert "'loopback:'" in result.stderr


def test_drives_that_are_not_known_are_refused_with_the_nearest():
    result = drives("scan", "--drives", "slcn:/dev/null")
    assert result.exit_code == 6
    assert "did you mean slcan:/dev/null?" in result.stderr


def test_a_path_that_is_no_adapter_is_refused():
    result = drives("scan", "--drives", "slcan:/dev/null")
    assert result.exit_code == 6
    assert "/dev/null" in result.stderr
