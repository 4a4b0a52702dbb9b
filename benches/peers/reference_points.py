"""Points of all problems and their values by published packages, as CSV on standard output, to check ports of the problems with.

    python reference_points.py > reference_points.csv
"""

from importlib.metadata import version

import numpy as np

from suites import problems, shift

POINTS = 5


def main():
    packages = ", ".join(f"{name} {version(name)}" for name in ("pymoo", "jmetalpy", "pygmo", "opfunu", "numpy"))
    print(f"# Written by benches/peers/reference_points.py with {packages}.")
    print("# Random points within the bounds (numpy, seed 17, five digits), their objectives, and their constraints G <= 0.")
    print("# The last point of each rotated problem is its optimum.")
    print("# RE23 and RE33 are led back from jmetalpy's to the suite's definition, see suites.py.")
    print("problem,package,variables,values")
    random = np.random.default_rng(17)
    number = 0
    for problem in problems():
        rows = problem.lower + (problem.upper - problem.lower) * random.random((POINTS, len(problem.lower)))
        rows = np.array([[float(f"{x:.5g}") for x in row] for row in rows]).clip(problem.lower, problem.upper)
        if problem.suite == "rotated":
            # The optimum as well.
            rows = np.vstack([rows, shift(number, 0)])
            number += 1
        costs, constraints = problem.evaluate(rows)
        for row, values in zip(rows, np.hstack([costs, constraints])):
            texts = (" ".join(repr(float(x)) for x in figures) for figures in (row, values))
            print(",".join([problem.name, problem.source, *texts]))


if __name__ == "__main__":
    main()
