"""What studies find, with the types of their figures. The book's chapter on JSON says what each key means.

Names end in their unit. None stands where a figure does not apply.
"""

from __future__ import annotations

import types
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

T = TypeVar("T")
Pair = tuple[float, float]


@dataclass(frozen=True)
class Figures:
    """How a study ran: what all of them tell."""

    study: str
    seed: int
    backend: str
    adapter: str
    driver: str
    elapsed_s: float
    evaluations: int
    evaluations_per_s: float | None
    failures: dict[str, int]
    device_faults: list[str]
    longest_dispatch_ms: float | None
    interrupted: bool
    ended_by: str | None


@dataclass(frozen=True)
class Parameter:
    """One free parameter of a car."""

    name: str
    unit: str
    bounds: Pair
    swarm_value: float
    value: float | None
    car_value: float
    standard_error: float | None
    truth: float | None
    at_bound: bool


@dataclass(frozen=True)
class Untold:
    """Parameters that a log does not tell apart."""

    parameters: list[str]
    combinations_told: int


@dataclass(frozen=True)
class Tried:
    """A number of free parameters that was tried."""

    parameters: int
    held_out_error: float


@dataclass(frozen=True)
class Choice:
    """How free parameters were chosen by a log."""

    names: list[str]
    among: int
    starting_error: float | None
    tried: list[Tried]
    not_chosen: str | None


@dataclass(frozen=True)
class Finding:
    """What was found about a channel of a log."""

    role: str
    kind: str
    value: float
    standard_error: float | None
    threshold: float | None
    applied: bool
    correlation: float | None
    samples: int
    evidence: str


@dataclass(frozen=True)
class Calibration:
    """What was found about a log's channels."""

    findings: list[Finding]
    notes: list[str]


@dataclass(frozen=True)
class Identified(Figures):
    """Figures of ``identify``."""

    swarm_elapsed_s: float
    particle_steps_per_s: float
    total_parameter_error: float | None
    swarm_total_parameter_error: float | None
    costs: dict[str, float]
    rms_error: dict[str, float]
    rms_signal: dict[str, float]
    holdout_rms_error: dict[str, float] | None
    holdout_rms_signal: dict[str, float] | None
    holdout_lost_windows: tuple[int, int] | None
    verdict: str
    verdict_text: str
    unidentifiable: list[str]
    untold_groups: list[Untold]
    step_in_standard_errors: float | None
    errors_look_like_noise: bool
    hops: tuple[int, int]
    singular_values: list[float]
    noise_estimate: dict[str, float]
    parameters: list[Parameter]
    sample_interval_s: float
    substeps: int
    substeps_needed: int
    windows: int
    settle_s: float
    choice: Choice | None
    notes: list[str]
    calibration: Calibration


@dataclass(frozen=True)
class Limits:
    """Limits of a car at a speed."""

    v_mps: float
    ay_mps2: float
    ax_grip_mps2: float
    ax_drive_mps2: float
    drag_mps2: float


@dataclass(frozen=True)
class SmallSteering:
    """How a car answers to small steering at a speed."""

    v_mps: float
    yaw_rate_gain_1ps: float
    ay_gain_mps2: float
    sideslip_gain: float
    stability_factor_s2_per_m2: float
    frequency_hz: float | None
    damping_ratio: float | None
    slowest_decay_1ps: float


@dataclass(frozen=True)
class Supported:
    """What a log reached about a speed of the limits."""

    v_mps: float
    ay_mps2: float | None
    ax_grip_mps2: float | None
    ay_extrapolated: bool
    ax_extrapolated: bool


@dataclass(frozen=True)
class Measured:
    """How much of the limits a log takes, as shares of them."""

    log: str
    samples: int
    used_median: float
    used_p95: float
    used_greatest: float
    beyond_share: float


@dataclass(frozen=True)
class Enveloped(Figures):
    """Figures of ``envelope``."""

    car: str
    steady_states: int
    top_speed_mps: float
    understeer_gradient_deg_per_g: float
    stability_factor_s2_per_m2: float
    yaw_stiffness_nm_per_rad: float
    static_margin: float
    characteristic_speed_mps: float | None
    critical_speed_mps: float | None
    small_steering: list[SmallSteering]
    limits: list[Limits]
    surface_difference_mps2: float | None
    ridge_speeds: int
    ridge_difference_mps2: float | None
    ridge_tolerance_mps2: float | None
    ridge_agrees: bool
    supported: list[Supported] | None = None
    measured: Measured | None = None
    notes: list[str] | None = None


@dataclass(frozen=True)
class LineFigures:
    """A line round a track."""

    length_m: float
    gamma_1pm: float
    integral_kappa2_1pm: float
    lap_time_s: float
    lap_time_fine_s: float
    length_fine_m: float
    integral_kappa2_fine_1pm: float
    clearance_m: float
    clearance_station_m: float
    steering_rate_deg_s: float


@dataclass(frozen=True)
class ParameterWorth:
    """What a parameter of set-ups is worth."""

    range: list[float]
    lap_time_s_per_percent: float


@dataclass(frozen=True)
class LineSetup:
    """A set-up and the fastest lap on its own line."""

    setup: int
    values: dict[str, float]
    lap_time_s: float
    own_line_gains_s: float
    clearance_m: float
    above_exact_percent: float | None


@dataclass(frozen=True)
class SectorShape:
    """The shape of a line within a sector."""

    length_m: float
    gamma_1pm: float


@dataclass(frozen=True)
class LineSector:
    """A sector of a line that was looked for in several; beside it the road's edges and its middle."""

    sections: int
    length_m: float
    link_m: float
    gamma_1pm: float
    right: SectorShape
    middle: SectorShape
    left: SectorShape


@dataclass(frozen=True)
class LineSetups:
    """Set-ups with fastest lines of their own."""

    parameters: list[str]
    share: float
    solved: int
    failed: int
    laps_per_s: float
    worth: dict[str, ParameterWorth]
    worth_rms_s: float | None
    fastest: list[LineSetup]
    greatest_above_exact_percent: float | None


@dataclass(frozen=True)
class Lines(Figures):
    """Figures of ``raceline``; dicts are by objective."""

    car: str
    track: str
    search_elapsed_s: float
    exact_elapsed_s: float
    sections: int
    car_width_m: float
    warm_start: bool
    local_search: bool
    best: dict[str, LineFigures]
    swarm: dict[str, float]
    exact: dict[str, LineFigures | None]
    exact_status: dict[str, str | None]
    exact_left_percent: dict[str, float | None]
    above_exact_percent: dict[str, float | None]
    reference: LineFigures
    compromise: LineFigures | None
    hypervolume: float | None
    hypervolume_reference: list[float] | None
    front_size: int
    setups: LineSetups | None
    sectors: list[LineSector]
    off_road: list[str]
    warnings: list[str]


@dataclass(frozen=True)
class Scenario:
    """A lap of a hybrid by one rule."""

    mode: str
    deployed_mj: float
    harvested_k_mj: float
    harvested_h_mj: float
    soc_end: float
    soc_greatest: float
    fuel_l: float
    motor_time_share: float
    generator_time_share: float
    lap_time_s: float
    additional_lap_time_s: float
    additional_deployed_mj: float
    balance_error_j: float
    soc_least: float
    net_deployed_mj: float
    fuel_percent: float


@dataclass(frozen=True)
class Site:
    """A stretch on which the motor works; allocation is its share of all that leaves the store."""

    start_m: float
    end_m: float
    deployed_mj: float
    allocation: float


@dataclass(frozen=True)
class Search:
    """What a further search of a hybrid's gates or zones found."""

    mode: str
    lap_time_s: float
    fuel_l: float
    fuel_percent: float
    deployed_mj: float
    soc_end: float
    motor_time_share: float
    evaluations: int
    variables: dict[str, float]


@dataclass(frozen=True)
class DeploymentPoint:
    """A point of the front of time against energy."""

    energy_mj: float
    deployed_mj: float
    lap_time_s: float


@dataclass(frozen=True)
class Deployment:
    """Where a hybrid's energy goes."""

    energy_mj: float
    exact_lap_time_s: float
    exact_deployed_mj: float
    exact_status: str
    exact_programs: int
    exact_bound_s: float | None
    exact_elapsed_s: float
    swarm_lap_time_s: float
    swarm_deployed_mj: float
    swarm_above_exact_s: float
    gain_s: float
    zones: int
    binds_up_to_mj: float
    front: list[DeploymentPoint]
    swarm_front_size: int | None
    worth_speed_correlation: float | None
    worth_taken_s_per_mj: float | None
    worth_left_s_per_mj: float | None
    sites: list[Site]


@dataclass(frozen=True)
class StintLap:
    """One lap of a stint."""

    mass_kg: float
    lap_time_s: float
    fuel_l: float
    deployed_mj: float
    harvested_mj: float
    soc_end: float
    gate_mps: float
    engine_lap_time_s: float
    engine_fuel_l: float


@dataclass(frozen=True)
class Sizing:
    """A motor with which the car laps in the time asked for."""

    power_kw: float
    energy_mj: float | None
    harvested_mj: float
    store_mj: float
    lap_time_s: float
    exact_lap_time_s: float | None
    fuel_l: float
    engine_share: float | None
    fuel_saving_l: float | None


@dataclass(frozen=True)
class Energy(Figures):
    """Figures of ``hybrid``."""

    car: str
    track: str
    line: str
    length_m: float
    rules_deployed_mj: float | None
    engine_lap_time_s: float
    engine_fuel_l: float
    scenarios: dict[str, Scenario]
    deployment: Deployment | None
    searches: dict[str, Search]
    stint: list[StintLap]
    sizing: list[Sizing]
    store_overflow: bool
    warnings: list[str]


@dataclass(frozen=True)
class CornerGrip:
    """A corner of a driven lap: the share of the grip held there, and times with it and with all of the grip."""

    start_m: float
    end_m: float
    least_speed_mps: float
    grip_share: float
    driven_s: float
    full_grip_s: float | None


@dataclass(frozen=True)
class Accounts:
    """The accounts of energy of a lap."""

    lap_time_s: float
    engine_mj: float
    moving_mj: float
    tyres_mj: float
    deployed_mj: float
    harvested_k_mj: float
    harvested_h_mj: float
    soc_end: float
    fuel_l: float
    motor_time_share: float
    balance_error_j: float


@dataclass(frozen=True)
class DrivenEnergy:
    """The accounts of a hybrid's lap, driven and in quasi-steady state."""

    mode: str
    driven: Accounts
    quasi_steady_state: Accounts
    deployed_difference_percent: float
    harvested_k_difference_percent: float
    moving_difference_percent: float


@dataclass(frozen=True)
class DrivenLine(Figures):
    """Figures of ``transient`` for one line."""

    car: str
    grip_share: float
    lap_time_s: float
    point_mass_lap_time_s: float | None
    disagreement_percent: float | None
    agrees: bool
    rule: str
    margin_m: float
    greatest_offset_m: float
    heading_gain: float
    beyond: str | None
    warnings: list[str]
    corners: list[CornerGrip]
    full_grip_lap_time_s: float | None
    behind_full_grip_percent: float | None
    energy: DrivenEnergy | None


@dataclass(frozen=True)
class SetUp:
    """A set-up on a line."""

    line: str
    setup: int
    values: dict[str, float]
    grip_share: float
    lap_time_s: float
    room_m: float
    steering_radps: float


@dataclass(frozen=True)
class DrivenSetUps(Figures):
    """Figures of ``transient`` for several lines or set-ups."""

    car: str
    lines: list[str]
    parameters: list[str]
    share: float
    within_edges: int
    driven: int
    best: SetUp | None
    as_it_is: SetUp | None
    fastest: list[SetUp]
    rule: str


@dataclass(frozen=True)
class SobolIndex:
    """Shares of a cost's variance, with their 95 % intervals."""

    first: float
    first_interval: Pair
    total: float
    total_interval: Pair


@dataclass(frozen=True)
class ParameterSensitivity:
    """How much one parameter matters; dicts are by cost."""

    name: str
    unit: str
    value: float
    range: Pair
    one_at_a_time: dict[str, float | None]
    rms_change: dict[str, float | None]
    sobol: dict[str, SobolIndex]


@dataclass(frozen=True)
class Sensitivities(Figures):
    """Figures of ``sensitivity``."""

    share: float
    samples: int
    left_out: int
    base_costs: dict[str, float]
    cost_units: dict[str, str]
    parameters: list[ParameterSensitivity]
    warnings: list[str]


@dataclass(frozen=True)
class Least:
    """The least of a cost, and where it is."""

    cost: float
    at: Pair


@dataclass(frozen=True)
class SurfaceFigures(Figures):
    """Figures of ``surface``; least is by cost."""

    parameters: tuple[str, str]
    base: Pair
    least: dict[str, Least | None]
    failed: int


@dataclass(frozen=True)
class Round:
    """One line of a run, and its drive."""

    planned_lap_time_s: float
    length_m: float
    grip_share: float
    point_mass_lap_time_s: float
    driven_lap_time_s: float
    disagreement_percent: float
    margin_m: float


@dataclass(frozen=True)
class RunEnergy:
    """What a hybrid's energy does on the line that was driven."""

    engine_lap_time_s: float
    engine_fuel_l: float
    sustaining_fuel_l: float
    deployed_lap_time_s: float
    deployed_mj: float
    exact_lap_time_s: float


@dataclass(frozen=True)
class RunFigures(Figures):
    """Figures of ``run``."""

    log: str
    car: str
    total_parameter_error: float | None
    rms_error: dict[str, float]
    told_at_mps: Pair
    ay_mps2: Pair
    ay_in_the_log_mps2: tuple[float | None, float | None]
    top_speed_mps: float
    rounds: list[Round]
    energy: RunEnergy | None
    agrees: bool
    reused: list[str]


def typed(kind: Any, value: Any) -> Any:
    """What was read from JSON, as a value of that type. Keys that the type lacks are left out."""
    origin, of = get_origin(kind), get_args(kind)
    if value is None:
        return None
    if origin in (Union, types.UnionType):
        kinds = [k for k in of if k is not type(None)]
        # Of several, the one whose figures these are.
        return typed(max(kinds, key=lambda k: _shared(k, value)), value)
    if origin is list:
        return [typed(of[0], v) for v in value]
    if origin is dict:
        return {k: typed(of[1], v) for k, v in value.items()}
    if origin is tuple:
        return tuple(typed(k, v) for k, v in zip(of, value, strict=True))
    if is_dataclass(kind):
        hints = get_type_hints(kind)
        return kind(**{f.name: typed(hints[f.name], value.get(f.name)) for f in fields(kind)})  # type: ignore[operator]
    return value


def _shared(kind: Any, value: Any) -> int:
    return sum(f.name in value for f in fields(kind)) if is_dataclass(kind) else 0
