"""Optimisers by ask and tell, and minimise."""

from __future__ import annotations

import pickle

import lapswarm
import numpy as np
import pytest

BOX = [(-2.0, 3.0)] * 4


def sphere(x: np.ndarray) -> np.ndarray:
    return (x**2).sum(axis=1)


def two(x: np.ndarray) -> np.ndarray:
    return np.stack([(x**2).sum(axis=1), ((x - 1.0) ** 2).sum(axis=1)], axis=1)


CASES = [(name, 1, sphere) for name in lapswarm.SINGLE_OBJECTIVE] + [(name, 2, two) for name in lapswarm.MULTI_OBJECTIVE]


@pytest.mark.parametrize(("name", "count", "function"), CASES)
def test_a_pickled_optimiser_goes_on_to_the_bit(name: str, count: int, function) -> None:  # type: ignore[no-untyped-def]
    problem = lapswarm.OwnProblem(BOX, count)
    one = lapswarm.Optimiser(problem, name, population=20, iterations=12, seed=5)
    for _ in range(4):
        one.tell(function(one.ask()))
    other = pickle.loads(pickle.dumps(one))
    assert other.evaluations == one.evaluations > 0
    while not one.done:
        x, y = one.ask(), other.ask()
        assert np.array_equal(x, y)
        one.tell(function(x))
        other.tell(function(y))
    assert other.done
    for a, b in zip(one.front, other.front, strict=True):
        assert np.array_equal(a, b) and len(a) > 0
    again = lapswarm.Optimiser(problem, name, population=20, iterations=12, seed=5)
    while not again.done:
        again.tell(function(again.ask()))
    assert np.array_equal(again.best, one.best)


def test_a_state_between_ask_and_tell_is_whole() -> None:
    one = lapswarm.Optimiser(lapswarm.OwnProblem(BOX), "pso", population=10, iterations=5)
    x = one.ask()
    other = lapswarm.Optimiser.from_bytes(one.to_bytes())
    one.tell(sphere(x))
    other.tell(sphere(x))
    assert np.array_equal(one.ask(), other.ask())


def test_damaged_states_and_wrong_shapes_are_refused() -> None:
    one = lapswarm.Optimiser(lapswarm.OwnProblem(BOX), "pso", population=10, iterations=5)
    state = one.to_bytes()
    for damaged in (b"", state[:-1], state[:40] + bytes([state[40] ^ 1]) + state[41:]):
        with pytest.raises(lapswarm.InputError):
            lapswarm.Optimiser.from_bytes(damaged)
    x = one.ask()
    with pytest.raises(lapswarm.InputError, match="10 candidates"):
        one.tell(sphere(x[:9]))
    with pytest.raises(lapswarm.InputError, match="2 columns, expected 1"):
        one.tell(two(x))
    one.tell(sphere(x))
    with pytest.raises(lapswarm.InputError, match="default"):
        lapswarm.Optimiser(lapswarm.OwnProblem(BOX), "best")


def test_what_fails_and_what_violates_is_not_the_best() -> None:
    swarm = lapswarm.Optimiser(lapswarm.OwnProblem(BOX), "default", population=20, iterations=60, seed=2)
    while not swarm.done:
        x = swarm.ask()
        f = np.where(x[:, 1] > 2.5, np.nan, sphere(x))
        swarm.tell(f, violations=np.maximum(1.0 - x[:, 0], 0.0))
    (best,), cost = swarm.front
    assert swarm.violation == 0.0 and best[0] >= 1.0 and abs(cost[0, 0] - 1.0) < 0.05


def test_an_optimiser_runs_on_an_evaluator(line: lapswarm.LineProblem) -> None:
    evaluator = lapswarm.Evaluator(line, "simd")
    swarm = lapswarm.Optimiser(line, population=40, iterations=20)
    first = evaluator.evaluate(x := swarm.ask())
    swarm.tell(first)
    while not swarm.done:
        swarm.tell(evaluator.evaluate(swarm.ask()))
    assert (swarm.best <= first.F.min(axis=0)).all() and (swarm.best < first.F.min(axis=0)).any()
    lower, upper = line.bounds.T
    assert ((x >= lower) & (x <= upper)).all()


def test_whole_numbers_stay_whole() -> None:
    problem = lapswarm.OwnProblem([(0, 9), (0, 1)], whole=[True, False])
    swarm = lapswarm.Optimiser(problem, population=20, iterations=3)
    x = swarm.ask()
    assert np.array_equal(x[:, 0], np.round(x[:, 0])) and not np.array_equal(x[:, 1], np.round(x[:, 1]))


def test_minimise_finds_the_least() -> None:
    found = lapswarm.minimise(BOX, sphere, evaluations=8_000, seed=3)
    assert found.f < 1e-6 and np.abs(found.x).max() < 1e-3
    assert found.stopped == "evaluations" and found.evaluations == found.history[-1]["evaluations"]
    again = lapswarm.minimise(BOX, sphere, evaluations=8_000, seed=3)
    assert np.array_equal(again.X, found.X)


def test_minimise_obeys_constraints_targets_and_callbacks() -> None:
    bound = lapswarm.minimise(
        BOX, lambda x: np.column_stack([sphere(x), 1.0 - x[:, 0]]), inequalities=1, evaluations=8_000
    )
    assert bound.violation == 0.0 and abs(bound.f - 1.0) < 1e-3
    assert lapswarm.minimise(BOX, sphere, target=0.1).stopped == "target"
    told: list[int] = []

    def three(now: dict[str, int]) -> bool:
        told.append(now["evaluations"])
        return len(told) < 3

    stopped = lapswarm.minimise(BOX, sphere, callback=three)
    assert stopped.stopped == "callback" and stopped.evaluations == told[-1] and len(told) == 3
    front = lapswarm.minimise(BOX, two, objectives=2, evaluations=4_000, archive=30)
    assert front.F.shape[1] == 2 and 10 < len(front.F) <= 30


def test_minimise_passes_on_what_is_raised() -> None:
    def wrong(x: np.ndarray) -> np.ndarray:
        raise ZeroDivisionError("mine")

    with pytest.raises(ZeroDivisionError, match="mine"):
        lapswarm.minimise(BOX, wrong)
    with pytest.raises(lapswarm.InputError, match="rows, expected 40"):
        lapswarm.minimise(BOX, lambda x: sphere(x)[:-1])

    calls = 0

    def stopped(x: np.ndarray) -> np.ndarray:
        nonlocal calls
        calls += 1
        if calls == 5:
            raise KeyboardInterrupt
        return sphere(x)

    found = lapswarm.minimise(BOX, stopped)
    assert found.stopped == "interrupt" and len(found.X) == 1 and calls == 5


TAKE_IN = [("pso", sphere), ("thesis", sphere), ("difference", sphere), ("default", two), ("smpso", two), ("thesis", two)]


@pytest.mark.parametrize(("name", "function"), TAKE_IN)
def test_what_is_accepted_is_what_islands_of_the_library_exchange(name: str, function) -> None:  # type: ignore[no-untyped-def]
    problem = lapswarm.OwnProblem(BOX, 1 if function is sphere else 2)
    sizes = {"population": 12, "iterations": 9, "archive": 8}
    within = lapswarm.Optimiser(problem, name, seed=5, islands=3, migrate_every=2, migrants=2, **sizes)
    apart = [lapswarm.Optimiser(problem, name, seed=5 + k, **sizes) for k in range(3)]
    while not within.done:
        x, asked = within.ask(), [one.ask() for one in apart]
        assert np.array_equal(x, np.vstack(asked))
        within.tell(function(x))
        for one, own in zip(apart, asked, strict=True):
            one.tell(function(own))
        if within.iteration % 2 == 0:
            fronts = [one.front for one in apart]
            for k, one in enumerate(apart):
                X, F = fronts[k - 1]
                rows = [i * len(F) // min(2, len(F)) for i in range(min(2, len(F)))]
                one.accept(X[rows], F[rows])
    assert np.array_equal(within.best, np.min([one.best for one in apart], axis=0))


def test_rows_known_from_before_are_accepted_by_their_violations() -> None:
    swarm = lapswarm.Optimiser(lapswarm.OwnProblem(BOX), "pso", population=10, iterations=5, seed=3)
    swarm.tell(sphere(swarm.ask()) + 10.0)
    # The first has failed, the second violates, the third is feasible, and beyond the bounds.
    known = np.array([[0.0] * 4, [0.1] * 4, [9.0, 0.2, 0.2, 0.2]])
    swarm.accept(known, [np.nan, 0.04, 0.5], violations=[0.0, 1.0, 0.0])
    X, F = swarm.front
    assert np.allclose(X, [[3.0, 0.2, 0.2, 0.2]], rtol=0.0, atol=1e-15) and F[0, 0] == 0.5 == swarm.best[0]
    assert swarm.violation == 0.0 and swarm.evaluations == 10
    several = lapswarm.Optimiser(lapswarm.OwnProblem(BOX, 2), population=10, iterations=5)
    known[2] = 0.9
    several.accept(known, two(known), violations=[2.0, 1.0, 1.0])
    assert several.violation == 1.0 and len(several.front[0]) == 2


def test_what_cannot_be_accepted_is_refused_and_changes_nothing() -> None:
    swarm = lapswarm.Optimiser(lapswarm.OwnProblem(BOX), "pso", population=10, iterations=5)
    before = swarm.to_bytes()
    x = np.zeros((3, 4))
    for X, F, said in (
        (x[:, :3], sphere(x), "3 columns, expected 4"),
        (x, sphere(x[:2]), "3 candidates"),
        (x, two(x), "2 columns, expected 1"),
        (x * np.nan, sphere(x), "NaN in row 0"),
    ):
        with pytest.raises(lapswarm.InputError, match=said):
            swarm.accept(X, F)
    with pytest.raises(lapswarm.InputError, match="violations"):
        swarm.accept(x, sphere(x), violations=[0.0])
    assert swarm.to_bytes() == before
    with pytest.raises(lapswarm.InputError, match="takes in no candidates"):
        lapswarm.Optimiser(lapswarm.OwnProblem(BOX), "covariance").accept(x, sphere(x))
