"""Studies as functions: what the command line runs, with its settings as keyword arguments."""

from __future__ import annotations

import html
import inspect
import json
import webbrowser
from collections.abc import Callable
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from . import _native
from ._native import USUAL_MIB
from ._settings import STUDIES, as_text


class Result:
    """What a study came to.

    summary: its figures, as ``--json`` prints them. folder: where its files are. text: the figures in words. warnings: what
    must be told whatever is shown. interrupted: whether it was stopped before its end; ``resume=True`` continues it.
    verdict: what it did not reach of what it was asked to reach, None if it did.
    """

    def __init__(self, study: str, answer: dict[str, Any]) -> None:
        self.study = study
        self.summary: dict[str, Any] = json.loads(answer["json"])
        self.folder = Path(answer["folder"])
        self.text: str = answer["text"]
        self.warnings: list[str] = answer["warnings"]
        self.interrupted: bool = answer["interrupted"]
        self.verdict: str | None = answer["verdict"]

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


class Study:
    """A study: called, it runs. ``settings`` are the declarations of what it may be given."""

    def __init__(self, name: str) -> None:
        info = STUDIES[name]
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
    ) -> Result:
        """Runs the study.

        out: the run folder, else the next ``runs/STUDY-NNN``. resume: continues the interrupted run in ``out``. callback: is
        told of the progress (``stage``, ``done``, ``planned``, ``reached``), and stops the study when it returns something
        false that is not None. An interrupt stops the study too; what it has reached is saved and returned.
        """
        asked = {
            "out": None if out is None else fspath(out),
            "resume": resume,
            "save_every_s": save_every_s,
            "time_limit_s": time_limit_s,
            "memory_limit_mib": memory_limit_mib,
            "dry_run": False,
        }
        return Result(self.name, _native.run_study(self.name, as_text(self.name, settings), asked, callback))

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
        said: str = _native.run_study(self.name, as_text(self.name, settings), asked, None)["plan"]
        return said

    def __repr__(self) -> str:
        return f"<study {self.name}>"


def _line(setting: _native.Setting) -> str:
    words = [w for w in (setting["range"], "" if setting["unit"] == "-" else setting["unit"]) if w]
    told = f" ({' '.join(words)})" if words else ""
    usual = f" Default: {setting['default']}." if setting["default"] else ""
    return f"{setting['key']}: {setting['meaning']}{told}.{usual}\n"


run = Study("run")
identify = Study("identify")
envelope = Study("envelope")
raceline = Study("raceline")
hybrid = Study("hybrid")
transient = Study("transient")
sensitivity = Study("sensitivity")
surface = Study("surface")
