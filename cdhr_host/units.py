"""The unit table: what one of each worn unit is in SI.

Bare names are SI everywhere in the package. A value in another unit wears it in its
name (``_mm``, ``_mm_min``, ``_kpa``, ...) and exists only at the doors: G-code, profiles,
logs, screens and wires. ``value_mm * MM`` goes in, ``value / MM`` comes out.
"""

from typing import Final

MM: Final = 1e-3
"""m in a millimetre"""
MM2: Final = 1e-6
"""m² in a square millimetre"""
MM3: Final = 1e-9
"""m³ in a cubic millimetre"""
INCH: Final = 25.4e-3
"""m in an inch"""
MINUTE: Final = 60.0
"""s in a minute"""
MS: Final = 1e-3
"""s in a millisecond"""
KPA: Final = 1e3
"""Pa in a kilopascal"""
N_MM: Final = 1e3
"""N/m in a newton per millimetre"""
DEG: Final = 3.141592653589793 / 180.0
"""rad in a degree"""

SUFFIXES: Final[dict[str, float]] = {
    "_mm": MM,
    "_mm2": MM2,
    "_mm3": MM3,
    "_mm_s": MM,
    "_mm_s2": MM,
    "_mm_s3": MM,
    "_mm3_s": MM3,
    "_n": 1.0,
    "_n_mm": N_MM,
    "_kg": 1.0,
    "_deg": DEG,
    "_kg_m3": 1.0,
    "_pa": 1.0,
    "_pa_s_n": 1.0,
    "_kpa": KPA,
    "_kpa_s_mm3": KPA / MM3,
    "_mm3_kpa": MM3 / KPA,
    "_ms": MS,
    "_s": 1.0,
    "_hz": 1.0,
    "_nm": 1.0,
    "_counts": 1.0,
    "_percent": 1e-2,
}
"""Suffix worn by a key -> factor to SI. The longest matching suffix counts."""


def split_unit(key: str) -> tuple[str, float]:
    """``"lead_mm"`` -> ``("lead", 0.001)``; a key without a unit keeps its name and factor 1."""
    for suffix in sorted(SUFFIXES, key=len, reverse=True):
        if key.endswith(suffix):
            return key.removesuffix(suffix), SUFFIXES[suffix]
    return key, 1.0
