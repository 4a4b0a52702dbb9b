"""Frames of pandas, polars and pyarrow, dicts of arrays, and cars, in and out."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import lapswarm
import numpy as np
import pytest
from conftest import FREE, TRUTH

SHORT: dict[str, Any] = {"free": FREE, "window_s": 1.5, "settle_s": 0.5}
Columns = dict[str, np.ndarray]


@pytest.fixture(scope="session")
def lap(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Columns]:
    """A simulated lap as a file, and its columns."""
    folder = tmp_path_factory.mktemp("lap") / "run"
    command = [sys.executable, "-m", "lapswarm.command_line", "simulate", "--quiet", "--out", str(folder)]
    subprocess.run(command, check=True)
    path = folder / "lap.csv"
    comment, head, *_ = path.read_text().splitlines()
    assert comment.startswith("#")
    rows = np.loadtxt(path, delimiter=",", skiprows=2)
    return path, dict(zip(head.split(","), rows.T.copy(), strict=True))


def pandas_frame(columns: Columns) -> Any:
    return pytest.importorskip("pandas").DataFrame(columns)


def pandas_without_arrow(columns: Columns) -> Any:
    frame = pandas_frame(columns)

    class Old:
        """What a frame of pandas is where pyarrow is not installed."""

        columns = frame.columns
        __getitem__ = staticmethod(frame.__getitem__)

        def __arrow_c_stream__(self, requested_schema: object = None) -> object:
            raise ImportError("pyarrow")

    return Old()


def polars_frame(columns: Columns) -> Any:
    return pytest.importorskip("polars").DataFrame(columns)


def polars_chunks(columns: Columns) -> Any:
    frame = polars_frame(columns)
    return pytest.importorskip("polars").concat([frame[:777], frame[777:]], rechunk=False)


def arrow_table(columns: Columns) -> Any:
    return pytest.importorskip("pyarrow").table(columns)


def arrow_reader(columns: Columns) -> Any:
    """Batches with an offset, of a stream that is read once."""
    table = arrow_table({name: np.concatenate([values[:5], values]) for name, values in columns.items()})
    return table.slice(5).to_reader(1000)


FRAMES = [dict, pandas_frame, pandas_without_arrow, polars_frame, polars_chunks, arrow_table, arrow_reader]


@pytest.mark.parametrize("made", FRAMES)
def test_frames_of_every_kind_are_the_file(lap: tuple[Path, Columns], made: Callable[[Columns], Any]) -> None:
    path, columns = lap
    found = [
        lapswarm.Evaluator(lapswarm.ReplayProblem("gt", log, **SHORT), "cpu").evaluate([TRUTH]).F
        for log in (path, made(columns))
    ]
    assert np.isfinite(found[0]).all() and np.array_equal(*found)


@pytest.mark.parametrize("made", [dict, pandas_frame, polars_frame, arrow_table])
def test_types_of_columns(made: Callable[[Columns], Any]) -> None:
    given = {
        "whole": np.array([1, -2, 3], dtype=np.int16),
        "byte": np.array([1, 2, 255], dtype=np.uint8),
        "large": np.array([1, 2, 2**40], dtype=np.int64),
        "single": np.array([0.5, 1.25, -3.0], dtype=np.float32),
        "switch": np.array([True, False, True]),
        "double": np.array([0.1, np.nan, 1e300]),
        "name": np.array(["a", "b", "c"]),
    }
    from lapswarm._frames import columns_of

    found = columns_of(made(given), "it")
    assert list(found) == list(given)
    for name, values in given.items():
        if name == "name":
            assert found[name] == "a text"
        else:
            assert np.array_equal(np.asarray(found[name], dtype=float), values.astype(float), equal_nan=True), name


def test_missing_values_of_arrow_are_no_numbers() -> None:
    from lapswarm._frames import columns_of

    frame = pytest.importorskip("polars").DataFrame({"a": [None, 1, 2, None, 3], "b": [True, None, False, True, True]})
    found = columns_of(frame[1:], "it")
    assert np.array_equal(found["a"], [1, 2, np.nan, 3], equal_nan=True)  # type: ignore[call-overload]
    assert np.array_equal(found["b"], [np.nan, 0, 1, 1], equal_nan=True)  # type: ignore[call-overload]


def test_what_is_wrong_with_a_frame_is_said(lap: tuple[Path, Columns], tmp_path: Path) -> None:
    columns = lap[1]
    gap = columns["yaw_rate_radps"].copy()
    gap[5:15] = np.nan  # longer than what straight lines join
    for changed, field, words in [
        ({"steer_rad": None}, "steer", "found none"),
        ({"time_s": None}, None, "a column of times"),
        ({"vx_mps": np.full(len(gap), "fast")}, "vx_mps", "a text"),
        ({"yaw_rate_radps": gap}, "yaw_rate_radps", "row 15"),
        ({"ax_mps2": gap[:-1]}, None, "different lengths"),
        ({"ax_mps2": gap[:, None]}, "ax_mps2", "shape"),
    ]:
        frame = {name: values for name, values in (columns | changed).items() if values is not None}
        for study in (lapswarm.ReplayProblem, lapswarm.identify):
            out = {"out": tmp_path / "run"} if study is lapswarm.identify else {}
            with pytest.raises(lapswarm.InputError, match=words) as raised:
                study(log=frame, **SHORT, **out)
            assert raised.value.file == "the frame given as log" and str(raised.value).startswith(raised.value.file)
            assert (raised.value.field, raised.value.line) == (field, None)
    assert not any(tmp_path.iterdir()), "nothing is left of input that is refused"
    with pytest.raises(lapswarm.InputError, match="no rows"):
        lapswarm.LineProblem({"x_m": [], "y_m": []})
    with pytest.raises(lapswarm.InputError, match="car: found a frame") as raised:
        lapswarm.ReplayProblem(pandas_frame(columns))
    assert raised.value.field == "car"


def test_a_study_of_a_frame_is_resumed(lap: tuple[Path, Columns], tmp_path: Path) -> None:
    frame = polars_frame(lap[1])
    settings = SHORT | {"population": 8, "iterations": 20, "hops": 0, "polish": False}
    calls = 0

    def stop(now: dict[str, Any]) -> bool:
        nonlocal calls
        calls += 1
        return calls < 3

    part = lapswarm.identify(log=frame, out=tmp_path / "run", callback=stop, **settings)
    assert part.interrupted
    assert "frame" in lapswarm.identify.plan(log=frame, **settings) or os.listdir(tmp_path / "frames")
    rest = lapswarm.identify(out=tmp_path / "run", resume=True)
    whole = lapswarm.identify(log=lap[0], out=tmp_path / "whole", **settings)
    assert rest.figures.parameters == whole.figures.parameters
    # The same frame is the same file.
    lapswarm.identify(log=frame, out=tmp_path / "again", **settings | {"iterations": 1})
    assert len(os.listdir(tmp_path / "frames")) == 1


def test_a_track_and_a_line_are_frames(table: Path) -> None:
    angle = np.linspace(0.0, 2 * np.pi, 400, endpoint=False)
    circle = {"x_m": 300 * np.cos(angle), "y_m": 300 * np.sin(angle), "width_m": np.full(400, 12.0)}
    lengths = []
    for track in (circle, pandas_frame(circle), "circle:294:306"):
        lines = lapswarm.LineProblem(track, sections=180, objectives=["length"])
        lengths.append(lapswarm.Evaluator(lines, "cpu").evaluate(np.full((1, 180), 0.5)).F[0, 0])
    assert lengths[0] == lengths[1] == pytest.approx(2 * np.pi * 300, rel=1e-3) == pytest.approx(lengths[2], rel=1e-3)

    x, y = np.loadtxt(table, delimiter=",", skiprows=1).T
    settings: dict[str, Any] = {"track": "stadium:60:40:14", "grip_shares": [0.4, 0.5]}
    of_file = lapswarm.DriveProblem(table, **settings)
    of_frames = lapswarm.DriveProblem([arrow_table({"x_m": x, "y_m": y})], **settings)
    middle = of_file.bounds.mean(axis=1)[None, :]
    found = [lapswarm.Evaluator(problem, "cpu").evaluate(middle).F for problem in (of_file, of_frames)]
    assert np.array_equal(*found)


def test_cars_are_given_by_their_parameters(tmp_path: Path) -> None:
    heavy = lapswarm.Car("gt", mass_kg=1300.0)
    assert repr(heavy) == "Car('gt', mass_kg=1300)"
    held = lapswarm.SteadyProblem(lapswarm.Car("gt"), objectives=["minus_ay_mps2"])
    more = lapswarm.SteadyProblem(lapswarm.Car("gt", downforce_area_m2=3.0), objectives=["minus_ay_mps2"])
    own = lapswarm.SteadyProblem("gt", objectives=["minus_ay_mps2"])
    state = np.array([[60.0, 0.03]])
    found = [lapswarm.Evaluator(p, "cpu").evaluate(state).F[0, 0] for p in (own, held, more)]
    assert found[0] == found[1] and found[2] < found[0]
    with pytest.raises(lapswarm.InputError, match="mas_kg.*mass_kg"):
        lapswarm.Car("gt", mas_kg=1300.0)
    with pytest.raises(lapswarm.InputError, match="the car given as car.*mass_kg") as raised:
        lapswarm.SteadyProblem(lapswarm.Car("gt", mass_kg=-1.0))
    assert raised.value.field == "chassis.mass_kg"


def test_a_car_is_a_dict_as_its_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    subprocess.run([sys.executable, "-m", "lapswarm.command_line", "init", "car"], check=True, capture_output=True)
    (tyre,) = tmp_path.glob("*.tir")
    (file,) = tmp_path.glob("*.toml")
    tomllib = pytest.importorskip("tomllib")
    car = tomllib.loads(file.read_text())
    car["chassis"]["mass_kg"] = np.float64(car["chassis"]["mass_kg"])
    assert car["tyres"]["both"] == tyre.name
    state = np.array([[60.0, 0.03]])
    found = [lapswarm.Evaluator(lapswarm.SteadyProblem(c), "cpu").evaluate(state).F for c in (file, car)]
    assert np.array_equal(*found)
    del car["chassis"]["mass_kg"]
    with pytest.raises(lapswarm.InputError, match="mass_kg"):
        lapswarm.SteadyProblem(car)


@pytest.mark.parametrize("kind", ["pandas", "polars", "numpy", None])
def test_variables_are_a_frame(line: lapswarm.LineProblem, kind: str | None) -> None:
    if kind in ("pandas", "polars"):
        pytest.importorskip(kind)
    frame = line.frame(kind)
    assert list(frame) == ["name", "unit", "lower", "upper", "whole"] if kind == "numpy" else True
    assert list(frame["name"]) == line.names and list(frame["unit"]) == line.units
    assert np.array_equal(np.column_stack([frame["lower"], frame["upper"]]), line.bounds)
    with pytest.raises(lapswarm.InputError, match="kind"):
        line.frame("excel")
