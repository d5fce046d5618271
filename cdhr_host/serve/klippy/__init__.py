"""Klipper's unix socket: JSON ended by 0x03, so that the real Moonraker works in front of it."""
