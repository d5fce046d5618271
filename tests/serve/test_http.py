"""The HTTP port: uploads as slicers send them, Moonraker's methods, and who is turned away."""

import asyncio
import json
from pathlib import Path

import aiohttp
import pytest
from doors import Open, with_doors
from serve_surface import ScriptedSurface

from cdhr_host.errors import JobError
from cdhr_host.job.surface import JobState
from cdhr_host.serve.server import Doors, Server
from cdhr_host.serve.web.keys import ApiKey, Tokens

PROGRAM = b"G1 X1 F600\nG1 X2\n"


def form(name: str = "vase.gcode", data: bytes = PROGRAM, **fields: str) -> aiohttp.FormData:
    made = aiohttp.FormData(quote_fields=False)
    for key, value in fields.items():
        made.add_field(key, value)
    made.add_field("file", data, filename=name, content_type="application/octet-stream")
    return made


async def proven(door: Open) -> None:
    while door.surface.state is not JobState.PROVING:
        await asyncio.sleep(0.005)
    door.surface.advance(0)


def test_prusaslicer_orca_and_superslicer_as_octoprint(tmp_path: Path) -> None:
    async def act(door: Open) -> None:
        async with door.web.get(f"{door.url}/api/version", headers={"X-Api-Key": ""}) as answer:
            version = await answer.json()
        assert "api" in version
        assert version["text"].startswith("OctoPrint")
        upload = door.web.post(
            f"{door.url}/api/files/local", data=form(print="true", path="pots", plateindex="0")
        )
        answer, _ = await asyncio.gather(upload, proven(door))
        assert answer.status == 201
        assert answer.headers["Location"].endswith("/api/files/local/pots/vase.gcode")
        told = await answer.json()
        assert told["done"]
        assert told["files"]["local"]["path"] == "pots/vase.gcode"
        assert door.surface.state is JobState.PRINTING
        async with door.web.get(f"{door.url}/api/printer") as answer:
            flags = (await answer.json())["state"]["flags"]
        assert flags["printing"]
        assert flags["operational"]

    with_doors(act, tmp_path)


def test_prusaslicer_and_orca_as_moonraker(tmp_path: Path) -> None:
    async def act(door: Open) -> None:
        async with door.web.get(f"{door.url}/server/info") as answer:
            text = await answer.text()
        assert text.startswith('{"result"')
        info = json.loads(text)["result"]
        assert info["moonraker_version"]
        assert info["klippy_state"] == "ready"
        async with door.web.get(f"{door.url}/server/files/roots") as answer:
            assert (await answer.json())["result"][0]["name"] == "gcodes"
        upload = door.web.post(f"{door.url}/server/files/upload", data=form(root="gcodes", print="true"))
        answer, _ = await asyncio.gather(upload, proven(door))
        told = await answer.json()
        assert told["print_started"] is told["result"]["print_started"] is True
        assert told["item"]["path"] == told["result"]["item"]["path"] == "vase.gcode"

    with_doors(act, tmp_path)


def test_cura_polls_and_uploads(tmp_path: Path) -> None:
    async def act(door: Open) -> None:
        for path in ("/api/printer", "/api/job", "/api/settings"):
            async with door.web.get(f"{door.url}{path}") as answer:
                assert answer.status == 200
        async with door.web.post(f"{door.url}/api/files/local", data=form(select="true")) as answer:
            assert answer.status == 201
        order = {"command": "select", "print": True}
        post = door.web.post(f"{door.url}/api/files/local/vase.gcode", json=order)
        answer, _ = await asyncio.gather(post, proven(door))
        assert answer.status == 204
        for command, state in (
            ("pause", JobState.HELD),
            ("pause", JobState.PRINTING),
            ("cancel", JobState.STOPPED),
        ):
            async with door.web.post(f"{door.url}/api/job", json={"command": command}) as answer:
                assert answer.status == 204
            assert door.surface.state is state

    with_doors(act, tmp_path)


def test_a_file_comes_back_as_it_went_in(tmp_path: Path) -> None:
    async def act(door: Open) -> None:
        data = bytes(range(256)) * 1000
        async with door.web.post(f"{door.url}/server/files/upload", data=form("a b.gcode", data)) as answer:
            assert answer.status == 201
        async with door.web.get(f"{door.url}/server/files/gcodes/a%20b.gcode") as answer:
            assert await answer.read() == data
        async with door.web.delete(f"{door.url}/server/files/gcodes/a%20b.gcode") as answer:
            assert answer.status == 200
        async with door.web.get(f"{door.url}/server/files/gcodes/a%20b.gcode") as answer:
            assert answer.status == 404

    with_doors(act, tmp_path)


def test_a_refused_program_says_line_and_word(tmp_path: Path) -> None:
    async def act(door: Open) -> None:
        upload = door.web.post(
            f"{door.url}/api/files/local", data=form(data=b"G1 X1 F600\nG77\n", print="true")
        )
        answer, _ = await asyncio.gather(upload, proven(door))
        assert answer.status == 400
        assert "unknown word G77" in (await answer.json())["error"]["message"]
        assert door.surface.state is JobState.IDLE

    with_doors(act, tmp_path)


@pytest.mark.parametrize(
    "name",
    [
        "../x.gcode",
        "/etc/cron.d/x.gcode",
        "a/../../x.gcode",
        "x.sh",
        ".x.gcode",
        "con.gcode",
        "x.gcode\x00.sh",
    ],
)
def test_no_file_lands_outside(tmp_path: Path, name: str) -> None:
    async def act(door: Open) -> None:
        edge = "x1x"
        about = f'Content-Disposition: form-data; name="file"; filename="{name}"'
        body = f"--{edge}\r\n{about}\r\n\r\nG28\r\n--{edge}--\r\n"
        kind = {"Content-Type": f"multipart/form-data; boundary={edge}"}
        for path in ("/api/files/local", "/server/files/upload"):
            async with door.web.post(f"{door.url}{path}", data=body.encode(), headers=kind) as answer:
                assert answer.status in {201, 400}
        inside = {entry.name for entry in door.server.host.folder.entries()}
        assert all("/" not in each.replace("etc/cron.d/", "") for each in inside)

    with_doors(act, tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"programs"}


def test_a_program_under_way_is_not_deleted(tmp_path: Path) -> None:
    async def act(door: Open) -> None:
        upload = door.web.post(f"{door.url}/api/files/local", data=form(print="true"))
        await asyncio.gather(upload, proven(door))
        async with door.web.delete(f"{door.url}/server/files/gcodes/vase.gcode") as answer:
            assert answer.status == 409

    with_doors(act, tmp_path)


def test_pages_elsewhere_and_names_elsewhere_are_turned_away(tmp_path: Path) -> None:
    async def act(door: Open) -> None:
        stop = f"{door.url}/printer/emergency_stop"
        async with door.web.post(stop, headers={"Origin": "http://evil.example"}) as answer:
            assert answer.status == 403
            assert "Access-Control-Allow-Origin" not in answer.headers
        async with door.web.post(stop, headers={"Host": "evil.example"}) as answer:
            assert answer.status == 403
        async with door.web.post(stop, headers={"Origin": "null"}) as answer:
            assert answer.status == 403
        with pytest.raises(aiohttp.WSServerHandshakeError):
            await door.web.ws_connect(f"{door.url}/websocket", headers={"Origin": "http://evil.example"})
        assert door.surface.state is JobState.IDLE

    with_doors(act, tmp_path)


def test_an_origin_that_is_allowed_may_speak(tmp_path: Path) -> None:
    async def act(door: Open) -> None:
        headers = {"Origin": "http://mainsail.local"}
        async with door.web.options(f"{door.url}/server/info", headers=headers) as answer:
            assert answer.headers["Access-Control-Allow-Origin"] == "http://mainsail.local"
        async with door.web.get(f"{door.url}/server/info", headers=headers) as answer:
            assert answer.status == 200

    with_doors(act, tmp_path, origins=frozenset({"http://mainsail.local"}))


def test_a_wrong_key_is_refused_even_where_none_is_needed(tmp_path: Path) -> None:
    key, text = ApiKey.make(tmp_path / "key")

    async def act(door: Open) -> None:
        for given, status in ((text, 200), ("wrong", 401), (text[:-1], 401)):
            async with door.web.get(f"{door.url}/api/version", headers={"X-Api-Key": given}) as answer:
                assert answer.status == status
        async with door.web.get(f"{door.url}/api/version") as answer:
            assert answer.status == 200

    with_doors(act, tmp_path, key=key)
    assert text not in (tmp_path / "key").read_text()
    assert (tmp_path / "key").stat().st_mode & 0o777 == 0o600


def test_beyond_loopback_a_key_is_demanded(tmp_path: Path) -> None:
    key, text = ApiKey.make(tmp_path / "key")

    async def act(door: Open) -> None:
        async with door.web.get(f"{door.url}/") as answer:
            assert answer.status == 200
        for path in (
            "/server/info",
            "/api/version",
            "/websocket",
            "/access/oneshot_token",
            "/server/files/gcodes/x.g",
        ):
            async with door.web.get(f"{door.url}{path}") as answer:
                assert answer.status == 401, path
        headers = {"Authorization": f"Bearer {text}"}
        async with door.web.get(f"{door.url}/access/oneshot_token", headers=headers) as answer:
            token = (await answer.json())["result"]
        async with door.web.get(f"{door.url}/server/info?token={token}") as answer:
            assert answer.status == 200
        async with door.web.get(f"{door.url}/server/info?token={token}") as answer:
            assert answer.status == 401

    with_doors(act, tmp_path, key=key, demands_key=True)


def test_an_address_beyond_loopback_without_a_key_is_refused(tmp_path: Path) -> None:
    with pytest.raises(JobError, match="needs an API key"):
        Server(ScriptedSurface(), Doors(files=tmp_path, http=0, address="0.0.0.0"))


def test_tokens_end() -> None:
    tokens = Tokens()
    first = tokens.give(0.0)
    assert not tokens.take(first, Tokens.LIFE + 0.1)
    assert len({tokens.give(1.0) for _ in range(200)}) == 200
    assert len(tokens._ends) <= Tokens.MOST


def test_a_silent_connection_is_hung_up_on(tmp_path: Path) -> None:
    async def act(door: Open) -> None:
        http = door.server.http
        assert http is not None
        http.gates.headers_within = 0.1
        host, port = door.url.removeprefix("http://").split(":")
        reader, writer = await asyncio.open_connection(host, int(port))
        writer.write(b"POST /api/files/local HTTP/1.1\r\nHost: localhost\r\nX-Slow: ")
        assert await asyncio.wait_for(reader.read(), 5.0) == b""
        writer.close()

    with_doors(act, tmp_path)


def test_connections_have_a_limit(tmp_path: Path) -> None:
    async def act(door: Open) -> None:
        host, port = door.url.removeprefix("http://").split(":")
        opened = [await asyncio.open_connection(host, int(port)) for _ in range(70)]
        await asyncio.sleep(0.1)
        assert door.server.http.gates.count <= 64
        for _, writer in opened:
            writer.transport.abort()

    with_doors(act, tmp_path)


def test_a_websocket_calls_in_batches_subscribes_and_is_pushed_to(tmp_path: Path) -> None:
    async def act(door: Open) -> None:
        async with door.web.ws_connect(f"{door.url}/websocket") as socket:
            batch = [
                {"jsonrpc": "2.0", "id": 1, "method": "server.info"},
                {"jsonrpc": "2.0", "id": 2, "method": "no.such.method"},
                {"jsonrpc": "2.0", "method": "server.info"},
            ]
            await socket.send_json(batch)
            answers = await answer_of(socket, lambda message: isinstance(message, list))
            assert [each["id"] for each in answers] == [1, 2]
            assert answers[1]["error"]["code"] == -32601
            wanted = {"objects": {"print_stats": ["state"], "air": None}}
            await socket.send_json(
                {"jsonrpc": "2.0", "id": 3, "method": "printer.objects.subscribe", "params": wanted}
            )
            told = await answer_of(socket, lambda message: message.get("id") == 3)
            assert told["result"]["status"]["print_stats"] == {"state": "standby"}
            door.surface.emergency_stop("a test")
            await answer_of(socket, lambda message: message.get("method") == "notify_klippy_shutdown")
            update = await answer_of(socket, lambda message: message.get("method") == "notify_status_update")
            assert update["params"][0]["print_stats"] == {"state": "error"}
            await socket.send_json({"jsonrpc": "2.0", "id": 4, "method": "printer.firmware_restart"})
            await answer_of(socket, lambda message: message.get("method") == "notify_klippy_ready")
            proc = await answer_of(socket, lambda message: message.get("method") == "notify_proc_stat_update")
            assert "cpu" in proc["params"][0]["system_cpu_usage"]

    with_doors(act, tmp_path)


async def answer_of(socket: aiohttp.ClientWebSocketResponse, fits: object) -> object:
    for _ in range(30):
        message = json.loads((await socket.receive(timeout=60)).data)
        if fits(message):
            return message
    raise AssertionError("the answer never came")


def test_klippers_socket_answers_side_by_side_and_pushes(tmp_path: Path) -> None:
    path = tmp_path / "klippy.sock"

    async def act(door: Open) -> None:
        reader, writer = await asyncio.open_unix_connection(path)

        async def call(method: str, **params: object) -> object:
            writer.write(json.dumps({"id": method, "method": method, "params": params}).encode() + b"\x03")
            while True:
                answer = json.loads((await asyncio.wait_for(reader.readuntil(b"\x03"), 10))[:-1])
                if answer.get("id") == method:
                    return answer.get("result", answer.get("error"))

        assert (await call("info"))["state"] == "ready"
        assert "objects/subscribe" in (await call("list_endpoints"))["endpoints"]
        assert "cables" in (await call("objects/list"))["objects"]
        template = {"method": "process_status_update"}
        await call("objects/subscribe", objects={"webhooks": None}, response_template=template)
        await call("gcode/subscribe_output", response_template={"method": "process_gcode_response"})
        error = await call("gcode/script", script="NOTHING_LIKE_THIS")
        assert error["error"] == "WebRequestError"
        assert "no.such" in (await call("no.such"))["message"]
        await call("emergency_stop")
        pushed = json.loads((await asyncio.wait_for(reader.readuntil(b"\x03"), 10))[:-1])
        while pushed.get("method") != "process_status_update":
            pushed = json.loads((await asyncio.wait_for(reader.readuntil(b"\x03"), 10))[:-1])
        assert pushed["params"]["status"]["webhooks"]["state"] == "shutdown"
        writer.close()

    with_doors(act, tmp_path, klippy=path)
    assert not path.exists()


def test_klippers_socket_is_for_its_user_only(tmp_path: Path) -> None:
    path = tmp_path / "klippy.sock"

    async def act(door: Open) -> None:
        assert path.stat().st_mode & 0o077 == 0

    with_doors(act, tmp_path, klippy=path)


def test_methods_that_pages_cannot_do_without(tmp_path: Path) -> None:
    needed = [
        *("server.connection.identify", "server.info", "server.config", "machine.system_info"),
        *("machine.proc_stats", "server.database.list", "server.webcams.list", "printer.info"),
        *("server.gcode_store", "printer.objects.list", "server.temperature_store", "printer.gcode.help"),
        *("server.files.list", "access.oneshot_token"),
    ]

    async def act(door: Open) -> None:
        async with door.web.ws_connect(f"{door.url}/websocket") as socket:
            for number, method in enumerate(needed):
                await socket.send_json({"jsonrpc": "2.0", "id": number, "method": method, "params": {}})
                told = await answer_of(socket, lambda message, n=number: message.get("id") == n)
                assert "result" in told, method
            value = {"namespace": "mainsail", "key": "general", "value": {"a": 1}}
            for number, (method, params) in enumerate(
                [
                    ("server.database.post_item", value),
                    ("server.database.get_item", {"namespace": "mainsail"}),
                ],
                100,
            ):
                await socket.send_json({"jsonrpc": "2.0", "id": number, "method": method, "params": params})
                told = await answer_of(socket, lambda message, n=number: message.get("id") == n)
            assert told["result"]["value"] == {"general": {"a": 1}}

    with_doors(act, tmp_path)
