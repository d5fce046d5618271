"""The endpoints Moonraker calls on Klipper, over the host."""

import os
import platform
import sys
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cdhr_host import __version__
from cdhr_host.errors import JobError
from cdhr_host.serve.host import Host, problem_text
from cdhr_host.serve.model import chosen, halted, host_state, object_names
from cdhr_host.serve.names import shown
from cdhr_host.serve.params import Fields, Params, fields_of, text_of
from cdhr_host.serve.script import Executor


class EndpointError(Exception):
    """An endpoint that was refused, as Klipper's WebRequestError."""


@dataclass(slots=True)
class Subscription:
    """What one client is told, and under which template."""

    template: dict[str, Any] = field(default_factory=dict)
    wanted: Fields = field(default_factory=dict)
    sent: dict[str, dict[str, Any]] = field(default_factory=dict)


@dataclass(slots=True)
class Session:
    """One client of the socket."""

    status: Subscription = field(default_factory=Subscription)
    output: dict[str, Any] | None = None
    """template of G-code responses"""


Endpoint = Callable[[Session, Params], Awaitable[Any] | Any]


class Endpoints:
    """What the socket answers."""

    def __init__(self, host: Host, executor: Executor) -> None:
        self._host = host
        self._executor = executor
        self._table: dict[str, Endpoint] = {
            "info": self._info,
            "list_endpoints": lambda _, __: {"endpoints": list(self._table)},
            "objects/list": lambda _, __: {"objects": object_names(host.profile)},
            "objects/query": self._query,
            "objects/subscribe": self._subscribe,
            "gcode/help": lambda _, __: executor.help(),
            "gcode/script": lambda _, params: self._do(text_of(params, "script")),
            "gcode/restart": lambda _, __: self._do("FIRMWARE_RESTART"),
            "gcode/firmware_restart": lambda _, __: self._do("FIRMWARE_RESTART"),
            "gcode/subscribe_output": self._subscribe_output,
            "emergency_stop": lambda _, __: self._do("M112"),
            "register_remote_method": lambda _, __: {},
            "pause_resume/pause": lambda _, __: self._do("PAUSE"),
            "pause_resume/resume": lambda _, __: self._do("RESUME"),
            "pause_resume/cancel": lambda _, __: self._do("CANCEL_PRINT"),
            "query_endstops/status": lambda _, __: {},
        }

    async def call(self, session: Session, name: str, params: Params) -> Any:
        """The result of an endpoint; EndpointError when it is refused."""
        endpoint = self._table.get(name)
        if endpoint is None:
            raise EndpointError(f"webhooks: No registered callback for path '{shown(name)}'")
        try:
            result = endpoint(session, params)
            return await result if isinstance(result, Awaitable) else result
        except JobError as error:
            raise EndpointError(problem_text(error.problems[0])) from error
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise EndpointError(f"{shown(name)}: bad or missing parameter {shown(str(error))}") from error

    async def _do(self, script: str) -> dict[str, Any]:
        await self._executor.run(script)
        return {}

    def _info(self, _: Session, __: Params) -> dict[str, Any]:
        status = self._host.status()
        return {
            "state": host_state(status),
            "state_message": status.message if halted(status) else "Printer is ready",
            "hostname": platform.node(),
            "klipper_path": str(Path(__file__).resolve().parents[3]),
            "python_path": sys.executable,
            "process_id": os.getpid(),
            "user_id": os.getuid(),
            "group_id": os.getgid(),
            "log_file": "",
            "config_file": "",
            "software_version": f"cdhr_host-{__version__}",
            "cpu_info": f"{os.cpu_count()} core",
        }

    def _query(self, _: Session, params: Params) -> dict[str, Any]:
        return self._status(fields_of(params))

    def _subscribe(self, session: Session, params: Params) -> dict[str, Any]:
        wanted = fields_of(params)
        result = self._status(wanted)
        session.status = Subscription(_template(params), wanted, result["status"])
        return result

    def _subscribe_output(self, session: Session, params: Params) -> dict[str, Any]:
        session.output = _template(params)
        return {}

    def _status(self, wanted: Fields) -> dict[str, Any]:
        return {"eventtime": self._host.monotonic(), "status": chosen(self._host.objects(wanted), wanted)}


def _template(params: Params) -> dict[str, Any]:
    template = params.get("response_template", {})
    if not isinstance(template, dict):
        raise TypeError("response_template")
    return template
