"""What the tests share: small problems, each set up once."""

from __future__ import annotations

from pathlib import Path

import lapswarm
import numpy as np
import pytest

FREE = {
    "mass_kg": (1150.0, 1350.0),
    "roll_damping_nms_per_rad": (9e3, 4e4),
    "roll_stiffness_nm_per_rad": (8e4, 1.4e5),
}
# Those of the car that drove the bundled lap.
TRUTH = [1245.0, 1.9e4, 1e5]


@pytest.fixture(scope="session")
def replay() -> lapswarm.ReplayProblem:
    return lapswarm.ReplayProblem("gt", free=FREE, window_s=1.5, settle_s=0.5)


@pytest.fixture(scope="session")
def line() -> lapswarm.LineProblem:
    return lapswarm.LineProblem("ellipse:400:250:12", sections=60, objectives=["length", "lap_time"])


@pytest.fixture(scope="session")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The middle of a stadium, as a line to drive."""
    half, radius, step = 30.0, 40.0, 1.0
    arc = np.pi * radius
    points = []
    for s in np.arange(0.0, 2 * (2 * half + arc), step):
        turn, s = divmod(s, 2 * half + arc)
        sign = 1.0 if turn == 0 else -1.0
        if s < 2 * half:
            x, y = s - half, -radius
        else:
            angle = (s - 2 * half) / radius
            x, y = half + radius * np.sin(angle), -radius * np.cos(angle)
        points.append((sign * x, sign * y))
    path = tmp_path_factory.mktemp("line") / "line.csv"
    np.savetxt(path, points, delimiter=",", header="x_m,y_m", comments="")
    return path


def drawn(problem: lapswarm.Problem, count: int, seed: int = 1) -> np.ndarray:
    """Random candidates from the middle of the bounds."""
    lower, upper = problem.bounds.T
    share = np.random.default_rng(seed).uniform(0.3, 0.7, (count, len(lower)))
    return lower + share * (upper - lower)
