"""Programs to measure with: as long as wanted, like those a slicer makes."""

import math
from pathlib import Path


def spiral_pot(path: Path, lines: int, chord_mm: float = 0.3) -> Path:
    """A wavy spiral wall of short chords at 20 mm/s, with absolute E, as a vase-mode slicer draws it."""
    radius_mm, rise_mm = 60.0, 2.0
    with path.open("w") as out:
        out.write("; benchmark: wavy spiral of short chords\nG21\nG90\nM82\nG92 E0\nG1 Z2 F2400\n")
        out.write(f"G1 X{radius_mm:.3f} Y0 F3600\nG1 F1200\n")
        angle, e = 0.0, 0.0
        for _ in range(lines):
            angle += chord_mm / radius_mm
            r = radius_mm + 4.0 * math.sin(6 * angle)
            z = 2.0 + rise_mm * angle / (2 * math.pi)
            if z > 700.0:
                angle, z = 0.0, 2.0
                out.write("G1 Z720\nG1 X60 Y0\nG1 Z2\n")
            e += 12.5 * chord_mm
            out.write(f"G1 X{r * math.cos(angle):.3f} Y{r * math.sin(angle):.3f} Z{z:.3f} E{e:.5f}\n")
    return path
