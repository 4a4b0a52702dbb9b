"""The suites of test problems from published packages, for reference points and for the peers' runs.

A problem scores a batch: rows of variables in, rows of objectives and of constraints (`G <= 0`) out.
"""

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import Callable

import numpy as np
import pygmo
from jmetal.problem.multiobjective import re as jmetal_re
from opfunu.utils import operator as opfunu
from pymoo.problems.many import cdtlz, dtlz, wfg
from pymoo.problems.multi import bnh, osy, tnk, welded_beam, zdt

SCALES = Path(__file__).with_name("scales.csv")


@dataclass
class Problem:
    """A problem as the harness sees it."""

    suite: str
    name: str
    lower: np.ndarray
    upper: np.ndarray
    objectives: int
    constraints: int
    evaluate: Callable
    source: str


def scales():
    """The ideal and the nadir point of every problem of several objectives, by its name."""
    found = {}
    with open(SCALES) as file:
        for row in csv.reader(line for line in file if not line.startswith("#")):
            figures = [float(x) for x in row[1:] if x]
            half = len(figures) // 2
            found[row[0]] = (np.array(figures[:half]), np.array(figures[half:]))
    return found


def of_pymoo(suite, name, problem):
    def evaluate(rows):
        found = problem.evaluate(np.array(rows, float), return_as_dictionary=True)
        return found["F"], found["G"] if problem.n_ieq_constr else np.zeros((len(rows), 0))

    bounds = [np.broadcast_to(np.asarray(b, float), (problem.n_var,)).copy() for b in (problem.xl, problem.xu)]
    return Problem(suite, name, *bounds, problem.n_obj, problem.n_ieq_constr, evaluate, "pymoo")


def by_row(suite, name, lower, upper, objectives, function, source):
    """A problem without constraints that scores one row at a time."""

    def evaluate(rows):
        return np.array([function(row) for row in rows]), np.zeros((len(rows), 0))

    return Problem(suite, name, np.array(lower, float), np.array(upper, float), objectives, 0, evaluate, source)


class Solution:
    """What jmetalpy's problems read and write."""

    def __init__(self, variables, objectives):
        self.variables, self.objectives = variables, [0.0] * objectives


def of_tanabe(number):
    """RE21 and so on from jmetalpy. Two differ from the suite's definition, and are led back to it."""
    problem = getattr(jmetal_re, f"RE{number}")()
    count = problem.number_of_objectives()

    def function(row):
        row = [float(x) for x in row]
        if number == 23:
            # The suite counts the thickness in sixteenths of an inch, jmetalpy measures it in inches.
            row[:2] = [0.0625 * x for x in row[:2]]
        solution = Solution(row, count)
        problem.evaluate(solution)
        found = list(solution.objectives)
        if number == 33:
            # The suite's pressure has 3.14 for pi.
            ring = row[2] / (row[1] ** 2 - row[0] ** 2)
            found[2] += max(0.0, ring / 3.14 - 0.4) - max(0.0, ring / np.pi - 0.4)
        return found

    return by_row("engineering", f"re{number}", problem.lower_bound, problem.upper_bound, count, function, "jmetalpy")


def of_cec2009(number):
    problem = pygmo.problem(pygmo.cec2009(number, False, 30))
    return by_row("uf", f"uf{number}", *problem.get_bounds(), problem.get_nobj(), problem.fitness, "pygmo")


# The counter-based random numbers that shifts and rotations come from: Philox 4x32-10 (Salmon et al., 2011).


def philox(counter, key):
    counter, key = list(counter), list(key)
    for _ in range(10):
        first, second = 0xD2511F53 * counter[0], 0xCD9E8D57 * counter[2]
        counter = [
            (second >> 32) ^ counter[1] ^ key[0],
            second & 0xFFFFFFFF,
            (first >> 32) ^ counter[3] ^ key[1],
            first & 0xFFFFFFFF,
        ]
        key = [(key[0] + 0x9E3779B9) & 0xFFFFFFFF, (key[1] + 0xBB67AE85) & 0xFFFFFFFF]
    return counter


def uniform(seed, purpose, when, who, index):
    return (philox([index // 4, who, when, purpose], [seed, 0])[index % 4] >> 8) * 2.0**-24


def normal(seed, purpose, when, who, index):
    words = philox([index // 2, who, when, purpose], [seed, 0])
    first, second = words[:2] if index % 2 == 0 else words[2:]
    radius = np.sqrt(-2.0 * np.log(1.0 - first * 2.0**-32))
    return radius * np.cos(2.0 * np.pi * (second >> 8) * 2.0**-24)


SEED = 2014
SIZE = 30


def shifted(name, bound):
    """Problems whose optimum is only shifted."""
    centre = np.array([0.8 * bound * (2.0 * uniform(2005, 0, 0, 0, k) - 1.0) for k in range(SIZE)])
    function, _, optimum = CORES[name]
    bounds = [-bound] * SIZE, [bound] * SIZE
    return by_row("shifted", name, *bounds, 1, lambda row: [function(row - centre + optimum)], "opfunu")


def shift(number, part):
    return np.array([80.0 * (2.0 * uniform(SEED, 0, number, part, k) - 1.0) for k in range(SIZE)])


def rotation(number, part):
    """Rows of normal deviates, each freed from those before it and scaled to one."""
    rows = []
    for i in range(SIZE):
        row = np.array([normal(SEED, 1 + part, number, i, k) for k in range(SIZE)])
        for other in rows:
            row = row - (row @ other) * other
        rows.append(row / np.sqrt(row @ row))
    return np.array(rows)


# What is in the middle of each rotated problem: a function of opfunu, what coordinates are scaled by, and where its optimum lies.
SCHWEFEL = 4.209687462275036e2
CORES = {
    "sphere": (opfunu.sphere_func, 1.0, 0.0),
    "bent_cigar": (opfunu.bent_cigar_func, 1.0, 0.0),
    "rosenbrock": (opfunu.rosenbrock_func, 0.02048, 1.0),
    "rastrigin": (opfunu.rastrigin_func, 0.0512, 0.0),
    "schwefel": (opfunu.modified_schwefel_func, 10.0, 0.0),
    "ackley": (opfunu.ackley_func, 1.0, 0.0),
    "griewank": (opfunu.griewank_func, 6.0, 0.0),
    "levy": (opfunu.levy_func, 0.0512, 1.0),
}


def core(name, y):
    function, scale, optimum = CORES[name]
    return function(scale * y + optimum)


def hybrid(y):
    return core("bent_cigar", y[:6]) + core("rosenbrock", y[6:18]) + core("rastrigin", y[18:])


# Parts of the composition: function, height, width and level.
COMPOSITION = [("rosenbrock", 1.0, 10.0, 0.0), ("bent_cigar", 1e-6, 20.0, 100.0), ("rastrigin", 1.0, 30.0, 200.0)]


def composition(number):
    places = [(shift(number, part), rotation(number, part)) for part in range(len(COMPOSITION))]

    def function(row):
        total, weights = 0.0, 0.0
        for (name, height, width, level), (centre, turn) in zip(COMPOSITION, places):
            away = row - centre
            square = away @ away
            if square == 0.0:
                return [level]
            weight = np.exp(-square / (2.0 * SIZE * width**2)) / np.sqrt(square)
            total += weight * (height * core(name, turn @ away) + level)
            weights += weight
        return [total / weights]

    return function


def rotated(number, name):
    if name == "composition":
        function = composition(number)
    else:
        centre, turn = shift(number, 0), rotation(number, 0)
        inner = hybrid if name == "hybrid" else lambda y: core(name, y)

        def function(row):
            return [inner(turn @ (row - centre))]

    bounds = [-100.0] * SIZE, [100.0] * SIZE
    return by_row("rotated", f"rotated_{name}", *bounds, 1, function, "opfunu")


def problems():
    """All problems, in the order of the suites."""
    found = [of_pymoo("zdt", f"zdt{k}", getattr(zdt, f"ZDT{k}")()) for k in (1, 2, 3, 4, 6)]
    for k in range(1, 8):
        size = {1: 7, 7: 22}.get(k, 12)
        found.append(of_pymoo("dtlz", f"dtlz{k}", getattr(dtlz, f"DTLZ{k}")(n_var=size, n_obj=3)))
    for count in (2, 3):
        for k in range(1, 10):
            problem = getattr(wfg, f"WFG{k}")(n_var=24, n_obj=count, k=4)
            found.append(of_pymoo(f"wfg{count}", f"wfg{k}_{count}", problem))
    found += [of_cec2009(k) for k in range(1, 11)]
    constrained = [
        ("bnh", bnh.BNH()),
        ("osy", osy.OSY()),
        ("tnk", tnk.TNK()),
        ("welded_beam", welded_beam.WeldedBeam()),
        ("c1_dtlz1", cdtlz.C1DTLZ1(n_var=7, n_obj=3)),
        ("c2_dtlz2", cdtlz.C2DTLZ2(n_var=12, n_obj=3)),
        ("c3_dtlz4", cdtlz.C3DTLZ4(n_var=7, n_obj=3)),
    ]
    found += [of_pymoo("constrained", name, problem) for name, problem in constrained]
    found += [of_tanabe(k) for k in (21, 22, 23, 24, 25, 31, 32, 33, 34, 35, 36, 37)]
    found += [rotated(i, name) for i, name in enumerate([*CORES, "hybrid", "composition"])]
    bounds = [("sphere", 100.0), ("rosenbrock", 30.0), ("rastrigin", 5.12), ("ackley", 32.0), ("griewank", 600.0)]
    return found + [shifted(name, bound) for name, bound in bounds]
