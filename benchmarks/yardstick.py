"""The yardstick Y: six pulley-compensated lengths in plain numpy, one expression a line, no blocking.

    python benchmarks/yardstick.py SETPOINTS

Prints the CPU seconds of the whole process, imports included.
"""

import sys

import numpy as np
from measure import own_cpu_s

RADIUS_M, PULLEY_M = 0.89862, 0.011
AZIMUTH = np.array([0, 2, 4, 0, 2, 4]) * np.pi / 3
PULLEY_Z_M = np.array([0, 0, 0, 1.796, 1.796, 1.796])
PLATFORM_M = np.array([0.06062, 0.06062, 0.06062, 0, 0, 0])
PLATFORM_Z_M = np.array([0.4385, 0.4385, 0.4385, 0.4935, 0.4935, 0.4935])


def lengths(q: np.ndarray) -> np.ndarray:
    """(N, 3) m -> (N, 6) m."""
    found = np.empty((len(q), 6))
    for i in range(6):
        x = (RADIUS_M - PLATFORM_M[i]) * np.cos(AZIMUTH[i]) - q[:, 0]
        y = (RADIUS_M - PLATFORM_M[i]) * np.sin(AZIMUTH[i]) - q[:, 1]
        z = PULLEY_Z_M[i] - PLATFORM_Z_M[i] - q[:, 2]
        rho = np.sqrt(x**2 + y**2)
        w = np.abs(z)
        d = np.sqrt(rho**2 + w**2)
        theta = np.arcsin(PULLEY_M / d) + np.arctan2(w, rho)
        found[:, i] = PULLEY_M * theta + np.sqrt(d**2 - PULLEY_M**2)
    return found


def main() -> None:
    """Evaluate as many poses as asked for."""
    turn = np.linspace(0.0, 100.0, int(sys.argv[1]))
    q = np.column_stack((0.2 * np.cos(turn), 0.2 * np.sin(turn), 0.003 * turn))
    lengths(q)
    print(own_cpu_s())


if __name__ == "__main__":
    main()
