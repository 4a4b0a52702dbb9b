//! Steady-state cornering and the greatest longitudinal force of the tyres, from the car's own equations of motion.
//!
//! A trim is a state in which the car goes round a circle: its sideways, yaw, roll and pitch accelerations are zero. The tyres
//! exert no force along the path, so drag slows the car; a quasi-steady-state lap accounts for drag by itself. The trims at one
//! speed then form a curve that passes through straight running. The curve is followed by its arc length (Keller, *Numerical
//! solution of bifurcation and nonlinear eigenvalue problems*, 1977), because neither steering angle nor lateral acceleration
//! rises all along it: an oversteering car needs less steering the faster it corners, and every car has a greatest lateral
//! acceleration.

use super::aero::aero_forces;
use super::chassis::BodyState;
use super::loads::wheel_loads;
use super::model::{CarInput, CarModel, CarState};
use super::tyre::Tyre;
use super::{Car, LinearTyre, MagicFormula, TyreModel};
use crate::scalar::{Dual, Real, bisected};
use nalgebra::{SMatrix, SVector};

/// Unknowns of a trim.
const UNKNOWNS: usize = 5;
type Exact = Dual;
type Point = SVector<f64, UNKNOWNS>;

/// The car in steady cornering.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trim {
    /// Angle of the front road wheels, positive to the left (rad).
    pub steer_rad: f64,
    /// Lateral acceleration `v r`, across the path (m/s^2).
    pub ay_mps2: f64,
    /// Yaw rate (rad/s).
    pub yaw_rate_radps: f64,
    /// Angle from the car's axis to its velocity, positive when it drifts to its left (rad).
    pub sideslip_rad: f64,
    /// Roll angle (rad).
    pub roll_rad: f64,
    /// Slip ratio of the driven rear wheels.
    pub slip_ratio: f64,
    /// Vertical loads of the wheels FL FR RL RR (N).
    pub wheel_load_n: [f64; 4],
}

/// Which way a car turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// To the left: a positive yaw rate.
    Left,
    /// To the right.
    Right,
}

/// Steady states and limits of one car.
pub trait SteadyCar: Send + Sync {
    /// The curve of trims at `speed` (m/s) from straight running to one side, until the road wheels reach `greatest_steer` (rad),
    /// the car stands across the road, or lateral acceleration has fallen well below its peak. The trims are in order along the
    /// curve. The curve has at least straight running, or is empty if that has no solution.
    fn cornering(&self, speed: f64, greatest_steer: f64, turn: Turn) -> Vec<Trim>;

    /// The trim under `steer` (rad) between two trims of `curve`, which is [`SteadyCar::cornering`] at `speed` (m/s), on its
    /// first part, up to where the steering angle turns back. `None` beyond that part.
    fn trim_at(&self, speed: f64, steer: f64, curve: &[Trim]) -> Option<Trim>;

    /// The trim of greatest lateral acceleration of a curve that [`SteadyCar::cornering`] found at `speed` (m/s), up to a steering
    /// angle (rad), to rounding. `None` without a trim up to there.
    fn greatest_cornering(&self, speed: f64, lock: f64, curve: &[Trim]) -> Option<Trim> {
        let within = curve.iter().take_while(|t| t.steer_rad <= lock);
        let (top, _) = within
            .enumerate()
            .max_by(|(_, a), (_, b)| a.ay_mps2.total_cmp(&b.ay_mps2))?;
        let mut low = curve[top.saturating_sub(1)].steer_rad;
        let mut high = curve.get(top + 1).map_or(lock, |t| t.steer_rad).min(lock);
        let mut best = curve[top];
        // By thirds: the curve is bent one way about its peak. Each round leaves two thirds of the range.
        for _ in 0..40 {
            let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            let (at_a, at_b) = (self.trim_at(speed, a, curve)?, self.trim_at(speed, b, curve)?);
            for trim in [at_a, at_b] {
                if trim.ay_mps2 > best.ay_mps2 {
                    best = trim;
                }
            }
            if at_a.ay_mps2 < at_b.ay_mps2 {
                low = a
            } else {
                high = b
            }
        }
        Some(best)
    }

    /// The greatest deceleration by the tyres (m/s^2) running straight at `speed` (m/s), each axle at the slip at
    /// which it brakes hardest.
    fn greatest_braking(&self, speed: f64) -> f64;

    /// The greatest acceleration by the driven rear tyres (m/s^2) running straight at `speed` (m/s), whatever the engine can
    /// give.
    fn greatest_traction(&self, speed: f64) -> f64;

    /// The slip ratio of the driven rear wheels at which they just overcome the drag, running straight at `speed` (m/s); that of the
    /// greatest traction where they cannot.
    fn slip_against_drag(&self, speed: f64) -> f64;

    /// What drives the car along its path while it corners at `ay` (m/s^2, of the sign of the turn), below the peak of `curve`,
    /// which is [`SteadyCar::cornering`] at `speed` (m/s). The road wheels turn by no more than `lock` (rad). The driven wheels share
    /// one slip ratio; the engine's power would push the car by `engine` (m/s^2) if nothing were lost. `None` where the curve does not
    /// reach `ay`, or turns back there.
    fn greatest_drive(
        &self,
        speed: f64,
        ay: f64,
        lock: f64,
        curve: &[Trim],
        engine: f64,
    ) -> Option<BendDrive>;

    /// Side force of the tyres against a radian of sideslip (N/rad), running straight at `speed` (m/s), and the yaw moment that
    /// turns the car back into its direction (N m/rad).
    fn sideslip_stiffness(&self, speed: f64) -> [f64; 2];

    /// Deceleration by drag (m/s^2) at `speed` (m/s).
    fn drag(&self, speed: f64) -> f64;
}

/// The steady states of a car, for either tyre model.
pub fn steady_car(car: &Car) -> Box<dyn SteadyCar> {
    match car.tyre_model() {
        TyreModel::MagicFormula => Box::new(Ready::<MagicFormula<f64>, MagicFormula<Exact>>::new(car)),
        TyreModel::Linear => Box::new(Ready::<LinearTyre<f64>, LinearTyre<Exact>>::new(car)),
    }
}

/// Greatest accelerations of a car along its path in a bend (m/s^2), before drag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BendDrive {
    /// By the driven tyres, whatever the engine gives.
    pub traction_mps2: f64,
    /// By the engine. Slip of the driven tyres and drag of all tyres, whose side forces point backwards in a bend, take from what it
    /// brings to the wheels. Where the tyres give way first, it is what the engine would reach with the losses there.
    pub engine_mps2: f64,
}

/// What of lateral acceleration and push along the path is the second unknown of a point; the other is given.
#[derive(Clone, Copy)]
enum Bend {
    /// The lateral acceleration; the tyres push by nothing.
    Free,
    /// The push (m/s^2), at this lateral acceleration (m/s^2).
    Held(f64),
}

/// A trim as a point of its curve.
fn place(t: &Trim) -> Point {
    let unknown = [t.sideslip_rad, t.ay_mps2, t.roll_rad, t.slip_ratio, t.steer_rad];
    Point::from_fn(|i, _| unknown[i] / SCALES[i])
}

/// A car prepared in `f64` and in dual numbers.
struct Ready<T, D> {
    plain: CarModel<f64, T>,
    exact: CarModel<Exact, D>,
}

/// Sizes of the unknowns sideslip, yaw rate (times speed), roll, slip ratio and steering angle that count as one
/// step along a curve: about a tenth of what they reach at the limit.
const SCALES: [f64; UNKNOWNS] = [0.01, 2.0, 0.01, 0.01, 0.01];
/// Steps along the curve, in [`SCALES`]: the longest, and the one below which the curve is taken to end.
const LONGEST_STEP: f64 = 0.7;
const SHORTEST_STEP: f64 = 1e-4;
/// Most points of a curve.
const MOST_POINTS: usize = 2000;
/// A step this short or shorter may turn the curve sharply.
const KINK: f64 = 0.01;
/// Sideslip at which a car counts as standing across the road (rad).
const GREATEST_SIDESLIP: f64 = 0.5;
/// The curve is left where lateral acceleration has fallen to this share of its peak.
const PAST_THE_PEAK: f64 = 0.85;

impl<T: Tyre<f64>, D: Tyre<Exact>> Ready<T, D> {
    fn new(car: &Car) -> Self {
        let flat = car.to_flat();
        let duals: Vec<Exact> = flat.iter().copied().map(Exact::constant).collect();
        Self {
            plain: CarModel::from_parameters(&flat),
            exact: CarModel::from_parameters(&duals),
        }
    }

    /// Residuals of the four equations at a point of the curve, with their derivatives with respect to the unknowns.
    fn residual(&self, held: (f64, Bend), point: &Point) -> [Exact; 4] {
        self.balance(held, point).0
    }

    /// The residuals, and the forward force of the rear wheels over the mass (m/s^2).
    fn balance(&self, (speed, bend): (f64, Bend), point: &Point) -> ([Exact; 4], f64) {
        let unknown = |i: usize| Exact::variable(point[i] * SCALES[i], i);
        let [sideslip, second, roll, slip_ratio, steer] = std::array::from_fn(unknown);
        let (across, push) = match bend {
            Bend::Free => (second, Exact::constant(0.0)),
            Bend::Held(across) => (Exact::constant(across), second),
        };
        let v = Exact::constant(speed);
        let (cos, sin) = (sideslip.cos(), sideslip.sin());
        let yaw_rate = across / v;
        let zero = Exact::constant(0.0);
        let one = Exact::constant(1.0);
        let body = BodyState {
            vx: v * cos,
            vy: v * sin,
            yaw_rate,
            roll,
            roll_rate: zero,
        };
        let chassis = &self.exact.chassis;
        // The force along the path is the push: the rest of the tyres' forces along the car and across it balances there.
        let drag = aero_forces(chassis, body.vx, zero).drag / chassis.mass;
        let state = CarState {
            pitch_acceleration: push * cos - body.vx * yaw_rate * sin / cos - drag,
            body,
        };
        let direction = (steer.cos(), steer.sin());
        let wheel_speed = std::array::from_fn(|wheel| {
            let front = wheel < 2;
            let (x, half_track, radius) = if front {
                (
                    chassis.cg_to_front,
                    chassis.half_track_front,
                    chassis.radius_front,
                )
            } else {
                (-chassis.cg_to_rear, chassis.half_track_rear, chassis.radius_rear)
            };
            let y = if wheel % 2 == 0 { half_track } else { -half_track };
            let turned = if front { direction } else { (one, zero) };
            let rolling = one + if front { zero } else { slip_ratio };
            let hub_x = body.vx - body.yaw_rate * y;
            let hub_y = body.vy + body.yaw_rate * x;
            let along = turned.0 * hub_x + turned.1 * hub_y;
            along * rolling / radius
        });
        // The model takes the angle as a sensor reads it.
        let steer = (steer - chassis.steer_offset) / chassis.steer_scale;
        let rate = self.exact.rate(
            &state,
            &CarInput {
                wheel_speed,
                steer,
                flap: zero,
                friction: None,
            },
        );
        let residual = [
            // At a steady sideslip the velocity across the car grows with that along the path.
            rate.state.body.vy - push * sin,
            rate.state.body.yaw_rate,
            rate.state.body.roll_rate,
            rate.state.pitch_acceleration * chassis.pitch_lag,
        ];
        (residual, (rate.rear_force / chassis.mass).value)
    }

    /// The trim on the line `direction . (point - guess) = 0` nearest to `guess`, by Newton's method.
    fn solve(&self, held: (f64, Bend), guess: &Point, direction: &Point) -> Option<(Point, Point)> {
        /// Accelerations this small are rounding (m/s^2, rad/s^2).
        const BALANCED: f64 = 1e-9;
        let mut point = *guess;
        for _ in 0..12 {
            let residual = self.residual(held, &point);
            let mut slopes = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::zeros();
            let mut value = Point::zeros();
            for (row, equation) in residual.iter().enumerate() {
                value[row] = equation.value;
                for column in 0..UNKNOWNS {
                    slopes[(row, column)] = equation.gradient[column] * SCALES[column];
                }
            }
            value[4] = direction.dot(&(point - guess));
            slopes.set_row(4, &direction.transpose());
            let factors = slopes.lu();
            if value.amax() < BALANCED {
                // Only the fifth equation changes along the curve.
                let tangent = factors.solve(&Point::from_fn(|i, _| f64::from(i == 4)))?;
                return Some((point, tangent.normalize()));
            }
            let step = factors.solve(&value)?;
            // The step was too long and has left the curve.
            if !step.iter().all(|x| x.is_finite()) || step.norm() > 20.0 {
                return None;
            }
            point -= step;
        }
        None
    }

    /// Follows a curve from a point on it into the direction of a tangent, and tells of each further point. It ends where that
    /// says so or no step leads on.
    fn follow(
        &self,
        held: (f64, Bend),
        (mut point, mut tangent): (Point, Point),
        mut goes_on: impl FnMut(&Point) -> bool,
    ) {
        let mut length = 0.1;
        while length > SHORTEST_STEP {
            let guess = point + tangent * length;
            let Some((next, direction)) = self.solve(held, &guess, &tangent) else {
                length *= 0.5;
                continue;
            };
            // Two tangents at more than a right angle belong to two branches, not to one step along a curve.
            let ahead = direction.dot(&tangent);
            if ahead.abs() < if length > KINK { 0.9 } else { 0.1 } {
                length *= 0.5;
                continue;
            }
            (point, tangent) = (next, direction * ahead.signum());
            length = (1.4 * length).min(LONGEST_STEP);
            if !goes_on(&point) {
                break;
            }
        }
    }

    fn trim(&self, speed: f64, point: &Point) -> Trim {
        let unknown: [f64; UNKNOWNS] = std::array::from_fn(|i| point[i] * SCALES[i]);
        let [sideslip_rad, across, roll_rad, slip_ratio, steer_rad] = unknown;
        let yaw_rate_radps = across / speed;
        let body = BodyState {
            vx: speed * sideslip_rad.cos(),
            vy: speed * sideslip_rad.sin(),
            yaw_rate: yaw_rate_radps,
            roll: roll_rad,
            roll_rate: 0.0,
        };
        let chassis = &self.plain.chassis;
        let aero = aero_forces(chassis, body.vx, 0.0);
        let push = -body.vy * yaw_rate_radps - aero.drag / chassis.mass;
        Trim {
            steer_rad,
            ay_mps2: across,
            yaw_rate_radps,
            sideslip_rad,
            roll_rad,
            slip_ratio,
            wheel_load_n: wheel_loads(chassis, &body, push, &aero),
        }
    }

    /// The tyres' acceleration (m/s^2) running straight at `speed` with these slip ratios of the axles.
    fn push(&self, speed: f64, slip: [f64; 2]) -> f64 {
        let chassis = &self.plain.chassis;
        let drag = self.drag(speed);
        let mut state = CarState::straight(speed);
        let wheel_speed = std::array::from_fn(|wheel| {
            let radius = [chassis.radius_front, chassis.radius_rear][wheel / 2];
            speed * (1.0 + slip[wheel / 2]) / radius
        });
        let input = CarInput {
            wheel_speed,
            steer: -chassis.steer_offset / chassis.steer_scale,
            flap: 0.0,
            friction: None,
        };
        // Load transfer and force depend on each other. The iteration converges, since a change of one changes the other by a
        // sixth at most.
        for _ in 0..40 {
            let change = self.plain.rate(&state, &input).state.pitch_acceleration * chassis.pitch_lag;
            state.pitch_acceleration += change;
            if change.abs() < 1e-12 {
                break;
            }
        }
        state.pitch_acceleration + drag
    }
}

/// The argument between `low` and `high` where `f` is greatest, to a ten-thousandth of the range: the best of an
/// even scan, narrowed by golden sections.
pub(super) fn greatest(low: f64, high: f64, f: impl Fn(f64) -> f64) -> f64 {
    const SCAN: usize = 24;
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let step = (high - low) / SCAN as f64;
    let scanned = (0..=SCAN).map(|i| low + step * i as f64).map(|x| (x, f(x)));
    let best = scanned.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(low, |(x, _)| x);
    let (mut a, mut b) = ((best - step).max(low), (best + step).min(high));
    let inner = |a: f64, b: f64| [b - GOLDEN * (b - a), a + GOLDEN * (b - a)];
    let [mut c, mut d] = inner(a, b).map(|x| (x, f(x)));
    while b - a > 1e-4 * (high - low) {
        if c.1 > d.1 {
            (b, d) = (d.0, c);
            let x = inner(a, b)[0];
            c = (x, f(x));
        } else {
            (a, c) = (c.0, d);
            let x = inner(a, b)[1];
            d = (x, f(x));
        }
    }
    0.5 * (a + b)
}

/// The top of the parabola through three points of which the middle one is the highest; its height, where they are no three.
fn peak_of([(a, low), (b, top), (c, high)]: [(f64, f64); 3]) -> f64 {
    let (left, right) = ((top - low) / (b - a), (high - top) / (c - b));
    // Points that coincide have no slope.
    let bend = (right - left) / (c - a);
    let slope = left + bend * (b - a);
    let rise = -slope * slope / (4.0 * bend);
    if bend < 0.0 && rise.is_finite() {
        top + rise
    } else {
        top
    }
}

/// Greatest slip ratio in the search for the limits.
pub(super) const GREATEST_SLIP: f64 = 0.4;

impl<T: Tyre<f64>, D: Tyre<Exact>> SteadyCar for Ready<T, D> {
    fn cornering(&self, speed: f64, greatest_steer: f64, turn: Turn) -> Vec<Trim> {
        // Straight running. A car with even sides needs no steering for it. Another may answer to no steering with a bend, and near
        // its critical speed with none that can be found: it starts without a yaw rate, whatever the steering.
        let held = |unknown: usize| {
            let direction = Point::from_fn(|i, _| f64::from(i == unknown));
            self.solve((speed, Bend::Free), &Point::zeros(), &direction)
        };
        let unsteered = held(4).filter(|(point, _)| point[1].abs() < 1e-6);
        let Some((point, mut tangent)) = unsteered.or_else(|| held(1)) else {
            return Vec::new();
        };
        // A left turn has a yaw rate to the left, whatever the steering does.
        if (tangent[1] < 0.0) == (turn == Turn::Left) {
            tangent = -tangent;
        }
        let mut trims = vec![self.trim(speed, &point)];
        let mut peak = 0.0f64;
        self.follow((speed, Bend::Free), (point, tangent), |point| {
            let trim = self.trim(speed, point);
            if trims.len() == MOST_POINTS
                || trim.steer_rad.abs() > greatest_steer
                || trim.sideslip_rad.abs() > GREATEST_SIDESLIP
            {
                return false;
            }
            peak = peak.max(trim.ay_mps2.abs());
            trims.push(trim);
            trim.ay_mps2.abs() >= PAST_THE_PEAK * peak
        });
        trims
    }

    fn trim_at(&self, speed: f64, steer: f64, curve: &[Trim]) -> Option<Trim> {
        let rising = curve.windows(2).take_while(|w| w[1].steer_rad > w[0].steer_rad);
        let pair = rising
            .into_iter()
            .find(|w| (w[0].steer_rad..=w[1].steer_rad).contains(&steer))?;
        let share = (steer - pair[0].steer_rad) / (pair[1].steer_rad - pair[0].steer_rad);
        let (from, to) = (place(&pair[0]), place(&pair[1]));
        let steering = Point::from_fn(|i, _| f64::from(i == 4));
        let (point, _) = self.solve((speed, Bend::Free), &(from + (to - from) * share), &steering)?;
        Some(self.trim(speed, &point))
    }

    fn greatest_braking(&self, speed: f64) -> f64 {
        let mut slip = [-0.1; 2];
        // The best slip of each axle depends on that of the other through the loads alone, so a few rounds are enough.
        for _ in 0..3 {
            slip[0] = greatest(-GREATEST_SLIP, 0.0, |s| -self.push(speed, [s, slip[1]]));
            slip[1] = greatest(-GREATEST_SLIP, 0.0, |s| -self.push(speed, [slip[0], s]));
        }
        -self.push(speed, slip)
    }

    fn greatest_traction(&self, speed: f64) -> f64 {
        let slip = greatest(0.0, GREATEST_SLIP, |s| self.push(speed, [0.0, s]));
        self.push(speed, [0.0, slip])
    }

    fn slip_against_drag(&self, speed: f64) -> f64 {
        let push = |slip: f64| self.push(speed, [0.0, slip]);
        let drag = self.drag(speed);
        let range = [0.0, greatest(0.0, GREATEST_SLIP, push)];
        bisected(range, 1e-9, |slip| push(slip) < drag)[1]
    }

    fn greatest_drive(
        &self,
        speed: f64,
        ay: f64,
        lock: f64,
        curve: &[Trim],
        engine: f64,
    ) -> Option<BendDrive> {
        let pair = curve
            .windows(2)
            .find(|w| w[0].ay_mps2.abs() <= ay.abs() && ay.abs() < w[1].ay_mps2.abs())?;
        // Between the two points by false position. Close to the peak the lateral acceleration itself cannot be held: steps across
        // the chord find the curve there too.
        let (from, to) = (place(&pair[0]), place(&pair[1]));
        let chord = (to - from).normalize();
        let (mut low, mut high) = ((0.0, pair[0].ay_mps2), (1.0, pair[1].ay_mps2));
        let mut start = from;
        for _ in 0..8 {
            let share = low.0 + (ay - low.1) / (high.1 - low.1) * (high.0 - low.0);
            (start, _) = self.solve((speed, Bend::Free), &(from + (to - from) * share), &chord)?;
            let found = start[1] * SCALES[1];
            if (found - ay).abs() < 1e-6 {
                break;
            }
            let side = if found.abs() < ay.abs() {
                &mut low
            } else {
                &mut high
            };
            *side = (share, found);
        }
        let held = (speed, Bend::Held(start[1] * SCALES[1]));
        let across = Point::from_fn(|i, _| f64::from(i == 1));
        start[1] = 0.0;
        let (start, tangent) = self.solve(held, &start, &across)?;
        let tangent = tangent * tangent[1].signum();
        // Length along the curve and push, of the greatest push so far, the point before it and the one after it.
        let mut around = [(0.0, 0.0); 3];
        let (mut last, mut length) = (start, 0.0);
        let mut points = 0;
        // What the engine has to spare at a point, and the push with it: that is the engine's push where nothing is to spare.
        let spare = |point: &Point| {
            // The rims turn faster than the road passes, and take the power with less force.
            let spare = engine / (1.0 + point[3] * SCALES[3]) - self.balance(held, point).1;
            (spare, point[1] * SCALES[1] + spare)
        };
        let mut by_engine = spare(&start);
        self.follow(held, (start, tangent), |point| {
            let [sideslip, push, _, slip, steer] = std::array::from_fn(|i| point[i] * SCALES[i]);
            points += 1;
            if points == MOST_POINTS
                || steer.abs() > lock
                || sideslip.abs() > GREATEST_SIDESLIP
                || slip > GREATEST_SLIP
            {
                return false;
            }
            length += (point - last).norm();
            last = *point;
            if by_engine.0 > 0.0 {
                let (before, here) = (by_engine, spare(point));
                let share = (before.0 / (before.0 - here.0)).min(1.0);
                by_engine = if here.0 > 0.0 {
                    here
                } else {
                    (0.0, before.1 + share * (here.1 - before.1))
                };
            }
            let now = (length, push);
            if push > around[1].1 {
                around = [around[1], now, now];
                true
            } else {
                around[2] = now;
                false
            }
        });
        Some(BendDrive {
            traction_mps2: peak_of(around),
            engine_mps2: by_engine.1,
        })
    }

    fn sideslip_stiffness(&self, speed: f64) -> [f64; 2] {
        let c = &self.plain.chassis;
        let straight = self.residual((speed, Bend::Free), &Point::zeros());
        let [side, yaw, roll, _] = straight.map(|rate| rate.gradient[0]);
        // The body rolls about an axis in the ground, so that its roll takes part in the sideways acceleration.
        [-c.mass * (side - c.cg_height * roll), c.inertia_yaw * yaw]
    }

    fn drag(&self, speed: f64) -> f64 {
        aero_forces(&self.plain.chassis, speed, 0.0).drag / self.plain.chassis.mass
    }
}

#[cfg(test)]
mod tests;
