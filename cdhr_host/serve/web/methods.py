"""Moonraker's methods over the host: one table for the websocket and for HTTP."""

import os
import platform
import re
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from itertools import count
from typing import Any, Final

from cdhr_host import __version__
from cdhr_host.errors import JobError
from cdhr_host.serve.folder import Entry
from cdhr_host.serve.host import Host, Message
from cdhr_host.serve.model import chosen, halted, host_state, object_names
from cdhr_host.serve.names import shown
from cdhr_host.serve.params import Fields, Params, fields_of, text_of
from cdhr_host.serve.script import Executor
from cdhr_host.serve.web.metadata import described
from cdhr_host.serve.web.store import Store
from cdhr_host.serve.web.uploads import reason

Result = Any
Method = Callable[["Session", Params], Awaitable[Result] | Result]

API: Final = (1, 5, 0)
_MISSING: Final = -32601
_BAD_PARAMS: Final = -32602


class RpcError(Exception):
    """A method that was refused."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code


@dataclass(slots=True)
class Session:
    """One client of the methods."""

    number: int = 0
    subscribed: Fields = field(default_factory=dict)
    sent: dict[str, dict[str, Any]] = field(default_factory=dict)
    lasting: bool = False
    """a websocket: it can be told things later"""


class Methods:
    """What clients may call."""

    def __init__(self, host: Host, executor: Executor, give_token: Callable[[], str]) -> None:
        self.host = host
        self.executor = executor
        self.store = Store()
        self._numbers = count(1)
        self._table: dict[str, Method] = {
            "server.info": self._server_info,
            "server.config": lambda _, __: {"config": {}, "orig": {}, "files": []},
            "server.connection.identify": lambda session, _: {"connection_id": session.number},
            "server.websocket.id": lambda session, _: {"websocket_id": session.number},
            "server.temperature_store": lambda _, __: {},
            "server.gcode_store": self._gcode_store,
            "server.webcams.list": lambda _, __: {"webcams": []},
            "server.database.list": lambda _, __: {"namespaces": self.store.namespaces(), "backups": []},
            "server.database.get_item": self._get_item,
            "server.database.post_item": self._post_item,
            "server.database.delete_item": self._delete_item,
            "server.files.list": self._list,
            "server.files.roots": self._roots,
            "server.files.get_directory": self._directory,
            "server.files.metadata": self._metadata,
            "server.files.delete_file": self._delete,
            "machine.system_info": lambda _, __: {"system_info": _system()},
            "machine.proc_stats": lambda _, __: proc_stats(),
            "access.oneshot_token": lambda _, __: give_token(),
            "access.info": lambda _, __: {"default_source": "moonraker", "available_sources": ["moonraker"]},
            "printer.info": self._printer_info,
            "printer.objects.list": lambda _, __: {"objects": object_names(host.profile)},
            "printer.objects.query": self._query,
            "printer.objects.subscribe": self._subscribe,
            "printer.query_endstops.status": lambda _, __: {},
            "printer.gcode.script": self._script,
            "printer.gcode.help": lambda _, __: executor.help(),
            "printer.print.start": self._start,
            "printer.print.pause": lambda _, __: self._do("PAUSE"),
            "printer.print.resume": lambda _, __: self._do("RESUME"),
            "printer.print.cancel": lambda _, __: self._do("CANCEL_PRINT"),
            "printer.emergency_stop": lambda _, __: self._do("M112"),
            "printer.restart": lambda _, __: self._do("FIRMWARE_RESTART"),
            "printer.firmware_restart": lambda _, __: self._do("FIRMWARE_RESTART"),
        }

    def session(self, *, lasting: bool) -> Session:
        """A new client."""
        return Session(next(self._numbers), lasting=lasting)

    def knows(self, name: str) -> bool:
        """Whether there is such a method."""
        return name in self._table

    async def call(self, session: Session, name: str, params: Params) -> Result:
        """Call a method; RpcError when it is refused."""
        method = self._table.get(name)
        if method is None:
            raise RpcError(_MISSING, "Method not found")
        try:
            result = method(session, params)
            return await result if isinstance(result, Awaitable) else result
        except JobError as error:
            raise RpcError(_status(error), reason(error)) from error
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise RpcError(_BAD_PARAMS, f"{name}: bad or missing parameter: {shown(str(error))}") from error

    async def _do(self, script: str) -> str:
        await self.executor.run(script)
        return "ok"

    async def _script(self, _: Session, params: Params) -> str:
        return await self._do(text_of(params, "script"))

    async def _start(self, _: Session, params: Params) -> str:
        name = self.host.folder.entry(text_of(params, "filename")).name
        return await self._do(f'SDCARD_PRINT_FILE FILENAME="{name}"')

    def _server_info(self, _: Session, __: Params) -> Result:
        status = self.host.status()
        return {
            "klippy_connected": True,
            "klippy_state": host_state(status),
            "components": ["file_manager", "klippy_apis", "database", "data_store", "machine", "webcam"],
            "failed_components": [],
            "registered_directories": ["gcodes"],
            "warnings": [],
            "websocket_count": 0,
            "missing_klippy_requirements": [],
            "moonraker_version": f"v0.11.0-cdhr-{__version__}",
            "api_version": list(API),
            "api_version_string": ".".join(map(str, API)),
        }

    def _printer_info(self, _: Session, __: Params) -> Result:
        status = self.host.status()
        return {
            "state": host_state(status),
            "state_message": status.message if halted(status) else "Printer is ready",
            "hostname": platform.node(),
            "software_version": f"cdhr_host {__version__}",
            "cpu_info": f"{os.cpu_count()} core",
            "klipper_path": "",
            "python_path": "",
            "log_file": "",
            "config_file": self.host.profile.machine.name,
        }

    def _query(self, _: Session, params: Params) -> Result:
        return {"eventtime": self.host.monotonic(), "status": self._chosen(fields_of(params))}

    def _subscribe(self, session: Session, params: Params) -> Result:
        wanted = fields_of(params)
        found = self._chosen(wanted)
        if session.lasting:
            session.subscribed, session.sent = wanted, found
        return {"eventtime": self.host.monotonic(), "status": found}

    def _chosen(self, wanted: Fields) -> dict[str, dict[str, Any]]:
        return chosen(self.host.objects(wanted), wanted)

    def _gcode_store(self, _: Session, params: Params) -> Result:
        messages = list(self.host.messages)[-int(params.get("count", 500)) :]
        return {"gcode_store": [_stored(message) for message in messages]}

    def _roots(self, _: Session, __: Params) -> Result:
        return [{"name": "gcodes", "path": str(self.host.folder.root), "permissions": "rw"}]

    def _list(self, _: Session, params: Params) -> Result:
        here = params.get("root", "gcodes") == "gcodes"
        return [_listed(entry) for entry in self.host.folder.entries()] if here else []

    def _directory(self, _: Session, params: Params) -> Result:
        """Only the first level: folders are named, not walked."""
        root, inside = (*str(params.get("path", "gcodes")).strip("/").split("/", 1), "")[:2]
        if root != "gcodes":
            raise RpcError(400, f"Invalid root path ({shown(root)})")
        if inside and inside not in self.host.folder.folders():
            raise RpcError(404, f"Directory does not exist ({shown(inside)})")
        prefix = f"{inside}/" if inside else ""
        entries = [entry for entry in self.host.folder.entries() if entry.name.startswith(prefix)]
        here = [entry for entry in entries if "/" not in entry.name.removeprefix(prefix)]
        folders = {entry.name.removeprefix(prefix).split("/")[0] for entry in entries if entry not in here}
        disk = os.statvfs(self.host.folder.root)
        total, free = disk.f_blocks * disk.f_frsize, disk.f_bavail * disk.f_frsize
        return {
            "dirs": [
                {"dirname": name, "modified": 0.0, "size": 0, "permissions": "rw"} for name in sorted(folders)
            ],
            "files": [{**_listed(entry), "filename": entry.name.removeprefix(prefix)} for entry in here],
            "disk_usage": {"total": total, "used": total - free, "free": free},
            "root_info": {"name": "gcodes", "permissions": "rw"},
        }

    def _metadata(self, _: Session, params: Params) -> Result:
        return described(self.host.folder, gcodes_name(text_of(params, "filename")))

    def _delete(self, _: Session, params: Params) -> Result:
        name = gcodes_name(text_of(params, "path"))
        self.host.delete(name)
        return {"item": {"path": name, "root": "gcodes"}, "action": "delete_file"}

    def _get_item(self, _: Session, params: Params) -> Result:
        space, key = text_of(params, "namespace"), params.get("key")
        value = self.store.get(space, key)
        if value is None:
            below = "" if key is None else f" '{shown(str(key))}'"
            raise RpcError(404, f"nothing is stored as '{shown(space)}'{below}")
        return {"namespace": space, "key": key, "value": value}

    def _post_item(self, _: Session, params: Params) -> Result:
        space, key = text_of(params, "namespace"), params["key"]
        self.store.put(space, key, params.get("value"))
        return {"namespace": space, "key": key, "value": params.get("value")}

    def _delete_item(self, _: Session, params: Params) -> Result:
        space, key = text_of(params, "namespace"), params["key"]
        return {"namespace": space, "key": key, "value": self.store.delete(space, key)}


def gcodes_name(name: str) -> str:
    """A name with or without the root before it."""
    return re.sub(r"\A/?gcodes/", "", name)


def proc_stats() -> dict[str, Any]:
    """What Moonraker tells of its machine; only what is cheap."""
    return {
        "moonraker_stats": [],
        "throttled_state": None,
        "cpu_temp": None,
        "network": {},
        "system_cpu_usage": {"cpu": round(min(os.getloadavg()[0] / (os.cpu_count() or 1), 1.0) * 100.0, 1)},
        "system_memory": {"total": 0, "available": 0, "used": 0},
        "system_uptime": time.clock_gettime(time.CLOCK_BOOTTIME),
        "websocket_connections": 0,
    }


def _status(error: JobError) -> int:
    """HTTP's word for a refusal."""
    return {"missing": 404, "size": 413, "full": 507, "state": 409}.get(error.problems[0].kind, 400)


def _listed(entry: Entry) -> dict[str, Any]:
    return {"path": entry.name, "modified": entry.modified, "size": entry.size, "permissions": "rw"}


def _stored(message: Message) -> dict[str, Any]:
    return {"message": message.text, "time": message.when, "type": message.kind}


def _system() -> dict[str, Any]:
    return {
        "cpu_info": {"cpu_count": os.cpu_count(), "processor": platform.machine(), "total_memory": 0},
        "distribution": {"name": platform.system(), "version": platform.release()},
        "available_services": [],
        "service_state": {},
        "network": {},
        "python": {"version_string": platform.python_version()},
        "virtualization": {"virt_type": "none", "virt_identifier": "none"},
    }
