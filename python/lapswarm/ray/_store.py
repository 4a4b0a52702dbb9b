"""Where islands keep their states: a folder, or any place that fsspec reaches."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from ..errors import InputError

_MAGIC = b"LAPSWARM ISLANDS 1\n"


class Store:
    """Files by name in one place, each written whole."""

    def __init__(self, place: str | PathLike[str]) -> None:
        self.place = fspath(place)
        self.remote: Any = None
        if "://" in self.place:
            try:
                from fsspec.core import url_to_fs
            except ImportError:
                message = f"out: found {self.place}, which takes the package fsspec"
                raise InputError(message, file="out", field="out") from None
            self.remote, self.root = url_to_fs(self.place)
        else:
            self.root = self.place

    def names(self) -> list[str]:
        """The names of all files, in order."""
        if self.remote is None:
            return sorted(path.name for path in Path(self.root).glob("*") if path.is_file())
        if not self.remote.exists(self.root):
            return []
        self.remote.invalidate_cache()
        return sorted(path.rsplit("/", 1)[-1] for path in self.remote.ls(self.root, detail=False))

    def read(self, name: str) -> bytes:
        """A file."""
        if self.remote is None:
            return (Path(self.root) / name).read_bytes()
        found: bytes = self.remote.cat_file(f"{self.root}/{name}")
        return found

    def write(self, name: str, content: bytes) -> None:
        """Writes a file: on a disk beside its place, then moved there; an object store has it once it has all of it."""
        if self.remote is None:
            write_whole(Path(self.root) / name, content)
        else:
            self.remote.makedirs(self.root, exist_ok=True)
            self.remote.pipe_file(f"{self.root}/{name}", content)

    def remove(self, name: str) -> None:
        """Removes a file."""
        if self.remote is None:
            (Path(self.root) / name).unlink(missing_ok=True)
        else:
            self.remote.rm_file(f"{self.root}/{name}")


def write_whole(path: Path, content: bytes) -> None:
    """Writes a file beside its place and moves it there: it is whole, or as it was."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with beside.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        beside.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            beside.unlink()
        raise


def sealed(head: dict[str, Any], states: list[bytes]) -> bytes:
    """States with what they are of, and a sum over all."""
    line = json.dumps(head | {"lengths": [len(state) for state in states]}, sort_keys=True).encode()
    body = _MAGIC + line + b"\n" + b"".join(states)
    return body + hashlib.sha256(body).digest()


def unsealed(content: bytes) -> tuple[dict[str, Any], list[bytes]] | None:
    """What was sealed; None if it is damaged or something else."""
    body, total = content[:-32], content[-32:]
    if not body.startswith(_MAGIC) or hashlib.sha256(body).digest() != total:
        return None
    line, rest = body[len(_MAGIC) :].split(b"\n", 1)
    head = json.loads(line)
    states = []
    for length in head.pop("lengths"):
        states.append(rest[:length])
        rest = rest[length:]
    return head, states
