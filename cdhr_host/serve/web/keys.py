"""The API key of a machine: made once, shown once, kept as a hash."""

import hashlib
import hmac
import os
import secrets
from pathlib import Path
from typing import Final

BYTES: Final = 32
"""of randomness: too much to guess, so a plain hash keeps it and no slow one is needed"""


def default_key_file() -> Path:
    """Where the hash lives unless another place is named."""
    base = os.environ.get("XDG_CONFIG_HOME") or str(Path.home() / ".config")
    return Path(base) / "cdhr" / "api-key.sha256"


class ApiKey:
    """The one key clients must show."""

    def __init__(self, digest: str) -> None:
        self._digest = digest

    @classmethod
    def stored(cls, path: Path) -> "ApiKey | None":
        """The key of a file; None when there is none."""
        try:
            digest = path.read_text(encoding="ascii").strip()
        except (OSError, UnicodeDecodeError):
            return None
        return cls(digest) if len(digest) == hashlib.sha256().digest_size * 2 else None

    @classmethod
    def make(cls, path: Path) -> "tuple[ApiKey, str]":
        """A new key, in place of the old one; the text is nowhere else."""
        text = secrets.token_urlsafe(BYTES)
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        fresh = path.with_name(f"{path.name}.{os.getpid()}")
        fd = os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o600)
        with os.fdopen(fd, "w", encoding="ascii") as file:
            file.write(_digest(text) + "\n")
        fresh.replace(path)
        return cls(_digest(text)), text

    def fits(self, text: str) -> bool:
        """Whether this is the key, in time that does not depend on how much of it is right."""
        return hmac.compare_digest(_digest(text), self._digest)


class Tokens:
    """One-shot tokens for what cannot send a header: websockets and downloads."""

    LIFE: Final = 5.0
    MOST: Final = 64

    def __init__(self) -> None:
        self._ends: dict[str, float] = {}

    def give(self, now: float) -> str:
        """A token that opens one request within 5 s."""
        self._forget(now)
        while len(self._ends) >= self.MOST:
            del self._ends[next(iter(self._ends))]
        token = secrets.token_urlsafe(BYTES)
        self._ends[token] = now + self.LIFE
        return token

    def take(self, token: str, now: float) -> bool:
        """Whether a token is good; it is not a second time."""
        self._forget(now)
        return self._ends.pop(token, None) is not None

    def _forget(self, now: float) -> None:
        self._ends = {token: end for token, end in self._ends.items() if end > now}


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
