"""Host software for a cable-driven clay printer."""

__version__ = "0.1.0"
