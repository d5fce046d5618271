"""OctoPrint's API as its clients use it: polls, files, jobs, and the panel that moves the nozzle."""

import os
from typing import Any, Final
from urllib.parse import quote

from aiohttp import web

from cdhr_host.serve.host import Host
from cdhr_host.serve.model import ACTIVE, PAUSED, halted
from cdhr_host.serve.names import refused
from cdhr_host.serve.script import Executor
from cdhr_host.serve.web.metadata import described

VERSION: Final = {"api": "0.1", "server": "1.11.8", "text": "OctoPrint 1.11.8 (cdhr_host)"}
JOBS: Final = {"cancel": "CANCEL_PRINT", "restart": "RESUME"}
JOG_MM_MIN: Final = 1500.0
EXTRUDE_MM_MIN: Final = 120.0


class OctoPrint:
    """What a slicer, Cura and octorest ask."""

    def __init__(self, host: Host, executor: Executor) -> None:
        self._host = host
        self._executor = executor
        self._selected: str | None = None

    def routes(self) -> list[web.RouteDef]:
        """Paths and what they do."""
        return [
            web.get("/api/version", self._version),
            web.get("/api/server", self._version),
            web.get("/api/settings", self._settings),
            web.get("/api/currentuser", self._user),
            web.post("/api/login", self._user),
            web.get("/api/connection", self._connection),
            web.post("/api/connection", self._connect),
            web.get("/api/system/commands", self._nothing_else),
            web.get("/api/printerprofiles", self._profiles),
            web.get("/api/printer", self._printer),
            web.get("/api/job", self._job),
            web.post("/api/job", self._order),
            web.post("/api/printer/command", self._command),
            web.post("/api/printer/printhead", self._printhead),
            web.post("/api/printer/tool", self._tool),
            web.post("/api/printer/bed", self._no_heater),
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

    async def _connect(self, request: web.Request) -> web.Response:
        """The machine is always connected: to connect changes nothing, anything else is refused."""
        if (await request.json()).get("command") != "connect":
            raise web.HTTPConflict(reason="the machine stays connected; end cdhr serve to let it go")
        return web.Response(status=204)

    async def _nothing_else(self, _: web.Request) -> web.Response:
        return web.json_response({"core": [], "custom": []})

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
        elif self._selection() is not None:
            job["file"] = {**file, **self._described(self._chosen())}
        return web.json_response({"job": job, "progress": told, "state": self._state()["text"]})

    async def _order(self, request: web.Request) -> web.Response:
        order = await request.json()
        command, action = str(order.get("command")), str(order.get("action", "toggle"))
        if command == "start":
            await self._executor.run(f'SDCARD_PRINT_FILE FILENAME="{self._chosen()}"')
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

    async def _printhead(self, request: web.Request) -> web.Response:
        order = await request.json()
        command = order.get("command")
        if command == "jog":
            way = " ".join(f"{axis.upper()}{float(order[axis]):.4f}" for axis in "xyz" if axis in order)
            mode = "G90" if order.get("absolute") else "G91"
            await self._apart(f"{mode}\nG1 {way} F{float(order.get('speed') or JOG_MM_MIN):.0f}")
        elif command == "home":
            await self._executor.run("G28")
        elif command == "feedrate":
            await self._executor.run(f"M220 S{_percent(order['factor']):.0f}")
        else:
            raise web.HTTPBadRequest(reason="command is jog, home or feedrate")
        return web.Response(status=204)

    async def _tool(self, request: web.Request) -> web.Response:
        order = await request.json()
        command = order.get("command")
        if command == "flowrate":
            await self._executor.run(f"M221 S{_percent(order['factor']):.0f}")
        elif command == "extrude":
            speed = float(order.get("speed") or EXTRUDE_MM_MIN)
            await self._apart(f"M83\nG1 E{float(order['amount']):.4f} F{speed:.0f}")
        elif command not in {"target", "offset", "select"}:
            raise web.HTTPBadRequest(reason="command is flowrate, extrude, target, offset or select")
        return web.Response(status=204)

    async def _no_heater(self, _: web.Request) -> web.Response:
        return web.Response(status=204)

    async def _apart(self, script: str) -> None:
        """Without leaving modes behind."""
        await self._executor.run(
            f"SAVE_GCODE_STATE NAME=_octoprint\n{script}\nRESTORE_GCODE_STATE NAME=_octoprint"
        )

    def _chosen(self) -> str:
        """The program that a start means: selected, or printed last."""
        progress = self._host.status().progress
        name = self._selection() or (progress.file if progress else None)
        if name is None:
            raise refused("no program is selected", "select one, or upload it with select=true", kind="state")
        return name

    def _selection(self) -> str | None:
        """The program that was selected, while it is there."""
        if self._selected not in {entry.name for entry in self._host.folder.entries()}:
            self._selected = None
        return self._selected

    def select(self, name: str) -> None:
        """The program that the next start means."""
        self._selected = name

    async def _files(self, _: web.Request) -> web.Response:
        files = [self._described(entry.name) for entry in self._host.folder.entries()]
        disk = os.statvfs(self._host.folder.root)
        free, total = disk.f_bavail * disk.f_frsize, disk.f_blocks * disk.f_frsize
        return web.json_response({"files": files, "free": free, "total": total})

    async def _file(self, request: web.Request) -> web.Response:
        return web.json_response(self._described(request.match_info["name"]))

    async def _file_order(self, request: web.Request) -> web.Response:
        order = await request.json()
        name = self._host.folder.entry(request.match_info["name"]).name
        if order.get("command") != "select":
            raise web.HTTPBadRequest(reason="command is select")
        self.select(name)
        if order.get("print"):
            await self._executor.run(f'SDCARD_PRINT_FILE FILENAME="{name}"')
        return web.Response(status=204)

    async def _delete(self, request: web.Request) -> web.Response:
        self._host.delete(request.match_info["name"])
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
            "refs": {"resource": resource_of(path)},
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
            "resuming": status.state.value == "resuming",
            "finishing": False,
            "cancelling": status.state.value == "stopping",
            "error": error,
            "closedOrError": error,
            "ready": not error and not printing and not paused,
            "sdReady": False,
        }
        return {"text": text, "flags": flags}


def resource_of(name: str) -> str:
    """The path under which a program is found."""
    return f"/api/files/local/{quote(name)}"


def _percent(factor: float | str) -> float:
    """A number is percent when it is whole, a share when it is a fraction, as OctoPrint takes it."""
    return float(factor) if isinstance(factor, int) else float(factor) * 100.0
