"""What studies hand back: typed figures, tables as frames, pages, and interrupts."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import types
import warnings
import webbrowser
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import Any, Union, get_args, get_origin, get_type_hints

import lapswarm
import numpy as np
import pytest
from lapswarm import _native

STADIUM: dict[str, Any] = {"track": "stadium:300:80:12", "sections": 60, "backend": "simd"}
SECTION: dict[str, Any] = {"section": "Abbey", "backend": "simd"}
SWARM: dict[str, Any] = {"population": 16, "iterations": 4}
SMALL: dict[str, list[dict[str, Any]]] = {
    "identify": [SECTION | SWARM | {"hops": 0, "free": {"K": (3e4, 3e5), "C": (5e3, 5e4)}}],
    "envelope": [{"step_mps": 25, "steers": 8, "backend": "simd"}],
    "raceline": [STADIUM | SWARM | {"objectives": ["length", "gamma"]}],
    "hybrid": [STADIUM | SWARM | {"budgets_mj": [0.5]}],
    "transient": [{"track": "circle:294:306", "setups": 3, "backend": "simd"}, {"track": "circle:294:306"}],
    "sensitivity": [SECTION | {"samples": 8, "free": {"K": (3e4, 3e5), "C": (5e3, 5e4)}}],
    "surface": [SECTION | {"grid": 3}],
}


def fits(kind: Any, value: Any) -> bool:
    """Whether a value is of a type, with all that it holds."""
    origin, of = get_origin(kind), get_args(kind)
    if origin in (Union, types.UnionType):
        return any(fits(k, value) for k in of)
    if origin is list:
        return isinstance(value, list) and all(fits(of[0], v) for v in value)
    if origin is tuple:
        return isinstance(value, tuple) and len(value) == len(of) and all(map(fits, of, value))
    if origin is dict:
        return isinstance(value, dict) and all(fits(of[1], v) for v in value.values())
    if is_dataclass(kind):
        hints = get_type_hints(kind)
        return isinstance(value, kind) and all(fits(hints[f.name], getattr(value, f.name)) for f in fields(kind))
    return isinstance(value, (float, int) if kind is float else kind)


def same(figures: Any, told: Any, place: str) -> None:
    """Nothing is told that the types lack, and the types have nothing that is not told."""
    if is_dataclass(figures):
        known = {f.name: f.default is not MISSING for f in fields(figures)}
        assert set(told) <= set(known), f"{place}: keys without a type"
        assert {name for name, optional in known.items() if not optional} <= set(told), f"{place}: types without a key"
        for key, value in told.items():
            same(getattr(figures, key), value, f"{place}.{key}")
    elif isinstance(told, dict):
        for key, value in told.items():
            same(figures[key], value, f"{place}.{key}")
    elif isinstance(told, list):
        for k, (one, value) in enumerate(zip(figures, told, strict=True)):
            same(one, value, f"{place}[{k}]")
    else:
        assert figures == told, place


def small(study: str, k: int, folder: Path) -> dict[str, Any]:
    settings = dict(SMALL[study][k])
    if study == "transient":
        angle = np.linspace(0.0, 2 * np.pi, 400, endpoint=False)
        settings["line"] = {"x_m": 300 * np.cos(angle), "y_m": 300 * np.sin(angle)}
    return settings


@pytest.mark.parametrize(("study", "k"), [(study, k) for study, all_of in SMALL.items() for k in range(len(all_of))])
def test_figures_have_the_types_that_they_say(study: str, k: int, tmp_path: Path) -> None:
    function = getattr(lapswarm, study)
    found = function(out=tmp_path / "run", **small(study, k, tmp_path))
    same(found.figures, found.summary, study)
    kinds = get_args(function.kind) or (function.kind,)
    assert any(fits(kind, found.figures) for kind in kinds)
    assert found.tables
    for name in found.tables:
        frame = found.frame(name, "numpy")
        assert frame and len({len(values) for values in frame.values()}) == 1, name


def test_every_study_has_typed_figures() -> None:
    for study in _native.studies():
        kind = getattr(lapswarm, study["name"]).kind
        assert all(issubclass(k, lapswarm.figures.Figures) for k in get_args(kind) or (kind,))
        assert study["name"] in SMALL or study["name"] == "run"


def test_a_run_has_the_figures_of_its_stages(tmp_path: Path) -> None:
    for name, settings in {"car": SMALL["identify"][0] | {"polish": False}, "line": dict(STADIUM)}.items():
        settings |= {"objectives": ["lap_time"], "sections": 120} if name == "line" else {}
        text = lapswarm._settings.as_text("identify" if name == "car" else "raceline", settings)
        (tmp_path / f"{name}.toml").write_text(text)
    found = lapswarm.run(
        out=tmp_path / "run",
        identify=tmp_path / "car.toml",
        raceline=tmp_path / "line.toml",
        rounds=1,
        no_cache=True,
    )
    same(found.figures, found.summary, "run")
    assert fits(lapswarm.figures.RunFigures, found.figures) and found.figures.rounds[0].driven_lap_time_s > 10.0
    assert any("/" in name for name in found.tables)


def test_tables_are_frames_and_pages_open(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = lapswarm.identify(out=tmp_path / "run", **small("identify", 0, tmp_path))
    for kind in ("pandas", "polars", "numpy"):
        if kind != "numpy":
            pytest.importorskip(kind)
        frame = found.frame("parameters", kind)
        assert type(frame).__module__.split(".")[0] == {"numpy": "builtins"}.get(kind, kind)
        assert list(frame["parameter"]) == [p.name for p in found.figures.parameters]
        assert list(frame["value"]) == [p.value for p in found.figures.parameters]
    with pytest.raises(lapswarm.InputError, match="parameters") as raised:
        found.frame("parametres")
    assert raised.value.field == "parametres"
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    assert opened == [] and found.report() == tmp_path / "run" / "report.html"
    assert opened == [(tmp_path / "run" / "report.html").resolve().as_uri()]


INTERRUPTED = """
import sys, lapswarm
def told(now):
    print(now["done"], flush=True)
found = lapswarm.identify(out=sys.argv[1], free={"K": (3e4, 3e5)}, backend="cpu", population=64, iterations=100000,
                          polish=False, callback=told)
print("interrupted", found.interrupted, found.figures.interrupted, found.figures.parameters[0].car_value > 0, flush=True)
"""


@pytest.mark.skipif(os.name == "nt", reason="another way of interrupting")
def test_a_signal_saves_and_hands_back_what_was_reached(tmp_path: Path) -> None:
    command = [sys.executable, "-c", INTERRUPTED, str(tmp_path / "run")]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    # Generations are told one by one.
    told = [int(process.stdout.readline()) for _ in range(3)]
    assert told == sorted(told)
    process.send_signal(signal.SIGINT)
    said, _ = process.communicate(timeout=300)
    assert process.returncode == 0 and said.splitlines()[-1] == "interrupted True True True"
    assert (tmp_path / "run" / "report.html").is_file() and (tmp_path / "run" / "state.lapswarm").is_file()


def test_without_a_gpu_the_processor_says_so(line: lapswarm.LineProblem, tmp_path: Path) -> None:
    script = "import lapswarm\nlapswarm.Evaluator(lapswarm.LineProblem('circle:590:600', sections=60))\n"
    # Loaders of Vulkan find no driver there.
    nothing = {"VK_DRIVER_FILES": str(tmp_path), "VK_ICD_FILENAMES": str(tmp_path)}
    command = [sys.executable, "-W", "error", "-c", script]
    ended = subprocess.run(command, env=os.environ | nothing, capture_output=True, text=True)
    assert ended.returncode == 1 and "RuntimeWarning: no GPU" in ended.stderr and "simd" in ended.stderr
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert lapswarm.Evaluator(line, "simd").backend == "simd"
    refused = script.replace("60))", "60), 'gpu')")
    ended = subprocess.run([sys.executable, "-c", refused], env=os.environ | nothing, capture_output=True, text=True)
    assert "DeviceError" in ended.stderr


def test_islands_are_asked_together_and_go_on_to_the_bit() -> None:
    import pickle

    problem = lapswarm.OwnProblem([(-2.0, 3.0)] * 4)
    sizes: dict[str, Any] = {"population": 10, "iterations": 12}

    def cost(x: np.ndarray) -> np.ndarray:
        return (x**2).sum(axis=1)

    alone = [lapswarm.Optimiser(problem, "pso", seed=5 + k, **sizes) for k in range(3)]
    apart = lapswarm.Optimiser(problem, "pso", seed=5, islands=3, **sizes)
    moving = lapswarm.Optimiser(problem, "pso", seed=5, islands=3, migrate_every=4, migrants=1, **sizes)
    differ = False
    while not moving.done:
        x, y = apart.ask(), moving.ask()
        assert np.array_equal(x, np.vstack([one.ask() for one in alone]))
        differ |= not np.array_equal(x, y)
        apart.tell(cost(x))
        for k, one in enumerate(alone):
            one.tell(cost(x[10 * k : 10 * k + 10]))
        moving.tell(cost(y))
        moving = pickle.loads(pickle.dumps(moving))
    assert differ and apart.best[0] == min(one.best[0] for one in alone)
    with pytest.raises(lapswarm.InputError, match="difference"):
        lapswarm.Optimiser(problem, "covariance", islands=3)
    with pytest.raises(lapswarm.InputError, match="islands"):
        lapswarm.Optimiser(problem, "pso", islands=0)
    front = lapswarm.Optimiser(lapswarm.OwnProblem([(0, 1)] * 3, 2), "default", population=10, iterations=3, islands=2)
    assert front.ask().shape == (20, 3)
