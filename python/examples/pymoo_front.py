"""A front of lines by pymoo's NSGA-II and by lapswarm's own swarm, both on one evaluator with the same number of lines.

Needs pymoo: ``pip install lapswarm[pymoo]``.
"""

import lapswarm
import numpy as np
from lapswarm.pymoo import Problem
from pymoo.algorithms.moo.nsga2 import NSGA2  # type: ignore[import-untyped]
from pymoo.indicators.hv import HV  # type: ignore[import-untyped]
from pymoo.optimize import minimize  # type: ignore[import-untyped]

POPULATION, GENERATIONS = 60, 50


def main() -> None:
    lines = lapswarm.LineProblem(
        "ellipse:400:250:12", sections=120, objectives=["length", "lap_time"], control_points=16
    )
    problem = Problem(lines)
    theirs = minimize(problem, NSGA2(pop_size=POPULATION), ("n_gen", GENERATIONS), seed=1).F

    swarm = lapswarm.Optimiser(lines, population=POPULATION, iterations=GENERATIONS)
    while not swarm.done:
        swarm.tell(problem.evaluator.evaluate(swarm.ask()))
    ours = swarm.front[1]

    both = np.vstack([theirs, ours])
    least, most = both.min(axis=0), both.max(axis=0)
    volume = HV(ref_point=np.array([1.1, 1.1]))
    print(f"{problem.evaluator.backend}, {POPULATION * GENERATIONS} lines each")
    for name, front in (("NSGA-II of pymoo", theirs), ("swarm of lapswarm", ours)):
        print(f"{name:18} {len(front):3} lines, hypervolume {volume((front - least) / (most - least)):.4f}")


if __name__ == "__main__":
    main()
