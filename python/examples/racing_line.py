"""The shortest and the fastest line round an ellipse by asking and telling, and a picture of the study's lines.

The picture is what the study has drawn: an SVG, which needs no plotting package.
"""

import sys
import tempfile
from pathlib import Path

import lapswarm


def main() -> None:
    best = {}
    for objective in ("length", "lap_time"):
        lines = lapswarm.LineProblem("ellipse:400:250:12", sections=120, objectives=[objective], control_points=16)
        evaluator = lapswarm.Evaluator(lines)
        swarm = lapswarm.Optimiser(lines, population=64, iterations=150, seed=3)
        while not swarm.done:
            swarm.tell(evaluator.evaluate(swarm.ask()))
        best[objective] = swarm.best[0]
        print(f"{objective}: {swarm.best[0]:.3f} {lines.objective_units[0]} after {swarm.evaluations} lines")

    with tempfile.TemporaryDirectory() as folder:
        found = lapswarm.raceline(
            out=Path(folder) / "run",
            track="ellipse:400:250:12",
            sections=120,
            objectives=["length", "lap_time"],
            population=40,
            iterations=20,
        )
        print(found.text)
        pictures = sorted(path.name for path in found.folder.glob("*.svg"))
        print("pictures:", ", ".join(pictures))
    if not pictures or best["length"] < 1000.0:
        sys.exit("there is no picture, or a line that is too short")


if __name__ == "__main__":
    main()
