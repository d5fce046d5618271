"""What the keys do."""

from typing import Final

HELP: Final = """\
arrows, PgUp, PgDn  jog x and y, z        + -     larger, smaller step
c                   steps / hold a key    h       home (G28)
s, then 1 to 6      arrows move one slider alone, 0.1 or 1 mm (Esc ends it)
:                   type G-code: up, down recall, right completes; Esc
space               hold, resume          [ ]     feed -10 %, +10 %
F3                  load, prove a file    { }     flow -10 %, +10 %
F5                  start the print       0       feed and flow 100 %
F8                  abort: rest, lift     F9      acknowledge a fault
!                   EMERGENCY STOP        Ctrl-C  hold
q, F10              quit
"""
