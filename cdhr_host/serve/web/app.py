"""The HTTP port: routes, errors as JSON, and the port's life."""

import asyncio
from importlib.resources import files
from typing import Any, Final

from aiohttp import web
from aiohttp.http import HttpProcessingError
from aiohttp.typedefs import Handler, Middleware

from cdhr_host.errors import JobError
from cdhr_host.serve.folder import Entry
from cdhr_host.serve.host import Host
from cdhr_host.serve.script import Executor
from cdhr_host.serve.web.gate import PARSER_LOG, Gates
from cdhr_host.serve.web.guard import LOG, Guard, guarded, refuse
from cdhr_host.serve.web.methods import Methods, RpcError, gcodes_name
from cdhr_host.serve.web.octoprint import OctoPrint, resource_of
from cdhr_host.serve.web.sockets import Sockets
from cdhr_host.serve.web.uploads import CHUNK, Form, reason, receive

BODY_MAX: Final = 1 << 20
"""bytes of a body that is no upload"""
PAGE: Final = {
    "/": ("page.html", "text/html"),
    "/page.css": ("page.css", "text/css"),
    "/page.js": ("page.js", "text/javascript"),
    "/icon.svg": ("icon.svg", "image/svg+xml"),
}
REFUSALS: Final = {"missing": 404, "size": 413, "full": 507, "state": 409}
GETS: Final = {
    "server": ("info", "config", "temperature_store", "gcode_store"),
    "server.files": ("list", "roots", "metadata"),
    "server.webcams": ("list",),
    "machine": ("system_info", "proc_stats"),
    "access": ("oneshot_token", "info"),
    "printer": ("info",),
    "printer.objects": ("list",),
    "printer.gcode": ("help",),
    "printer.query_endstops": ("status",),
}
POSTS: Final = {
    "printer": ("emergency_stop", "restart", "firmware_restart"),
    "printer.gcode": ("script",),
    "printer.print": ("start", "pause", "resume", "cancel"),
}


class HttpDoor:
    """One HTTP port on one address."""

    def __init__(self, host: Host, executor: Executor, guard: Guard, address: str, port: int) -> None:
        self.address = address
        self.port = port
        self.methods = Methods(host, executor, lambda: guard.tokens.give(guard.now()))
        self._host = host
        self._executor = executor
        self._guard = guard
        self._octoprint = OctoPrint(host, executor)
        self._sockets: Sockets | None = None
        self._runner: web.AppRunner | None = None
        self._server: asyncio.Server | None = None
        self.gates: Gates

    async def open(self) -> None:
        """Listen; OSError when the port is taken."""
        self._sockets = Sockets(self._host, self.methods)
        self._runner = web.AppRunner(
            self._app(), access_log=None, handle_signals=False, shutdown_timeout=2.0, logger=PARSER_LOG
        )
        await self._runner.setup()
        assert self._runner.server is not None
        self.gates = Gates(self._runner.server)
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(self.gates, self.address, self.port)
        self.port = self._server.sockets[0].getsockname()[1]

    async def close(self) -> None:
        """Hang up and close."""
        if self._server is not None:
            self._server.close()
        if self._sockets is not None:
            self._sockets.close()
        if self._runner is not None:
            await self._runner.cleanup()

    def _app(self) -> web.Application:
        app = web.Application(
            middlewares=[self._spoken(), guarded(self._guard), _told], client_max_size=BODY_MAX
        )
        assert self._sockets is not None
        app.add_routes([web.get(path, _page(*page)) for path, page in PAGE.items()])
        app.add_routes(self._octoprint.routes())
        app.add_routes([web.get(_path(name), self._call(name)) for name in _names(GETS)])
        app.add_routes([web.post(_path(name), self._call(name)) for name in _names(POSTS)])
        app.add_routes(
            [
                web.get("/websocket", self._sockets.serve),
                web.post("/api/files/local", self._octoprint_upload),
                web.post("/server/files/upload", self._moonraker_upload),
                web.get("/server/files/directory", self._call("server.files.get_directory")),
                web.get("/server/files/gcodes/{name:.+}", self._download),
                web.delete("/server/files/gcodes/{name:.+}", self._delete),
                web.get("/printer/objects/query", self._query),
                web.post("/printer/objects/query", self._call("printer.objects.query")),
                web.get("/server/database/list", self._call("server.database.list")),
                web.get("/server/database/item", self._call("server.database.get_item")),
                web.post("/server/database/item", self._call("server.database.post_item")),
                web.delete("/server/database/item", self._call("server.database.delete_item")),
            ]
        )
        return app

    def _spoken(self) -> Middleware:
        @web.middleware
        async def middleware(request: web.Request, handler: Handler) -> web.StreamResponse:
            if request.transport is not None:
                self.gates.spoke.add(request.transport)
            return await handler(request)

        return middleware

    def _call(self, name: str) -> Handler:
        """A method of the table over HTTP."""

        async def handle(request: web.Request) -> web.Response:
            params: dict[str, Any] = dict(request.query)
            params.pop("token", None)
            if request.can_read_body and request.content_type == "application/json":
                body = await request.json()
                params |= body if isinstance(body, dict) else {}
            return await self._result(name, params)

        return handle

    async def _result(self, name: str, params: dict[str, Any]) -> web.Response:
        result = await self.methods.call(self.methods.session(lasting=False), name, params)
        return web.json_response({"result": result})

    async def _query(self, request: web.Request) -> web.Response:
        """``?toolhead=position,homed_axes&configfile``"""
        wanted = {
            name: keys.split(",") if keys else None for name, keys in request.query.items() if name != "token"
        }
        return await self._result("printer.objects.query", {"objects": wanted})

    async def _received(self, request: web.Request) -> Form:
        form = await receive(request, self._host.folder)
        LOG.info("%s uploaded '%s', %d bytes", request.remote, form.entry.name, form.entry.size)
        if self._sockets is not None:
            entry = form.entry
            self._sockets.files_changed("create_file", entry.name, entry.size, entry.modified)
        return form

    async def _started(self, entry: Entry) -> None:
        await self._executor.run(f'SDCARD_PRINT_FILE FILENAME="{entry.name}"')

    async def _octoprint_upload(self, request: web.Request) -> web.Response:
        form = await self._received(request)
        name = form.entry.name
        if form.wants("select") or form.wants("print"):
            self._octoprint.select(name)
        if form.wants("print"):
            await self._started(form.entry)
        resource = f"{request.scheme}://{request.host}{resource_of(name)}"
        local = {
            "name": name.split("/")[-1],
            "display": name,
            "path": name,
            "origin": "local",
            "refs": {"resource": resource},
        }
        answer = {
            "files": {"local": local},
            "done": True,
            "effectivePrint": form.wants("print"),
            "effectiveSelect": form.wants("select"),
        }
        return web.json_response(answer, status=201, headers={"Location": resource})

    async def _moonraker_upload(self, request: web.Request) -> web.Response:
        """Both forms at once: clients look for ``result.print_started`` and for ``print_started``."""
        form = await self._received(request)
        if form.fields.get("root", "gcodes") != "gcodes":
            raise web.HTTPBadRequest(reason="root is gcodes")
        if form.wants("print"):
            await self._started(form.entry)
        item = {
            "path": form.entry.name,
            "root": "gcodes",
            "size": form.entry.size,
            "modified": form.entry.modified,
        }
        answer = {
            "item": item,
            "print_started": form.wants("print"),
            "print_queued": False,
            "action": "create_file",
        }
        return web.json_response({"result": answer, **answer}, status=201)

    async def _download(self, request: web.Request) -> web.StreamResponse:
        entry = self._host.folder.entry(request.match_info["name"])
        headers = {"Content-Disposition": "attachment", "Content-Type": "text/plain"}
        response = web.StreamResponse(headers=headers)
        response.content_length = entry.size
        await response.prepare(request)
        for at in range(0, entry.size, CHUNK):
            await response.write(self._host.folder.read(entry.name, min(CHUNK, entry.size - at), at=at))
        return response

    async def _delete(self, request: web.Request) -> web.Response:
        name = gcodes_name(request.match_info["name"])
        response = await self._result("server.files.delete_file", {"path": name})
        if self._sockets is not None:
            self._sockets.files_changed("delete_file", name, 0, 0.0)
        return response


def _names(table: dict[str, tuple[str, ...]]) -> list[str]:
    """Methods of a table."""
    return [f"{space}.{name}" for space, names in table.items() for name in names]


def _path(name: str) -> str:
    """``printer.print.start`` -> ``/printer/print/start``"""
    return f"/{name.replace('.', '/')}"


@web.middleware
async def _told(request: web.Request, handler: Handler) -> web.StreamResponse:
    """Refusals and slips of clients as JSON."""
    try:
        return await handler(request)
    except JobError as error:
        return refuse(request, REFUSALS.get(error.problems[0].kind, 400), reason(error))
    except RpcError as error:
        return refuse(request, error.code if error.code > 0 else 400, str(error))
    except TimeoutError:
        return refuse(request, 408, "the client was too slow")
    except ConnectionError:
        raise
    except OSError as error:
        return refuse(request, 507, f"the disk of this machine: {error.strerror or error}")
    except (HttpProcessingError, ValueError, TypeError, AttributeError, RecursionError) as error:
        LOG.debug("a request that was not understood", exc_info=error)
        return refuse(request, 400, "the request was not understood")


def _page(name: str, kind: str) -> Handler:
    """A file of our own page."""
    body = files("cdhr_host.serve.web").joinpath("page", name).read_bytes()

    async def handle(_: web.Request) -> web.Response:
        return web.Response(
            body=body, content_type=kind, charset="utf-8", headers={"Cache-Control": "no-cache"}
        )

    return handle
