"""A function of your own over whole populations: a cantilever's weight against its deflection, with a limit on its stress.

Deb, *An efficient constraint handling method for genetic algorithms* (2000), has problems like it.
"""

import sys

import lapswarm
import numpy as np

LOAD_N, STIFFNESS_PA, DENSITY_KGPM3, STRENGTH_PA = 1000.0, 207e9, 7800.0, 300e6


def cantilever(x: np.ndarray) -> np.ndarray:
    """x: diameter (m) and length (m), of shape (n, 2). Returns mass (kg), deflection (m), and the stress less its limit."""
    diameter, length = x.T
    mass = DENSITY_KGPM3 * np.pi * diameter**2 / 4 * length
    deflection = 64 * LOAD_N * length**3 / (3 * STIFFNESS_PA * np.pi * diameter**4)
    stress = 32 * LOAD_N * length / (np.pi * diameter**3)
    return np.column_stack([mass, deflection, stress / STRENGTH_PA - 1.0])


def main() -> None:
    beam = lapswarm.OwnProblem([(0.01, 0.05), (0.2, 1.0)], ["mass", "deflection"], names=["diameter", "length"])
    found = lapswarm.minimise(beam, cantilever, inequalities=1, evaluations=10_000, archive=50, seed=2)
    print(f"{len(found.F)} beams, stopped by {found.stopped}")
    for mass, deflection in found.F[np.argsort(found.F[:, 0])][::10]:
        print(f"{mass:7.3f} kg {1e3 * deflection:8.4f} mm")
    if found.violation > 0.0 or len(found.F) < 25 or found.F[:, 0].min() > 0.6:
        sys.exit("the front is not what it should be")


if __name__ == "__main__":
    main()
