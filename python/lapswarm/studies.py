"""Studies as functions: what the command line runs, with its settings as keyword arguments."""

from __future__ import annotations

import html
import inspect
import json
import webbrowser
from collections.abc import Callable
from os import PathLike, fspath
from pathlib import Path
from typing import Any, Generic, TypeVar

from . import _native, figures
from ._frames import Given, frame_of, in_passing, read_table
from ._native import USUAL_MIB
from ._settings import STUDIES, as_text
from .errors import InputError

F = TypeVar("F")


class Result(Generic[F]):
    """What a study came to.

    figures: typed, as ``found.figures.parameters[0].value``. summary: the same as ``--json`` prints them, a dict. folder: where
    its files are. tables: names of those that ``frame`` reads. text: the figures in words. warnings: what must be told whatever
    is shown. interrupted: whether it was stopped before its end; ``resume=True`` continues it. verdict: what it did not reach
    of what it was asked to reach, None if it did.

    >>> import tempfile
    >>> folder = tempfile.TemporaryDirectory()
    >>> found = surface(out=folder.name + "/run", section="Abbey", grid=3, backend="simd")
    >>> found.figures.study, len(found.figures.base), found.interrupted
    ('surface', 2, False)
    >>> {len(column) for column in found.frame(found.tables[0], "numpy").values()}
    {9}
    >>> folder.cleanup()
    """

    def __init__(self, study: str, kind: Any, answer: dict[str, Any]) -> None:
        self.study = study
        self.summary: dict[str, Any] = json.loads(answer["json"])
        self.figures: F = figures.typed(kind, self.summary)
        self.folder = Path(answer["folder"])
        self.text: str = answer["text"]
        self.warnings: list[str] = answer["warnings"]
        self.interrupted: bool = answer["interrupted"]
        self.verdict: str | None = answer["verdict"]

    @property
    def tables(self) -> list[str]:
        """Names of the tables in the run folder, ``stage/name`` for those of a stage."""
        found = self.folder.rglob("*.csv")
        return sorted(path.relative_to(self.folder).with_suffix("").as_posix() for path in found)

    def frame(self, name: str, kind: str | None = None) -> Any:
        """A table of the run folder as a frame: numbers, not a number where a cell is empty, or texts.

        kind: ``pandas``, ``polars`` or ``numpy`` (a dict of arrays of shape (n,)); without it the first that is installed.
        """
        if name not in self.tables:
            expected = ", ".join(self.tables)
            raise InputError(f"{self.folder}: table: found {name}, expected one of {expected}", str(self.folder), field=name)
        return frame_of(read_table(self.folder / f"{name}.csv"), kind)

    def report(self, open_it: bool = True) -> Path:
        """The page with all tables and pictures; it is opened in a browser unless ``open_it`` is false."""
        page = self.folder / "report.html"
        if open_it:
            webbrowser.open(page.resolve().as_uri())
        return page

    def __repr__(self) -> str:
        return f"<{self.study}{' (interrupted)' if self.interrupted else ''} in {self.folder}>\n{self.text}"

    def _repr_html_(self) -> str:
        shown = {k: v for k, v in self.summary.items() if isinstance(v, (str, int, float)) and v != ""}
        rows = "".join(f"<tr><th>{html.escape(k)}</th><td>{html.escape(str(v))}</td></tr>" for k, v in shown.items())
        pictures = sorted(self.folder.glob("*.svg"))
        picture = pictures[0].read_text(encoding="utf-8") if pictures else ""
        return f"<table>{rows}</table>{picture}"


class Study(Generic[F]):
    """A study: called, it runs. ``settings`` are the declarations of what it may be given."""

    def __init__(self, name: str, kind: Any) -> None:
        info = STUDIES[name]
        self.kind = kind
        self.name = self.__name__ = name
        self.settings = info["settings"]
        self.__doc__ = info["about"] + "\n\n" + "".join(map(_line, self.settings))
        keyword = inspect.Parameter.KEYWORD_ONLY
        usual = list(inspect.signature(Study.__call__).parameters.values())[1:-1]
        keys = dict.fromkeys(setting["key"].split(".")[0] for setting in self.settings)
        given = [inspect.Parameter(key, keyword, default=None) for key in keys]
        self.__signature__ = inspect.Signature(usual + given)

    def __call__(
        self,
        *,
        out: str | PathLike[str] | None = None,
        resume: bool = False,
        save_every_s: float = 5.0,
        time_limit_s: float | None = None,
        memory_limit_mib: int = USUAL_MIB,
        callback: Callable[[dict[str, Any]], object] | None = None,
        **settings: Any,
    ) -> Result[F]:
        """Runs the study.

        out: the run folder, else the next ``runs/STUDY-NNN``. resume: continues the interrupted run in ``out``. callback: is
        told of the progress (``stage``, ``done``, ``planned``, ``reached``), and stops the study when it returns something
        false that is not None. An interrupt stops the study too; what it has reached is saved and returned.

        log, track, line and envelope may be frames (pandas, polars, pyarrow, anything of Arrow's C interface) or dicts of arrays
        of shape (n,), with the columns of the files; car may be a ``Car`` or a dict as its TOML file has it. They are kept
        beside the run folder, in ``frames``, for as long as the run may be resumed or checked.
        """
        asked = {
            "out": None if out is None else fspath(out),
            "resume": resume,
            "save_every_s": save_every_s,
            "time_limit_s": time_limit_s,
            "memory_limit_mib": memory_limit_mib,
            "dry_run": False,
        }
        given = Given((Path("runs") if out is None else Path(out).absolute().parent) / "frames")
        with given.named():
            text = as_text(self.name, given.put(settings))
            return Result(self.name, self.kind, _native.run_study(self.name, text, asked, callback))

    def plan(self, **settings: Any) -> str:
        """Reads and checks all that is needed and says what would be done. Nothing is written."""
        asked = {
            "out": None,
            "resume": False,
            "save_every_s": 5.0,
            "time_limit_s": None,
            "memory_limit_mib": USUAL_MIB,
            "dry_run": True,
        }
        with in_passing(settings) as files:
            said: str = _native.run_study(self.name, as_text(self.name, files), asked, None)["plan"]
        return said

    def __repr__(self) -> str:
        return f"<study {self.name}>"


def _line(setting: _native.Setting) -> str:
    words = [w for w in (setting["range"], "" if setting["unit"] == "-" else setting["unit"]) if w]
    told = f" ({' '.join(words)})" if words else ""
    usual = f" Default: {setting['default']}." if setting["default"] else ""
    return f"{setting['key']}: {setting['meaning']}{told}.{usual}\n"


run: Study[figures.RunFigures] = Study("run", figures.RunFigures)
identify: Study[figures.Identified] = Study("identify", figures.Identified)
envelope: Study[figures.Enveloped] = Study("envelope", figures.Enveloped)
raceline: Study[figures.Lines] = Study("raceline", figures.Lines)
hybrid: Study[figures.Energy] = Study("hybrid", figures.Energy)
transient: Study[figures.DrivenLine | figures.DrivenSetUps] = Study(
    "transient", figures.DrivenLine | figures.DrivenSetUps
)
sensitivity: Study[figures.Sensitivities] = Study("sensitivity", figures.Sensitivities)
surface: Study[figures.SurfaceFigures] = Study("surface", figures.SurfaceFigures)
