"""A thousand hostile inputs at each open door: no traceback, no hang, no file elsewhere, memory flat."""

import asyncio
import gc
import json
import logging
import os
import sys
import tty
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parents[1] / "serve"))
from doors import Open, with_doors
from test_serve_laws import LINES, RECORDED

GROWS_BLOCKS, GROWS_BYTES = 5_000, 2 << 20
"""what the second five hundred inputs may leave behind: a bounded store fills, an allocator rounds"""
Exchange = Callable[[list[bytes]], Awaitable[None]]

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
    return (found * count)[:count]


def held() -> tuple[int, int]:
    """Blocks of memory and bytes that this process holds."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return sys.getallocatedblocks(), pages * os.sysconf("SC_PAGE_SIZE")


def at_doors(tmp_path: Path, act: Callable[[Open], Awaitable[None]], **doors: object) -> None:
    with_doors(act, tmp_path, **doors)
    assert {path.name for path in tmp_path.iterdir()} <= {"programs"}


async def flat(door: Open, exchange: Exchange, inputs: list[bytes]) -> None:
    """Exchange all inputs; the second half leaves no more behind than a little."""
    assert len(inputs) >= 1000
    half = len(inputs) // 2
    await exchange(inputs[:half])
    blocks, size = held()
    door.surface.said.clear()
    await exchange(inputs[half:])
    door.surface.said.clear()
    blocks_after, size_after = held()
    assert blocks_after - blocks < GROWS_BLOCKS
    assert size_after - size < GROWS_BYTES


@contextmanager
def quietly(caplog: pytest.LogCaptureFixture) -> Iterator[None]:
    with caplog.at_level(logging.ERROR):
        yield
    assert not [record for record in caplog.records if record.exc_info or record.levelno >= logging.ERROR]


async def printed_on(door: Open) -> None:
    """The machine prints what it was given, and is acknowledged when it was halted."""
    while True:
        door.surface.advance(50)
        await asyncio.sleep(0.001)


async def answered(reader: Callable[[], Awaitable[bytes]], writer: Callable[[bytes], None]) -> None:
    """The line protocol still answers: halts are acknowledged, a pause is ended."""
    writer(b"\nM108\nM999\nM105\n")
    heard = b""
    while b"ok T:" not in heard[-4000:]:
        heard = heard[-4000:] + await asyncio.wait_for(reader(), 60)


def lines_of_clients() -> list[bytes]:
    drawn = [bytes(each) + b"\n" for each in cases(LINES | st.binary(max_size=300), 1000 - len(RECORDED))]
    return drawn + RECORDED


def test_a_thousand_hostile_lines_over_the_pseudo_terminal(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "printer"
    inputs = lines_of_clients()

    async def act(door: Open) -> None:
        fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(fd)
        loop = asyncio.get_running_loop()
        reader = asyncio.StreamReader(limit=1 << 22)
        reading, _ = await loop.connect_read_pipe(
            lambda: asyncio.StreamReaderProtocol(reader), os.fdopen(os.dup(fd), "rb", 0)
        )
        printing = asyncio.create_task(printed_on(door))

        async def send(data: bytes) -> None:
            while data:
                try:
                    data = data[os.write(fd, data) :]
                except BlockingIOError:
                    await asyncio.sleep(0.001)

        async def exchange(some: list[bytes]) -> None:
            for data in some:
                await send(data)
                if door.surface.status().state.value == "fault":
                    door.surface.acknowledge()
            await answered(lambda: reader.read(1 << 16), lambda data: os.write(fd, data) and None)

        await flat(door, exchange, inputs)
        printing.cancel()
        reading.close()
        os.close(fd)

    with quietly(caplog):
        at_doors(tmp_path, act, marlin=path)


def test_a_thousand_hostile_lines_over_tcp(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    inputs = lines_of_clients()

    async def act(door: Open) -> None:
        host, port = door.server.addresses["tcp"].split(":")
        reader, writer = await asyncio.open_connection(host, int(port))
        printing = asyncio.create_task(printed_on(door))

        async def exchange(some: list[bytes]) -> None:
            for data in some:
                writer.write(data)
                await writer.drain()
                if door.surface.status().state.value == "fault":
                    door.surface.acknowledge()
            await answered(lambda: reader.read(1 << 16), writer.write)

        await flat(door, exchange, inputs)
        printing.cancel()
        writer.close()

    with quietly(caplog):
        at_doors(tmp_path, act, tcp=0)


def test_a_thousand_hostile_calls_over_the_websocket(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    calls = [json.dumps(each).encode() for each in cases(CALLS | JSON | st.lists(CALLS, max_size=3), 990)]
    calls += [b"{" * 3000, b"[" * 100_000, b"\xff", b"[]", b'{"id": 1e999}'] * 2

    async def act(door: Open) -> None:
        async with door.web.ws_connect(f"{door.url}/websocket") as socket:

            async def ask(some: list[bytes]) -> None:
                for call in some:
                    await socket.send_str(call.decode("latin-1"))
                await socket.send_json({"id": "last", "method": "server.info"})

            async def exchange(some: list[bytes]) -> None:
                asking = asyncio.create_task(ask(some))
                heard = ""
                while '"id": "last"' not in heard:
                    message = await socket.receive(timeout=60)
                    assert isinstance(message.data, str), message
                    heard = message.data
                await asking

            await flat(door, exchange, calls)

    with quietly(caplog):
        at_doors(tmp_path, act)


def test_a_thousand_hostile_calls_over_klippers_socket(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    calls = [json.dumps(each).encode() for each in cases(CALLS | JSON, 700)]
    calls += [bytes(each) for each in cases(st.binary(max_size=60), 300)]
    path = tmp_path / "klippy.sock"

    async def act(door: Open) -> None:
        reader, writer = await asyncio.open_unix_connection(path)

        async def ask(some: list[bytes]) -> None:
            for call in some:
                writer.write(call.replace(b"\x03", b"") + b"\x03")
                await writer.drain()
            writer.write(b'{"id": "last", "method": "info"}\x03')

        async def exchange(some: list[bytes]) -> None:
            asking = asyncio.create_task(ask(some))
            while b'"last"' not in await asyncio.wait_for(reader.readuntil(b"\x03"), 20):
                continue
            await asking

        await flat(door, exchange, calls)
        writer.close()

    with quietly(caplog):
        at_doors(tmp_path, act, klippy=path)


PLACES = """
/api/files/local /server/files/upload /printer/gcode/script /api/job /api/printer/command /websocket /
/server/files/gcodes/x.gcode /server/database/item /printer/objects/query /api/printer /access/login
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

        async def exchange(some: list[bytes]) -> None:
            for first in range(0, len(some), 20):
                part = some[first : first + 20]
                answers = await asyncio.gather(*map(one, part), return_exceptions=True)
                for request, answer in zip(part, answers, strict=True):
                    assert isinstance(answer, bytes | ConnectionError), (request, answer)
                    assert not isinstance(answer, bytes) or b" 500 " not in answer[:20], (request, answer)
            async with door.web.get(f"{door.url}/server/info") as answer:
                assert answer.status == 200

        await flat(door, exchange, requests)

    with quietly(caplog):
        at_doors(tmp_path, act)
