"""How stiffly did the car that drove the bundled lap roll? A study as a function, and its summary.

The bundled lap is simulated, so the truth is known. Ends with an error if what is found is not that.
"""

import sys
import tempfile
from pathlib import Path

import lapswarm


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        found = lapswarm.identify(
            out=Path(folder) / "run",
            free={"rBy1": (5, 25), "rCy1": (0.8, 1.5), "roll_stiffness_nm_per_rad": (3e4, 3e5)},
            population=32,
            iterations=20,
        )
        print(found.text)
        worst = max(abs(row["value"] / row["truth"] - 1.0) for row in found.summary["parameters"])
    if worst > 1e-6:
        sys.exit(f"off by {worst:.1e}")


if __name__ == "__main__":
    main()
