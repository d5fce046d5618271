"""OctoPrint's upload API and the polls of its clients."""

from typing import Any, Final

from aiohttp import web

from cdhr_host.serve.host import Host
from cdhr_host.serve.model import ACTIVE, PAUSED, halted
from cdhr_host.serve.script import Executor
from cdhr_host.serve.web.metadata import described

VERSION: Final = {"api": "0.1", "server": "1.11.8", "text": "OctoPrint 1.11.8 (cdhr_host)"}
JOBS: Final = {"cancel": "CANCEL_PRINT", "restart": "RESUME"}


class OctoPrint:
    """What a slicer, Cura and octorest ask."""

    def __init__(self, host: Host, executor: Executor) -> None:
        self._host = host
        self._executor = executor

    def routes(self) -> list[web.RouteDef]:
        """Paths and what they do."""
        return [
            web.get("/api/version", self._version),
            web.get("/api/server", self._version),
            web.get("/api/settings", self._settings),
            web.get("/api/currentuser", self._user),
            web.post("/api/login", self._user),
            web.get("/api/connection", self._connection),
            web.get("/api/printerprofiles", self._profiles),
            web.get("/api/printer", self._printer),
            web.get("/api/job", self._job),
            web.post("/api/job", self._order),
            web.post("/api/printer/command", self._command),
            web.get("/api/files", self._files),
            web.get("/api/files/local", self._files),
            web.get("/api/files/local/{name:.+}", self._file),
            web.post("/api/files/local/{name:.+}", self._file_order),
            web.delete("/api/files/local/{name:.+}", self._delete),
        ]

    async def _version(self, _: web.Request) -> web.Response:
        return web.json_response(VERSION)

    async def _settings(self, _: web.Request) -> web.Response:
        return web.json_response(
            {
                "appearance": {"name": self._host.profile.machine.name},
                "feature": {"sdSupport": False},
                "webcam": {"webcamEnabled": False},
                "plugins": {},
            }
        )

    async def _user(self, _: web.Request) -> web.Response:
        return web.json_response(
            {"name": "client", "active": True, "admin": False, "user": True, "groups": [], "permissions": []}
        )

    async def _connection(self, _: web.Request) -> web.Response:
        current = {
            "state": self._state()["text"],
            "port": "cdhr",
            "baudrate": 115200,
            "printerProfile": "_default",
        }
        return web.json_response({"current": current, "options": {"ports": ["cdhr"], "baudrates": [115200]}})

    async def _profiles(self, _: web.Request) -> web.Response:
        bed = self._host.profile.bed
        volume = {
            "formFactor": "circular",
            "width": bed.radius * 2e3,
            "depth": bed.radius * 2e3,
            "height": bed.height * 1e3,
        }
        return web.json_response(
            {
                "profiles": {
                    "_default": {
                        "id": "_default",
                        "name": self._host.profile.machine.name,
                        "volume": volume,
                        "extruder": {"count": 1},
                        "heatedBed": False,
                    }
                }
            }
        )

    async def _printer(self, _: web.Request) -> web.Response:
        return web.json_response({"temperature": {}, "sd": {"ready": False}, "state": self._state()})

    async def _job(self, _: web.Request) -> web.Response:
        progress = self._host.status().progress
        file = {"name": None, "origin": None, "size": None, "date": None, "path": None, "display": None}
        told: dict[str, Any] = {"completion": None, "filepos": None, "printTime": None, "printTimeLeft": None}
        job: dict[str, Any] = {"file": file, "estimatedPrintTime": None, "filament": None}
        if progress is not None:
            name = progress.file
            job["file"] = {
                **file,
                "name": name.split("/")[-1],
                "path": name,
                "display": name,
                "origin": "local",
                "size": progress.size,
            }
            job["estimatedPrintTime"] = progress.duration
            told = {
                "completion": progress.fraction * 100.0,
                "filepos": progress.position,
                "printTime": int(progress.elapsed),
                "printTimeLeft": int(progress.left),
            }
        return web.json_response({"job": job, "progress": told, "state": self._state()["text"]})

    async def _order(self, request: web.Request) -> web.Response:
        order = await request.json()
        command, action = str(order.get("command")), str(order.get("action", "toggle"))
        if command == "start":
            progress = self._host.status().progress
            await self._executor.run(f'SDCARD_PRINT_FILE FILENAME="{progress.file if progress else ""}"')
        elif command == "pause":
            held = self._host.state in PAUSED
            resumes = action == "resume" or (action == "toggle" and held)
            await self._executor.run("RESUME" if resumes else "PAUSE")
        elif command in JOBS:
            await self._executor.run(JOBS[command])
        else:
            raise web.HTTPBadRequest(reason="command is start, pause, cancel or restart")
        return web.Response(status=204)

    async def _command(self, request: web.Request) -> web.Response:
        order = await request.json()
        lines = order.get("commands") or [order.get("command", "")]
        await self._executor.run("\n".join(map(str, lines)))
        return web.Response(status=204)

    async def _files(self, _: web.Request) -> web.Response:
        files = [self._described(entry.name) for entry in self._host.folder.entries()]
        return web.json_response({"files": files, "free": None, "total": None})

    async def _file(self, request: web.Request) -> web.Response:
        return web.json_response(self._described(request.match_info["name"]))

    async def _file_order(self, request: web.Request) -> web.Response:
        order = await request.json()
        name = self._host.folder.entry(request.match_info["name"]).name
        if order.get("command") == "select" and order.get("print"):
            await self._executor.run(f'SDCARD_PRINT_FILE FILENAME="{name}"')
        elif order.get("command") != "select":
            raise web.HTTPBadRequest(reason="command is select")
        return web.Response(status=204)

    async def _delete(self, request: web.Request) -> web.Response:
        self._host.folder.delete(request.match_info["name"])
        return web.Response(status=204)

    def _described(self, name: str) -> dict[str, Any]:
        about = described(self._host.folder, name)
        path = about["filename"]
        return {
            "name": path.split("/")[-1],
            "display": path,
            "path": path,
            "origin": "local",
            "type": "machinecode",
            "typePath": ["machinecode", "gcode"],
            "size": about["size"],
            "date": int(about["modified"]),
            "refs": {"resource": f"/api/files/local/{path}"},
        }

    def _state(self) -> dict[str, Any]:
        status = self._host.status()
        printing, paused, error = status.state in ACTIVE - PAUSED, status.state in PAUSED, halted(status)
        text = (
            "Printing"
            if printing
            else "Paused"
            if paused
            else "Offline after error"
            if error
            else "Operational"
        )
        flags = {
            "operational": not error,
            "printing": printing,
            "paused": paused,
            "pausing": status.state.value == "holding",
            "cancelling": status.state.value == "stopping",
            "error": error,
            "closedOrError": error,
            "ready": not error and not printing and not paused,
            "sdReady": False,
        }
        return {"text": text, "flags": flags}
