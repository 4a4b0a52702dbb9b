"""Frames in and out: pandas, polars, pyarrow and dicts of arrays alike, none of which has to be installed."""

from __future__ import annotations

import csv
import hashlib
import importlib
import os
import re
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from . import _native
from ._settings import as_toml
from .errors import Error, InputError

# Settings that are files, and may be given as frames: a column is for each key.
TABLES = ("envelope", "line", "log", "track")
# What columns hold that are no numbers: the first letters of Arrow's formats, and kinds of numpy's types.
WORDS = {"u": "text", "U": "text", "v": "text", "t": "time", "O": "text", "S": "text", "T": "text", "M": "time", "m": "time"}
KINDS = ("pandas", "polars", "numpy")


class Car:
    """A car with other values of its parameters, for ``car=``.

    base: a bundled name or a TOML file. parameters: values in their units, as in ``Car("gt", mass_kg=1300, rBy1=12)``;
    a tyre coefficient of one axle is given as ``**{"front.rBy1": 12}``.

    >>> Car("gt", mass_kg=1300, **{"front.rBy1": 12})
    Car('gt', mass_kg=1300, front.rBy1=12)
    """

    def __init__(self, base: str | os.PathLike[str] = "gt", **parameters: float) -> None:
        values = [(name, float(value)) for name, value in parameters.items()]
        self.base, self.parameters = os.fspath(base), dict(values)
        self.files: list[tuple[str, str]] = _native.car_files(self.base, values)

    def __repr__(self) -> str:
        return f"Car({', '.join([repr(self.base), *(f'{k}={v:g}' for k, v in self.parameters.items())])})"


def is_frame(value: Any) -> bool:
    """Whether a value has named columns, other than a dict."""
    return hasattr(value, "__arrow_c_stream__") or (hasattr(value, "columns") and hasattr(value, "__getitem__"))


def columns_of(frame: Any, name: str) -> dict[str, np.ndarray | str]:
    """The columns of a frame: arrays of shape (n,), or for what is no number its type in a word. name: what errors call it."""
    columns: dict[str, np.ndarray | str] = {}
    for column, values in _pairs(frame, name):
        if column in columns:
            raise InputError(f"{name}: column {column}: found a second one, expected each once", name, field=column)
        if isinstance(values, str):  # a format of Arrow's
            values = f"a {WORDS.get(values[0], values)}"
        else:
            values = np.asarray(values)
            if values.dtype == object:  # None is a missing number
                try:
                    values = values.astype(float)
                except (TypeError, ValueError):
                    pass
            if values.dtype.kind not in "fiub":
                values = f"a {WORDS.get(values.dtype.kind, values.dtype)}"
            elif values.ndim != 1:
                said = f"{name}: column {column}: found an array of shape {values.shape}, expected one of shape (n,)"
                raise InputError(said, name, field=column)
        columns[column] = values
    lengths = {column: len(values) for column, values in columns.items() if not isinstance(values, str)}
    if len(set(lengths.values())) > 1:
        told = ", ".join(f"{column} {length}" for column, length in lengths.items())
        raise InputError(f"{name}: found columns of different lengths ({told}), expected one length", name)
    return columns


def _pairs(frame: Any, name: str) -> Iterable[tuple[str, Any]]:
    if isinstance(frame, Mapping):
        return [(str(column), values) for column, values in frame.items()]
    if hasattr(frame, "__arrow_c_stream__"):
        try:
            return _native.arrow_columns(frame.__arrow_c_stream__(), name)
        except ImportError:  # pandas has it only beside pyarrow
            pass
    return [(str(column), frame[column].to_numpy()) for column in frame.columns]


def frame_of(columns: Mapping[str, Any], kind: str | None = None) -> Any:
    """Columns as a frame of pandas or polars, or as a dict of arrays of numpy; without a kind the first that is installed.

    >>> frame_of({"x_m": [0.0, 1.0]}, "numpy")
    {'x_m': array([0., 1.])}
    """
    arrays = {name: np.asarray(values) for name, values in columns.items()}
    if kind not in (None, *KINDS):
        raise InputError(f"frame: kind: found {kind}, expected {', '.join(KINDS)}", "frame", field="kind")
    for package in KINDS if kind is None else (kind,):
        if package == "numpy":
            break
        try:
            return importlib.import_module(package).DataFrame(arrays)
        except ImportError:
            if kind is not None:
                raise
    return arrays


def read_table(path: Path) -> dict[str, np.ndarray]:
    """The columns of a table of a run folder: numbers, not a number where a cell is empty, or texts."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    head, body = rows[0], rows[1:]
    columns = {}
    for k, name in enumerate(head):
        cells = [row[k] if k < len(row) else "" for row in body]
        try:
            columns[name] = np.array([float(cell) if cell else np.nan for cell in cells])
        except ValueError:
            columns[name] = np.array(cells, dtype=object)
    return columns


class Given:
    """What was given as frames and cars: files in their place, and what errors call them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.names: dict[str, str] = {}
        self.written: list[Path] = []

    def put(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        """The settings with a file for each frame and car."""
        return {key: self._put(key, value) for key, value in settings.items()}

    def _put(self, key: str, value: Any) -> Any:
        if isinstance(value, Car):
            return self._files(key, value.files)
        if key == "car" and isinstance(value, Mapping):
            return self._files(key, [("car.toml", as_toml(_with_whole_paths(value)))])
        if key in TABLES and isinstance(value, (list, tuple)):
            return [self._put(f"{key}[{k}]", one) for k, one in enumerate(value)]
        table = key.partition("[")[0] in TABLES
        if is_frame(value) or (table and isinstance(value, Mapping)):
            if not table:
                said = f"{key}: found a frame, expected a value; frames are taken as {', '.join(TABLES)}"
                raise InputError(said, key, field=key)
            return self._table(key, value)
        return value

    def _table(self, key: str, frame: Any) -> str:
        name = f"the frame given as {key}"
        columns = columns_of(frame, name)
        count = max((len(values) for values in columns.values() if not isinstance(values, str)), default=0)
        if count == 0:
            raise InputError(f"{name}: found no rows of numbers, expected some", name)
        # What is no number is refused by whoever needs it, and by nobody else.
        cells = [[values] * count if isinstance(values, str) else _cells(values) for values in columns.values()]
        lines = [",".join(map(_quoted, columns)), *map(",".join, zip(*cells, strict=True))]
        return self._files(key, [("table.csv", "\n".join(lines) + "\n")])

    def _files(self, key: str, files: list[tuple[str, str]]) -> str:
        """Writes files of one kind into a folder that is named by what is in them, and returns the path of the last."""
        said = hashlib.sha256(repr(files).encode()).hexdigest()[:16]
        folder = self.folder / f"{re.sub(r'[^a-z0-9]+', '-', key).strip('-')}-{said}"
        if not folder.is_dir():
            self.folder.mkdir(parents=True, exist_ok=True)
            new = Path(tempfile.mkdtemp(dir=self.folder, prefix=".new-"))
            for name, text in files:
                (new / name).write_text(text, encoding="utf-8")
            try:
                new.rename(folder)
                self.written.append(folder)
            except OSError:  # another process was first, with the same
                _remove(new)
        path = folder / files[-1][0]
        for called in {str(path), str(path.absolute())}:
            self.names[called] = f"the {'car' if path.suffix == '.toml' else 'frame'} given as {key}"
        return str(path.absolute())

    def remove(self) -> None:
        """Takes away what was written."""
        for folder in self.written:
            _remove(folder)
        if self.written and not any(self.folder.iterdir()):
            self.folder.rmdir()

    @contextmanager
    def named(self) -> Iterator[None]:
        """Errors about the files speak of what was given; nothing is left of input that is refused."""
        try:
            yield
        except Error as error:
            if isinstance(error, InputError):
                self.remove()
            for path, name in self.names.items():
                if error.file != path:
                    continue
                # The head of a table is its first line; rows count from 0, as in frames.
                said = str(error).replace(path, name)
                if error.line is not None and path.endswith(".csv"):
                    row = error.line - 2
                    said = said.replace(f"line {error.line}", f"row {row} (from 0)" if row >= 0 else "columns")
                error.args = (said,)
                error.file, error.line = name, None
            raise


@contextmanager
def in_passing(settings: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """The settings with a file for each frame and car, for as long as a problem is set up from them."""
    with tempfile.TemporaryDirectory(prefix="lapswarm-") as folder:
        given = Given(Path(folder) / "given")
        with given.named():
            yield given.put(settings)


def _cells(values: np.ndarray) -> list[str]:
    return ["" if x != x else repr(x) for x in values.astype(float).tolist()]


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"' if any(c in name for c in ',"\n') else name


def _remove(folder: Path) -> None:
    for path in folder.iterdir():
        path.unlink()
    folder.rmdir()


def _with_whole_paths(car: Mapping[str, Any]) -> dict[str, Any]:
    """A car's tyre files are found from where its file is, which is elsewhere."""
    tyres = car.get("tyres")
    if not isinstance(tyres, Mapping):
        return dict(car)
    whole = {axle: os.path.abspath(of) if isinstance(of, (str, os.PathLike)) else of for axle, of in tyres.items()}
    return {**car, "tyres": whole}
