"""Hostile input at every door: no traceback, no hang, nothing outside the folder, memory flat."""

import asyncio
import json
import logging
import sys
import tracemalloc
from collections.abc import Awaitable, Callable
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
from doors import Open, with_doors
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


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=10),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)
METHODS = """
server.info printer.objects.subscribe printer.objects.query printer.gcode.script server.files.metadata
server.files.delete_file server.database.post_item server.database.get_item printer.print.start
server.files.get_directory server.gcode_store access.oneshot_token no.such objects/query gcode/script
"""
NAMES = st.sampled_from(METHODS.split())
KEYS = st.sampled_from(["objects", "script", "filename", "path", "namespace", "key", "value", "count", "x"])
PARAMS = st.dictionaries(KEYS, JSON, max_size=3) | JSON
CALLS = st.fixed_dictionaries({"method": NAMES | st.text(max_size=10), "params": PARAMS, "id": st.integers()})


def cases(strategy: st.SearchStrategy[object], count: int) -> list[object]:
    """Examples drawn once, for doors that are dear to open."""
    found: list[object] = []

    @settings(max_examples=count, deadline=None, database=None, suppress_health_check=list(HealthCheck))
    @given(strategy)
    def collect(each: object) -> None:
        found.append(each)

    collect()
    return found


def at_doors(tmp_path: Path, act: Callable[[Open], Awaitable[None]], **doors: object) -> None:
    with_doors(act, tmp_path, **doors)
    assert {path.name for path in tmp_path.iterdir()} <= {"programs"}


def test_a_thousand_hostile_calls_over_the_websocket(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    calls = cases(CALLS | JSON | st.lists(CALLS, max_size=3), 1000)

    async def act(door: Open) -> None:
        async with door.web.ws_connect(f"{door.url}/websocket") as socket:

            async def ask() -> None:
                for call in calls:
                    await socket.send_json(call)
                await socket.send_str("{" * 3000)
                await socket.send_json({"id": "last", "method": "server.info"})

            asking = asyncio.create_task(ask())
            heard = ""
            while '"id": "last"' not in heard:
                message = await socket.receive(timeout=20)
                assert isinstance(message.data, str), message
                heard = message.data
            await asking

    with caplog.at_level(logging.ERROR):
        at_doors(tmp_path, act)
    assert not caplog.records


def test_a_thousand_hostile_calls_over_klippers_socket(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    calls = [json.dumps(each).encode() for each in cases(CALLS | JSON, 700)]
    calls += [bytes(each) for each in cases(st.binary(max_size=60), 300)]
    path = tmp_path / "klippy.sock"

    async def act(door: Open) -> None:
        reader, writer = await asyncio.open_unix_connection(path)

        async def ask() -> None:
            for call in calls:
                writer.write(call.replace(b"\x03", b"") + b"\x03")
                await writer.drain()
            writer.write(b'{"id": "last", "method": "info"}\x03')

        asking = asyncio.create_task(ask())
        while b'"last"' not in await asyncio.wait_for(reader.readuntil(b"\x03"), 20):
            continue
        await asking
        writer.close()

    with caplog.at_level(logging.ERROR):
        at_doors(tmp_path, act, klippy=path)
    assert not caplog.records


PLACES = """
/api/files/local /server/files/upload /printer/gcode/script /api/job /api/printer/command /websocket /
/server/files/gcodes/x.gcode /server/database/item /printer/objects/query
"""
ODD = st.text(alphabet="az09/.%~ü", max_size=20).map(lambda text: f"/{text}")
PATHS = (st.sampled_from(PLACES.split()) | ODD).map(str.encode)
FORM = b"Content-Type: multipart/form-data"
HEADS = [b"Content-Type: application/json", FORM, FORM + b"; boundary=x", b"X-Api-Key: \xff", b"Origin: null"]
HEADS += [b"Transfer-Encoding: chunked", b"Upgrade: websocket", b"Range: bytes=-1"]
FILE = b'--x\r\nContent-Disposition: form-data; name="file"; filename="../../x.gcode"\r\n\r\nG28\r\n--x--\r\n'
BODIES = [b"", b"{", b"[]", b"null", b'{"command": 5}', b'{"commands": [1]}', b"--x\r\n\r\n--x--", FILE]
BODIES += [b"--x\r\nContent-Disposition: x\r\n\r\nG28"]


def request(method: bytes, path: bytes, head: bytes, body: bytes) -> bytes:
    top = b"%s %s HTTP/1.1\r\nHost: localhost\r\nContent-Length: %d\r\n" % (method, path, len(body))
    return top + head + b"\r\n\r\n" + body


REQUESTS = st.builds(
    request,
    st.sampled_from([b"GET", b"POST", b"DELETE", b"PUT", b"OPTIONS"]),
    PATHS,
    st.sampled_from(HEADS),
    st.sampled_from(BODIES) | st.binary(max_size=80),
)


def test_a_thousand_hostile_requests_over_http(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    requests = [bytes(each) for each in cases(REQUESTS, 700)]
    requests += [bytes(each) for each in cases(st.binary(max_size=200), 300)]

    async def act(door: Open) -> None:
        door.server.http.gates.headers_within = 0.2
        host, port = door.url.removeprefix("http://").split(":")

        async def one(request: bytes) -> bytes:
            reader, writer = await asyncio.open_connection(host, int(port))
            writer.write(request)
            writer.write_eof()
            answer = await asyncio.wait_for(reader.read(1 << 20), 20)
            writer.close()
            return answer

        for first in range(0, len(requests), 20):
            answers = await asyncio.gather(*map(one, requests[first : first + 20]), return_exceptions=True)
            for request, answer in zip(requests[first : first + 20], answers, strict=True):
                assert isinstance(answer, bytes | ConnectionError), (request, answer)
                assert not isinstance(answer, bytes) or b" 500 " not in answer[:20], (request, answer)
        async with door.web.get(f"{door.url}/server/info") as answer:
            assert answer.status == 200

    with caplog.at_level(logging.ERROR):
        at_doors(tmp_path, act)
    assert not [record for record in caplog.records if record.exc_info]
