import os
from pathlib import Path

import pytest

from cdhr_host.errors import JobError
from cdhr_host.serve.folder import Folder, FolderLimits

BAD = [
    "",
    "/",
    "..",
    "../x.gcode",
    "a/../../x.gcode",
    "/etc/x.gcode/..",
    "//etc/x.gcode",
    "a//x.gcode",
    ".hidden.gcode",
    "a/.git/x.gcode",
    "x.gcode\0.txt",
    "a\\..\\x.gcode",
    "C:x.gcode",
    "CON.gcode",
    "nul.gcode",
    "com1.tar.gcode",
    "x.gcode ",
    "x.gcode.",
    "x\n.gcode",
    "\u202eedocg.gcode",
    "a/b/c/d/x.gcode",
    "x" * 181 + ".gcode",
    "x.txt",
    "x",
    "x.gcode/",
    "|x.gcode",
    "x\udcff.gcode",
]


def put(folder: Folder, name: str, data: bytes = b"G28\n") -> None:
    with folder.receive(name) as upload:
        upload.write(data)
        upload.keep()


@pytest.mark.parametrize("name", BAD)
def test_names_that_lead_elsewhere_are_refused(tmp_path: Path, name: str) -> None:
    folder = Folder(tmp_path / "programs")
    for use in (folder.entry, folder.delete, folder.path, lambda each: put(folder, each)):
        with pytest.raises(JobError):
            use(name)
    assert sorted(tmp_path.iterdir()) == [folder.root]
    assert list(folder.root.iterdir()) == []


@pytest.mark.parametrize(
    "name", ["vase.gcode", "Töpfe/Große Vase (2).gcode", "a/b/c/x.g", "x.gcode.gz", "ÄÖ 🏺.nc"]
)
def test_plain_names_are_taken(tmp_path: Path, name: str) -> None:
    folder = Folder(tmp_path / "programs")
    put(folder, name)
    assert [entry.name for entry in folder.entries()] == [name]
    assert folder.read(name, 100) == b"G28\n"
    folder.delete(name)
    assert folder.entries() == []


def test_links_lead_nowhere(tmp_path: Path) -> None:
    folder = Folder(tmp_path / "programs")
    secret = tmp_path / "secret.gcode"
    secret.write_text("G28\n")
    (folder.root / "link.gcode").symlink_to(secret)
    (folder.root / "out").symlink_to(tmp_path)
    os.mkfifo(folder.root / "pipe.gcode")
    assert folder.entries() == []
    for name in ("link.gcode", "out/secret.gcode", "pipe.gcode"):
        with pytest.raises(JobError):
            folder.read(name, 10)
    with pytest.raises(JobError):
        put(folder, "out/new.gcode")
    assert not (tmp_path / "new.gcode").exists()


def test_an_upload_that_breaks_off_leaves_nothing(tmp_path: Path) -> None:
    folder = Folder(tmp_path / "programs")
    with folder.receive("vase.gcode") as upload:
        upload.write(b"G28\n")
    assert list(folder.root.iterdir()) == []


def test_what_a_killed_server_left_is_cleared(tmp_path: Path) -> None:
    folder = Folder(tmp_path / "programs")
    (folder.root / ".upload-1-2").write_text("half")
    assert list(Folder(folder.root).root.iterdir()) == []


def test_size_and_count_have_limits(tmp_path: Path) -> None:
    folder = Folder(tmp_path / "programs", FolderLimits(size_max=100, files_max=2))
    with pytest.raises(JobError, match="larger than 100 bytes"):
        put(folder, "big.gcode", b"x" * 101)
    with pytest.raises(JobError, match="is empty"):
        put(folder, "empty.gcode", b"")
    put(folder, "a.gcode")
    put(folder, "b.gcode")
    with pytest.raises(JobError, match="the folder is full"):
        put(folder, "c.gcode")
    put(folder, "a.gcode", b"G28\nG28\n")
    assert folder.entry("a.gcode").size == 8


def test_a_file_is_replaced_whole(tmp_path: Path) -> None:
    folder = Folder(tmp_path / "programs")
    put(folder, "a.gcode", b"old\n")
    with folder.receive("a.gcode") as upload:
        upload.write(b"new\n")
        assert folder.read("a.gcode", 10) == b"old\n"
        upload.keep()
    assert folder.read("a.gcode", 10) == b"new\n"
