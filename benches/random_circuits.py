"""Circuits drawn at random, in the racetrack database's format.

    python3 benches/random_circuits.py 7 14 circuits
    python3 benches/circuits.py target/release/lapswarm circuits/*.csv

A circuit is a closed curve whose distance from the middle is a Fourier series, stretched one way. Its tightest bend has a radius of 13 m or
more. It has a point every 2, 4, 5 or 8 m, and half of the surveys are off by 3 cm (standard deviation). Needs numpy.
"""

import argparse
import pathlib

import numpy as np

TIGHTEST_M = 13.0
HEADER = "x_m,y_m,w_tr_right_m,w_tr_left_m"


def curve(random):
    """Close points of a closed curve (m); nothing if it comes too near its middle or is too tight."""
    waves = random.integers(4, 11)
    radius_m = random.uniform(250, 700)
    angle = np.linspace(0, 2 * np.pi, 20000, endpoint=False)
    distance = np.ones_like(angle)
    for k in range(2, waves + 1):
        distance += random.normal(0, 0.55) / k**1.1 * np.cos(k * angle + random.uniform(0, 2 * np.pi))
    if distance.min() < 0.25:
        return None
    x = radius_m * distance * np.cos(angle) * random.uniform(0.8, 1.8)
    y = radius_m * distance * np.sin(angle)
    dx, dy = np.gradient(x), np.gradient(y)
    curvature = (dx * np.gradient(dy) - dy * np.gradient(dx)) / (dx * dx + dy * dy) ** 1.5
    return None if np.abs(curvature[5:-5]).max() > 1 / TIGHTEST_M else (x, y)


def survey(random, x, y):
    """Rows of a survey of the curve: points, widths to the right and to the left (m)."""
    x, y = np.r_[x, x[0]], np.r_[y, y[0]]
    station = np.concatenate([[0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    length = station[-1]
    at = np.linspace(0, length, int(length / random.choice([2.0, 4.0, 5.0, 8.0])), endpoint=False)
    points = [np.interp(at, station, x), np.interp(at, station, y)]
    phases = random.uniform(0, 6.28, 4)

    def width(waves, phase):
        return random.uniform(4, 7) + random.uniform(0, 1.5) * np.sin(2 * np.pi * at / length * waves + phase)

    right, left = width(3, phases[0]), width(5, phases[1])
    noise = random.choice([0, 0.03])
    points = [p + random.normal(0, noise, len(at)) for p in points]
    if random.random() < 0.5:
        points, right, left = [p[::-1] for p in points], left[::-1], right[::-1]
    return np.c_[points[0], points[1], right, left]


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("seed", type=int, help="seed of all random numbers")
    arguments.add_argument("number", type=int, help="how many circuits")
    arguments.add_argument("folder", type=pathlib.Path, help="where r0.csv, r1.csv ... are written")
    given = arguments.parse_args()
    given.folder.mkdir(exist_ok=True)
    random = np.random.default_rng(given.seed)
    made = 0
    while made < given.number:
        found = curve(random)
        if found is not None:
            path = given.folder / f"r{made}.csv"
            np.savetxt(path, survey(random, *found), fmt="%.4f", delimiter=",", header=HEADER, comments="# ")
            made += 1


if __name__ == "__main__":
    main()
