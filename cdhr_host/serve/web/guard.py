"""Who may come in: host names, origins, keys; every refusal is logged with its reason."""

import ipaddress
import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final
from urllib.parse import urlsplit

from aiohttp import web
from aiohttp.typedefs import Handler, Middleware

from cdhr_host.serve.names import shown
from cdhr_host.serve.web.keys import ApiKey, Tokens

LOG = logging.getLogger("cdhr.serve")
OPEN: Final = frozenset({"/", "/page.css", "/page.js", "/icon.svg"})
"""paths that show nothing of the machine and ask for no key"""
POLICY: Final = (
    "default-src 'self'; connect-src 'self' ws: wss:; img-src 'self' data:; frame-ancestors 'none'; "
    "base-uri 'none'; form-action 'self'"
)
HEADERS: Final = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
}


@dataclass(slots=True)
class Guard:
    """The rules of one HTTP port."""

    key: ApiKey | None
    demands_key: bool
    """whether a request without a key is refused"""
    names: frozenset[str] = frozenset()
    """host names beside addresses and localhost by which clients may call this machine"""
    origins: frozenset[str] = frozenset()
    """origins of other pages that may speak to this one, as in http://mainsail.local"""
    now: Callable[[], float] = field(kw_only=True)
    tokens: Tokens = field(default_factory=Tokens)

    def refusal(self, request: web.Request) -> tuple[int, str] | None:
        """The status and reason a request is turned away with, or None."""
        if not self._called_rightly(request.host):
            return 403, f"called as '{shown(request.host)}': not a name of this machine"
        origin = request.headers.get("Origin")
        if origin is not None and not self._same(origin, request.host) and origin not in self.origins:
            return 403, f"origin '{shown(origin)}' is not allowed"
        if request.path in OPEN:
            return None
        return self._key_refusal(request)

    def _key_refusal(self, request: web.Request) -> tuple[int, str] | None:
        given = request.headers.get("X-Api-Key") or _bearer(request)
        token = request.query.get("token")
        if token and self.tokens.take(token, self.now()):
            return None
        if given and self.key is not None:
            return None if self.key.fits(given) else (401, "the API key is wrong")
        return (401, "an API key is needed: send it as X-Api-Key") if self.demands_key else None

    def _called_rightly(self, host: str) -> bool:
        """A page elsewhere may point a name of its own here; then Host has that name."""
        name = urlsplit(f"//{host}").hostname or ""
        if name == "localhost" or name in self.names:
            return True
        try:
            ipaddress.ip_address(name)
        except ValueError:
            return False
        return True

    @staticmethod
    def _same(origin: str, host: str) -> bool:
        parts = urlsplit(origin)
        return parts.scheme in {"http", "https"} and parts.netloc == host


def _bearer(request: web.Request) -> str:
    scheme, _, value = request.headers.get("Authorization", "").partition(" ")
    return value.strip() if scheme.lower() == "bearer" else ""


def guarded(guard: Guard) -> Middleware:
    """The guard as aiohttp's middleware."""

    @web.middleware
    async def middleware(request: web.Request, handler: Handler) -> web.StreamResponse:
        refusal = guard.refusal(request)
        if refusal is None:
            response = await _answered(request, handler)
        else:
            response = refuse(request, *refusal)
        if not response.prepared:
            response.headers.update(HEADERS)
            _allow(response, request, guard)
        return response

    return middleware


async def _answered(request: web.Request, handler: Handler) -> web.StreamResponse:
    if request.method == "OPTIONS":
        return web.Response(status=204)
    try:
        return await handler(request)
    except web.HTTPException as error:
        return refuse(request, error.status, error.reason)


def refuse(request: web.Request, status: int, reason: str) -> web.Response:
    """A refusal, logged."""
    LOG.warning(
        "%s %s %s: %d %s", request.remote, request.method, shown(request.path), status, shown(reason, 200)
    )
    return web.json_response({"error": {"code": status, "message": reason}}, status=status)


def _allow(response: web.StreamResponse, request: web.Request, guard: Guard) -> None:
    origin = request.headers.get("Origin", "")
    if origin in guard.origins:
        response.headers["Access-Control-Allow-Origin"] = origin
        response.headers["Access-Control-Allow-Headers"] = "Content-Type, X-Api-Key, Authorization"
        response.headers["Access-Control-Allow-Methods"] = "GET, POST, DELETE, OPTIONS"
        response.headers["Vary"] = "Origin"


def is_loopback(address: str) -> bool:
    """Whether only this machine can reach it."""
    if address == "localhost":
        return True
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return False
