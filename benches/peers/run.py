"""Runs other libraries' optimisers on the suites at the budget of `lapswarm bench optimisers`.

    python run.py --seeds 5 --out ../results/peers.csv      the peers' medians
    python run.py --check fronts.csv                         the hypervolumes of fronts in a file, by moocore

25,000 evaluations for several objectives, with populations and archives of 100; 100,000 for one, with populations of 40.
Settings are the libraries' own defaults. Hypervolumes are moocore's, on the scale of `scales.csv`, with the reference at 1.1
in every objective. Infeasible members do not count. Python and packages: requirements.txt.
"""

import argparse
import csv
import time
from importlib.metadata import version

import cma
import moocore
import numpy as np
import pygmo
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.nsga3 import NSGA3
from pymoo.algorithms.moo.sms import SMSEMOA
from pymoo.core.problem import Problem as PymooProblem
from pymoo.optimize import minimize
from pymoo.util.ref_dirs import get_reference_directions

import suites

REFERENCE = 1.1
SEVERAL, ONE = (100, 25_000), (40, 100_000)
COLUMNS = "suite,problem,algorithm,library,seeds,median,first_quartile,third_quartile,all_feasible,seconds"


class Batch(PymooProblem):
    """A problem of the suites as pymoo sees it."""

    def __init__(self, problem):
        self.inner = problem
        super().__init__(
            n_var=len(problem.lower),
            n_obj=problem.objectives,
            n_ieq_constr=problem.constraints,
            xl=problem.lower,
            xu=problem.upper,
        )

    def _evaluate(self, x, out, *args, **kwargs):
        out["F"], out["G"] = self.inner.evaluate(x)


class Single:
    """A problem of the suites as pygmo sees it."""

    def __init__(self, problem):
        self.inner = problem

    def fitness(self, x):
        return self.inner.evaluate(x[None])[0][0]

    def batch_fitness(self, rows):
        return self.inner.evaluate(rows.reshape(-1, len(self.inner.lower)))[0].ravel()

    def get_bounds(self):
        return self.inner.lower, self.inner.upper

    def get_nobj(self):
        return self.inner.objectives


def of_pymoo(make):
    def run(problem, seed):
        population, evaluations = SEVERAL
        result = minimize(Batch(problem), make(problem, population), ("n_eval", evaluations), seed=seed)
        return None if result.F is None else np.atleast_2d(result.F)

    return run


def directions(problem, population):
    """As many of Das and Dennis's directions as fit into the population."""
    parts = 99 if problem.objectives == 2 else 12
    return NSGA3(get_reference_directions("das-dennis", problem.objectives, n_partitions=parts), pop_size=population)


def of_pygmo(algorithm, sizes):
    def run(problem, seed):
        if problem.constraints:
            return NotImplemented
        population, evaluations = sizes
        inner = algorithm(evaluations // population - 1, seed)
        if hasattr(inner, "set_bfe"):
            inner.set_bfe(pygmo.bfe(pygmo.member_bfe()))
        evolved = pygmo.algorithm(inner).evolve(pygmo.population(Single(problem), population, seed=seed))
        if problem.objectives == 1:
            return evolved.champion_f
        found = evolved.get_f()
        return found[pygmo.fast_non_dominated_sorting(found)[0][0]]

    return run


def smpso(problem, seed):
    """SMPSO of jmetalpy, its leaders by crowding."""
    import random

    from jmetal.algorithm.multiobjective.smpso import SMPSO
    from jmetal.core.problem import FloatProblem
    from jmetal.operator.mutation import PolynomialMutation
    from jmetal.util.archive import CrowdingDistanceArchive
    from jmetal.util.termination_criterion import StoppingByEvaluations

    class Row(FloatProblem):
        def __init__(self):
            super().__init__()
            self.lower_bound, self.upper_bound = list(problem.lower), list(problem.upper)
            self.obj_directions = [self.MINIMIZE] * problem.objectives

        def number_of_objectives(self):
            return problem.objectives

        def number_of_constraints(self):
            return problem.constraints

        def name(self):
            return problem.name

        def evaluate(self, solution):
            costs, constraints = problem.evaluate(np.array([solution.variables]))
            solution.objectives = list(costs[0])
            solution.constraints = list(-constraints[0])
            return solution

    random.seed(seed)
    np.random.seed(seed)
    population, evaluations = SEVERAL
    size = len(problem.lower)
    algorithm = SMPSO(
        problem=Row(),
        swarm_size=population,
        mutation=PolynomialMutation(probability=1.0 / size, distribution_index=20),
        leaders=CrowdingDistanceArchive(population),
        termination_criterion=StoppingByEvaluations(max_evaluations=evaluations),
    )
    algorithm.run()
    feasible = [s.objectives for s in algorithm.result() if all(g >= 0 for g in s.constraints)]
    return np.array(feasible) if feasible else None


def covariance(problem, seed):
    """CMA-ES of pycma with the restarts of BIPOP."""
    population, evaluations = ONE
    middle = 0.5 * (problem.lower + problem.upper)
    options = {
        "bounds": [list(problem.lower), list(problem.upper)],
        "maxfevals": evaluations,
        "popsize": population,
        "seed": seed,
        "verbose": -9,
        "ftarget": 1e-12,
    }
    width = 0.3 * (problem.upper[0] - problem.lower[0])
    found = cma.fmin2(
        lambda x: problem.evaluate(x[None])[0][0][0], middle, width, options, restarts=9, bipop=True
    )
    return np.array([found[1].result.fbest])


PEERS = {
    "sms_emoa": ("pymoo", of_pymoo(lambda problem, size: SMSEMOA(pop_size=size)), 2),
    "nsga2": ("pymoo", of_pymoo(lambda problem, size: NSGA2(pop_size=size)), 2),
    "nsga3": ("pymoo", of_pymoo(directions), 2),
    "nsga2_pygmo": ("pygmo", of_pygmo(lambda gen, seed: pygmo.nsga2(gen, seed=seed), SEVERAL), 2),
    "nspso": ("pygmo", of_pygmo(lambda gen, seed: pygmo.nspso(gen, seed=seed), SEVERAL), 2),
    "moead": ("pygmo", of_pygmo(lambda gen, seed: pygmo.moead_gen(gen, weight_generation="random", seed=seed), SEVERAL), 2),
    "smpso": ("jmetalpy", smpso, 2),
    "bipop_cma": ("cma", covariance, 1),
    "sade": ("pygmo", of_pygmo(lambda gen, seed: pygmo.sade(gen, variant_adptv=2, ftol=0, xtol=0, seed=seed), ONE), 1),
    "pso": ("pygmo", of_pygmo(lambda gen, seed: pygmo.pso_gen(gen, seed=seed), ONE), 1),
}


def quality(problem, found, scales):
    """The hypervolume of a front, or the error of a single cost, whose optimum is zero."""
    if problem.objectives == 1:
        return float(found[0])
    if found is None:
        return 0.0
    ideal, nadir = scales[problem.name]
    return float(moocore.hypervolume((found - ideal) / (nadir - ideal), ref=[REFERENCE] * problem.objectives))


def compare(arguments):
    scales = suites.scales()
    problems = [p for p in suites.problems() if not arguments.problems or p.name in arguments.problems]
    names = arguments.algorithms or list(PEERS)
    with open(arguments.out, "w") as file:
        packages = ", ".join(f"{name} {version(name)}" for name in ("pymoo", "jmetalpy", "pygmo", "cma", "moocore"))
        print(f"# benches/peers/run.py, seeds 1 to {arguments.seeds}, {packages}", file=file)
        print("# Hypervolume for several objectives, error for one. Seconds are those of a run.", file=file)
        print(COLUMNS, file=file, flush=True)
        for name in names:
            library, run, least = PEERS[name]
            for problem in problems:
                if (problem.objectives == 1) != (least == 1):
                    continue
                start = time.monotonic()
                fronts = [run(problem, seed) for seed in range(1, arguments.seeds + 1)]
                if fronts[0] is NotImplemented:
                    continue
                seconds = (time.monotonic() - start) / arguments.seeds
                low, median, high = np.quantile([quality(problem, f, scales) for f in fronts], [0.25, 0.5, 0.75])
                feasible = str(all(f is not None for f in fronts)).lower()
                row = f"{problem.suite},{problem.name},{name},{library},{arguments.seeds}"
                print(f"{row},{median:.6g},{low:.6g},{high:.6g},{feasible},{seconds:.1f}", file=file, flush=True)


def check(path):
    """Compares the hypervolumes of exported fronts with moocore's."""
    scales, fronts = suites.scales(), {}
    with open(path) as file:
        for row in csv.DictReader(file):
            key = (row["problem"], row["algorithm"], row["seed"], float(row["hypervolume"]))
            costs = [float(row[k]) for k in ("f1", "f2", "f3") if row[k]]
            fronts.setdefault(key, []).append(costs)
    worst = 0.0
    for (name, algorithm, seed, told), rows in fronts.items():
        ideal, nadir = scales[name]
        reference = [REFERENCE] * len(ideal)
        found = moocore.hypervolume((np.array(rows) - ideal) / (nadir - ideal), ref=reference)
        off = abs(found - told)
        worst = max(worst, off)
        if off > 1e-9:
            print(f"{name}, {algorithm}, seed {seed}: {told}, moocore has {found}")
    print(f"{len(fronts)} fronts, hypervolumes at most {worst:.1e} apart")
    return worst <= 1e-9


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=11)
    parser.add_argument("--problems", nargs="*")
    parser.add_argument("--algorithms", nargs="*", choices=PEERS)
    parser.add_argument("--out", default="peers.csv")
    parser.add_argument("--check", metavar="FRONTS")
    arguments = parser.parse_args()
    if arguments.check:
        raise SystemExit(0 if check(arguments.check) else 1)
    compare(arguments)


if __name__ == "__main__":
    main()
