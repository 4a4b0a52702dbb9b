"""Compares `lapswarm.minimise` with pymoo's optimisers on families of problems that are not in lapswarm's suites.

    pip install ./python pymoo==0.6.2 moocore==0.3.2 coco-experiment==2.8.2
    python benches/peers/families.py --seeds 5 --families mw,g

They are constrained problems of pymoo (`das5`, `das9` and `das13` are DAS-CMOP with another difficulty than `dascmop`), LIR-CMOP
(`lircmop`), and COCO's `bbob-biobj` with ten variables (`biobj`): 55 pairs of ten functions.

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

SEVERAL, ONE = 25_000, 100_000


class Lircmop(Problem):
    """LIR-CMOP1 to 14 (Fan et al., *An improved epsilon constraint-handling method in MOEA/D for CMOPs with large infeasible
    regions*, Soft Computing 23, 2019)."""

    LIMITS = (2, 2, 3, 3, 2, 2, 3, 3, 2, 2, 2, 2, 2, 3)
    # Of the ellipses within which nothing is feasible: where they lie, and their axes.
    ELLIPSES = {
        5: ((1.6, 1.6, 2, 4), (2.5, 2.5, 2, 8)),
        6: ((1.8, 1.8, 2, 8), (2.8, 2.8, 2, 8)),
        7: ((1.2, 1.2, 2, 6), (2.25, 2.25, 2.5, 12), (3.5, 3.5, 2.5, 10)),
        9: ((1.4, 1.4, 1.5, 6),),
        10: ((1.1, 1.2, 2, 4),),
        11: ((1.2, 1.2, 1.5, 5),),
        12: ((1.6, 1.6, 1.5, 6),),
    }
    ELLIPSES[8] = ELLIPSES[7]
    WAVES = {9: 2.0, 10: 1.0, 11: 2.1, 12: 2.5}

    def __init__(self, number):
        self.number, self.title = number, f"LIRCMOP{number}"
        objectives = 3 if number >= 13 else 2
        super().__init__(n_var=30, n_obj=objectives, n_ieq_constr=self.LIMITS[number - 1], xl=0.0, xu=1.0)

    def _evaluate(self, x, out, *args, **kwargs):
        f, limits = self.spheres(x) if self.number >= 13 else self.curves(x)
        # They are wanted at zero and above.
        out["F"], out["G"] = np.stack(f, axis=1), -np.stack(limits, axis=1)

    def spheres(self, x):
        radius = 1.7057 + 10 * ((x[:, 2:] - 0.5) ** 2).sum(axis=1)
        a, b = x[:, 0] * np.pi / 2, x[:, 1] * np.pi / 2
        f = [radius * np.cos(a) * np.cos(b), radius * np.cos(a) * np.sin(b), radius * np.sin(a)]
        shells = ((3, 2), (1.9, 1.8), (1.75, 1.6))[: self.n_ieq_constr]
        return f, [(radius**2 - one**2) * (radius**2 - other**2) for one, other in shells]

    def curves(self, x):
        number, first = self.number, x[:, 0]
        j = np.arange(2, 31)
        phase = 0.5 * np.pi * x[:, :1] * (1 if number <= 4 else j / 30)
        odd = ((x[:, 1:] - np.sin(phase)) ** 2)[:, j % 2 == 1].sum(axis=1)
        even = ((x[:, 1:] - np.cos(phase)) ** 2)[:, j % 2 == 0].sum(axis=1)
        other = 1 - np.sqrt(first) if number in (2, 4, 5, 7, 10, 11) else 1 - first**2
        if number <= 4:
            limits = [(0.51 - odd) * (odd - 0.5), (0.51 - even) * (even - 0.5), np.sin(20 * np.pi * first) - 0.5]
            return [first + odd, other + even], limits[: self.n_ieq_constr]
        if number <= 8:
            f = [first + 10 * odd + 0.7057, other + 10 * even + 0.7057]
        else:
            f = [1.7057 * first * (10 * odd + 1), 1.7057 * other * (10 * even + 1)]
        limits = [self.outside(f, *ellipse) for ellipse in self.ELLIPSES[number]]
        if number in self.WAVES:
            along, across = (f[0] + f[1]) * np.sqrt(0.5), (f[0] - f[1]) * np.sqrt(0.5)
            limits.append(along - np.sin(4 * np.pi * across) - self.WAVES[number])
        return f, limits

    @staticmethod
    def outside(f, p, q, a, b):
        """Of an ellipse with its first axis along the diagonal."""
        u, v = (f[0] - p + f[1] - q) * np.sqrt(0.5), (f[1] - q - f[0] + p) * np.sqrt(0.5)
        return (u / a) ** 2 + (v / b) ** 2 - 0.1


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
    "dcdtlz": lambda: [getattr(many, f"DC{i}DTLZ{j}")() for i in (1, 2, 3) for j in (1, 3)],
    "g": lambda: [getattr(single, f"G{i}")() for i in (*range(1, 12), *range(13, 20), 21, 23, 24)],
    "biobj": lambda: coco(1),
}
# The members that NSGA-II and SMS-EMOA have.
MEMBERS = 100


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
    arguments = parser.parse_args()
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
