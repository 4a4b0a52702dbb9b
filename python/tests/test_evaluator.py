"""Problems and evaluators."""

from __future__ import annotations

import sys
import threading
from pathlib import Path

import lapswarm
import numpy as np
import pytest
from conftest import FREE, TRUTH, drawn


def test_a_problem_tells_its_variables(replay: lapswarm.ReplayProblem) -> None:
    assert replay.names == list(FREE)
    assert np.array_equal(replay.bounds, list(FREE.values()))
    assert replay.units == ["kg", "N m s/rad", "N m/rad"]
    assert replay.whole == [False] * 3
    assert len(replay.objectives) == len(replay.objective_units) == 1


def test_the_car_that_drove_costs_least(replay: lapswarm.ReplayProblem) -> None:
    exact, lanes = lapswarm.Evaluator(replay, "cpu"), lapswarm.Evaluator(replay, "simd")
    assert (exact.backend, lanes.backend) == ("cpu", "simd")
    candidates = np.vstack([TRUTH, drawn(replay, 15)])
    found, near = exact.evaluate(candidates), lanes.evaluate(candidates)
    assert found.F.shape == (16, 1) and len(found) == 16
    assert found.failures == [None] * 16 and found.failure_counts == {}
    assert 100 * found.F[0] < found.F[1:].min()
    assert np.allclose(near.F[1:], found.F[1:], rtol=1e-2)


def test_a_candidate_that_fails_says_why() -> None:
    slippery = lapswarm.ReplayProblem("gt", free={"rBy1": (5.0, 25.0), "rCy1": (0.8, 1.5)}, window_s=1.5, settle_s=0.5)
    found = lapswarm.Evaluator(slippery, "cpu").evaluate(np.array([[15.0, 1.15]]))
    assert found.failures == ["spun"] and found.failure_counts == {"spun": 1}
    assert np.isposinf(found.F).all()


def test_lines_on_a_circle_are_known() -> None:
    circle = lapswarm.LineProblem("circle:590:600", sections=361, objectives=["length"], car_width_m=0, car_length_m=0)
    found = lapswarm.Evaluator(circle, "cpu").evaluate(np.array([np.zeros(361), np.ones(361)]))
    lengths = sorted(found.F[:, 0])
    assert np.allclose(lengths, [2 * np.pi * 590, 2 * np.pi * 600], rtol=1e-4)


def test_control_points_make_fewer_variables() -> None:
    ellipse = lapswarm.LineProblem("ellipse:400:250:12", sections=60, objectives=["length"], control_points=12)
    assert ellipse.bounds.shape == (12, 2)


def test_cars_settle_in_a_corner() -> None:
    steady = lapswarm.SteadyProblem("gt", free={"mass_kg": (1000.0, 1400.0)}, objectives=["minus_ay_mps2", "roll_rad"])
    assert steady.names == ["mass_kg", "speed_mps", "steer_rad"]
    found = lapswarm.Evaluator(steady, "cpu").evaluate(np.array([[1200.0, 30.0, 0.02]]))
    assert found.failures == [None] and found.F[0, 0] < -1.0


def test_set_ups_are_driven(table: Path) -> None:
    drive = lapswarm.DriveProblem(table, track="stadium:60:40:14", grip_shares=[0.4, 0.5])
    assert drive.names == ["front_roll_moment_share", "aero_balance_front", "grip_share"]
    found = lapswarm.Evaluator(drive, "simd").evaluate(drive.bounds.mean(axis=1)[None, :])
    assert found.failures == [None] and 10.0 < found.F[0, 0] < 60.0


def test_energy_shortens_a_lap(table: Path) -> None:
    energy = lapswarm.EnergyProblem(
        "stadium:60:40:14", line=table, energy_mj=0.5, sections=60, objectives=["lap_time_s", "energy_used_mj"]
    )
    count = len(energy.names)
    found = lapswarm.Evaluator(energy, "cpu").evaluate(np.array([np.zeros(count), np.ones(count)]))
    assert found.failures == [None, None]
    assert found.F[1, 0] < found.F[0, 0] and found.F[0, 1] == 0.0 < found.F[1, 1]


def test_layouts_and_types_make_no_difference(line: lapswarm.LineProblem) -> None:
    evaluator = lapswarm.Evaluator(line, "simd")
    rows = drawn(line, 32)
    expected = evaluator.evaluate(rows).F
    for same in (np.asfortranarray(rows), np.repeat(rows, 2, axis=0)[::2], rows.tolist()):
        assert np.array_equal(evaluator.evaluate(same).F, expected)
    assert evaluator.evaluate(np.empty((0, rows.shape[1]))).F.shape == (0, 2)


def test_threads_of_python_share_an_evaluator(line: lapswarm.LineProblem) -> None:
    evaluator = lapswarm.Evaluator(line, "simd")
    populations = [drawn(line, 64, seed) for seed in range(4)]
    expected = [evaluator.evaluate(x).F for x in populations]
    found: dict[int, np.ndarray] = {}

    def work(k: int) -> None:
        for _ in range(5):
            found[k] = evaluator.evaluate(populations[k]).F

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(found[k], expected[k]) for k in range(4))


def test_other_threads_run_while_cars_are_driven(replay: lapswarm.ReplayProblem) -> None:
    evaluator = lapswarm.Evaluator(replay, "cpu")
    turns, ended = 0, threading.Event()

    def work() -> None:
        nonlocal turns
        while not ended.wait(0.001):
            turns += 1

    thread = threading.Thread(target=work)
    usual = sys.getswitchinterval()
    # From here on another thread runs only where this one lets it.
    sys.setswitchinterval(1000.0)
    try:
        thread.start()
        population = drawn(replay, 64)
        before = turns
        evaluator.evaluate(population)
        after = turns
    finally:
        sys.setswitchinterval(usual)
        ended.set()
        thread.join()
    assert after > before


def test_what_is_wrong_with_an_array_is_said(line: lapswarm.LineProblem) -> None:
    evaluator = lapswarm.Evaluator(line, "simd")
    rows = drawn(line, 3)
    bad = rows.copy()
    bad[1, 2] = np.nan
    with pytest.raises(lapswarm.InputError, match=r"X: .*NaN in row 1 .*finite") as raised:
        evaluator.evaluate(bad)
    assert raised.value.file == "X" and raised.value.field == line.names[2]
    many = drawn(line, 40)
    many[30, 7] = many[31, 0] = np.inf
    with pytest.raises(lapswarm.InputError, match="inf in row 30 "):
        evaluator.evaluate(many)
    with pytest.raises(lapswarm.InputError, match="59 columns, expected 60"):
        evaluator.evaluate(rows[:, :-1])
    with pytest.raises(lapswarm.InputError, match="X: type: found complex numbers"):
        evaluator.evaluate(np.full((2, 60), 0.5j))
    with pytest.raises(lapswarm.InputError, match=r"shape \(60,\)"):
        evaluator.evaluate(rows[0])
    with pytest.raises(lapswarm.InputError, match="array of numbers"):
        evaluator.evaluate([["a"] * 60])
    assert np.isfinite(evaluator.evaluate(rows).F).all()


def test_errors_say_where_they_are(tmp_path: Path) -> None:
    with pytest.raises(lapswarm.InputError, match="mas_kg") as raised:
        lapswarm.ReplayProblem("gt", free={"mas_kg": (1.0, 2.0)})
    assert "mass_kg" in str(raised.value)
    car = tmp_path / "car.toml"
    car.write_text("mass_kg = 'heavy'\n")
    with pytest.raises(lapswarm.InputError) as raised:
        lapswarm.ReplayProblem(car)
    assert raised.value.file == str(car) and raised.value.line is not None or raised.value.field is not None
    with pytest.raises(lapswarm.Error) as missing:
        lapswarm.ReplayProblem(tmp_path / "none.toml")
    assert "none.toml" in str(missing.value)
    with pytest.raises(lapswarm.InputError, match="wheels"):
        lapswarm.LineProblem("circle:590:600", wheels=4)
    with pytest.raises(lapswarm.InputError, match="backend"):
        lapswarm.Evaluator(lapswarm.LineProblem("circle:590:600", sections=60), "tpu")
    with pytest.raises(lapswarm.InputError, match="minimise"):
        lapswarm.Evaluator(lapswarm.OwnProblem([(0, 1)]))
