"""Ranges of the fronts that have no formula: the extremes of what a long run of NSGA-II finds.

Prints lines for `scales.csv`: name, ideal point, nadir point. 300 individuals, 400 generations, seeds 1 and 2 together; by pygmo where there
are no constraints, by pymoo where there are. Tails are left out: points to which others are equal but for a millionth of the
range, and better by a tenth of it in some objective, over and over until there are none.
"""

import sys

import numpy as np
import pygmo
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

from run import Batch, of_pygmo
from suites import problems


def without_tails(front):
    while True:
        scaled = (front - front.min(axis=0)) / np.ptp(front, axis=0)
        kept = [
            not ((scaled <= point + 1e-6).all(axis=1) & (scaled < point - 0.1).any(axis=1)).any() for point in scaled
        ]
        if all(kept):
            return front
        front = front[kept]


def main():
    wanted = ["osy", "tnk", "welded_beam"] + [p.name for p in problems() if p.suite == "engineering"]
    for problem in problems():
        if problem.name not in (sys.argv[1:] or wanted):
            continue
        if problem.constraints:
            found = [minimize(Batch(problem), NSGA2(pop_size=300), ("n_gen", 400), seed=seed).F for seed in (1, 2)]
        else:
            search = of_pygmo(lambda gen, seed: pygmo.nsga2(gen, seed=seed), (300, 120_000))
            found = [search(problem, seed) for seed in (1, 2)]
        points = np.vstack(found)
        front = points[NonDominatedSorting().do(points, only_non_dominated_front=True)]
        front = without_tails(front)
        figures = [*front.min(axis=0), *front.max(axis=0)]
        print(",".join([problem.name, *(f"{x:.6g}" for x in figures)]), flush=True)


if __name__ == "__main__":
    main()
