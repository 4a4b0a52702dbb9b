"""How stiffly did the car roll that drove a lap? A log in a frame, a car fitted to it, and the fit as a frame.

The log is simulated here, so the truth is known. Ends with an error if what is found is not that. Any frame will do: pandas,
polars, pyarrow, or a dict of arrays as here.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import lapswarm
import numpy as np


def logged(folder: Path) -> dict[str, np.ndarray]:
    """The columns of a lap that is simulated with the bundled car."""
    command = [sys.executable, "-m", "lapswarm.command_line", "simulate", "--quiet", "--out", str(folder)]
    subprocess.run(command, check=True)
    with (folder / "lap.csv").open() as file:
        names = [line for line in (next(file), next(file)) if not line.startswith("#")][-1]
        return dict(zip(names.strip().split(","), np.loadtxt(file, delimiter=",").T, strict=True))


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        lap = logged(Path(folder) / "simulated")
        found = lapswarm.identify(
            log=lap,
            out=Path(folder) / "run",
            free={"rBy1": (5, 25), "rCy1": (0.8, 1.5), "roll_stiffness_nm_per_rad": (3e4, 3e5)},
            population=32,
            iterations=20,
        )
        traces = found.frame("traces", "numpy")
    print(found.text)
    off = traces["ay_fitted (m/s^2)"] - traces["ay_measured (m/s^2)"]
    print(f"the fitted car is off by {np.sqrt(np.nanmean(off**2)):.1e} m/s^2 across, at {np.isfinite(off).sum()} samples")
    stiffness = next(p for p in found.figures.parameters if p.name == "roll_stiffness_nm_per_rad")
    if stiffness.value is None or abs(stiffness.value / 1e5 - 1.0) > 1e-6:
        sys.exit(f"found {stiffness.value}, expected 100000")


if __name__ == "__main__":
    main()
