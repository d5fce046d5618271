"""What web pages keep with the printer: small JSON values by namespace, in memory."""

import json
from typing import Any, Final

from cdhr_host.serve.names import refused

VALUE_MAX: Final = 1 << 16
"""bytes of one value as JSON"""
TOTAL_MAX: Final = 4 << 20


class Store:
    """Values by namespace and key."""

    def __init__(self) -> None:
        self._spaces: dict[str, dict[str, Any]] = {}
        self._sizes: dict[tuple[str, str], int] = {}

    def namespaces(self) -> list[str]:
        """All there are."""
        return sorted(self._spaces)

    def get(self, space: str, key: object) -> Any:
        """One value, or all of a namespace when ``key`` is None; None when there is nothing."""
        values = self._spaces.get(space)
        return values if values is None or key is None else values.get(str(key))

    def put(self, space: str, key: str, value: Any) -> None:
        """Keep a value; JobError when it is too much."""
        size = len(json.dumps(value)) + len(space) + len(key)
        others = sum(self._sizes.values()) - self._sizes.get((space, key), 0)
        if size > VALUE_MAX or others + size > TOTAL_MAX:
            raise refused(f"too much to keep: {size} bytes", kind="size")
        self._sizes[space, key] = size
        self._spaces.setdefault(space, {})[key] = value

    def delete(self, space: str, key: str) -> Any:
        """Forget a value; None when there was none."""
        self._sizes.pop((space, key), None)
        values = self._spaces.get(space, {})
        value = values.pop(key, None)
        if not values:
            self._spaces.pop(space, None)
        return value
