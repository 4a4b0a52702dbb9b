"""What Ray adds to a row of a sweep, a migration between islands and a portion of a population, on this machine.

Prints bytes and milliseconds, and from them how large a row, an epoch or a generation must be for an efficiency of 90 % on so
many nodes. The book's chapter on Ray has the model.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median

import lapswarm
import lapswarm.ray
import numpy as np
import ray
from lapswarm._settings import as_text
from lapswarm.ray._inputs import Recipe
from lapswarm.ray._migration import accepted
from lapswarm.ray._pool import Job, Pool
from lapswarm.ray._store import write_whole
from lapswarm.ray._sweep import _row, _text

TIMES = 9
NODES = (10, 100, 1_000, 10_000)


def milliseconds(work: Callable[[], object]) -> float:
    """The median over several calls, the first of which does not count."""
    work()
    took = []
    for _ in range(TIMES):
        began = time.perf_counter()
        work()
        took.append(time.perf_counter() - began)
    return 1e3 * median(took)


def per_call(pool: Pool, method: str, arguments: tuple[object, ...], count: int) -> float:
    """Time of the driver for each of many calls, the work itself being next to nothing (ms)."""

    def all_calls() -> None:
        left = iter(range(count))

        def job(_: object) -> Job | None:
            place = next(left, None)
            return None if place is None else Job(method, arguments, place)

        pool.run(job, lambda job, answer: None)

    return milliseconds(all_calls) / count


def main() -> None:
    ray.init(num_cpus=1, include_dashboard=False, logging_level="error")
    variables = 22
    problem = lapswarm.OwnProblem([(0.0, 1.0)] * variables, 2)

    def function(x: np.ndarray) -> np.ndarray:
        return x[:, :2]

    pool = Pool(problem, function, "auto", 1, 0, 0)
    X = np.zeros((1024, variables))
    portion_ms = per_call(pool, "evaluate", (X,), 32)
    portion_bytes = X.nbytes + len(pickle.dumps(function(X)))
    swarm = lapswarm.Optimiser(problem, "default", population=100, iterations=100)
    for _ in range(50):
        swarm.tell(function(swarm.ask()))
    state = swarm.to_bytes()
    migration_ms = milliseconds(lambda: accepted(state, state, 2))
    epoch_ms = per_call(pool, "epoch", (state, [state], 2, 0), 16) - migration_ms
    with tempfile.TemporaryDirectory() as folder:
        keep_ms = milliseconds(partial(write_whole, Path(folder) / "state", state))
    pool.close()

    free = {"mass_kg": (1150.0, 1350.0)}
    small = {"free": free, "window_s": 1.5, "settle_s": 0.5, "polish": False, "backend": "simd"}
    settings = as_text("identify", small | {"population": 8, "iterations": 1, "hops": 0})
    text = _text("identify", settings, {"seed": ["1"]})
    found = _row(text, {}, lapswarm.__version__, 1)
    row_bytes = len(text) + sum(map(len, found.values()))
    task = ray.remote(lambda *_: found)
    row_ms = milliseconds(lambda: ray.get([task.remote(text, {}) for _ in range(20)])) / 20
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / name for name in found]
        row_ms += sum(milliseconds(partial(write_whole, path, found["row"])) for path in paths)
    program = [sys.executable, "-m", "lapswarm.command_line", "--version"]
    program_ms = milliseconds(lambda: subprocess.run(program, check=True, capture_output=True))

    recipe = len(pickle.dumps(Recipe(lapswarm.ReplayProblem("gt", free=free, window_s=1.5, settle_s=0.5))))
    print(f"portion of 1024 candidates of {variables} variables: {portion_bytes} bytes, {portion_ms:.2f} ms of the driver")
    print(f"state of 100 particles and their archive: {len(state)} bytes")
    print(f"epoch of an island: {2 * len(state)} bytes there, {len(state)} back, {epoch_ms:.2f} ms of the driver")
    print(f"migration: {migration_ms:.2f} ms of the worker; keeping a state: {keep_ms:.2f} ms of the driver")
    print(f"row: {row_bytes} bytes, {row_ms:.2f} ms of the driver, {program_ms:.0f} ms of the worker to start the program")
    print(f"problem as it travels: {recipe} bytes")
    print("\nseconds for 90 % on so many nodes, a worker on each")
    print(f"{'nodes':>6}  {'row':>8}  {'epoch':>8}  {'generation':>10}")
    for nodes in NODES:
        row = max(9 * program_ms, 0.9 * nodes * row_ms)
        epoch = 9 * (migration_ms + keep_ms + nodes * epoch_ms)
        # Three portions of each worker are what a generation is cut into, about.
        generation = 9 * 3 * nodes * portion_ms
        print(f"{nodes:>6}  {row / 1e3:>8.2f}  {epoch / 1e3:>8.2f}  {generation / 1e3:>10.2f}")
    ray.shutdown()


if __name__ == "__main__":
    main()
