"""Islands on several nodes."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import lapswarm
import lapswarm.ray
import numpy as np
import pytest
from conftest import Machines, once
from lapswarm.ray._islands import _seed, non_dominated
from lapswarm.ray._migration import accepted

PROBLEM = lapswarm.OwnProblem([(-2.0, 3.0)] * 4, 2)
SIZES: dict[str, Any] = {"islands": 3, "epochs": 4, "iterations": 3, "population": 16, "archive": 12, "seed": 7, "num_cpus": 1}


def two(trouble: Callable[[], object] = lambda: None) -> Callable[[np.ndarray], np.ndarray]:
    def function(x: np.ndarray) -> np.ndarray:
        trouble()
        return np.stack([(x**2).sum(axis=1), ((x - 1.0) ** 2).sum(axis=1)], axis=1)

    return function


@pytest.fixture(scope="module")
def undisturbed(all_machines: Machines) -> list[bytes]:
    return states(lapswarm.ray.islands(PROBLEM, function=two(), **SIZES))


def states(found: lapswarm.ray.Archipelago) -> list[bytes]:
    return [optimiser.to_bytes() for optimiser in found.optimisers]


@pytest.mark.parametrize(("algorithm", "objectives"), [("default", 2), ("smpso", 2), ("pso", 1), ("difference", 1)])
def test_islands_are_those_of_a_loop_in_one_process(machines: Machines, algorithm: str, objectives: int) -> None:
    problem = lapswarm.OwnProblem([(-2.0, 3.0)] * 4, objectives)
    function = two() if objectives == 2 else lambda x: (x**2).sum(axis=1)
    found = lapswarm.ray.islands(problem, function=function, algorithm=algorithm, **SIZES)
    alone = [
        lapswarm.Optimiser(problem, algorithm, population=16, iterations=12, archive=12, seed=_seed(7, k)) for k in range(3)
    ]
    for epoch in range(4):
        if epoch > 0:
            before = [one.to_bytes() for one in alone]
            alone = [lapswarm.Optimiser.from_bytes(accepted(before[k], before[k - 1], 2)) for k in range(3)]
        for one in alone:
            for _ in range(3):
                one.tell(function(one.ask()))
    assert states(found) == [one.to_bytes() for one in alone]
    assert all(len(one.front[0]) > 0 for one in alone)


def test_a_run_depends_on_its_settings_alone(machines: Machines, undisturbed: list[bytes]) -> None:
    machines.add()
    again = lapswarm.ray.islands(PROBLEM, function=two(), **SIZES)
    assert states(again) == undisturbed
    assert again.evaluations == 3 * 4 * 3 * 16 and again.failed == 0 and again.epochs == 4
    fronts = np.vstack([optimiser.front[1] for optimiser in again.optimisers])
    dominated = [(np.all(fronts <= f, axis=1) & np.any(fronts < f, axis=1)).any() for f in again.F]
    assert not any(dominated) and len(again.F) > 3
    assert np.array_equal(two()(again.X), again.F)
    for changed in ({"seed": 8}, {"topology": "none"}, {"topology": "all"}, {"migrants": 1}):
        assert states(lapswarm.ray.islands(PROBLEM, function=two(), **(SIZES | changed))) != undisturbed


def test_a_killed_process_changes_no_bit(machines: Machines, undisturbed: list[bytes], tmp_path: Path) -> None:
    first = once(tmp_path / "killed")
    calls = tmp_path / "calls"

    def die() -> None:
        with calls.open("a") as file:
            file.write("x")
        if calls.stat().st_size > 14 and first():
            os.kill(os.getpid(), 9)

    found = lapswarm.ray.islands(PROBLEM, function=two(die), **SIZES)
    assert (tmp_path / "killed").exists() and states(found) == undisturbed


def test_a_killed_node_changes_no_bit(machines: Machines, undisturbed: list[bytes]) -> None:
    victim = machines.add().node_id

    def kill(now: dict[str, Any]) -> None:
        if now["epoch"] == 2:
            machines.kill(victim)

    assert states(lapswarm.ray.islands(PROBLEM, function=two(), callback=kill, **SIZES)) == undisturbed


DRIVER = """
import os, sys
import numpy as np
import lapswarm, lapswarm.ray

def two(x):
    return np.stack([(x**2).sum(axis=1), ((x - 1.0) ** 2).sum(axis=1)], axis=1)

def kill(now):
    if now["epoch"] == 2:
        os.kill(os.getpid(), 9)

problem = lapswarm.OwnProblem([(-2.0, 3.0)] * 4, 2)
lapswarm.ray.islands(problem, function=two, out=sys.argv[1], callback=kill, **eval(sys.argv[2]))
"""


def test_a_killed_driver_is_resumed_to_the_same_bits(
    machines: Machines, undisturbed: list[bytes], tmp_path: Path
) -> None:
    out = tmp_path / "islands"
    assert machines.driver(DRIVER, str(out), repr(SIZES)) == -9
    kept = sorted(path.name for path in out.iterdir())
    assert kept == ["epoch-000001.islands", "epoch-000002.islands"]
    # As a disk that was full leaves it: the one before is whole.
    damaged = out / kept[1]
    damaged.write_bytes(damaged.read_bytes()[:-40])
    told: list[int] = []
    found = lapswarm.ray.islands(
        PROBLEM, function=two(), out=out, resume=True, callback=lambda now: told.append(now["epoch"]), **SIZES
    )
    assert told == [2, 3, 4] and states(found) == undisturbed
    with pytest.raises(lapswarm.InputError, match="seed: found 7 .*expected 9"):
        lapswarm.ray.islands(PROBLEM, function=two(), out=out, resume=True, **(SIZES | {"seed": 9}))
    with pytest.raises(lapswarm.InputError, match="resume=True"):
        lapswarm.ray.islands(PROBLEM, function=two(), out=out, **SIZES)
    done = lapswarm.ray.islands(PROBLEM, function=two(), out=out, resume=True, **SIZES)
    assert states(done) == undisturbed


def test_states_go_where_fsspec_reaches(machines: Machines, undisturbed: list[bytes]) -> None:
    place = "memory://lapswarm/islands"
    part = lapswarm.ray.islands(PROBLEM, function=two(), out=place, callback=lambda now: now["epoch"] < 3, **SIZES)
    assert part.epochs == 3
    found = lapswarm.ray.islands(PROBLEM, function=two(), out=place, resume=True, **SIZES)
    assert states(found) == undisturbed


def test_what_is_wrong_is_said_before_anything_is_written(machines: Machines, tmp_path: Path) -> None:
    out = tmp_path / "islands"
    for wrong, said in (
        ({"topology": "rign"}, "topology: found rign, expected ring"),
        ({"islands": 0}, "islands: found 0"),
        ({"migrants": 1.5}, "migrants: found 1.5"),
        ({"algorithm": "nsga2"}, "algorithm: found nsga2, which takes in no solutions"),
        ({"algorithm": "best"}, "best"),
        ({"backend": "tpu"}, "backend: found tpu"),
    ):
        with pytest.raises(lapswarm.InputError, match=said):
            lapswarm.ray.islands(PROBLEM, function=two(), out=out, **(SIZES | wrong))
    with pytest.raises(lapswarm.InputError, match="function"):
        lapswarm.ray.islands(PROBLEM, out=out, **SIZES)
    assert not out.exists()


def test_what_is_dominated_goes() -> None:
    F = np.random.default_rng(1).integers(0, 6, (200, 3)).astype(float)
    kept = non_dominated(F)
    for k, f in enumerate(F):
        dominated = (np.all(F <= f, axis=1) & np.any(F < f, axis=1)).any()
        first = (F == f).all(axis=1).argmax() == k
        assert (k in kept) == (first and not dominated)
    assert non_dominated(np.array([[2.0], [1.0], [1.0]])) == [1]
