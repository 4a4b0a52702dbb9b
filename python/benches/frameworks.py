"""The same replay of the 4DOF car by lapswarm, JAX and numba, each on one core, in million particle-steps per core-second.

A particle-step is one Runge-Kutta step of one candidate car. The equations are those of the book's chapter on the model, written
once for both frameworks. Terms whose coefficients are zero in the bundled tyre are left out here, and lapswarm computes them.
Objectives are compared with lapswarm's reference before anything is timed. Needs `pip install jax numba`.
"""

from __future__ import annotations

import argparse
import os
import platform
import re
import time
import tomllib
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

# One core for all of them: what each would make of several is another question.
if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
os.environ["RAYON_NUM_THREADS"] = "1"

import jax
import jax.numpy as jnp
import lapswarm
import numba
import numpy as np

FREE = {
    "mass_kg": (1150.0, 1350.0),
    "pDy1": (1.4, 1.7),
    "pKy1": (-42.0, -33.0),
    "roll_damping_nms_per_rad": (9e3, 4e4),
    "roll_stiffness_nm_per_rad": (8e4, 1.4e5),
    "yaw_inertia_kgm2": (1300.0, 1700.0),
}
CHANNELS = ["vx", "ax", "ay", "yaw_rate"]
DT_S, SUBSTEPS, SECONDS = 0.02, 2, 20.0
# Largest relative difference from the reference's objectives. A step rounds some thousand times, and 2,000 steps 2e6 times: if all
# roundings fell alike, 2e6 times 1.1e-16 in double precision; in single precision they fall as chance has it, 6e-8 times the root of
# 2e6, and a cost is a difference from the log ten times smaller than what is compared.
TOLERANCE = {"float64": 2.2e-10, "float32": 1e-3}


def log() -> dict[str, np.ndarray]:
    """Inputs of a slalom at 40 m/s with some drive, and outputs that no car has: the costs are far from zero."""
    t = np.arange(0.0, SECONDS + DT_S / 2, DT_S)
    speed = 40.0 + 2.0 * np.sin(0.3 * t)
    wheel = speed / 0.325
    columns = {"time_s": t, "distance_m": np.concatenate([[0.0], np.cumsum(speed[:-1] * DT_S)])}
    columns |= {f"wheel_speed_{name}_radps": wheel * (1.0 + slip) for name, slip in (("fl", 0), ("fr", 0), ("rl", 0.01), ("rr", 0.01))}
    columns |= {"steer_rad": 0.02 * np.sin(1.1 * t), "vx_mps": speed, "ax_mps2": 0.6 * np.cos(0.3 * t)}
    columns |= {"ay_mps2": 4.0 * np.sin(1.1 * t), "yaw_rate_radps": 0.1 * np.sin(1.1 * t)}
    columns |= {"lap_number": np.ones_like(t), "lap_complete": np.ones_like(t)}
    return columns


def figures() -> tuple[SimpleNamespace, SimpleNamespace]:
    """The bundled car's chassis, and the coefficients of its tyre."""
    files = dict(lapswarm.Car("gt").files)
    rows = re.findall(r"^(\w+)\s*=\s*(-?[\d.]+)", files["car.tir"], re.MULTILINE)
    tyre = SimpleNamespace(**{name.lower(): float(value) for name, value in rows if name.isupper()})
    zero = "phx1 phx2 pvx1 pvx2 pex3 pex4 pey3 pey4 phy1 phy2 pvy1 pvy2 qbz10 qdz6 qdz7 qez3 qhz1 qhz2 ssz1".split()
    assert all(getattr(tyre, name) == 0.0 for name in zero)
    return SimpleNamespace(**tomllib.loads(files["car.toml"])["chassis"]), tyre


def equations(m: Any, where: Callable[..., Any], jit: Callable[[Any], Any]) -> Callable[..., Any]:
    """One Runge-Kutta step, and the accelerations at its start, over the functions of ``m``."""
    c, t = figures()
    sin, cos, tan, atan, exp, sqrt = m.sin, m.cos, m.tan, m.arctan, m.exp, m.sqrt
    sign, absolute, least, most = m.sign, m.abs, m.minimum, m.maximum
    a, b, h = c.cg_to_front_axle_m, c.cg_to_rear_axle_m, c.cg_height_m
    wf, wr, base = c.front_half_track_m, c.rear_half_track_m, a + b
    gravity, lag, floor, r0, nominal = 9.80665, 0.03, 1.0, t.unloaded_radius, t.fnomin
    ixx, iyy = c.roll_inertia_kgm2, c.pitch_inertia_kgm2
    rolling_front, rolling_rear, share = c.front_rolling_radius_m, c.rear_rolling_radius_m, c.front_roll_moment_share
    drag_area, lift_area, density = c.drag_area_m2, c.downforce_area_m2, c.air_density_kgpm3
    balance, drag_height = c.aero_balance_front, c.drag_height_m
    camber_front, camber_rear = (-np.radians(x) for x in (c.front_camber_deg, c.rear_camber_deg))
    pcx1, pdx1, pdx2, pdx3, pex1, pex2 = t.pcx1, t.pdx1, t.pdx2, t.pdx3, t.pex1, t.pex2
    pkx1, pkx2, pkx3, rbx1, rbx2, rcx1, rex1, rex2, rhx1 = t.pkx1, t.pkx2, t.pkx3, t.rbx1, t.rbx2, t.rcx1, t.rex1, t.rex2, t.rhx1
    pcy1, pdy2, pdy3, pey1, pey2, pky2, pky3 = t.pcy1, t.pdy2, t.pdy3, t.pey1, t.pey2, t.pky2, t.pky3
    phy3, pvy3, pvy4, rby1, rby2, rby3, rcy1 = t.phy3, t.pvy3, t.pvy4, t.rby1, t.rby2, t.rby3, t.rcy1
    rey1, rey2, rhy1, rhy2 = t.rey1, t.rey2, t.rhy1, t.rhy2
    rvy1, rvy2, rvy3, rvy4, rvy5, rvy6 = t.rvy1, t.rvy2, t.rvy3, t.rvy4, t.rvy5, t.rvy6
    qbz1, qbz2, qbz3, qbz4, qbz5, qbz9, qcz1 = t.qbz1, t.qbz2, t.qbz3, t.qbz4, t.qbz5, t.qbz9, t.qcz1
    qdz1, qdz2, qdz3, qdz4, qdz8, qdz9 = t.qdz1, t.qdz2, t.qdz3, t.qdz4, t.qdz8, t.qdz9
    qez1, qez2, qez4, qez5, qhz3, qhz4 = t.qez1, t.qez2, t.qez4, t.qez5, t.qhz3, t.qhz4
    ssz2, ssz3, ssz4 = t.ssz2, t.ssz3, t.ssz4
    two_over_pi = 2.0 / np.pi

    @jit
    def curve(cf, bx, e):  # type: ignore[no-untyped-def]
        return cf * atan(bx - e * (bx - atan(bx)))

    @jit
    def sec_atan(x):  # type: ignore[no-untyped-def]
        return sqrt(1.0 + x * x)

    @jit
    def wheel(camber, side, load, ratio, tangent, pdy1, pky1):  # type: ignore[no-untyped-def]
        """Magic Formula 5.2: force along and across, and aligning moment."""
        g = np.sin(camber)
        fz = most(load, 1e-3)
        dfz = fz / nominal - 1.0
        mux = (pdx1 + pdx2 * dfz) * (1.0 - pdx3 * camber * camber)
        kx = fz * (pkx1 + pkx2 * dfz) * exp(pkx3 * dfz)
        fx0 = mux * fz * sin(curve(pcx1, kx / (pcx1 * mux * fz) * ratio, least(pex1 + pex2 * dfz, 1.0)))
        dy = (pdy1 + pdy2 * dfz) * (1.0 - pdy3 * g * g) * fz
        z = fz / (pky2 * nominal)
        ky = 2.0 * pky1 * nominal * (1.0 - pky3 * abs(g)) * (z / (1.0 + z * z))
        slope = ky / dy
        shy = phy3 * g * side
        svy = fz * (pvy3 + pvy4 * dfz) * g * side
        fy0 = dy * sin(curve(pcy1, slope / pcy1 * (tangent + shy), least(pey1 + pey2 * dfz, 1.0))) + svy
        bx, ex = rbx1 / sec_atan(rbx2 * ratio), least(rex1 + rex2 * dfz, 1.0)
        gx = cos(curve(rcx1, bx * (tangent + rhx1), ex)) / cos(curve(rcx1, bx * rhx1, ex))
        by, ey = rby1 / sec_atan(rby2 * (tangent - rby3)), least(rey1 + rey2 * dfz, 1.0)
        shift = rhy1 + rhy2 * dfz
        gy = cos(curve(rcy1, by * (ratio + shift), ey)) / cos(curve(rcy1, by * shift, ey))
        svyk = dy * (rvy1 + rvy2 * dfz + rvy3 * g * side) / sec_atan(rvy4 * tangent) * sin(rvy5 * atan(rvy6 * ratio))
        fx, fy = fx0 * gx, fy0 * gy + svyk
        at = tangent + (qhz3 + qhz4 * dfz) * g * side
        ar = tangent + shy + svy / ky
        slip_share = kx / ky * ratio
        bt = (qbz1 + dfz * (qbz2 + qbz3 * dfz)) * (1.0 + qbz5 * abs(camber) + qbz4 * camber * side)
        et = least((qez1 + dfz * qez2) * (1.0 + (qez4 + qez5 * g * side) * two_over_pi * atan(bt * qcz1 * at)), 1.0)
        tan_t, tan_r = tan(at), tan(ar)
        at_eq = atan(sqrt(tan_t * tan_t + slip_share * slip_share) * sign(at))
        ar_eq = atan(sqrt(tan_r * tan_r + slip_share * slip_share) * sign(ar))
        d = fz * (qdz1 + qdz2 * dfz) * r0 / nominal * (1.0 + qdz4 * camber * camber + qdz3 * camber * side)
        trail = d * cos(curve(qcz1, bt * at_eq, et)) / sec_atan(tangent)
        residual = fz * r0 * (qdz8 + qdz9 * dfz) * g * side * cos(tangent) / sec_atan(qbz9 * ar_eq)
        arm = r0 * (ssz2 * fy / nominal + (ssz3 + ssz4 * dfz) * camber * side)
        mz = residual - trail * (fy - svyk) + arm * fx
        on = load > 0.0
        return where(on, fx, 0.0), where(on, fy, 0.0), where(on, mz, 0.0)

    @jit
    def corner(camber, x, y, side, cs, sn, rim, load, vx, vy, r, pdy1, pky1):  # type: ignore[no-untyped-def]
        hx, hy = vx - r * y, vy + r * x
        wx, wy = cs * hx + sn * hy, cs * hy - sn * hx
        speed = most(absolute(wx), floor)
        fx, fy, mz = wheel(camber, side, load, (rim - wx) / speed, wy / speed, pdy1, pky1)
        bx, by = fx * cs - fy * sn, fx * sn + fy * cs
        return bx, by, x * by - y * bx + mz

    @jit
    def rate(car, state, u):  # type: ignore[no-untyped-def]
        mass, pdy1, pky1, damping, stiffness, izz = car
        vx, vy, r, phi, p, ap = state
        drag = 0.5 * density * drag_area * vx * absolute(vx)
        down = 0.5 * density * lift_area * vx * vx
        pitch = (mass * ap * h + drag * drag_height) / base
        front = 0.5 * (mass * gravity * b / base + down * balance - pitch)
        rear = 0.5 * (mass * gravity * a / base + down * (1.0 - balance) + pitch)
        moment = stiffness * phi + damping * p
        roll_f, roll_r = 0.5 * share * moment / wf, 0.5 * (1.0 - share) * moment / wr
        cs, sn = cos(u[4]), sin(u[4])
        rf, rr = rolling_front, rolling_rear
        x1, y1, m1 = corner(camber_front, a, wf, 1.0, cs, sn, u[0] * rf, front - roll_f, vx, vy, r, pdy1, pky1)
        x2, y2, m2 = corner(camber_front, a, -wf, -1.0, cs, sn, u[1] * rf, front + roll_f, vx, vy, r, pdy1, pky1)
        x3, y3, m3 = corner(camber_rear, -b, wr, 1.0, 1.0, 0.0, u[2] * rr, rear - roll_r, vx, vy, r, pdy1, pky1)
        x4, y4, m4 = corner(camber_rear, -b, -wr, -1.0, 1.0, 0.0, u[3] * rr, rear + roll_r, vx, vy, r, pdy1, pky1)
        fx, fy, mz = x1 + x2 + x3 + x4 - drag, y1 + y2 + y3 + y4, m1 + m2 + m3 + m4
        s, c = sin(phi), cos(phi)
        hs, hc, sc, di = h * s, h * c, s * c, iyy - izz
        dr = (mz - hs * fx - 2.0 * di * sc * p * r) / (iyy * s * s + izz * c * c)
        dp = hc * fy + mass * gravity * hs - moment + di * sc * r * r - mass * h * h * sc * p * p
        dp = dp / (ixx + mass * hs * hs)
        dvx = fx / mass + vy * r - hs * dr - 2.0 * hc * p * r
        dvy = fy / mass - vx * r + hc * dp - hs * (p * p + r * r)
        return (dvx, dvy, dr, p, dp, (fx / mass - ap) / lag), dvx - vy * r, dvy + vx * r

    @jit
    def moved(state, slope, by):  # type: ignore[no-untyped-def]
        v, w = state, slope
        return (v[0] + by * w[0], v[1] + by * w[1], v[2] + by * w[2], v[3] + by * w[3], v[4] + by * w[4], v[5] + by * w[5])

    @jit
    def step(car, state, u):  # type: ignore[no-untyped-def]
        dt = DT_S / SUBSTEPS
        k1, ax, ay = rate(car, state, u[0])
        k2, _, _ = rate(car, moved(state, k1, dt / 2), u[1])
        k3, _, _ = rate(car, moved(state, k2, dt / 2), u[1])
        k4, _, _ = rate(car, moved(state, k3, dt), u[2])
        end = moved(moved(moved(moved(state, k1, dt / 6), k2, dt / 3), k3, dt / 3), k4, dt / 6)
        return end, ax, ay

    return step  # type: ignore[no-any-return]


def inputs(columns: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Inputs at the start, half-way and end of each step: (steps, 3, 5); what is measured at its start (steps, 4), and whether it
    counts. One step more is driven from the last sample, whose outputs count."""
    names = [f"wheel_speed_{wheel}_radps" for wheel in ("fl", "fr", "rl", "rr")] + ["steer_rad"]
    samples = np.stack([columns[name] for name in names], axis=1)
    measured = np.stack([columns[name] for name in ("vx_mps", "ax_mps2", "ay_mps2", "yaw_rate_radps")], axis=1)
    at = (np.arange(SUBSTEPS * (len(samples) - 1) + 1)[:, None] + [0.0, 0.5, 1.0]) / SUBSTEPS
    k = np.minimum(at.astype(int), len(samples) - 2)
    share = np.minimum(at - k, 1.0)[..., None]
    counts = (np.arange(len(at)) % SUBSTEPS == 0).astype(float)
    return samples[k] + share * (samples[k + 1] - samples[k]), measured[np.arange(len(at)) // SUBSTEPS], counts


def by_numba(columns: dict[str, np.ndarray]) -> Callable[[np.ndarray], np.ndarray]:
    """Candidates one after the other, in double precision."""
    jit = numba.njit(inline="never", error_model="numpy")
    step = equations(np, jit(lambda on, yes, no: yes if on else no), jit)
    u, y, counts = inputs(columns)

    @jit
    def costs(X):  # type: ignore[no-untyped-def]
        F = np.zeros((len(X), 4))
        for i in range(len(X)):
            car = (X[i, 0], X[i, 1], X[i, 2], X[i, 3], X[i, 4], X[i, 5])
            state = (y[0, 0], 0.0, y[0, 3], 0.0, 0.0, 0.0)
            for k in range(len(u)):
                end, ax, ay = step(car, state, u[k])
                for j, found in enumerate((state[0], ax, ay, state[2])):
                    F[i, j] += counts[k] * (found - y[k, j]) ** 2
                state = end
        return np.sqrt(F * DT_S)

    return costs  # type: ignore[no-any-return]


def by_jax(columns: dict[str, np.ndarray]) -> Callable[[np.ndarray], np.ndarray]:
    """All candidates abreast, in single precision."""
    step = equations(jnp, jnp.where, lambda function: function)
    u, y, counts = (jnp.asarray(x, jnp.float32) for x in inputs(columns))

    @jax.jit
    def costs(X):  # type: ignore[no-untyped-def]
        car = tuple(X.T)
        zero = jnp.zeros(len(X), jnp.float32)
        begin = (zero + y[0, 0], zero, zero + y[0, 3], zero, zero, zero)

        def scored(carry, now):  # type: ignore[no-untyped-def]
            state, sums = carry
            u, y, count = now
            end, ax, ay = step(car, state, u)
            errors = jnp.stack([state[0], ax, ay, state[2]]) - y[:, None]
            return (end, sums + count * errors * errors), None

        (_, sums), _ = jax.lax.scan(scored, (begin, jnp.zeros((4, len(X)), jnp.float32)), (u, y, counts))
        return jnp.sqrt(sums.T * DT_S)

    return lambda X: np.asarray(costs(jnp.asarray(X, jnp.float32)))


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--candidates", type=int, default=1024)
    asked.add_argument("--calls", type=int, default=5)
    told = asked.parse_args()
    columns = log()
    given: dict[str, Any] = {"window_s": None, "settle_s": 0.0, "substeps": SUBSTEPS, "rate_hz": 1 / DT_S, "norm": "2"}
    # The twins drive what is logged, and so must lapswarm.
    given["calibration"] = dict.fromkeys(("signs", "delays", "offsets", "rolling_radius"), False)
    problem = lapswarm.ReplayProblem("gt", columns, free=FREE, objectives=CHANNELS, **given)
    assert problem.names == list(FREE)
    lower, upper = problem.bounds.T
    X = lower + np.random.default_rng(1).uniform(0.2, 0.8, (told.candidates, len(lower))) * (upper - lower)
    ours = {backend: lapswarm.Evaluator(problem, backend) for backend in ("simd", "cpu")}
    wanted = ours["cpu"].evaluate(X).F
    assert np.isfinite(wanted).all()
    ways: list[tuple[str, str, Callable[[np.ndarray], np.ndarray]]] = [
        ("lapswarm simd", "float32", lambda X: ours["simd"].evaluate(X).F),
        (f"JAX {jax.__version__}", "float32", by_jax(columns)),
        ("lapswarm cpu", "float64", lambda X: ours["cpu"].evaluate(X).F),
        (f"numba {numba.__version__}", "float64", by_numba(columns)),
    ]
    steps = told.candidates * SUBSTEPS * (len(columns["time_s"]) - 1)
    print(f"lapswarm {lapswarm.__version__}, numpy {np.__version__}, Python {platform.python_version()}; one core; {told.candidates}")
    print(f"candidates, {steps} particle-steps a call, the best of {told.calls} calls")
    print("| | precision | off from the reference (-) | million particle-steps per core-second |\n|---|---|---|---|")
    for name, precision, evaluate in ways:
        off = np.max(np.abs(evaluate(X) / wanted - 1.0))
        assert off <= TOLERANCE[precision], f"{name}: objectives are off by {off:.1e}, expected {TOLERANCE[precision]:.0e} at most"
        took = []
        for _ in range(told.calls):
            # Of all threads, so that other work on the machine does not count.
            began = time.process_time()
            evaluate(X)
            took.append(time.process_time() - began)
        print(f"| {name} | {precision} | {off:.0e} | {steps / min(took) / 1e6:.2f} |", flush=True)


if __name__ == "__main__":
    main()
