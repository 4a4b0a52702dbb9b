"""One population on several nodes."""

from __future__ import annotations

import os
import pickle
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import lapswarm
import lapswarm.ray
import numpy as np
import pytest
from conftest import Machines, later, once
from lapswarm.ray._pool import Handle, Pool

BOX = [(-2.0, 3.0)] * 4


def candidates(problem: lapswarm.Problem, count: int) -> np.ndarray:
    lower, upper = problem.bounds.T
    return np.random.default_rng(1).uniform(lower, upper, (count, len(lower)))


def values(X: np.ndarray) -> np.ndarray:
    found = (X**2).sum(axis=1)
    return np.where(X[:, 0] > 2.9, np.nan, found)


def disturbed(trouble: Callable[[], object]) -> Callable[[np.ndarray], np.ndarray]:
    def function(X: np.ndarray) -> np.ndarray:
        trouble()
        found = (X**2).sum(axis=1)
        return np.where(X[:, 0] > 2.9, np.nan, found)

    return function


def test_figures_and_failures_are_those_of_one_machine(machines: Machines) -> None:
    machines.add()
    free = {"rBy1": (5.0, 25.0), "rCy1": (0.8, 1.5)}
    problem = lapswarm.ReplayProblem("gt", free=free, window_s=1.5, settle_s=0.5)
    local = lapswarm.Evaluator(problem, "simd")
    X = candidates(problem, 100)
    expected = local.evaluate(X)
    assert expected.failure_counts
    with lapswarm.ray.Evaluator(problem, num_cpus=1, least=4) as evaluator:
        assert evaluator.backend == "simd"
        for _ in range(2):
            found = evaluator.evaluate(X)
            assert np.array_equal(found.F, expected.F) and found.failures == expected.failures
        assert found.failure_counts == expected.failure_counts and len(found) == 100
        assert evaluator.evaluate(X[:0]).F.shape == (0, 1)
        here = lapswarm.Optimiser(problem, population=20, iterations=3)
        there = lapswarm.Optimiser(problem, population=20, iterations=3)
        while not here.done:
            here.tell(local.evaluate(here.ask()))
            there.tell(evaluator.evaluate(there.ask()))
        assert here.to_bytes() == there.to_bytes()


def test_files_go_along(machines: Machines, tmp_path: Path) -> None:
    here = tmp_path / "line.csv"
    angle = np.linspace(0.0, 2 * np.pi, 300, endpoint=False)
    np.savetxt(here, np.c_[60 * np.cos(angle), 60 * np.sin(angle)], delimiter=",", header="x_m,y_m", comments="")
    problem = lapswarm.EnergyProblem("circle:55:65", line=here, energy_mj=0.5, sections=60)
    X = candidates(problem, 8)
    expected = lapswarm.Evaluator(problem, "simd").evaluate(X)
    again = pickle.loads(pickle.dumps(problem))
    assert np.array_equal(lapswarm.Evaluator(again, "simd").evaluate(X).F, expected.F)
    with lapswarm.ray.Evaluator(problem, num_cpus=1) as evaluator:
        here.unlink()
        assert np.array_equal(evaluator.evaluate(X).F, expected.F)


def test_the_portion_of_a_killed_process_is_done_again(machines: Machines, tmp_path: Path) -> None:
    first = once(tmp_path / "killed")

    def die() -> None:
        if first():
            os.kill(os.getpid(), 9)

    problem = lapswarm.OwnProblem(BOX)
    X = candidates(problem, 500)
    with lapswarm.ray.Evaluator(problem, function=disturbed(die), num_cpus=1) as evaluator:
        found = evaluator.evaluate(X)
    assert (tmp_path / "killed").exists()
    expected = values(X)
    assert np.array_equal(found.F[:, 0], np.where(np.isnan(expected), np.inf, expected))
    assert found.failures == ["undefined" if bad else None for bad in np.isnan(expected)]


def test_the_portion_of_a_killed_node_is_done_again(machines: Machines, tmp_path: Path) -> None:
    machines.add()
    victim, at_work = machines.added[0].node_id, tmp_path / "at-work"

    def hang() -> None:
        import ray

        if ray.get_runtime_context().get_node_id() == victim:
            at_work.touch()
            time.sleep(600)

    problem = lapswarm.OwnProblem(BOX)
    X = candidates(problem, 500)
    thread = later(at_work.exists, lambda _: machines.kill(victim))
    with lapswarm.ray.Evaluator(problem, function=disturbed(hang), num_cpus=1) as evaluator:
        # Until the worker of that node is open, others have all the work.
        while not at_work.exists():
            found = evaluator.evaluate(X)
    thread.join()
    expected = values(X)
    assert np.array_equal(found.F[:, 0], np.where(np.isnan(expected), np.inf, expected))


def test_work_that_always_kills_ends_with_an_error(machines: Machines) -> None:
    problem = lapswarm.OwnProblem(BOX)
    fatal = disturbed(lambda: os.kill(os.getpid(), 9))
    with lapswarm.ray.Evaluator(problem, function=fatal, num_cpus=2, retries=1) as evaluator:
        with pytest.raises(lapswarm.StudyError, match="lost 2 times"):
            evaluator.evaluate(candidates(problem, 10))


def test_a_slow_node_delays_and_changes_nothing(machines: Machines) -> None:
    machines.add()
    slow = machines.added[0].node_id

    def wait() -> None:
        import ray

        if ray.get_runtime_context().get_node_id() == slow:
            time.sleep(0.2)

    problem = lapswarm.OwnProblem(BOX)
    X = candidates(problem, 400)
    expected = values(X)
    with lapswarm.ray.Evaluator(problem, function=disturbed(wait), num_cpus=1) as evaluator:
        for _ in range(4):
            found = evaluator.evaluate(X).F[:, 0]
            assert np.array_equal(found, np.where(np.isnan(expected), np.inf, expected))


def test_portions_go_by_the_measured_rates() -> None:
    pool = Pool.__new__(Pool)
    rates = [300.0, 100.0, None]
    pool.handles = {(str(k), 0): Handle(None, "node", None, "device", rate) for k, rate in enumerate(rates)}
    shares = [pool.share(handle) for handle in pool.handles.values()]
    # One that has not been measured is taken to be as fast as the others are on average.
    assert np.allclose(shares, [0.5, 1 / 6, 1 / 3])


def test_a_population_larger_than_the_object_store(machines: Machines) -> None:
    problem = lapswarm.OwnProblem([(0.0, 1.0)] * 100)
    X = np.random.default_rng(1).uniform(0.0, 1.0, (150_000, 100))
    assert X.nbytes > 80 << 20
    with lapswarm.ray.Evaluator(problem, function=lambda x: x.sum(axis=1), num_cpus=1) as evaluator:
        assert np.array_equal(evaluator.evaluate(X).F[:, 0], X.sum(axis=1))


def test_what_is_wrong_is_said_before_anything_is_sent(machines: Machines) -> None:
    problem = lapswarm.OwnProblem(BOX, names=["a", "b", "c", "d"])
    never: Callable[[Any], Any] = disturbed(lambda: os.kill(os.getpid(), 9))
    X = candidates(problem, 5)
    with lapswarm.ray.Evaluator(problem, function=never, num_cpus=1, retries=0) as evaluator:
        bad = X.copy()
        bad[3, 2] = np.nan
        with pytest.raises(lapswarm.InputError, match=r"X: c: found NaN in row 3 .*finite") as raised:
            evaluator.evaluate(bad)
        assert raised.value.field == "c"
        with pytest.raises(lapswarm.InputError, match="3 columns, expected 4"):
            evaluator.evaluate(X[:, :3])
        with pytest.raises(lapswarm.InputError, match=r"shape \(4,\)"):
            evaluator.evaluate(X[0])
        with pytest.raises(lapswarm.InputError, match="array of numbers"):
            evaluator.evaluate([["a"] * 4])
    with pytest.raises(lapswarm.InputError, match="function"):
        lapswarm.ray.Evaluator(problem)
    with pytest.raises(lapswarm.InputError, match="backend.*tpu"):
        lapswarm.ray.Evaluator(problem, "tpu", function=never)
    with pytest.raises(lapswarm.DeviceError, match="no node has .*1 GPU"):
        lapswarm.ray.Evaluator(problem, function=never, num_gpus=1)
    with lapswarm.ray.Evaluator(problem, function=lambda x: x, num_cpus=1) as evaluator:
        with pytest.raises(lapswarm.InputError, match=r"shape: found \(5, 4\), expected \(5, 1\)"):
            evaluator.evaluate(X)

    def wrong(x: np.ndarray) -> np.ndarray:
        raise ZeroDivisionError("mine")

    with lapswarm.ray.Evaluator(problem, function=wrong, num_cpus=1) as evaluator:
        with pytest.raises(ZeroDivisionError, match="mine"):
            evaluator.evaluate(X)


def test_a_node_of_another_version_is_named(machines: Machines, tmp_path: Path) -> None:
    (tmp_path / "lapswarm").mkdir()
    (tmp_path / "lapswarm/__init__.py").write_text("__version__ = '0.0.7'\n")
    machines.add(env_vars={"PYTHONPATH": str(tmp_path)})
    problem = lapswarm.OwnProblem(BOX)
    with pytest.raises(lapswarm.InputError, match=rf"version of lapswarm: found 0.0.7, expected {lapswarm.__version__}"):
        lapswarm.ray.Evaluator(problem, function=values)
    with pytest.raises(lapswarm.InputError, match=r"0\.0\.7"):
        lapswarm.ray.islands(problem, function=values, out=tmp_path / "islands")
    assert not (tmp_path / "islands").exists()
