"""Problems: bounded decision variables and objectives, all of which are minimised."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike, fspath
from typing import Any

from . import _native
from ._frames import Car, in_passing
from ._settings import as_text

Path = str | PathLike[str]
# A file, or what a frame's columns are: pandas, polars, pyarrow, or a dict of arrays of shape (n,).
Table = Path | Any
Bounds = Mapping[str, Sequence[float]]


def _of_study(kind: str, study: str, settings: Mapping[str, Any], control_points: int | None = None) -> _native.Problem:
    """A problem as a study sets it up; frames and cars are files for as long as that takes."""
    with in_passing(settings) as files:
        return _native.Problem.of_study(kind, as_text(study, files), control_points)


def _again(kind: type[Made], given: Sequence[Any], settings: Mapping[str, Any]) -> Made:
    return kind(*given, **settings)


class Made(_native.Problem):
    """A problem that knows what it was made of: pickled, it is made again where it arrives."""

    def __init__(self, *given: Any, **settings: Any) -> None:
        self.given, self.settings = given, settings

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, (type(self), self.given, self.settings)


class ReplayProblem(Made):
    """Which car did what was logged: free parameters of a car, and how far it is from the log.

    car: a bundled name (``gt``, ``gt_hybrid``), a TOML file, a ``Car``, or a dict as such a file has it. log: a CSV or MoTeC file,
    or a frame with its columns; without one the bundled lap.
    free: parameters with their least and greatest value in the parameter's unit, as in ``{"mass_kg": (1100, 1300)}``;
    without it the usual 22. Variables are in the order of their names. objectives: of ``all``, ``vx``, ``ax``, ``ay``, ``yaw_rate``. settings: others of ``identify``,
    such as ``window_s`` and ``laps``.

    >>> cars = ReplayProblem("gt", free={"mass_kg": (1150, 1350)}, window_s=1.5, settle_s=0.5)
    >>> cars.names, cars.units, cars.bounds.shape
    (['mass_kg'], ['kg'], (1, 2))
    >>> found = _native.Evaluator(cars, "cpu").evaluate([[1245.0], [1300.0]])
    >>> bool(found.F[0, 0] < found.F[1, 0])
    True
    """

    def __new__(
        cls,
        car: Path | Car | Mapping[str, Any] = "gt",
        log: Table | None = None,
        *,
        free: Bounds | None = None,
        objectives: Sequence[str] | None = None,
        **settings: Any,
    ) -> ReplayProblem:
        settings |= {"car": car, "log": log, "free": free, "objectives": objectives}
        return super().__new__(cls, _of_study("replay", "identify", settings))


class LineProblem(Made):
    """Lines round a circuit: the share of the usable width from the right, from 0 to 1, at every cross-section or at
    ``control_points`` of a spline.

    track: a bundled name, a shape such as ``circle:590:600``, a file, or a frame with its columns (``x_m``, ``y_m`` and widths).
    objectives: of ``length`` (m), ``length_squared``,
    ``gamma``, ``kappa2``, ``lap_time`` (s). settings: others of ``raceline``, such as ``sections`` and ``car_width_m``.

    >>> circle = LineProblem("circle:590:600", sections=360, objectives=["length"])
    >>> circle.objectives, circle.objective_units, circle.bounds.shape
    (['length'], ['m'], (360, 2))
    >>> x = [[0.0] * 360, [1.0] * 360]  # along the right edge, and along the left one
    >>> right, left = _native.Evaluator(circle, "cpu").evaluate(x).F[:, 0]
    >>> bool(3700 < right < left < 3770)
    True
    """

    def __new__(
        cls,
        track: Table = "silverstone_gp",
        car: Path | Car | Mapping[str, Any] = "gt",
        *,
        objectives: Sequence[str] | None = None,
        control_points: int | None = None,
        **settings: Any,
    ) -> LineProblem:
        settings |= {"track": track, "car": car, "objectives": objectives}
        return super().__new__(cls, _of_study("line", "raceline", settings, control_points))


class EnergyProblem(Made):
    """Where a hybrid's energy goes on a lap: the share of each zone, from 0 to 1, in which the motor works.

    objectives: of ``lap_time_s`` (s), ``fuel_l`` (l), ``energy_used_mj`` (MJ), ``soc_swing``. settings: others of ``hybrid``,
    such as ``energy_mj`` and ``line``. Without a line the fastest is found first, which takes seconds.
    """

    def __new__(
        cls,
        track: Table = "silverstone_gp",
        car: Path | Car | Mapping[str, Any] = "gt_hybrid",
        *,
        objectives: Sequence[str] | None = None,
        **settings: Any,
    ) -> EnergyProblem:
        settings |= {"track": track, "car": car, "objectives": objectives}
        return super().__new__(cls, _of_study("energy", "hybrid", settings))


class DriveProblem(Made):
    """Set-ups of a car driven round lines by a driver: its lap time (s), how far it leaves the road (m), how much it steers.

    line: one or more files or frames with columns ``x_m`` and ``y_m``. parameters: those that set-ups move, each by ``share`` of its
    value either way. Variables are the parameters, then ``line`` (a whole number) if there are several, then ``grip_share``.
    settings: others of ``transient``, such as ``track`` and ``grip_shares``.
    """

    def __new__(
        cls,
        line: Table | Sequence[Table],
        car: Path | Car | Mapping[str, Any] = "gt",
        *,
        parameters: Sequence[str] | None = None,
        **settings: Any,
    ) -> DriveProblem:
        settings.setdefault("setups", 1)
        settings |= {"line": line, "car": car, "parameters": parameters}
        return super().__new__(cls, _of_study("drive", "transient", settings))


class SteadyProblem(Made):
    """Cars in steady-state cornering. Variables are the free parameters, then ``speed_mps`` and ``steer_rad``.

    free: parameters with their bounds. objectives: of ``minus_ay_mps2``, ``sideslip_rad``, ``yaw_rate_radps``, ``roll_rad``,
    ``slip_ratio``.

    >>> cars = SteadyProblem("gt", free={"mass_kg": (1000, 1400)}, objectives=["minus_ay_mps2", "roll_rad"])
    >>> cars.names
    ['mass_kg', 'speed_mps', 'steer_rad']
    >>> _native.Evaluator(cars, "cpu").evaluate([[1200.0, 30.0, 0.02]]).F.shape
    (1, 2)
    """

    def __new__(
        cls,
        car: Path | Car | Mapping[str, Any] = "gt",
        *,
        free: Bounds | None = None,
        speeds_mps: tuple[float, float] = (20.0, 70.0),
        steers_rad: tuple[float, float] = (0.0, 0.1),
        objectives: Sequence[str] = ("minus_ay_mps2",),
    ) -> SteadyProblem:
        rows = [(name, float(lower), float(upper)) for name, (lower, upper) in (free or {}).items()]
        with in_passing({"car": car}) as files:
            of = fspath(files["car"])
            made = _native.Problem.of_steady(of, rows, list(speeds_mps), list(steers_rad), list(objectives))
        return super().__new__(cls, made)


class OwnProblem(Made):
    """Variables and objectives of your own, for optimisers.

    bounds: the least and the greatest value of each variable, of shape (d, 2). objectives: how many, or their names.
    whole: which variables take whole numbers alone.

    >>> OwnProblem([(0, 9), (0, 1)], ["mass"], names=["plies", "share"], whole=[True, False])
    <problem of 2 variables and 1 objectives>
    """

    def __new__(
        cls,
        bounds: Sequence[Sequence[float]],
        objectives: int | Sequence[str] = 1,
        *,
        names: Sequence[str] | None = None,
        units: Sequence[str] | None = None,
        whole: Sequence[bool] | None = None,
    ) -> OwnProblem:
        pairs = [(float(lower), float(upper)) for lower, upper in bounds]
        count = len(pairs)
        columns = (
            list(names) if names is not None else [f"x{k + 1}" for k in range(count)],
            list(units) if units is not None else ["-"] * count,
            [bool(w) for w in whole] if whole is not None else [False] * count,
        )
        variables = [(n, u, lo, up, w) for n, u, w, (lo, up) in zip(*columns, pairs, strict=True)]
        listed = [f"f{k + 1}" for k in range(objectives)] if isinstance(objectives, int) else list(objectives)
        return super().__new__(cls, _native.Problem.of_own(variables, [(name, "-") for name in listed]))
