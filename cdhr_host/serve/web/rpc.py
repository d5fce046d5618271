"""JSON-RPC 2.0 as text: single calls and batches."""

import json
from typing import Any, Final

from cdhr_host.serve.names import shown
from cdhr_host.serve.web.methods import Methods, RpcError, Session

BATCH_MAX: Final = 100


async def answered(methods: Methods, session: Session, text: str) -> str | None:
    """The answer to one message; None for notifications."""
    try:
        asked = json.loads(text)
    except (ValueError, RecursionError):
        return json.dumps(_failed(None, -32700, "Parse error"))
    if not isinstance(asked, list):
        answer = await _one(methods, session, asked)
        return None if answer is None else json.dumps(answer)
    if not asked or len(asked) > BATCH_MAX:
        return json.dumps(_failed(None, -32600, f"a batch has 1 to {BATCH_MAX} calls"))
    answers = [answer for each in asked if (answer := await _one(methods, session, each)) is not None]
    return json.dumps(answers) if answers else None


def notification(method: str, *params: object) -> str:
    """Something told without being asked."""
    return json.dumps({"jsonrpc": "2.0", "method": method, "params": list(params)})


async def _one(methods: Methods, session: Session, asked: Any) -> dict[str, Any] | None:
    if not isinstance(asked, dict) or not isinstance(asked.get("method"), str):
        return _failed(None, -32600, "Invalid Request")
    number, params = asked.get("id"), asked.get("params") or {}
    if not isinstance(params, dict):
        return _failed(number, -32602, "parameters go by name")
    try:
        result = await methods.call(session, asked["method"], params)
    except RpcError as error:
        return None if number is None else _failed(number, error.code, str(error))
    return None if number is None else {"jsonrpc": "2.0", "id": number, "result": result}


def _failed(number: Any, code: int, message: str) -> dict[str, Any]:
    return {"jsonrpc": "2.0", "id": number, "error": {"code": code, "message": shown(message, 500)}}
