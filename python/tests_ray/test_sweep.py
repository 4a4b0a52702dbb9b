"""Sweeps whose rows are tasks of a cluster."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import lapswarm
import lapswarm.ray
import pytest
from conftest import SMALL, Machines, later

GRID: dict[str, list[Any]] = {"seed": [1, 2], "population": [8, 10, 12]}


def figures(folder: Path) -> list[Any]:
    """The rows of a folder without what changes from run to run."""
    rows = [json.loads(path.read_text()) for path in sorted((folder / "rows").glob("*.json"))]
    return [{key: row[key] for key in ("run", "settings", "figures", "exit_code", "log")} for row in rows]


def program(*arguments: str) -> dict[str, Any]:
    command = [sys.executable, "-m", "lapswarm.command_line", *arguments, "--quiet", "--json"]
    said: dict[str, Any] = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    return said


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory, all_machines: Machines) -> tuple[Path, lapswarm.ray.Sweep]:
    """The sweep undisturbed."""
    folder = tmp_path_factory.mktemp("alone") / "sweep"
    told: list[int] = []
    found = lapswarm.ray.sweep(
        lapswarm.identify, GRID, out=folder, callback=lambda now: told.append(now["done"]), **SMALL
    )
    assert told == [1, 2, 3, 4, 5, 6]
    return folder, found


def test_a_folder_is_that_of_the_program(alone: tuple[Path, lapswarm.ray.Sweep], tmp_path: Path) -> None:
    folder, found = alone
    assert found.failed == [] and [row["run"] for row in found.rows] == list(range(6))
    assert [row["settings"] for row in found.rows[:2]] == [{"swarm.population": "8", "seed": s} for s in "12"]
    summary = program("sweep", str(folder / "sweep.toml"), "--out", str(folder), "--gather")
    assert len(summary["rows"]) == 6 and len(summary["groups"]) == 3
    local = tmp_path / "local"
    program("sweep", str(folder / "sweep.toml"), "--out", str(local))
    assert figures(local) == figures(folder)
    table = found.frame if isinstance(found.frame, list) else found.frame.to_dict("records")
    assert [row["best_cost"] for row in table] == [row["figures"]["best_cost"] for row in found.rows]
    assert (folder / "sweep.csv").is_file() and (folder / "report.html").is_file()
    leftovers = [path for path in folder.rglob("*") if path.name.endswith((".tmp", ".lock", ".checkpoint"))]
    assert leftovers == []


def test_killed_processes_and_nodes_lose_no_row(
    machines: Machines, alone: tuple[Path, lapswarm.ray.Sweep], tmp_path: Path
) -> None:
    victim = machines.add().node_id
    killed: list[int] = []

    def working() -> list[int]:
        """The processes of rows."""
        found = []
        for path in Path("/proc").glob("[0-9]*/cmdline"):
            try:
                if path.read_bytes().startswith(b"ray::_row"):
                    found.append(int(path.parent.name))
            except OSError:
                continue
        return found

    def kill(pids: list[int]) -> None:
        os.kill(pids[0], 9)
        killed.append(pids[0])

    def end_a_node(now: dict[str, Any]) -> None:
        if now["done"] == 1:
            machines.kill(victim)

    thread = later(working, kill)
    lapswarm.ray.sweep("identify", GRID, out=tmp_path / "sweep", callback=end_a_node, **SMALL)
    thread.join()
    assert killed and figures(tmp_path / "sweep") == figures(alone[0])


DRIVER = """
import os, sys
import lapswarm.ray

def kill(now):
    if now["done"] == 2:
        os.kill(os.getpid(), 9)

grid, settings = eval(sys.argv[2])
lapswarm.ray.sweep("identify", grid, out=sys.argv[1], callback=kill, **settings)
"""


def test_a_killed_driver_is_resumed(machines: Machines, alone: tuple[Path, lapswarm.ray.Sweep], tmp_path: Path) -> None:
    folder = tmp_path / "sweep"
    assert machines.driver(DRIVER, str(folder), repr((GRID, SMALL))) == -9
    before = {path: path.stat().st_mtime_ns for path in (folder / "rows").glob("*.json")}
    assert len(before) == 2
    with pytest.raises(lapswarm.InputError, match="resume=True"):
        lapswarm.ray.sweep("identify", GRID, out=folder, **SMALL)
    with pytest.raises(lapswarm.InputError, match="another sweep"):
        lapswarm.ray.sweep("identify", GRID, out=folder, resume=True, **(SMALL | {"iterations": 5}))
    told: list[int] = []
    lapswarm.ray.sweep(
        "identify", GRID, out=folder, resume=True, callback=lambda now: told.append(now["row"]["run"]), **SMALL
    )
    # What was done is not done again.
    assert sorted(told) == sorted(set(range(6)) - {int(path.stem) for path in before})
    assert all(path.stat().st_mtime_ns == time for path, time in before.items())
    assert figures(folder) == figures(alone[0])


def test_a_row_that_fails_says_why_and_is_tried_again(machines: Machines, tmp_path: Path) -> None:
    base: dict[str, Any] = {
        "track": "stadium:300:80:12",
        "objectives": ["gamma"],
        "algorithm": "thesis",
        "warm_start": False,
        "local_search": False,
        "population": 8,
        "iterations": 1,
        "seed": 1,
    }
    # With so few cross-sections every line leaves the road.
    grid = {"sections": [8, 60]}
    for resume in (False, True):
        told: list[int] = []
        found = lapswarm.ray.sweep(
            "raceline",
            grid,
            out=tmp_path / "sweep",
            resume=resume,
            callback=lambda now: told.append(now["row"]["run"]),
            **base,
        )
        assert sorted(told) == ([0] if resume else [0, 1])
        (why,) = found.failed
        assert why.startswith("run 00000 failed: ") and "leaves the road" in why
        assert found.rows[0]["exit_code"] == 1 and found.rows[1]["figures"]


def test_files_go_along_and_stay(machines: Machines, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "lapswarm.command_line", "init", "car", str(tmp_path / "mine.toml")]
    subprocess.run(command, check=True, capture_output=True)
    here = sorted(path.name for path in tmp_path.iterdir())
    assert len(here) == 2, "a car and its tyre"
    grid = {"seed": [1, 2]}
    base = SMALL | {"car": tmp_path / "mine.toml"}
    found = lapswarm.ray.sweep("identify", grid, out=tmp_path / "sweep", callback=lambda now: False, **base)
    assert found.failed == [] and len(found.rows) == 1
    assert sorted(path.name for path in (tmp_path / "sweep/inputs/00").iterdir()) == here
    # The program goes on with the files that the folder has.
    folder = str((tmp_path / "sweep").rename(tmp_path / "moved"))
    (tmp_path / "mine.toml").unlink()
    assert len(program("sweep", f"{folder}/sweep.toml", "--out", folder, "--resume")["rows"]) == 2


def test_what_is_wrong_is_said_before_anything_is_written(machines: Machines, tmp_path: Path) -> None:
    out = tmp_path / "sweep"
    cases: list[tuple[str, dict[str, Any], dict[str, Any], str]] = [
        ("cook", GRID, {}, "study: found cook, expected one of run, identify"),
        ("identify", {}, {}, "grid"),
        ("identify", {"seed": 1}, {}, "grid"),
        ("identify", {"seed": []}, {}, "grid"),
        ("identify", {"sede": [1]}, {}, "sede"),
        ("identify", GRID, {"hopz": 0}, "hopz"),
        ("identify", {"least_speed_mps": [1.0, -1.0]}, {}, "least_speed_mps"),
        ("identify", GRID, {"num_cpus": float("nan")}, "num_cpus"),
    ]
    for study, grid, more, said in cases:
        with pytest.raises(lapswarm.InputError, match=said):
            lapswarm.ray.sweep(study, grid, out=out, **(SMALL | more))
    with pytest.raises(lapswarm.FileError, match="none.csv"):
        lapswarm.ray.sweep("identify", GRID, out=out, **(SMALL | {"log": Path("none.csv")}))
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(lapswarm.DeviceError, match="no node has 1 CPUs and 1 GPUs"):
        lapswarm.ray.sweep("identify", GRID, out=out, num_gpus=1, **SMALL)
    assert list(tmp_path.iterdir()) == []
    out.mkdir()
    (out / "mine.txt").write_text("mine")
    with pytest.raises(lapswarm.InputError, match="other files"):
        lapswarm.ray.sweep("identify", GRID, out=out, **SMALL)
    assert [path.name for path in out.iterdir()] == ["mine.txt"]


def test_a_node_of_another_version_is_named_before_anything_is_written(machines: Machines, tmp_path: Path) -> None:
    (tmp_path / "lapswarm").mkdir()
    (tmp_path / "lapswarm/__init__.py").write_text("__version__ = '0.0.7'\n")
    machines.add(env_vars={"PYTHONPATH": str(tmp_path)})
    with pytest.raises(lapswarm.InputError, match=r"0\.0\.7"):
        lapswarm.ray.sweep("identify", GRID, out=tmp_path / "sweep", **SMALL)
    assert not (tmp_path / "sweep").exists()
