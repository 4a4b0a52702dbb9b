"""Compares `lapswarm.minimise` with pymoo's optimisers on families of problems that are not in lapswarm's suites.

    pip install ./python pymoo==0.6.2 moocore==0.3.2 coco-experiment==2.8.2
    python benches/peers/families.py --seeds 5 --families mw,g

They are constrained problems of pymoo (`das5`, `das9` and `das13` are DAS-CMOP with another difficulty than `dascmop`); those of
`problems.py` (`lircmop`, `cf`, `bt`, `glt`, and `zcat`; `zcat2` and `zcat3` are ZCAT of all levels in turn with two and three objectives);
and COCO's `bbob-biobj` with ten variables (`biobj`): 55 pairs of ten functions.

25,000 evaluations for several objectives, with populations and archives of 100; 100,000 for one. Settings are the defaults of
both. Hypervolumes are moocore's, on the scale of the front of all that was found in this run, with the reference at 1.1. A run
without a feasible candidate counts as zero, or as infinite for one objective. Errors are from the optimum that pymoo knows.
"""

import argparse
import time
import warnings

import cocoex
import lapswarm
import moocore
import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.sms import SMSEMOA
from pymoo.algorithms.soo.nonconvex.de import DE
from pymoo.algorithms.soo.nonconvex.isres import ISRES
from pymoo.core.problem import Problem
from pymoo.optimize import minimize
from pymoo.problems import many, multi, single

from problems import Lircmop, bt, cf, glt, zcat

SEVERAL, ONE = 25_000, 100_000


class Coco(Problem):
    """A problem of COCO."""

    def __init__(self, problem):
        super().__init__(n_var=problem.dimension, n_obj=2, xl=problem.lower_bounds, xu=problem.upper_bounds)
        self.problem = problem
        self.title = " and ".join(f"f{int(part[6:9])}" for part in problem.name.split("__"))

    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = np.array([self.problem(row) for row in x])


def coco(instance):
    """One after the other: a suite of COCO frees a problem when it hands out the next."""
    for problem in cocoex.Suite("bbob-biobj", "", f"dimensions:10 instance_indices:{instance}"):
        yield Coco(problem)


def dascmop(number, difficulty):
    return getattr(multi, f"DASCMOP{number}")(difficulty)


FAMILIES = {
    "mw": lambda: [getattr(multi, f"MW{i}")() for i in range(1, 15)],
    "ctp": lambda: [getattr(multi, f"CTP{i}")() for i in range(1, 9)],
    "dascmop": lambda: [dascmop(i, 3) for i in range(1, 10)],
    **{f"das{d}": lambda d=d: [dascmop(i, d) for i in range(1, 10)] for d in (5, 9, 13)},
    "lircmop": lambda: [Lircmop(i) for i in range(1, 15)],
    "cf": lambda: [cf(i) for i in range(1, 11)],
    "bt": lambda: [bt(i) for i in range(1, 10)],
    "glt": lambda: [glt(i) for i in range(1, 7)],
    "zcat": lambda: [zcat(i, 1) for i in range(1, 21)],
    # All levels in turn.
    "zcat2": lambda: [zcat(i, 1 + i % 6) for i in range(1, 21)],
    "zcat3": lambda: [zcat(i, 1 + (i + 2) % 6, 3) for i in range(1, 21)],
    "dcdtlz": lambda: [getattr(many, f"DC{i}DTLZ{j}")() for i in (1, 2, 3) for j in (1, 3)],
    "g": lambda: [getattr(single, f"G{i}")() for i in (*range(1, 12), *range(13, 20), 21, 23, 24)],
    "biobj": lambda: coco(1),
}
# The members that NSGA-II and SMS-EMOA have.
MEMBERS = 100
# Population and evaluations of lapswarm where they are not its own.
SIZE = {}


def ours(problem, seed):
    equalities, inequalities = problem.n_eq_constr, problem.n_ieq_constr

    def function(x):
        f, g, h = problem.evaluate(x, return_values_of=["F", "G", "H"])
        return np.hstack([f, g[:, :inequalities], h[:, :equalities]])

    found = lapswarm.minimise(
        np.stack([problem.xl, problem.xu], axis=1).astype(float).tolist(),
        function,
        objectives=problem.n_obj,
        inequalities=inequalities,
        equalities=equalities,
        seed=seed,
        **SIZE,
    )
    return found.F if found.violation == 0 else None


def of_pymoo(make):
    def run(problem, seed):
        budget = ONE if problem.n_obj == 1 else SEVERAL
        found = minimize(problem, make(), ("n_eval", budget), seed=seed).F
        return None if found is None else np.atleast_2d(found)

    return run


PROGRAMS = {
    1: {
        "lapswarm": ours,
        "DE": of_pymoo(lambda: DE(pop_size=MEMBERS)),
        "ISRES": of_pymoo(lambda: ISRES(n_offsprings=200, rule=1.0 / 7.0, gamma=0.85, alpha=0.2)),
    },
    2: {
        "lapswarm": ours,
        "NSGA-II": of_pymoo(lambda: NSGA2(pop_size=MEMBERS)),
        "SMS-EMOA": of_pymoo(lambda: SMSEMOA(pop_size=MEMBERS)),
    },
}


def qualities(problem, found):
    """The errors or hypervolumes of each program's runs."""
    if problem.n_obj == 1:
        best = float(np.ravel(problem.pareto_front())[0])
        return {name: [np.inf if f is None else float(f[0, 0]) - best for f in runs] for name, runs in found.items()}
    rows = [f for runs in found.values() for f in runs if f is not None]
    if not rows:
        return {name: [0.0 for _ in runs] for name, runs in found.items()}
    front = np.vstack(rows)
    front = front[moocore.is_nondominated(front)]
    low, span = front.min(axis=0), np.ptp(front, axis=0)
    span[span == 0] = 1.0

    def volume(f):
        return 0.0 if f is None else float(moocore.hypervolume((f - low) / span, ref=[1.1] * len(low)))

    return {name: [volume(f) for f in runs] for name, runs in found.items()}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--families", default=",".join(FAMILIES))
    parser.add_argument("--programs", default="", help="only these, by name")
    parser.add_argument("--population", type=int, help="of lapswarm")
    parser.add_argument("--evaluations", type=int, help="of lapswarm")
    arguments = parser.parse_args()
    given = {"population": arguments.population, "evaluations": arguments.evaluations}
    SIZE.update({name: value for name, value in given.items() if value is not None})
    warnings.filterwarnings("ignore")
    for family in arguments.families.split(","):
        for problem in FAMILIES[family]():
            said, found, seconds = [], {}, {}
            for name, run in PROGRAMS[min(problem.n_obj, 2)].items():
                if arguments.programs and name not in arguments.programs.split(","):
                    continue
                began = time.process_time()
                found[name] = [run(problem, seed) for seed in range(1, arguments.seeds + 1)]
                seconds[name] = (time.process_time() - began) / arguments.seeds
            for name, values in qualities(problem, found).items():
                feasible = sum(f is not None for f in found[name])
                of = f"{feasible} of {arguments.seeds}"
                said.append(f"{name} {np.median(values):.4g} ({of}, {seconds[name]:.1f} s)")
            name = getattr(problem, "title", type(problem).__name__)
            print(f"{family} {name:9}", " | ".join(said), flush=True)


if __name__ == "__main__":
    main()
