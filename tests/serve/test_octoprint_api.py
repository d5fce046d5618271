"""What OctoPrint's other clients (OctoPod, octorest, Obico) and Moonraker's pages ask beside uploads."""

import asyncio
from pathlib import Path

import aiohttp
from doors import Open, with_doors

from cdhr_host.job.surface import JobState


def given(door: Open, name: str, text: bytes = b"G1 X1 F600\nG1 X2\n") -> None:
    with door.server.host.folder.receive(name) as upload:
        upload.write(text)
        upload.keep()


async def ask(door: Open, path: str, status: int = 204, **body: object) -> None:
    async with door.web.post(f"{door.url}{path}", json=body) as answer:
        assert answer.status == status, await answer.text()


async def proven(door: Open) -> None:
    while door.surface.status().state is not JobState.PROVING:
        await asyncio.sleep(0.001)
    door.surface.advance(0)


def moved(door: Open) -> list[str]:
    """What the machine was given last, without the modes before it."""
    return str(door.surface.said[-1][1]).splitlines()[4:]


def test_the_control_panel_of_octoprints_clients(tmp_path: Path) -> None:
    async def act(door: Open) -> None:
        await ask(door, "/api/printer/printhead", command="jog", x=5, z=-0.5)
        assert moved(door) == ["G91", "G1 X5.0000 Z-0.5000 F1500"]
        await ask(door, "/api/printer/printhead", command="jog", y=7.5, absolute=True, speed=600)
        assert moved(door) == ["G90", "G1 Y7.5000 F600"]
        assert door.server.host.modes.absolute
        await ask(door, "/api/printer/printhead", command="home", axes=["x", "y", "z"])
        assert moved(door) == ["G28"]
        await ask(door, "/api/printer/printhead", command="feedrate", factor=80)
        await ask(door, "/api/printer/tool", command="flowrate", factor=0.95)
        assert door.surface.status().feed_override == 0.8
        assert door.surface.status().flow_override == 0.95
        await ask(door, "/api/printer/tool", command="target", targets={"tool0": 200})
        await ask(door, "/api/printer/bed", command="target", target=60)
        await ask(door, "/api/printer/printhead", 400, command="dance")
        await ask(door, "/api/printer/printhead", 400, command="jog", x="far")
        await ask(door, "/api/connection", command="connect")
        await ask(door, "/api/connection", 409, command="disconnect")

    with_doors(act, tmp_path)


def test_a_program_is_selected_then_started(tmp_path: Path) -> None:
    async def act(door: Open) -> None:
        await ask(door, "/api/job", 409, command="start")
        given(door, "pots/a ü%20b.gcode")
        async with door.web.get(f"{door.url}/api/files") as answer:
            (file,) = (await answer.json())["files"]
        await ask(door, file["refs"]["resource"], command="select")
        async with door.web.get(f"{door.url}/api/job") as answer:
            assert (await answer.json())["job"]["file"]["path"] == "pots/a ü%20b.gcode"
        await asyncio.gather(ask(door, "/api/job", command="start"), proven(door))
        assert door.surface.state is JobState.PRINTING
        resource = aiohttp.client.URL(f"{door.url}{file['refs']['resource']}", encoded=True)
        async with door.web.delete(resource) as answer:
            assert answer.status == 409
        async with door.web.delete(f"{door.url}/server/files/gcodes/pots/a ü%2520b.gcode") as answer:
            assert answer.status == 409
        await ask(door, "/api/job", command="cancel")
        async with door.web.delete(resource) as answer:
            assert answer.status == 204
        assert door.server.host.folder.entries() == []

    with_doors(act, tmp_path)


async def call(socket: aiohttp.ClientWebSocketResponse, method: str, **params: object) -> object:
    await socket.send_json({"jsonrpc": "2.0", "id": method, "method": method, "params": params})
    while True:
        told = await socket.receive_json(timeout=60)
        if told.get("id") == method:
            return told.get("result", told.get("error"))


def test_a_page_finds_its_settings_again_by_their_path(tmp_path: Path) -> None:
    async def act(door: Open) -> None:
        async with door.web.ws_connect(f"{door.url}/websocket") as socket:
            space = {"namespace": "mainsail"}
            await call(socket, "server.database.post_item", **space, key="general.printername", value="Clay")
            await call(socket, "server.database.post_item", **space, key=["ui", "logo"], value="#f00")
            all_of_it = await call(socket, "server.database.get_item", **space)
            assert all_of_it["value"] == {"general": {"printername": "Clay"}, "ui": {"logo": "#f00"}}
            part = await call(socket, "server.database.get_item", **space, key="general")
            assert part["value"] == {"printername": "Clay"}
            await call(socket, "server.database.delete_item", **space, key="general.printername")
            await call(socket, "server.database.delete_item", **space, key="general")
            await call(socket, "server.database.delete_item", **space, key="ui")
            assert (await call(socket, "server.database.list"))["namespaces"] == []
            assert (await call(socket, "server.database.get_item", **space))["code"] == 404

    with_doors(act, tmp_path)


def test_only_the_folder_of_programs_is_listed(tmp_path: Path) -> None:
    async def act(door: Open) -> None:
        given(door, "pots/vase.gcode")
        async with door.web.ws_connect(f"{door.url}/websocket") as socket:
            top = await call(socket, "server.files.get_directory", path="gcodes", extended=True)
            assert [each["dirname"] for each in top["dirs"]] == ["pots"]
            inside = await call(socket, "server.files.get_directory", path="gcodes/pots")
            assert [each["filename"] for each in inside["files"]] == ["vase.gcode"]
            assert (await call(socket, "server.files.get_directory", path="config"))["code"] == 400
            assert (await call(socket, "server.files.get_directory", path="gcodes/no"))["code"] == 404
            assert await call(socket, "server.files.list", root="config") == []

    with_doors(act, tmp_path)
