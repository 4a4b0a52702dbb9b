//! The quasi-steady-state lap of a point mass on a fixed line, with its derivatives in reverse mode.
//!
//! On a fixed line the state is one number, `e = v^2`, and both the most that it may rise and the most that it may fall
//! over a segment are functions of `e` at the segment's other end. The continuous problem `de/ds <= 2 a_drive(e, s)`,
//! `de/ds >= -2 a_brake(e, s)`, `e <= corner(s)` therefore has a solution that is the greatest at every station at once
//! (solutions of a scalar differential equation do not cross). Time falls with `e`, so this solution is the fastest, and one
//! pass each way finds it. Only the line is left to optimise.
//! Sources: Bobrow, Dubowsky, Gibson, *Time-optimal control of robotic manipulators along specified paths*, IJRR 4 (1985);
//! Kapania, Subosits, Gerdes, *A sequential two-step algorithm for fast generation of vehicle racing trajectories*, J. Dyn.
//! Sys. Meas. Control 138 (2016).

use super::geometry::Shape;
use crate::line::kernel::may_open;

/// A quantity at one speed, with its derivative by speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slope {
    /// The quantity.
    pub value: f64,
    /// Its derivative by speed (m/s).
    pub by_speed: f64,
}

/// What a point mass can do at one speed, all in m/s^2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grip {
    /// Greatest lateral acceleration by the tyres.
    pub lateral: Slope,
    /// Greatest longitudinal acceleration by the tyres.
    pub longitudinal: Slope,
    /// Greatest acceleration by the drive train.
    pub drive: Slope,
    /// Deceleration by drag, which is not a force of the tyres.
    pub drag: Slope,
}

/// What driven tyres and engine can give in a bend (m/s^2), with its derivatives by speed and by the root of what the lateral share
/// leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BendGrip {
    /// The greatest acceleration.
    pub value: f64,
    /// Its derivative by speed (m/s).
    pub by_speed: f64,
    /// Its derivative by the root.
    pub by_root: f64,
}

/// The g-g-v envelope of a point mass.
pub trait GripEnvelope: Sync {
    /// The envelope at a speed (m/s).
    fn at(&self, speed_mps: f64) -> Grip;
    /// What driven tyres and engine can give at a speed (m/s), a root of what the lateral share leaves and a friction (as a share of the
    /// car's own); `None` where the ellipse says so.
    fn traction(&self, _speed_mps: f64, _root: f64, _friction: f64) -> Option<BendGrip> {
        None
    }
    /// The envelopes on both sides of a load over mass, each with its own load (m/s^2), of a car whose limits are known under loads.
    fn loaded(&self, _load_mps2: f64) -> Option<[(f64, &dyn GripEnvelope); 2]> {
        None
    }
    /// What the road itself asks of the tyres to the left (m/s^2): gravity on a banked road.
    fn lean_mps2(&self) -> f64 {
        0.0
    }
    /// The same with the DRS open, of a car that has one.
    fn open(&self) -> Option<&dyn GripEnvelope> {
        None
    }
    /// The top speed (m/s).
    fn top_speed_mps(&self) -> f64;
    /// The curvature (1/m) that the car reaches on its steering lock. Beyond it the corner speed squared falls as that of a
    /// [`PointMass`](crate::line::PointMass) does.
    fn lock_1pm(&self) -> f64 {
        f64::INFINITY
    }
    /// The greatest rate at which the curvature may change in time (1/(m s)), as the steering allows.
    fn curvature_rate(&self) -> f64 {
        f64::INFINITY
    }
}

/// The speed squared (m^2/s^2) up to which the steering follows the change of curvature along a segment, without regard to the side
/// of the bend; with its relative derivatives by the curvature at both ends (m) and by the length (1/m).
#[derive(Clone, Debug)]
pub(super) struct SteeringLimit {
    pub square: f64,
    pub by_curvature: [f64; 2],
    pub by_length: f64,
}

impl SteeringLimit {
    /// That of segment `s` for a rate of curvature (1/(m s)); none where there is no limit.
    pub fn of(shape: &Shape, s: usize, curvature_rate: f64) -> Option<Self> {
        if curvature_rate.is_infinite() {
            return None;
        }
        let bends = shape.bends_1pm();
        let (from, to, length) = (bends[s], bends[(s + 1) % bends.len()], shape.driven_m()[s]);
        let change = to.abs() - from.abs();
        let square = (curvature_rate * length / change).powi(2);
        let by_change = -2.0 / change;
        square.is_finite().then(|| Self {
            square,
            by_curvature: [-from.signum() * by_change, to.signum() * by_change],
            by_length: 2.0 / length,
        })
    }
}

/// The direction of a pass: driving out of a corner, or backwards into one for braking.
#[derive(Clone, Copy, PartialEq)]
enum Pass {
    Drive,
    Brake,
}

/// What determines `e` at a node, with the derivatives of the value at a segment's end by its start, curvature and length.
#[derive(Clone, Copy, Debug)]
enum Origin {
    /// The node's own limit (of a corner, or what the drive pass left).
    Own,
    /// The neighbour across a segment.
    Neighbour {
        by_start: f64,
        by_curvature: f64,
        by_length: f64,
    },
}

/// Which curvature a segment is driven with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SegmentBend {
    /// That of its tighter end: an error of the first order in the spacing, and the only choice where every cross-section has a
    /// variable of its own. The mean would not penalise a line whose bends alternate between tight and wide, and an optimiser
    /// finds such lines.
    #[default]
    Tighter,
    /// The mean of both ends: of the second order, for lines with several cross-sections to a control.
    Mean,
}

/// The curvature of every segment (1/m), and the weight of each of its ends in it.
#[derive(Clone, Debug)]
pub(super) struct Bends {
    pub curvature_1pm: Vec<f64>,
    pub ends: Vec<[f64; 2]>,
}

impl Bends {
    pub fn of(shape: &Shape, bend: SegmentBend) -> Self {
        let k = shape.bends_1pm();
        let ends = (0..k.len()).map(|s| match bend {
            SegmentBend::Mean => [0.5, 0.5],
            SegmentBend::Tighter if k[(s + 1) % k.len()].abs() > k[s].abs() => [0.0, 1.0],
            SegmentBend::Tighter => [1.0, 0.0],
        });
        let ends: Vec<[f64; 2]> = ends.collect();
        let of = |(s, [here, there]): (usize, &[f64; 2])| here * k[s] + there * k[(s + 1) % k.len()];
        Self {
            curvature_1pm: ends.iter().enumerate().map(of).collect(),
            ends,
        }
    }

    /// Carries a derivative with respect to a segment's curvature on to those of its ends.
    fn pull_back(&self, segment: usize, bar: f64, by_curvature: &mut [f64]) {
        let [here, there] = self.ends[segment];
        by_curvature[segment] += bar * here;
        by_curvature[(segment + 1) % self.ends.len()] += bar * there;
    }
}

/// Speeds along a line, and time.
#[derive(Clone, Debug)]
pub(super) struct Lap {
    pub time_s: f64,
    /// Speed squared at the points.
    pub square: Vec<f64>,
    pub bends: Bends,
    /// Whether the car drives along each segment with its DRS open.
    pub open: Vec<bool>,
    corner_by_curvature: Vec<f64>,
    /// Where the steering limits a point, by the segment before it.
    steered: Vec<Option<SteeringLimit>>,
    drive: Vec<(usize, Origin)>,
    brake: Vec<(usize, Origin)>,
}

/// Most iterations for a segment: Newton's steps, or bisection where they fail. Bisection alone takes 52 for all bits of an
/// `f64`.
const MOST_STEPS: usize = 60;
/// Relative accuracy of `e` at which Newton's steps end.
const ACCURACY: f64 = 1e-12;

impl Lap {
    /// Drives `shape` as fast as `envelope` allows, from `start_mps` on an open line. `drs` says on which segments the DRS may be
    /// open; nowhere if it is empty.
    pub fn of(
        shape: &Shape,
        envelope: &dyn GripEnvelope,
        start_mps: f64,
        (bend, drs): (SegmentBend, &[bool]),
    ) -> Self {
        let n = shape.curvature_1pm.len();
        let bends = Bends::of(shape, bend);
        let (mut corner, mut corner_by_curvature) = (Vec::with_capacity(n), Vec::with_capacity(n));
        for (i, curvature) in shape.bends_1pm().iter().enumerate() {
            let (square, slope) = shape.at_point(i, envelope, |car| corner_square(car, *curvature));
            corner.push(square);
            corner_by_curvature.push(slope);
        }
        let mut steered: Vec<Option<SteeringLimit>> = (0..n).map(|_| None).collect();
        for s in 0..shape.driven_m().len() {
            let limit = SteeringLimit::of(shape, s, envelope.curvature_rate());
            let end = (s + 1) % n;
            if let Some(limit) = limit.filter(|limit| limit.square < corner[end]) {
                corner[end] = limit.square;
                steered[end] = Some(limit);
            }
        }
        if !shape.closed {
            let start = start_mps * start_mps;
            if start < corner[0] {
                corner[0] = start;
                corner_by_curvature[0] = 0.0;
            }
        }
        let (after_drive, drive, mut open) = if shape.closed {
            closed_drive(shape, &bends, (envelope, drs), &corner)
        } else {
            drive_pass(shape, &bends, (envelope, drs), &corner, 0, n)
        };
        let (square, brake) = brake_pass(shape, &bends, envelope, &after_drive);
        for (s, h) in shape.driven_m().iter().enumerate() {
            let (from, to) = (square[s], square[(s + 1) % n]);
            let drag = shape.on_segment(s, bends.ends[s], envelope, |car| {
                car.open()
                    .map_or(0.0, |open| open.at((0.5 * (from + to)).sqrt()).drag.value)
            });
            // The flap is shut on the brakes.
            open[s] &= 0.5 * (to - from) / h > -drag;
        }
        let speed: Vec<f64> = square.iter().map(|e| e.sqrt()).collect();
        let segments = shape.driven_m().iter().enumerate();
        let time_s = segments
            .map(|(s, h)| 2.0 * h / (speed[s] + speed[(s + 1) % n]))
            .sum();
        Self {
            time_s,
            square,
            bends,
            open,
            corner_by_curvature,
            steered,
            drive,
            brake,
        }
    }

    /// Derivatives of the time by segment lengths (s/m) and by curvature (s m).
    pub fn gradient(&self, shape: &Shape) -> (Vec<f64>, Vec<f64>) {
        let n = self.square.len();
        let speed: Vec<f64> = self.square.iter().map(|e| e.sqrt()).collect();
        let mut by_length = vec![0.0; shape.length_m.len()];
        let mut by_curvature = vec![0.0; n];
        let mut by_square = vec![0.0; n];
        for (s, h) in shape.driven_m().iter().enumerate() {
            let next = (s + 1) % n;
            let sum = speed[s] + speed[next];
            by_length[s] += 2.0 / sum;
            for node in [s, next] {
                if speed[node] > 0.0 {
                    by_square[node] -= h / (sum * sum * speed[node]);
                }
            }
        }
        let mut by_drive = vec![0.0; n];
        for &(node, origin) in self.brake.iter().rev() {
            let bar = std::mem::take(&mut by_square[node]);
            match origin {
                Origin::Own => by_drive[node] += bar,
                Origin::Neighbour {
                    by_start,
                    by_curvature: c,
                    by_length: l,
                } => {
                    let next = (node + 1) % n;
                    by_square[next] += bar * by_start;
                    self.bends.pull_back(node, bar * c, &mut by_curvature);
                    by_length[node] += bar * l;
                }
            }
        }
        for &(node, origin) in self.drive.iter().rev() {
            let bar = std::mem::take(&mut by_drive[node]);
            match origin {
                Origin::Own => match &self.steered[node] {
                    Some(limit) => {
                        let previous = (node + n - 1) % n;
                        by_curvature[previous] += bar * limit.square * limit.by_curvature[0];
                        by_curvature[node] += bar * limit.square * limit.by_curvature[1];
                        by_length[previous] += bar * limit.square * limit.by_length;
                    }
                    None => by_curvature[node] += bar * self.corner_by_curvature[node],
                },
                Origin::Neighbour {
                    by_start,
                    by_curvature: c,
                    by_length: l,
                } => {
                    let previous = (node + n - 1) % n;
                    by_drive[previous] += bar * by_start;
                    self.bends.pull_back(previous, bar * c, &mut by_curvature);
                    by_length[previous] += bar * l;
                }
            }
        }
        (by_length, by_curvature)
    }
}

/// The greatest `e` that a curvature (1/m) allows, and its derivative by curvature.
pub(super) fn corner_square(envelope: &dyn GripEnvelope, curvature_1pm: f64) -> (f64, f64) {
    let (square, slope) = grip_square(envelope, curvature_1pm);
    let share = envelope.lock_1pm() / curvature_1pm.abs();
    if share >= 1.0 {
        return (square, slope);
    }
    let left = share.powi(4);
    (left * square, left * (slope - 4.0 * square / curvature_1pm))
}

/// The greatest `e` at which the tyres hold a curvature (1/m), and its derivative by curvature.
fn grip_square(envelope: &dyn GripEnvelope, curvature_1pm: f64) -> (f64, f64) {
    let (k, lean) = (curvature_1pm.abs(), envelope.lean_mps2());
    let top = envelope.top_speed_mps();
    let mut high = top * top;
    // The grip less the need for it, which falls through zero at the corner speed.
    let spare = |e: f64| {
        let v = e.sqrt();
        let lateral = envelope.at(v).lateral;
        let across = curvature_1pm * e + lean;
        let by_square = across.signum() * curvature_1pm;
        (
            lateral.value - across.abs(),
            0.5 * lateral.by_speed / v - by_square,
        )
    };
    if spare(high).0 >= 0.0 {
        return (high, 0.0);
    }
    let mut low = 0.0;
    let mut e = (envelope.at(0.5 * top).lateral.value / k).min(high);
    for _ in 0..MOST_STEPS {
        let (value, slope) = spare(e);
        if value > 0.0 {
            low = e;
        } else {
            high = e;
        }
        let newton = e - value / slope;
        let next = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        let done = (next - e).abs() <= ACCURACY * e;
        e = next;
        if done {
            break;
        }
    }
    (e, (curvature_1pm * e + lean).signum() * e / spare(e).1)
}

/// Acceleration in the direction of a pass, at speed squared `e`, times `s`, where `s` is the share of longitudinal
/// grip left beside the lateral, and derivatives likewise times `s`, which keeps them finite where no grip is left.
struct Push {
    share: f64,
    value: f64,
    by_square: f64,
    by_curvature: f64,
}

fn push(envelope: &dyn GripEnvelope, pass: Pass, e: f64, curvature_1pm: f64) -> Push {
    let v = e.sqrt().max(f64::MIN_POSITIVE);
    let per_square = 0.5 / v;
    let grip = envelope.at(v);
    let lateral = grip.lateral.value;
    let used = (curvature_1pm * e + envelope.lean_mps2()) / lateral;
    let left = 1.0 - used * used;
    let (sign, drag) = match pass {
        Pass::Drive => (-1.0, grip.drag),
        Pass::Brake => (1.0, grip.drag),
    };
    let (drag_value, drag_slope) = (sign * drag.value, sign * drag.by_speed * per_square);
    let share = left.max(0.0).sqrt();
    let in_bend = match pass {
        Pass::Drive => envelope.traction(v, share, 1.0),
        Pass::Brake => None,
    };
    let tyre = in_bend.map_or(grip.longitudinal.value * share, |t| t.value);
    if pass == Pass::Drive && grip.drive.value < tyre {
        return Push {
            share: 1.0,
            value: grip.drive.value + drag_value,
            by_square: grip.drive.by_speed * per_square + drag_slope,
            by_curvature: 0.0,
        };
    }
    if left <= 0.0 {
        // Beyond the limit of the tyres the car coasts. This happens within O(h) of the slowest point of a corner, never on the
        // flanks of the fastest line.
        return Push {
            share: 1.0,
            value: drag_value,
            by_square: drag_slope,
            by_curvature: 0.0,
        };
    }
    let used_by_square = curvature_1pm / lateral - used * grip.lateral.by_speed * per_square / lateral;
    let used_by_curvature = e / lateral;
    let pull = in_bend.map_or(grip.longitudinal.value, |t| t.by_root) * used;
    let along = match in_bend {
        Some(t) => t.by_speed * per_square * share,
        None => grip.longitudinal.by_speed * per_square * left,
    };
    Push {
        share,
        value: tyre + drag_value,
        by_square: along + share * drag_slope - pull * used_by_square,
        by_curvature: -pull * used_by_curvature,
    }
}

/// The middle of a segment if the envelope did not change over it: the intersection of a parabola and the ellipse.
fn guess(envelope: &dyn GripEnvelope, pass: Pass, start: f64, curvature_1pm: f64, h: f64) -> f64 {
    let grip = envelope.at(start.sqrt().max(f64::MIN_POSITIVE));
    let drag = match pass {
        Pass::Drive => -h * grip.drag.value,
        Pass::Brake => h * grip.drag.value,
    };
    let coast = start + drag;
    let (reach, bend) = (h * grip.longitudinal.value, curvature_1pm / grip.lateral.value);
    let (reach2, bend2) = (reach * reach, bend * bend);
    let left = 1.0 - bend2 * coast * coast;
    if left <= 0.0 {
        return coast;
    }
    let tyre = (coast + reach * (left + reach2 * bend2).sqrt()) / (1.0 + reach2 * bend2);
    match pass {
        Pass::Drive => tyre.min(coast + h * grip.drive.value),
        Pass::Brake => tyre,
    }
}

/// The `e` that a pass reaches from `start` over one segment, by the implicit midpoint rule: the acceleration is that at the
/// middle, `e_m = start + h a(e_m)`. The rule is of second order, and stable because the envelope falls with speed.
fn across(envelope: &dyn GripEnvelope, pass: Pass, start: f64, curvature_1pm: f64, h: f64) -> (f64, Origin) {
    let first = push(envelope, pass, start, curvature_1pm);
    // No acceleration rises so fast with `e` that `h` times its slope exceeds one half. The middle therefore lies within twice
    // the step of Euler's method.
    let reach = 2.0 * h * first.value;
    let (mut low, mut high) = ((start + reach.min(0.0)).max(0.0), start + reach.max(0.0));
    let mut e = guess(envelope, pass, start, curvature_1pm, h).clamp(low, high);
    let mut p = push(envelope, pass, e, curvature_1pm);
    for _ in 0..MOST_STEPS {
        let excess = e - start - h * p.value;
        if excess <= 0.0 {
            low = e;
        } else {
            high = e;
        }
        let newton = e - p.share * excess / (p.share - h * p.by_square);
        if (newton - e).abs() <= ACCURACY * e {
            break;
        }
        e = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        p = push(envelope, pass, e, curvature_1pm);
    }
    let gain = p.share / (p.share - h * p.by_square);
    let by_curvature = h * p.by_curvature / (p.share - h * p.by_square);
    let origin = Origin::Neighbour {
        by_start: 2.0 * gain - 1.0,
        by_curvature: 2.0 * by_curvature,
        by_length: 2.0 * gain * p.value,
    };
    ((2.0 * e - start).max(0.0), origin)
}

type Passed = (Vec<f64>, Vec<(usize, Origin)>);
/// The same of a drive pass, and the segments along which it has the DRS open.
type Driven = (Vec<f64>, Vec<(usize, Origin)>, Vec<bool>);

/// The `e` that the car drives to along a segment, and whether it does so with its DRS open: where that may be, it is if it leads
/// to more.
fn driven(
    (envelope, drs): (&dyn GripEnvelope, &[bool]),
    segment: usize,
    start: f64,
    curvature_1pm: f64,
    h: f64,
) -> (f64, Origin, bool) {
    let (reached, origin) = across(envelope, Pass::Drive, start, curvature_1pm, h);
    let open = envelope.open().filter(|_| may_open(drs, segment));
    match open.map(|open| across(open, Pass::Drive, start, curvature_1pm, h)) {
        Some((further, origin)) if further > reached => (further, origin, true),
        _ => (reached, origin, false),
    }
}

/// Drives `count` nodes from `first` on, where the car has its corner speed.
fn drive_pass(
    shape: &Shape,
    bends: &Bends,
    car: (&dyn GripEnvelope, &[bool]),
    corner: &[f64],
    first: usize,
    count: usize,
) -> Driven {
    let n = corner.len();
    let mut square = corner.to_vec();
    let mut origins = vec![(first, Origin::Own)];
    let mut open = vec![false; n];
    for step in 1..count {
        let (previous, node) = ((first + step - 1) % n, (first + step) % n);
        let curvature = bends.curvature_1pm[previous];
        let length_m = shape.driven_m()[previous];
        let (envelope, drs) = car;
        let (reached, origin, with_drs) = shape.on_segment(previous, bends.ends[previous], envelope, |car| {
            driven((car, drs), previous, square[previous], curvature, length_m)
        });
        open[previous] = with_drs;
        let own = reached >= corner[node];
        square[node] = if own { corner[node] } else { reached };
        origins.push((node, if own { Origin::Own } else { origin }));
    }
    (square, origins, open)
}

/// The drive pass of a closed lap. It starts at a node whose corner speed the car reaches again a lap later. Drag may prevent
/// that at the slowest corner; then another node is tried. If there is none (a circle), two laps are driven.
fn closed_drive(shape: &Shape, bends: &Bends, car: (&dyn GripEnvelope, &[bool]), corner: &[f64]) -> Driven {
    let n = corner.len();
    let mut first = (0..n)
        .min_by(|a, b| corner[*a].total_cmp(&corner[*b]))
        .unwrap_or(0);
    for _ in 0..3 {
        let mut passed = drive_pass(shape, bends, car, corner, first, n);
        let last = (first + n - 1) % n;
        let curvature = bends.curvature_1pm[last];
        let (envelope, drs) = car;
        let (closing, _, open) = shape.on_segment(last, bends.ends[last], envelope, |car| {
            driven(
                (car, drs),
                last,
                passed.0[last],
                curvature,
                shape.driven_m()[last],
            )
        });
        passed.2[last] = open;
        if closing >= corner[first] {
            return passed;
        }
        let own = passed
            .1
            .iter()
            .skip(1)
            .rfind(|(_, origin)| matches!(origin, Origin::Own));
        match own {
            Some(&(node, _)) => first = node,
            None => break,
        }
    }
    drive_pass(shape, bends, car, corner, first, 2 * n)
}

/// The braking pass, backwards below the speeds of the drive pass. It starts at the slowest node of a closed line, which no
/// braking can lower, or at the end of an open one.
fn brake_pass(shape: &Shape, bends: &Bends, envelope: &dyn GripEnvelope, after_drive: &[f64]) -> Passed {
    let n = after_drive.len();
    let slowest = (0..n)
        .min_by(|a, b| after_drive[*a].total_cmp(&after_drive[*b]))
        .unwrap_or(0);
    let last = if shape.closed { slowest } else { n - 1 };
    let mut square = after_drive.to_vec();
    let mut origins = vec![(last, Origin::Own)];
    for step in 1..n {
        let (next, node) = ((last + n + 1 - step) % n, (last + n - step) % n);
        let curvature = bends.curvature_1pm[node];
        let (reached, origin) = shape.on_segment(node, bends.ends[node], envelope, |car| {
            across(car, Pass::Brake, square[next], curvature, shape.driven_m()[node])
        });
        let own = reached >= after_drive[node];
        square[node] = if own { after_drive[node] } else { reached };
        origins.push((node, if own { Origin::Own } else { origin }));
    }
    (square, origins)
}
