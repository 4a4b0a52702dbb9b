"""What travels to other machines: files that settings name go along with what names them."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from .. import _native
from ..errors import FileError, InputError
from ..problems import Made

_QUOTED = re.compile(rb"[\"']([^\"'\n]+)[\"']")


class Sent(str):
    """A file that goes along, by its name in the folder of inputs."""


class Inputs:
    """Files on their way, by their names in the folder where they arrive."""

    def __init__(self) -> None:
        self.files: dict[str, bytes] = {}
        self._names: dict[Path, Sent] = {}

    def packed(self, value: Any) -> Any:
        """The same value, in which files of this machine are replaced by what they are called where they arrive.

        A file is a path object, or a text with a suffix that names a file here.
        """
        if isinstance(value, Mapping):
            return {key: self.packed(entry) for key, entry in value.items()}
        if isinstance(value, (list, tuple)):
            return [self.packed(entry) for entry in value]
        if isinstance(value, PathLike) or (isinstance(value, str) and Path(value).suffix and Path(value).is_file()):
            return self._file(Path(fspath(value)))
        return value

    def _file(self, path: Path) -> Sent:
        path = path.absolute()
        if path not in self._names:
            folder = f"inputs/{len(self._names):02}"
            self._names[path] = Sent(f"{folder}/{path.name}")
            content = _read(path)
            self.files[self._names[path]] = content
            beside = [path.with_suffix(".ldx")] if path.suffix == ".ld" else []
            if path.suffix == ".toml":
                # A car names the files of its tyres, relative to its own.
                named = [Path(name.decode(errors="replace")) for name in _QUOTED.findall(content)]
                beside += [path.parent / name for name in named if name.suffix and not name.is_absolute()]
            for other in beside:
                inside = other.relative_to(path.parent)
                if ".." not in inside.parts and other.is_file():
                    self.files[f"{folder}/{inside.as_posix()}"] = _read(other)
        return self._names[path]

    def write(self, folder: Path) -> None:
        """Puts the files where they belong in a folder."""
        write_files(self.files, folder)


def write_files(files: Mapping[str, bytes], folder: Path) -> None:
    """Puts files where they belong in a folder."""
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


def _unpacked(value: Any, folder: Path) -> Any:
    if isinstance(value, dict):
        return {key: _unpacked(entry, folder) for key, entry in value.items()}
    if isinstance(value, list):
        return [_unpacked(entry, folder) for entry in value]
    return str(folder / value) if isinstance(value, Sent) else value


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}", file=str(path)) from None


class Recipe:
    """A problem as it travels: what it is made of, with all files that it reads."""

    def __init__(self, problem: _native.Problem) -> None:
        if not isinstance(problem, Made):
            message = "problem: found one that was made by hand, expected ReplayProblem or another of lapswarm's classes"
            raise InputError(message, file="problem")
        inputs = Inputs()
        self.kind = type(problem)
        self.given: list[Any] = inputs.packed(problem.given)
        self.settings: dict[str, Any] = inputs.packed(problem.settings)
        self.files = inputs.files
        self.version = _native.__version__

    def make(self) -> _native.Problem:
        """The problem, made again here."""
        with tempfile.TemporaryDirectory(prefix="lapswarm-") as folder:
            write_files(self.files, Path(folder))
            here = Path(folder)
            return self.kind(*_unpacked(self.given, here), **_unpacked(self.settings, here))
