"""Names of doors that mean something already: taken from a server that died, never from a living one."""

import os
import socket
from pathlib import Path

import pytest
from doors import Open, open_doors, with_doors

from cdhr_host.errors import JobError
from cdhr_host.serve.folder import Folder


def test_the_name_of_a_living_pseudo_terminal_stays_its_own(tmp_path: Path) -> None:
    link = tmp_path / "printer"

    async def act(door: Open) -> None:
        leads = os.readlink(link)
        with pytest.raises(JobError, match="which is in use"):
            async with open_doors(tmp_path / "second", marlin=link):
                pass
        assert os.readlink(link) == leads

    with_doors(act, tmp_path, marlin=link)
    assert not link.is_symlink()


def test_the_name_of_a_dead_pseudo_terminal_is_taken(tmp_path: Path) -> None:
    link = tmp_path / "printer"
    link.symlink_to("/dev/pts/999999")

    async def act(door: Open) -> None:
        assert link.exists()

    with_doors(act, tmp_path, marlin=link)


def test_a_file_is_no_name_for_a_door(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("mine")

    async def act(_: Open) -> None:
        raise AssertionError

    with pytest.raises(JobError, match="is no link"):
        with_doors(act, tmp_path, marlin=file)
    with pytest.raises(JobError, match="is no socket"):
        with_doors(act, tmp_path, klippy=file)
    with pytest.raises(JobError, match="cannot be the folder of programs"):
        Folder(file)
    assert file.read_text() == "mine"


def test_a_socket_that_is_listened_at_stays_and_one_left_behind_goes(tmp_path: Path) -> None:
    path = tmp_path / "klippy.sock"
    with socket.socket(socket.AF_UNIX) as left:
        left.bind(str(path))

    async def act(_: Open) -> None:
        with pytest.raises(JobError, match="listens at"):
            async with open_doors(tmp_path / "second", klippy=path):
                pass
        with socket.socket(socket.AF_UNIX) as asking:
            asking.connect(str(path))

    with_doors(act, tmp_path, klippy=path)
