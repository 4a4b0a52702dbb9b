"""Families of problems that pymoo lacks, by their published formulas: candidates in rows, objectives to be minimised, limits that hold
at zero and below."""

import numpy as np
from pymoo.core.problem import Problem

pi, sin, cos = np.pi, np.sin, np.cos


class Formula(Problem):
    """A problem of one function from candidates to lists of objectives and limits, each a column."""

    def __init__(self, title, function, low, high, objectives=2, limits=0):
        self.title, self.function = title, function
        super().__init__(n_var=len(low), n_obj=objectives, n_ieq_constr=limits, xl=low, xu=high)

    def _evaluate(self, x, out, *args, **kwargs):
        objectives, limits = self.function(x)
        out["F"] = np.stack(objectives, axis=1)
        if limits:
            out["G"] = np.stack(limits, axis=1)


def box(variables, low, high, first=1):
    """Bounds, of which the `first` few are 0 and 1."""
    lows, highs = np.full(variables, float(low)), np.full(variables, float(high))
    lows[:first], highs[:first] = 0.0, 1.0
    return lows, highs


# ZCAT (Zapotecas-Martinez, Coello, Aguirre, Tanaka, *Challenging test problems for multi- and many-objective optimization*, Swarm and
# Evolutionary Computation 81, 2023): shapes of the front, shapes of the Pareto set, and distances from it.


def angular(one, last):
    """Objectives but the last: products of `one`, and `last` of the coordinate after them."""

    def products(y, count):
        rows = [np.prod([one(y[i]) for i in range(count - j)], axis=0) for j in range(count)]
        return [rows[0]] + [row * last(y[count - j]) for j, row in enumerate(rows) if j > 0]

    return products


def averaged(one, last):
    """As [`angular`], with means."""

    def means(y, count):
        rows = [[one(y[i]) for i in range(count - j)] + ([last(y[count - j])] if j > 0 else []) for j in range(count)]
        return [np.mean(row, axis=0) for row in rows]

    return means


def flipped(rows):
    return lambda y, count: [1 - row for row in rows(y, count)]


def powers(first, later, wave):
    """Of the first coordinate alone; with three objectives and more the last but one is a wave."""

    def rows(y, count):
        s = sin(y[0] * pi / 2)
        found = [s**first] + [s ** (later + j / (count - 1)) for j in range(1, count - 1)]
        return found + ([0.5 * (1 + sin(wave * y[0] * pi / 2 - pi / 2))] if count > 1 else [])

    return rows


def wavy(k):
    return lambda y: (cos((2 * k - 1) * y * pi) + 2 * y + 4 * k * (1 - y) - 1) / (4 * k)


def degenerate(within, curve):
    """Where `within` holds, only the first coordinate counts."""

    def rows(y, count):
        inside = within(np.array(y[:count]))
        flat = [np.where(inside, y[0], y[j]) for j in range(count)]
        return flat + [curve(flat)]

    return rows


def between(y, low, high):
    return (y >= low) & (y <= high)


def exponential(y):
    return (np.exp(8 * (1 - np.mean(y, axis=0))) - 1) / (np.exp(8) - 1)


def fifth(y):
    return np.mean((0.5 - np.array(y)) ** 5, axis=0) / (2 * 0.5**5) + 0.5


def steep(y):
    k, r, mean = 40.0, 0.05, np.mean(y, axis=0)
    step = 1 / (1 + np.exp(2 * k * mean - k)) - r * mean - 1 / (1 + np.exp(k)) + r
    return step / (1 / (1 + np.exp(-k)) - 1 / (1 + np.exp(k)) + r)


def knee(y):
    r = 0.02
    return (1 / r - 1 / (1 - np.mean(y, axis=0) + r)) / (1 / r - 1 / (1 + r))


def ripple(y):
    mean = np.mean(y, axis=0)
    return 1 - mean - cos(10 * pi * mean + pi / 2) / (10 * pi)


def quarter(function):
    return lambda y: function(y * pi / 2)


def ended(rows, last):
    """These objectives, and a last one of the first coordinate."""
    return lambda y, count: rows(y, count) + [last(y[0])]


def themselves(last):
    """The coordinates, and a last objective of all of them."""
    return lambda y, count: y[:count] + [last(y[:count])]


SIN, COS = quarter(sin), quarter(cos)
LINEAR = averaged(lambda y: y, lambda y: 1 - y)
SINES = averaged(SIN, COS)
# All objectives, of the coordinates of the front and their number.
ZCAT_FRONTS = [
    ended(angular(SIN, COS), lambda y: 1 - SIN(y)),
    ended(angular(lambda y: 1 - COS(y), lambda y: 1 - SIN(y)), lambda y: 1 - SIN(y)),
    ended(LINEAR, lambda y: 1 - y),
    themselves(lambda y: 1 - np.mean(y, axis=0)),
    themselves(exponential),
    themselves(steep),
    themselves(fifth),
    ended(flipped(angular(lambda y: 1 - SIN(y), lambda y: 1 - COS(y))), COS),
    ended(SINES, COS),
    themselves(knee),
    ended(LINEAR, wavy(4)),
    ended(flipped(angular(lambda y: 1 - y, lambda y: y)), wavy(3)),
    ended(flipped(SINES), lambda y: 1 - wavy(3)(y)),
    ended(powers(2, 2, 6), COS),
    ended(lambda y, count: [y[0] ** (1 + j / (4 * (count + 1))) for j in range(count)], wavy(3)),
    ended(powers(1, 1, 10), wavy(5)),
    degenerate(lambda y: between(y, 0, 0.5).all(axis=0), exponential),
    degenerate(lambda y: between(y, 0, 0.4).all(axis=0) | between(y, 0.6, 1).all(axis=0), fifth),
    degenerate(lambda y: between(y[0], 0, 0.2) | between(y[0], 0.4, 0.6), ripple),
    degenerate(lambda y: between(y[0], 0.1, 0.4) | between(y[0], 0.6, 0.9), fifth),
]


def cube(x):
    return x**3


# Of the coordinates of the front (in the last axis) and an angle of each other one.
ZCAT_SETS = {
    1: lambda y, t: np.mean(sin(1.5 * pi * y + t), axis=2) / 2 + 0.5,
    2: lambda y, t: np.mean(y**2 * sin(4.5 * pi * y + t), axis=2) / 2 + 0.5,
    3: lambda y, t: np.mean(cos(pi * y + t) ** 2, axis=2),
    4: lambda y, t: y.mean(axis=2) / 2 * cos(4 * pi * y.mean(axis=2) + t[..., 0]) + 0.5,
    5: lambda y, t: np.mean(cube(sin(2 * pi * y - 1 + t)), axis=2) / 2 + 0.5,
    6: lambda y, t: (
        -10 * np.exp(-0.4 * np.sqrt(np.mean(y**2, axis=2))) - np.exp(np.mean(cube(cos(11 * pi * y + t)), axis=2)) + 10 + np.e
    )
    / (-10 * np.exp(-0.4) - 1 / np.e + 10 + np.e),
    7: lambda y, t: (y.mean(axis=2) + np.exp(sin(7 * pi * y.mean(axis=2) - pi / 2 + t[..., 0])) - 1 / np.e) / (1 + np.e - 1 / np.e),
    8: lambda y, t: np.mean(abs(sin(2.5 * pi * (y - 0.5) + t)), axis=2),
    9: lambda y, t: y.mean(axis=2) / 2 - np.mean(abs(sin(2.5 * pi * y - pi / 2 + t)), axis=2) / 2 + 0.5,
    10: lambda y, t: cube(np.mean(sin((4 * y - 2) * pi + t), axis=2)) / 2 + 0.5,
}
# Which of them each problem has.
ZCAT_SET = (4, 5, 2, 7, 9, 4, 5, 2, 7, 9, 3, 10, 1, 6, 8, 10, 1, 8, 6, 3)


def zcat_distance(level, z):
    if level == 1:
        return 10 * np.mean(z**2, axis=1)
    if level == 2:
        return 10 * abs(z).max(axis=1)
    if level == 3:
        return 10 * np.mean((z**2 - cos(9 * pi * z) + 1) / 3, axis=1)
    if level == 4:
        waves = np.exp(np.mean(0.5 * (cos(9 * pi * z) + 1), axis=1))
        return 10 / (2 * np.e - 2) * (np.exp(np.sqrt(abs(z).max(axis=1))) - waves - 1 + np.e)
    if level == 5:
        return -0.7 * zcat_distance(3, z) + 10 * np.mean(abs(z) ** 0.002, axis=1)
    return -0.7 * zcat_distance(4, z) + 10 * np.mean(abs(z), axis=1) ** 0.002


def zcat(number, level, objectives=2):
    """ZCAT1 to 20 at a level of difficulty from 1 to 6, with ten variables for an objective and the complicated Pareto set."""
    variables = 10 * objectives
    half = 0.5 * np.arange(1, variables + 1)
    along = 1 if number in (14, 15, 16) else objectives - 1
    angle = 2 * pi * np.arange(variables - along) / (variables - along)

    def function(x):
        y = (x + half) / (2 * half)
        front = ZCAT_FRONTS[number - 1](list(y.T), objectives - 1)
        z = y[:, along:] - ZCAT_SETS[ZCAT_SET[number - 1]](y[:, None, :along], angle[None, :, None])
        z[abs(z) < np.finfo(float).eps] = 0.0
        distances = [zcat_distance(level, z[:, i::objectives]) for i in range(objectives)]
        return [(i + 1) ** 2 * (f + distance) for i, (f, distance) in enumerate(zip(front, distances))], []

    name = f"ZCAT{number} of level {level}" + (f", {objectives} objectives" if objectives > 2 else "")
    return Formula(name, function, -half, half, objectives)


def bt(number):
    """BT1 to 9 (Li, Zhang, Deng, *Biased multiobjective optimization and decomposition algorithm*, IEEE Transactions on Cybernetics 47,
    2017), thirty variables, as PlatEMO has them."""
    j = np.arange(1, 31)
    scale = {1: 1e-10, 3: 1e-8, 4: 1e-8, 5: 1e-10, 6: 1e-4, 7: 1e-3, 8: 1e-3, 9: 1e-9}.get(number)

    def biased(y):
        return y**2 + (abs(y) ** 0.2 if number == 2 else 1 - np.exp(-(y**2) / scale)) / 5

    def spread(a, power):
        """Towards the quarters."""
        quarter = np.clip(np.floor(4 * a), 0, 3)
        up, part = quarter % 2 == 1, 4 * a - quarter
        return (quarter + np.where(up, part**power, 1 - (1 - part) ** power)) / 4

    def function(x):
        a = x[:, :1]
        if number in (6, 8):
            y = x - a ** (0.5 + 1.5 * (j - 1) / 29)
        elif number == 7:
            y = x - sin(6 * pi * a)
        else:
            y = x - sin(j * pi / 60)
        d = biased(y)
        if number == 8:
            d = 4 * d**2 - cos(8 * pi * d) + 1
        a = x[:, 0]
        if number == 9:
            b, sums = x[:, 1], [d[:, (j > 2) & (j % 3 == r)].sum(axis=1) for r in (0, 1, 2)]
            f = [cos(a * pi / 2) * cos(b * pi / 2), cos(a * pi / 2) * sin(b * pi / 2), sin(a * pi / 2)]
            return [f + s for f, s in zip(f, sums)], []
        even, odd = (d[:, (j > 1) & (j % 2 == r)].sum(axis=1) for r in (0, 1))
        a = a**0.02 if number == 3 else spread(a, 0.06) if number == 4 else a
        other = (1 - a) * (1 - a * sin(8.5 * pi * a)) if number == 5 else 1 - np.sqrt(a)
        return [a + even, other + odd], []

    return Formula(f"BT{number}", function, *box(30, -1 if number == 7 else 0, 1), 3 if number == 9 else 2)


def cf(number):
    """CF1 to 10 (Zhang et al., *Multiobjective optimization test instances for the CEC 2009 special session and competition*, Report
    CES-487, 2009), ten variables."""
    j = np.arange(1, 11)
    odd, even = (j > 1) & (j % 2 == 1), j % 2 == 0

    def mean(rows, which):
        return 2 * rows[:, which].mean(axis=1)

    def soft(t):
        return -t / (1 + np.exp(4 * abs(t)))

    def signed_root(t):
        return np.sign(t) * np.sqrt(abs(t))

    def valley(t):
        return np.where(t < 1.5 * (1 - np.sqrt(0.5)), abs(t), 0.125 + (t - 1) ** 2)

    def function(x):
        a, turn = x[:, 0], 6 * pi * x[:, :1] + j * pi / 10
        if number >= 8:
            return spheres(x)
        if number == 1:
            y = (x - x[:, :1] ** (0.5 * (1 + 3 * (j - 2) / 8))) ** 2
            f = [a + mean(y, odd), 1 - a + mean(y, even)]
            return f, [1 + abs(sin(10 * pi * (f[0] - f[1] + 1))) - f[0] - f[1]]
        if number == 2:
            f = [a + mean((x - sin(turn)) ** 2, odd), 1 - np.sqrt(a) + mean((x - cos(turn)) ** 2, even)]
            root = np.sqrt(f[0])
            return f, [soft(f[1] + root - sin(2 * pi * (root - f[1] + 1)) - 1)]
        if number == 3:
            y = x - sin(turn)

            def waves(which):
                product = cos(20 * y * pi / np.sqrt(j))[:, which].prod(axis=1)
                return 2 / which.sum() * (4 * (y[:, which] ** 2).sum(axis=1) - 2 * product + 2)

            f = [a + waves(odd), 1 - a**2 + waves(even)]
            return f, [1 + sin(2 * pi * (f[0] ** 2 - f[1] + 1)) - f[1] - f[0] ** 2]
        height = 0.8 * x[:, :1] if number in (5, 6) else 1.0
        y = x - height * np.where(odd & (number != 4), cos(turn), sin(turn))
        h = y**2 if number in (4, 6) else 2 * y**2 - cos(4 * pi * y) + 1
        if number in (4, 5):
            h[:, 1] = valley(y[:, 1])
            t = y[:, 1] - 0.5 * a + 0.25
            return [a + h[:, odd].sum(axis=1), 1 - a + h[:, even].sum(axis=1)], [soft(t) if number == 4 else -t]
        if number == 7:
            h[:, [1, 3]] = y[:, [1, 3]] ** 2
        limits = (1, 0.5 * (1 - a) - (1 - a) ** 2), (3, 0.25 * np.sqrt(1 - a) - 0.5 * (1 - a))
        f = [a + h[:, odd].sum(axis=1), (1 - a) ** 2 + h[:, even].sum(axis=1)]
        return f, [signed_root(t) - y[:, k] for k, t in limits]

    def spheres(x):
        a, b = x[:, 0] * pi / 2, x[:, 1] * pi / 2
        y = x - 2 * x[:, 1:2] * sin(2 * pi * x[:, :1] + j * pi / 10)
        h = 4 * y**2 - cos(8 * pi * y) + 1 if number == 10 else y**2
        f = [cos(a) * cos(b), cos(a) * sin(b), sin(a)]
        f = [row + mean(h, (j > 2) & (j % 3 == r)) for row, r in zip(f, (1, 2, 0))]
        rest = 1 - f[2] ** 2
        rest = np.where(abs(rest) < 1e-12, 1e-12, rest)
        wave = sin(2 * pi * ((f[0] ** 2 - f[1] ** 2) / rest + 1))
        wave = 4 * abs(wave) if number == 8 else 3 * wave if number == 9 else wave
        return f, [1 + wave - (f[0] ** 2 + f[1] ** 2) / rest]

    wide = 1 if number <= 2 else 4 if number == 8 else 2
    bounds = box(10, 0 if number == 1 else -wide, wide, 2 if number >= 8 else 1)
    return Formula(f"CF{number}", function, *bounds, 3 if number >= 8 else 2, 2 if number in (6, 7) else 1)


def glt(number):
    """GLT1 to 6 (Gu, Liu, Tan, *A multiobjective evolutionary algorithm using dynamic weight design method*, International Journal of
    Innovative Computing, Information and Control 8, 2012), ten variables, as jMetal has them but for two things: phases count from one,
    and GLT3's kink is where the first objective is 0.05."""
    i = np.arange(1, 11)
    along = 2 if number >= 5 else 1

    def function(x):
        a, b = x[:, 0], x[:, 1]
        distance = 1 + ((x - sin(2 * pi * x[:, :1] + i * pi / 10)) ** 2)[:, along:].sum(axis=1)
        if number == 1:
            f = [a, 2 - a - np.sign(cos(2 * pi * a))]
        elif number == 2:
            f = [1 - COS(a), 10 - 10 * SIN(a)]
        elif number == 3:
            f = [a, np.where(distance * a <= 0.05, 1 - 19 * a, (1 - a) / 19)]
        elif number == 4:
            f = [a, 2 - 2 * np.sqrt(a) * cos(2 * np.sqrt(a) * pi) ** 2]
        else:
            last = 1 - SIN(a) if number == 5 else 2 - SIN(a) - np.sign(cos(4 * pi * a))
            f = [(1 - COS(a)) * (1 - COS(b)), (1 - COS(a)) * (1 - SIN(b)), last]
        return [distance * row for row in f], []

    return Formula(f"GLT{number}", function, *box(10, -1, 1, along), 3 if number >= 5 else 2)


class Lircmop(Formula):
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
        self.number, self.limits = number, self.LIMITS[number - 1]
        function = self.spheres if number >= 13 else self.curves
        super().__init__(f"LIRCMOP{number}", function, *box(30, 0, 1), 3 if number >= 13 else 2, self.limits)

    def spheres(self, x):
        radius = 1.7057 + 10 * ((x[:, 2:] - 0.5) ** 2).sum(axis=1)
        a, b = x[:, 0] * np.pi / 2, x[:, 1] * np.pi / 2
        f = [radius * np.cos(a) * np.cos(b), radius * np.cos(a) * np.sin(b), radius * np.sin(a)]
        shells = ((3, 2), (1.9, 1.8), (1.75, 1.6))[: self.limits]
        return f, [-(radius**2 - one**2) * (radius**2 - other**2) for one, other in shells]

    def curves(self, x):
        number, first = self.number, x[:, 0]
        j = np.arange(2, 31)
        phase = 0.5 * np.pi * x[:, :1] * (1 if number <= 4 else j / 30)
        odd = ((x[:, 1:] - np.sin(phase)) ** 2)[:, j % 2 == 1].sum(axis=1)
        even = ((x[:, 1:] - np.cos(phase)) ** 2)[:, j % 2 == 0].sum(axis=1)
        other = 1 - np.sqrt(first) if number in (2, 4, 5, 7, 10, 11) else 1 - first**2
        if number <= 4:
            limits = [-(0.51 - odd) * (odd - 0.5), -(0.51 - even) * (even - 0.5), 0.5 - np.sin(20 * np.pi * first)]
            return [first + odd, other + even], limits[: self.limits]
        if number <= 8:
            f = [first + 10 * odd + 0.7057, other + 10 * even + 0.7057]
        else:
            f = [1.7057 * first * (10 * odd + 1), 1.7057 * other * (10 * even + 1)]
        limits = [self.within(f, *ellipse) for ellipse in self.ELLIPSES[number]]
        if number in self.WAVES:
            along, across = (f[0] + f[1]) * np.sqrt(0.5), (f[0] - f[1]) * np.sqrt(0.5)
            limits.append(-(along - np.sin(4 * np.pi * across) - self.WAVES[number]))
        return f, limits

    @staticmethod
    def within(f, p, q, a, b):
        """Of an ellipse with its first axis along the diagonal."""
        u, v = (f[0] - p + f[1] - q) * np.sqrt(0.5), (f[1] - q - f[0] + p) * np.sqrt(0.5)
        return -((u / a) ** 2 + (v / b) ** 2 - 0.1)
