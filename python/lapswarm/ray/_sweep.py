"""Sweeps: the rows are tasks of Ray, the folder is that of ``lapswarm sweep``."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import ray

from .. import _native
from .._settings import STUDIES, _key, _value, as_text
from ..errors import DeviceError, Error, FileError, InputError, StudyError
from ..studies import Study
from . import _cluster
from ._inputs import Inputs, write_files
from ._store import write_whole

# What the program ends with, and what it means.
_ERRORS: dict[int, type[Error]] = {1: StudyError, 2: InputError, 3: DeviceError}
# Rows that wait at the cluster, for each that is at work.
_WAITING = 3


class _Killed(Exception):
    """A signal has ended the program: it is run again."""


@dataclass(frozen=True)
class Sweep:
    """What a sweep came to.

    folder: that of ``lapswarm sweep``, with its tables and its page. rows: every row, as its file has it. failed: why runs failed
    that came to no figures.
    """

    folder: Path
    rows: list[dict[str, Any]]
    failed: list[str]

    @property
    def frame(self) -> Any:
        """A row for each run that has figures, with settings and figures as columns: a frame of pandas, else a list of dicts."""
        table = [
            {"run": row["run"]}
            | row["settings"]
            | row["figures"]
            | {name: row[name] for name in ("exit_code", "machine", "elapsed_s")}
            for row in self.rows
            if row["figures"]
        ]
        try:
            import pandas
        except ImportError:
            return table
        return pandas.DataFrame(table)

    def __repr__(self) -> str:
        return f"<sweep of {len(self.rows)} rows, {len(self.failed)} of which failed, in {self.folder}>"


def sweep(
    study: str | Study[Any],
    grid: Mapping[str, Sequence[Any]],
    *,
    out: str | PathLike[str],
    resume: bool = False,
    num_cpus: float = 1,
    num_gpus: float = 0,
    retries: int = 3,
    callback: Callable[[dict[str, Any]], object] | None = None,
    **base: Any,
) -> Sweep:
    """Runs a study over a grid of settings, a row for each combination.

    study: a study such as ``lapswarm.identify``, or its name. grid: settings with the values that they take; the seed changes
    fastest. base: settings that all rows share. Files that settings name go along, and are kept in ``out``. out: the folder,
    which the driver alone writes; with ``resume`` it may hold a part of the sweep, and rows that are there are not done again.
    num_cpus, num_gpus: what a row takes. retries: how often a row is done again whose worker or node was lost. callback: is told
    ``done``, ``planned`` and ``row``, and stops the sweep when it returns something false that is not None.

    A row that fails stops no other; ``resume`` tries it again. The backend ``auto`` is ``gpu`` with GPUs, else ``simd``.
    """
    name = study.name if isinstance(study, Study) else study
    if name not in STUDIES:
        raise InputError(f"study: found {name}, expected one of {', '.join(STUDIES)}", field="study")
    if not grid or any(isinstance(v, (str, Mapping)) or not hasattr(v, "__len__") or not len(v) for v in grid.values()):
        raise InputError("grid: expected settings, each with a list of values", field="grid")
    for setting, value, least in (("num_cpus", num_cpus, 0.0), ("num_gpus", num_gpus, 0.0), ("retries", retries, 0)):
        if not value >= least:
            raise InputError(f"{setting}: found {value}, expected {least} or more", field=setting)
    if (base.get("backend") or "auto") == "auto" and "backend" not in grid:
        base["backend"] = "gpu" if num_gpus else "simd"
    inputs = Inputs()
    shared = as_text(name, inputs.packed(base))
    # The program takes the keys in this order.
    axes = {_key(name, key): [_value(v) for v in inputs.packed(list(values))] for key, values in grid.items()}
    axes = dict(sorted(axes.items(), key=lambda axis: (axis[0] == "seed", axis[0])))
    folder = Path(fspath(out)).absolute()
    _cluster.join()
    _check_cluster(num_cpus, num_gpus)
    text = _text(name, shared, axes)
    _begin(folder, text, inputs, resume)
    with _alone(folder):
        rows = {row["run"]: row for row in _rows(folder) if row["figures"]}
        points = itertools.product(*axes.values())
        one = ({key: [value] for key, value in zip(axes, point, strict=True)} for point in points)
        left = [(run, _text(name, shared, axis)) for run, axis in enumerate(one) if run not in rows]
        planned = len(rows) + len(left)
        lost: list[str] = []
        if left:
            with contextlib.closing(_done(left, inputs, num_cpus, num_gpus, retries, lost)) as done:
                for count, (run, files) in enumerate(done, planned - len(left) + 1):
                    row = json.loads(files["row"]) | {"run": run}
                    # The row comes last: with it, the run is done.
                    for ending in ("toml", "json"):
                        if ending in files:
                            write_whole(folder / f"studies/{run:05}.{ending}", files[ending])
                    write_whole(folder / f"rows/{run:05}.json", json.dumps(row, indent=2, ensure_ascii=False).encode())
                    rows[run] = row
                    _cluster.tell(f"row {count} of {planned}")
                    said = None if callback is None else callback({"done": count, "planned": planned, "row": row})
                    if said is not None and not said:
                        break
            _cluster.told()
    _program(["sweep", "sweep.toml", "--out", ".", "--gather", "--quiet", "--json"], folder, unless=folder / "summary.json")
    if lost:
        raise StudyError(f"{len(lost)} rows were lost with their workers, resume=True tries them again; {lost[0]}")
    ordered = [rows[run] for run in sorted(rows)]
    failed = [f"run {row['run']:05} failed: {(row['log'] or ['no reason'])[-1]}" for row in ordered if not row["figures"]]
    return Sweep(folder, ordered, failed)


def _text(name: str, shared: str, axes: Mapping[str, list[str]]) -> str:
    grid = "".join(f"{json.dumps(key)} = [{', '.join(values)}]\n" for key, values in axes.items())
    return f"study = {json.dumps(name)}\n\n[base]\n{shared}\n[grid]\n{grid}"


def _check_cluster(num_cpus: float, num_gpus: float) -> None:
    """Refuses a cluster whose nodes have other versions, or no room for a row."""
    nodes = _cluster.nodes(strict=True)
    sizes = [node["Resources"] for node in nodes]
    if not any(size.get("CPU", 0) >= num_cpus and size.get("GPU", 0) >= num_gpus for size in sizes):
        message = f"the cluster: no node has {num_cpus:g} CPUs and {num_gpus:g} GPUs, which a row needs"
        raise DeviceError(message, file="the cluster")


def _begin(folder: Path, text: str, inputs: Inputs, resume: bool) -> None:
    """Makes the folder, or checks that it holds the same sweep. All points are read before anything is there."""
    if (folder / "sweep.toml").is_file():
        if not resume:
            message = f"{folder}: found a sweep, expected an empty folder, or resume=True"
            raise InputError(message, file=str(folder), field="out")
        if (folder / "sweep.toml").read_text(encoding="utf-8") != text:
            message = f"{folder}: found another sweep, expected the one that is resumed"
            raise InputError(message, file=str(folder / "sweep.toml"), field="resume")
        for file, content in inputs.files.items():
            if not (folder / file).is_file() or (folder / file).read_bytes() != content:
                message = f"{folder / file}: found another file, expected the one that the sweep was begun with"
                raise InputError(message, file=str(folder / file), field="resume")
        return
    if folder.exists() and any(entry.name != ".lock" for entry in folder.iterdir()):
        message = f"{folder}: found other files, expected an empty folder"
        raise InputError(message, file=str(folder), field="out")
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{folder.name}-", dir=folder.parent) as place:
        begun = Path(place)
        (begun / "sweep.toml").write_text(text, encoding="utf-8")
        inputs.write(begun)
        # No time for any row: the program reads all points and makes the folder.
        _program(["sweep", "sweep.toml", "--out", "run", "--rows", "..", "--time-limit-s", "0", "--quiet", "--json"], begun)
        for made in ("rows", "studies"):
            (begun / "run" / made).mkdir(exist_ok=True)
        # It knows files by where they were.
        (begun / "run/studies/inputs.json").unlink(missing_ok=True)
        if (begun / "inputs").is_dir():
            shutil.move(begun / "inputs", begun / "run/inputs")
        if folder.exists():
            (folder / ".lock").unlink(missing_ok=True)
            folder.rmdir()
        (begun / "run").replace(folder)


def _rows(folder: Path) -> list[dict[str, Any]]:
    """The rows that are there."""
    found = []
    for path in sorted((folder / "rows").glob("*.json")):
        try:
            found.append(json.loads(path.read_bytes()))
        except ValueError:
            raise InputError(f"{path}: found something else, expected a row", file=str(path)) from None
    return found


@contextlib.contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Keeps other processes out of the folder, those of the program too, as it does itself."""
    try:
        import fcntl
    except ImportError:  # not on this system
        yield
        return
    with (folder / ".lock").open("a+") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            message = f"{folder}: another process works in it"
            raise FileError(message, file=str(folder)) from None
        except OSError:
            # A file system without locks.
            pass
        try:
            yield
        finally:
            (folder / ".lock").unlink(missing_ok=True)


def _done(
    left: list[tuple[int, str]], inputs: Inputs, num_cpus: float, num_gpus: float, retries: int, lost: list[str]
) -> Generator[tuple[int, dict[str, bytes]], None, None]:
    """The files of rows as they are done; those that could not be are added to ``lost``."""
    task = ray.remote(_row).options(
        num_cpus=num_cpus,
        num_gpus=num_gpus,
        max_retries=retries,
        retry_exceptions=[_Killed],
        scheduling_strategy="SPREAD",
    )
    files = ray.put(inputs.files)
    begun = iter(left)
    running: dict[Any, int] = {}
    try:
        while True:
            cpus = ray.cluster_resources().get("CPU", 1.0)
            most = 1 + int(_WAITING * cpus / max(num_cpus, 0.1))
            for run, text in itertools.islice(begun, max(0, most - len(running))):
                running[task.remote(text, files, _native.__version__, max(1, int(num_cpus)))] = run
            if not running:
                return
            ready, _ = ray.wait(list(running), num_returns=1)
            run = running.pop(ready[0])
            try:
                found = _cluster.get(ready[0])
            except (ray.exceptions.RaySystemError, ray.exceptions.WorkerCrashedError, _Killed) as error:
                lost.append(f"run {run:05}: {error}")
                continue
            yield run, found
    finally:
        for reference in running:
            ray.cancel(reference, force=True)


def _row(text: str, files: dict[str, bytes], version: str, threads: int) -> dict[str, bytes]:
    """Runs a sweep of one row with the program, and hands back what it wrote."""
    _cluster.check_version(version)
    with tempfile.TemporaryDirectory(prefix="lapswarm-") as place:
        folder = Path(place)
        (folder / "sweep.toml").write_text(text, encoding="utf-8")
        write_files(files, folder)
        adapter = _cluster.adapter()
        environment = {"RAYON_NUM_THREADS": str(threads)} | ({} if adapter is None else {"LAPSWARM_ADAPTER": adapter})
        arguments = ["sweep", "sweep.toml", "--out", "run", "--rows", "0", "--quiet", "--json"]
        written = {
            "row": folder / "run/rows/00000.json",
            "toml": folder / "run/studies/00000.toml",
            "json": folder / "run/studies/00000.json",
        }
        _program(arguments, folder, environment, unless=written["row"])
        return {name: path.read_bytes() for name, path in written.items() if path.is_file()}


def _program(arguments: list[str], folder: Path, environment: Mapping[str, str] | None = None, unless: Path | None = None) -> None:
    """Runs the program in a folder, and raises what it says of an error.

    unless: a file that it has written nevertheless, where it only says that a row has failed.
    """
    command = [sys.executable, "-m", "lapswarm.command_line", *arguments]
    # Where this is imported from, the program is too.
    found_at = os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
    surroundings = {**os.environ, "PYTHONPATH": found_at, **(environment or {})}
    ended = subprocess.run(
        command, cwd=folder, env=surroundings, capture_output=True, text=True, preexec_fn=_end_with_parent, check=False
    )
    if ended.returncode < 0 or ended.returncode > 128:
        raise _Killed(f"the program was ended by signal {abs(ended.returncode) % 128}")
    if ended.returncode == 0 or (ended.returncode == 1 and unless is not None and unless.is_file()):
        return
    try:
        said = json.loads(ended.stdout)["error"]
    except (ValueError, KeyError):
        said = {"message": (ended.stderr or ended.stdout).strip()}
    place = {name: said.get(name) for name in ("file", "line", "field")}
    raise _ERRORS.get(ended.returncode, StudyError)(said["message"], **place)


def _end_with_parent() -> None:
    """Asks the system to end the program with the worker that runs it, however that one ends."""
    if sys.platform == "linux":
        import ctypes
        import signal

        ctypes.CDLL(None).prctl(1, signal.SIGKILL)
