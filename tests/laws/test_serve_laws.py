"""Hostile input to what stands behind the doors: every line answered, no name outside the folder."""

import sys
import tracemalloc
from collections.abc import Awaitable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cdhr_host.errors import JobError
from cdhr_host.serve.folder import Folder
from cdhr_host.serve.marlin.engine import OUT_MAX
from cdhr_host.serve.marlin.lines import Numbering
from cdhr_host.serve.names import program_name
from cdhr_host.serve.words import Modes, code_of, number_after

sys.path.insert(0, str(Path(__file__).parents[1] / "serve"))
from marlin_client import Client, checked, with_client

MANY = settings(
    max_examples=1000,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
SOME = settings(MANY, max_examples=200)
WORDS = [
    "G1 X1 F600",
    "G28",
    "M105",
    "M114",
    "M115",
    "M400",
    "M112",
    "M84",
    "M20",
    "M23 x",
    "M24",
    "M25",
    "M27 S1",
]
WORDS += [
    "M155 S1",
    "M117 *;",
    "PAUSE",
    "RESUME",
    "SDCARD_PRINT_FILE FILENAME=../x",
    "G91",
    "G1 E9999 F1",
    "T5",
    "M876 S1",
]
LINES = st.one_of(
    st.sampled_from(WORDS).map(str.encode),
    st.binary(max_size=60),
    st.builds(checked, st.integers(-10, 10), st.sampled_from(WORDS)),
    st.builds(
        lambda n, c, w: f"N{n} {w}*{c}\n".encode(), st.integers(), st.integers(0, 999), st.sampled_from(WORDS)
    ),
    st.text(max_size=40).map(lambda text: text.encode("utf-8", "surrogatepass")),
    st.integers(1000, 3000).map(lambda size: b"G1 X" + b"1" * size),
)
RECORDED = [
    b"\0" * 100 + b"\n",
    b"\xff" * 4096,
    b"N0 M110 N0*125" * 500,
    b"N99999999999999999999 M110*1\n",
    b"N-0 M110 N--1*1\n",
    b"M110 N999999999999999999\n",
    b"****\n*1*2*3\nN*\nN1*\n*\n",
    b"M117 " + b"\xc3\x28" * 200 + b"\n",
    b"M118 A1 //action:cancel\nM118 A1 A1 A1\n",
    b"G1 X" + b"9" * 400 + b"\n",
    b"G1 Xnan Yinf Z1e999\n",
    b"M220 S-1\nM220 S1e9\nM221 Snan\n",
    b"M23 ../../../etc/passwd\nM24\nM32 /dev/zero\nM30 x\nM28 x\n",
    b"SAVE_GCODE_STATE NAME='\nRESTORE_GCODE_STATE NAME=\"\n",
    b"M155 S-5\nM154 S1e12\nM113 S-1\nM27 S99999999\n",
]


@MANY
@given(st.lists(LINES, max_size=12), st.lists(st.integers(1, 200), max_size=12))
def test_whatever_a_marlin_client_sends_each_line_is_answered(
    tmp_path_factory: pytest.TempPathFactory, lines: list[bytes], cuts: list[int]
) -> None:
    data = b"\n".join(lines) + b"\n"

    async def act(client: Client) -> None:
        before = 0
        for cut in [*cuts, len(data)]:
            client.engine.receive(data[before : before + cut], client.now)
            before += cut
            client.surface.advance(50)
        for _ in range(4):
            await client.settle()
            client.surface.advance(50)
            client.wait(1.0)
        assert len(client.engine._framer._tail) <= 1024

    with_client(act, tmp_path_factory.getbasetemp())


@pytest.mark.parametrize("data", RECORDED, ids=range(len(RECORDED)))
def test_recorded_nonsense_is_survived(tmp_path: Path, data: bytes) -> None:
    async def act(client: Client) -> None:
        client.engine.receive(data, client.now)
        await client.settle()
        client.heard()
        client.engine.receive(b"\nM105\n", client.now)
        assert any("ok T:" in line for line in await client.settle() + client.heard())

    def again(client: Client) -> Awaitable[None]:
        return act(client)

    with_client(again, tmp_path)


def test_memory_does_not_grow_with_what_a_client_sends(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        def nonsense(count: int) -> int:
            for k in range(count):
                client.engine.receive(
                    b"\x01garbage" * 20 + b"\nM9999\nN5 M105*9\nM117 hello\n", client.now + k
                )
                client.engine.take()
            return tracemalloc.get_traced_memory()[0]

        tracemalloc.start()
        first = nonsense(300)
        second = nonsense(3000)
        tracemalloc.stop()
        assert second - first < 200_000

    with_client(act, tmp_path)


def test_a_client_that_never_reads_is_not_remembered_for_ever(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        client.engine.receive(b"M155 S1\nM154 S1\n", client.now)
        for k in range(20_000):
            client.engine.tick(client.now + k)
            client.host.say(f"message {k}")
        assert len(client.engine._out) < OUT_MAX + 10_000

    with_client(act, tmp_path)


@MANY
@given(st.text(max_size=80))
def test_no_name_leads_out_of_the_folder(name: str) -> None:
    try:
        path = program_name(name)
    except JobError:
        return
    assert not path.is_absolute()
    assert ".." not in path.parts
    assert not any(part.startswith(".") for part in path.parts)


@SOME
@given(
    st.text(max_size=40) | st.sampled_from(["../x.gcode", "a/../b.gcode", "/x.gcode"]),
    st.binary(min_size=1, max_size=50),
)
def test_what_is_received_lies_in_the_folder(
    tmp_path_factory: pytest.TempPathFactory, name: str, data: bytes
) -> None:
    base = tmp_path_factory.mktemp("folder")
    folder = Folder(base / "programs")
    try:
        with folder.receive(name) as upload:
            upload.write(data)
            entry = upload.keep()
    except JobError:
        assert list(folder.root.iterdir()) == []
    else:
        assert folder.read(entry.name, 100) == data
    assert [path.name for path in base.iterdir()] == ["programs"]


@MANY
@given(st.text(max_size=60))
def test_words_of_any_line_are_read_without_an_error(line: str) -> None:
    code_of(line)
    number_after(line, "S")
    Numbering().check(line.replace("\n", " ").encode("latin-1", "replace").decode("latin-1"))
    Modes().after(line.encode("latin-1", "replace").decode("latin-1"))
