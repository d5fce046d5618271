"""The framed serial link to a motion bridge: docs/link.md."""
