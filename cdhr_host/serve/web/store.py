"""What web pages keep with the printer: small JSON values by namespace, in memory."""

import json
from typing import Any, Final

from cdhr_host.serve.names import refused

VALUE_MAX: Final = 1 << 16
"""bytes of one value as JSON"""
TOTAL_MAX: Final = 4 << 20
DEPTH_MAX: Final = 16


class Store:
    """Values by namespace and key; a key with dots leads into the objects inside, as in Moonraker."""

    def __init__(self) -> None:
        self._spaces: dict[str, dict[str, Any]] = {}
        self._sizes: dict[str, int] = {}

    def namespaces(self) -> list[str]:
        """All there are."""
        return sorted(self._spaces)

    def get(self, space: str, key: object) -> Any:
        """One value, or all of a namespace when ``key`` is None; None when there is nothing."""
        found: Any = self._spaces.get(space)
        for part in [] if key is None else _parts(key):
            found = found.get(part) if isinstance(found, dict) else None
        return found

    def put(self, space: str, key: object, value: Any) -> None:
        """Keep a value; JobError when it is too much."""
        parts = _parts(key)
        size = len(json.dumps(value)) + len(space) + sum(map(len, parts))
        if size > VALUE_MAX or sum(self._sizes.values()) + size > TOTAL_MAX:
            raise refused(f"too much to keep: {size} bytes", kind="size")
        inside = self._spaces.setdefault(space, {})
        for part in parts[:-1]:
            if not isinstance(inside.get(part), dict):
                inside[part] = {}
            inside = inside[part]
        inside[parts[-1]] = value
        self._weigh(space)

    def delete(self, space: str, key: object) -> Any:
        """Forget a value; None when there was none."""
        *path, last = _parts(key)
        inside = self._spaces.get(space) if not path else self.get(space, path)
        value = inside.pop(last, None) if isinstance(inside, dict) else None
        self._weigh(space)
        return value

    def _weigh(self, space: str) -> None:
        """Note what a namespace takes; forget it when it is empty."""
        if self._spaces.get(space):
            self._sizes[space] = len(space) + len(json.dumps(self._spaces[space]))
        else:
            self._spaces.pop(space, None)
            self._sizes.pop(space, None)


def _parts(key: object) -> list[str]:
    parts = [str(part) for part in key] if isinstance(key, list) else str(key).split(".")
    if not all(parts) or not parts or len(parts) > DEPTH_MAX:
        raise ValueError(f"key {str(key)[:80]}")
    return parts
