"""Studies as functions, the command line, and other frameworks."""

from __future__ import annotations

import inspect
import json
import signal
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import lapswarm
import numpy as np
import pytest
from conftest import FREE
from lapswarm import _native

SMALL: dict[str, Any] = {
    "free": FREE,
    "window_s": 1.5,
    "settle_s": 0.5,
    "population": 8,
    "iterations": 4,
    "hops": 0,
}


def test_every_study_is_a_function() -> None:
    for study in _native.studies():
        function = getattr(lapswarm, study["name"])
        assert isinstance(function, lapswarm.Study) and study["name"] in lapswarm.__all__
        assert study["about"] in (function.__doc__ or "")
        keys = inspect.signature(function).parameters
        assert all(setting["key"].split(".")[0] in keys for setting in study["settings"])


def test_a_study_runs_and_tells(tmp_path: Path) -> None:
    told: list[dict[str, Any]] = []
    found = lapswarm.identify(out=tmp_path / "run", callback=told.append, **SMALL)
    assert found.folder == tmp_path / "run" and not found.interrupted and told
    assert found.summary == json.loads((found.folder / "summary.json").read_text())
    assert found.summary["study"] == "identify"
    assert found.report(open_it=False).is_file()
    shown = found._repr_html_()
    assert "<table>" in shown and "<svg" in shown


def test_settings_of_a_study_are_checked(tmp_path: Path) -> None:
    with pytest.raises(lapswarm.InputError, match="populaton"):
        lapswarm.identify(out=tmp_path / "run", populaton=3)
    with pytest.raises(lapswarm.InputError) as raised:
        lapswarm.identify(out=tmp_path / "run", least_speed_mps=-1.0)
    assert raised.value.field == "least_speed_mps"
    assert not (tmp_path / "run").exists()


def test_a_plan_writes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert "gt" in lapswarm.identify.plan(**SMALL)
    assert not list(tmp_path.iterdir())


def test_an_interrupted_study_is_resumed_to_the_same_figures(tmp_path: Path) -> None:
    settings = SMALL | {"iterations": 20, "polish": False}
    whole = lapswarm.identify(out=tmp_path / "whole", **settings)
    calls = 0

    def interrupt(now: dict[str, Any]) -> None:
        nonlocal calls
        calls += 1
        if calls == 3:
            signal.raise_signal(signal.SIGINT)

    assert threading.current_thread() is threading.main_thread()
    # A shell starts what runs in the background with interrupts ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        part = lapswarm.identify(out=tmp_path / "part", callback=interrupt, **settings)
    finally:
        signal.signal(signal.SIGINT, before)
    assert part.interrupted and part.summary["evaluations"] < whole.summary["evaluations"]
    rest = lapswarm.identify(out=tmp_path / "part", resume=True)
    assert not rest.interrupted
    changing = ("elapsed", "per_s", "dispatch", "folder")
    for key, value in whole.summary.items():
        if not any(word in key for word in changing):
            assert rest.summary[key] == value, key


def test_what_a_callback_raises_is_passed_on(tmp_path: Path) -> None:
    def wrong(now: dict[str, Any]) -> None:
        raise ZeroDivisionError("mine")

    with pytest.raises(ZeroDivisionError, match="mine"):
        lapswarm.identify(out=tmp_path / "run", callback=wrong, **SMALL)


def test_the_program_is_carried() -> None:
    program = [sys.executable, "-m", "lapswarm.command_line"]
    said = subprocess.run([*program, "--version"], capture_output=True, text=True, check=True).stdout
    assert lapswarm.__version__ in said
    wrong = subprocess.run([*program, "identify", "--car", "none.toml"], capture_output=True, text=True)
    assert wrong.returncode == 2 and "none.toml" in wrong.stderr


def test_pymoo_runs_on_an_evaluator(line: lapswarm.LineProblem) -> None:
    pytest.importorskip("pymoo")
    from lapswarm.pymoo import Problem
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.optimize import minimize

    problem = Problem(line, "simd")
    found = minimize(problem, NSGA2(pop_size=40), ("n_gen", 10), seed=1)
    again = lapswarm.Evaluator(line, "simd").evaluate(found.X)
    assert np.array_equal(again.F, found.F) and len(found.F) > 1


def test_a_problem_for_pygmo_takes_whole_populations(line: lapswarm.LineProblem) -> None:
    from lapswarm.pygmo import Problem

    problem = Problem(line, "simd")
    lower, upper = problem.get_bounds()
    rows = np.array([lower, 0.5 * (lower + upper)])
    batch = problem.batch_fitness(rows.ravel()).reshape(2, problem.get_nobj())
    assert np.array_equal(batch[1], problem.fitness(rows[1]))
