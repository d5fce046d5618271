"""The far side of a print as a process of its own: drives that write down each period, and fail when told.

Reads words, one a line: ``fault`` (a drive trips), ``stop`` (the emergency stop is pressed for a second),
``end``. Each period is a record of RECORD in a file, written at once, so that this process does not grow.
"""

import argparse
import select
import sys
import time
from pathlib import Path

import numpy as np

from cdhr_host.drives.sim.bridge import Bridge
from cdhr_host.drives.sim.serve import GRACE, SlcanStation, Terminal, serve
from cdhr_host.pipeline import open_profile

RECORD = np.dtype(
    [("at", "f8"), ("told", "i4", 6), ("stands", "i4", 6), ("air", "i4"), ("fresh", "i4"), ("laid", "f8")]
)
"""s, six setpoints and six positions in position units, raw pressure, whether all six followed, mm³/s"""
PRESSED = 1.0
"""s the emergency stop is pressed"""
OVER_CURRENT = 0x2310


RATES = {"slcan": 1_000_000, "link": 921_600}


class Far:
    """An slcan station or a bridge, its record, and its bad moments."""

    def __init__(self, bus, profile, record):
        now = time.monotonic()
        self.plain = SlcanStation(profile, now) if bus == "slcan" else Bridge(profile, now, grace=GRACE)
        self._trace, self._received = self.plain.trace, self.plain.record()
        self._record = record
        self._release = None
        self._drives = np.random.default_rng(1)
        self.ended = False

    def exchange(self, now, data):
        self._obey(now)
        answer = self.plain.exchange(now, data)
        self._keep()
        return answer

    def _obey(self, now):
        if self._release is not None and now > self._release:
            self.plain.station.press(False)
            self._release = None
        while select.select([sys.stdin], [], [], 0.0)[0]:
            match sys.stdin.readline().strip():
                case "fault":
                    self.plain.station.drives[self._drives.integers(6)].fault(OVER_CURRENT)
                case "stop":
                    self.plain.station.press(True)
                    self._release = now + PRESSED
                case _:
                    self.ended = True
                    return

    def _keep(self):
        """What the drives were told is known for the periods in which all six followed."""
        if not self._trace:
            return
        rows = np.zeros(len(self._trace), RECORD)
        told = iter(self._received)
        for row, (at, *stands, air, fresh, laid) in zip(rows, self._trace, strict=True):
            row["told"] = next(told)[:6] if fresh else stands
            row["at"], row["stands"], row["fresh"], row["laid"] = at, stands, fresh, laid
            row["air"] = 0 if self._release is not None else air
        self._trace.clear()
        self._received.clear()
        self._record.write(rows.tobytes())


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--bus", choices=RATES, default="slcan")
    options.add_argument("--profile", required=True)
    options.add_argument("--link", type=Path, required=True)
    options.add_argument("--record", type=Path, required=True)
    asked = options.parse_args()
    with asked.record.open("ab", buffering=0) as record, Terminal(asked.link) as terminal:
        far = Far(asked.bus, open_profile(asked.profile), record)
        print(f"{asked.bus}:{asked.link}@{RATES[asked.bus]}", flush=True)
        serve(terminal, far, lambda: far.ended, lambda: False)
    print(far.plain.report()["lost_ticks"], flush=True)


if __name__ == "__main__":
    main()
