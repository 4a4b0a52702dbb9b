"""What a call of ``evaluate`` from Python costs beside the work itself.

Each call is timed from Python, and ``Evaluation.elapsed_s`` is the time that the same call took in Rust: from the candidates in
memory to their objectives. The difference is the way there and back. Prints the median over all calls with its quartiles.
"""

from __future__ import annotations

import argparse
import os
import platform
import time

import lapswarm
import numpy as np


def machine() -> str:
    """The processor's name and how many of its cores are at hand."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            name = next(line.split(":")[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        name = platform.processor()
    return f"{name}, {os.cpu_count()} cores, Python {platform.python_version()}, numpy {np.__version__}"


def problems() -> dict[str, lapswarm.Problem]:
    """A log that is driven, a lap's line, and steady cornering: from long work to short."""
    return {
        "replay, 22 parameters": lapswarm.ReplayProblem("gt", section="Abbey"),
        "line, 600 sections": lapswarm.LineProblem("silverstone_gp", sections=600, objectives=["lap_time"]),
        "steady, 3 variables": lapswarm.SteadyProblem("gt", free={"mass_kg": (1000.0, 1400.0)}),
    }


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--backend", default="simd")
    asked.add_argument("--candidates", type=int, default=1024)
    asked.add_argument("--calls", type=int, default=60)
    told = asked.parse_args()
    print(f"lapswarm {lapswarm.__version__} on {told.backend}; {machine()}; {told.candidates} candidates, {told.calls} calls")
    print("| Problem | evaluate in Rust (ms) | on top (us) | on top (%) |\n|---|---|---|---|")
    for name, problem in problems().items():
        evaluator = lapswarm.Evaluator(problem, told.backend)
        lower, upper = problem.bounds.T
        random = np.random.default_rng(1)
        rows = lower + random.uniform(0.3, 0.7, (told.candidates, len(lower))) * (upper - lower)
        evaluator.evaluate(rows)
        inside, on_top = np.empty(told.calls), np.empty(told.calls)
        for k in range(told.calls):
            began = time.perf_counter()
            found = evaluator.evaluate(rows)
            inside[k] = found.elapsed_s
            on_top[k] = time.perf_counter() - began - found.elapsed_s
        low, middle, high = np.percentile(on_top, [25, 50, 75])
        percent = 100.0 * np.median(on_top / inside)
        print(f"| {name} | {1e3 * np.median(inside):.2f} | {1e6 * middle:.0f} ({1e6 * low:.0f} to {1e6 * high:.0f}) | {percent:.2f} |")


if __name__ == "__main__":
    main()
