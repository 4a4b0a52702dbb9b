"""Settings given as keyword arguments, as the text of a study file."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from typing import Any

from . import _native

# Settings that are lists, of which one alone may be given.
LISTS = {("transient", "line")}
STUDIES: dict[str, _native.StudyInfo] = {study["name"]: study for study in _native.studies()}


def _value(value: Any) -> str:
    if hasattr(value, "tolist"):  # numbers and arrays of numpy
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else str(value).replace("Infinity", "inf")
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        rows = (f"{json.dumps(str(k), ensure_ascii=False)} = {_value(v)}" for k, v in value.items() if v is not None)
        return "{" + ", ".join(rows) + "}"
    if isinstance(value, (list, tuple, set, frozenset)):
        return "[" + ", ".join(_value(v) for v in value) + "]"
    raise TypeError(f"a setting cannot be a {type(value).__name__}: {value!r}")


def _key(study: str, name: str) -> str:
    """The key of a setting: an entry of a table may be called without its table, as in population for swarm.population."""
    keys = [setting["key"] for setting in STUDIES[study]["settings"]]
    if name not in keys:
        for key in keys:
            if key.endswith("." + name):
                return key
    return name


def as_text(study: str, settings: Mapping[str, Any]) -> str:
    """The study file that says the same; None stands for the default."""
    lines = []
    for name, value in settings.items():
        if (study, name) in LISTS and isinstance(value, (str, os.PathLike)):
            value = [value]
        if value is not None:
            lines.append(f"{_key(study, name)} = {_value(value)}\n")
    return "".join(lines)


def as_toml(table: Mapping[str, Any]) -> str:
    """A table as the text of a TOML file."""
    return "".join(f"{json.dumps(name)} = {_value(value)}\n" for name, value in table.items() if value is not None)
