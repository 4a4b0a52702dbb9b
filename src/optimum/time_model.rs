//! The model of lap time in a step of line and speeds: the envelope about the last lap, and the time with its second derivative.

use super::conic::{Affine, ConicProgram};
use super::geometry::{LineMap, Shape};
use super::lap::{GripEnvelope, Lap, SteeringLimit, corner_square};
use crate::vehicle::envelope::root_left;

/// Relative change of a squared speed beyond which no step goes: what is farther is no bound.
const FAR_CHANGE: f64 = 1.0;
/// Share of the lateral grip below which steps do without the bound of a corner's speed, since the tyres' ellipses hold them.
const NEAR_CORNER: f64 = 0.5;
/// Shares of the lateral and the longitudinal grip by which steps may come closer to the limit of the driven tyres. Where the car is
/// farther from it, a step does without it, and its program takes half as long.
const NEAR: f64 = 0.1;
/// Share of the ellipse below which tangents stand in for it: that at full braking, which a step could reach, and that of the drive.
const FAR: f64 = 0.65;

/// Adds the time, times `weight`, of `lap` to a program whose variables so far are changes of the line's; relative changes of the
/// squared speeds follow them. Tyres are held within the ellipse at the middle of each segment with the curvature that it is
/// driven with (both ends', where that is the tighter one's), corner speeds at the points, as the lap has it.
pub(super) fn add_time(
    program: &mut ConicProgram,
    map: &LineMap,
    envelope: &dyn GripEnvelope,
    shape: &Shape,
    lap: &Lap,
    weight: f64,
    caution: f64,
) {
    let n = map.points();
    let squares = &lap.square;
    let speed: Vec<f64> = squares.iter().map(|e| e.sqrt()).collect();
    let top = envelope.top_speed_mps().powi(2);
    let bounds = squares.iter().enumerate().map(|(i, e)| {
        // The speed at the start of an open line is fixed, and so is a standstill.
        let held = *e <= 0.0 || (!map.closed && i == 0);
        if held {
            (0.0, 0.0)
        } else {
            // Time falls with speed, so that none needs to be held from below.
            let most = top / e - 1.0;
            let upper = if most > FAR_CHANGE {
                f64::INFINITY
            } else {
                most.max(0.0)
            };
            (f64::NEG_INFINITY, upper)
        }
    });
    let first = program.add_variables(bounds);
    let square = |i: usize| first + i;
    for (s, h) in shape.driven_m().iter().enumerate() {
        let next = (s + 1) % n;
        let sum = speed[s] + speed[next];
        let mut by_length = Vec::new();
        shape.add_length(map, s, 2.0 * weight / sum, &mut by_length);
        for (k, slope) in by_length {
            program.add_linear(k, slope);
        }
        // dT/de = -h/(S^2 v); half of d2T/de2 is the sum of squares.
        let both = (0.5 * weight * h / sum.powi(3)).sqrt();
        let mut terms = Vec::new();
        for i in [s, next].into_iter().filter(|i| speed[*i] > 0.0) {
            program.add_linear(square(i), -weight * h * speed[i] / (sum * sum));
            terms.push((square(i), both * speed[i]));
            let own = 0.5 * (weight * h * speed[i]).sqrt() / sum;
            program.add_square(Affine::change(vec![(square(i), own)]));
        }
        program.add_square(Affine::change(terms));
    }
    for s in 0..shape.length_m.len() {
        shape.on_segment(s, lap.bends.ends[s], envelope, |car| {
            add_segment(program, map, car, shape, lap, (first, s));
        });
    }
    for s in 0..shape.length_m.len() {
        let next = (s + 1) % n;
        let limit = SteeringLimit::of(shape, s, envelope.curvature_rate());
        // Speeds far below it are bound by others.
        let Some(limit) = limit.filter(|limit| limit.square < (1.0 + FAR_CHANGE) * squares[next]) else {
            continue;
        };
        let share = squares[next] / limit.square;
        let mut terms = vec![(square(next), -share)];
        shape.add_curvature(map, s, limit.by_curvature[0], &mut terms);
        shape.add_curvature(map, next, limit.by_curvature[1], &mut terms);
        shape.add_length(map, s, limit.by_length, &mut terms);
        let constant = (1.0 - share).max(0.0);
        program.add_nonnegative(Affine { constant, terms }.merged());
    }
    for i in 0..n {
        let (grip, lean) = shape.at_point(i, envelope, |car| {
            let grip = car.at(speed[i].max(f64::MIN_POSITIVE)).lateral;
            (grip, car.lean_mps2() / grip.value)
        });
        let bend = shape.bends_1pm()[i];
        let used = bend * squares[i] / grip.value + lean;
        let by_square = used * (1.0 - 0.5 * speed[i] * grip.by_speed / grip.value) - lean;
        // A linear model of grip leaves out the product of the relative changes of curvature and of speed squared. That costs at
        // most half the time spent here times the product, which the squares bound.
        let time = weight * shape.spacing_m[i] / speed[i].max(1.0);
        let caution = (0.25 * caution * time).sqrt();
        let mut turns = Vec::new();
        shape.add_curvature(map, i, caution * squares[i] / grip.value, &mut turns);
        program.add_square(Affine::change(turns));
        program.add_square(Affine::change(vec![(square(i), caution)]));
        for sign in [1.0, -1.0].into_iter().filter(|sign| sign * used >= NEAR_CORNER) {
            let mut terms = vec![(square(i), -sign * by_square)];
            shape.add_curvature(map, i, -sign * squares[i] / grip.value, &mut terms);
            shape.add_friction(map, i, 1.0, &mut terms);
            let constant = (1.0 - sign * used).max(0.0);
            program.add_nonnegative(Affine { constant, terms }.merged());
        }
        if bend.abs() > envelope.lock_1pm() {
            let (most, by_curvature) = shape.at_point(i, envelope, |car| corner_square(car, bend));
            let mut terms = vec![(square(i), -squares[i] / most)];
            shape.add_curvature(map, i, by_curvature / most, &mut terms);
            let constant = (1.0 - squares[i] / most).max(0.0);
            program.add_nonnegative(Affine { constant, terms }.merged());
        }
    }
}

/// Keeps the tyres of segment `s` within the ellipse and the drive train within its power; variable `first` is the change of
/// the first point's squared speed.
fn add_segment(
    program: &mut ConicProgram,
    map: &LineMap,
    envelope: &dyn GripEnvelope,
    shape: &Shape,
    lap: &Lap,
    (first, s): (usize, usize),
) {
    let envelope = envelope.open().filter(|_| lap.open[s]).unwrap_or(envelope);
    let next = (s + 1) % map.points();
    let (e0, e1, h) = (lap.square[s], lap.square[next], shape.driven_m()[s]);
    let middle = 0.5 * (e0 + e1);
    let v = middle.sqrt().max(f64::MIN_POSITIVE);
    let grip = envelope.at(v);
    let per_square = 0.5 / v;
    let acceleration = 0.5 * (e1 - e0) / h;
    let demand = acceleration + grip.drag.value;
    let along = grip.longitudinal.value;
    // Terms of a quantity that changes with the speeds at both ends.
    let terms = |by_start: f64, by_end: f64| vec![(first + s, e0 * by_start), (first + next, e1 * by_end)];
    // Those of one that also changes with the acceleration that is asked for, over the grip.
    let demanding = |by_start: f64, by_end: f64, by_demand: f64| {
        let share = by_demand / along;
        let mut terms = terms(by_start - 0.5 * share / h, by_end + 0.5 * share / h);
        shape.add_length(map, s, -share * acceleration / h, &mut terms);
        shape.add_climb(map, s, share, &mut terms);
        terms
    };
    let affine = |constant: f64, terms| Affine { constant, terms }.merged();
    // Each end has half of the effect of a change at the middle.
    let slope = 0.5 * per_square * (grip.drag.by_speed - demand * grip.longitudinal.by_speed / along) / along;
    let longitudinal = affine(demand / along, demanding(slope, slope, 1.0));
    let (across, lean) = (grip.lateral.value, envelope.lean_mps2());
    // After a step the other end may be the tighter one, so both are limited.
    let mixtures = match lap.bends.ends[s] {
        mean @ [0.5, 0.5] => vec![mean],
        _ => vec![[1.0, 0.0], [0.0, 1.0]],
    };
    for mixture in mixtures {
        let ends = [(s, mixture[0]), (next, mixture[1])];
        let curvature: f64 = ends
            .iter()
            .map(|(end, share)| share * shape.bends_1pm()[*end])
            .sum();
        let used = (curvature * middle + lean) / across;
        let slope = 0.5 * (curvature / across - used * per_square * grip.lateral.by_speed / across);
        let mut change = terms(slope, slope);
        for (end, share) in ends {
            shape.add_curvature(map, end, share * middle / across, &mut change);
        }
        let across = affine(used, change);
        // The ellipse grows with the friction.
        let slippery = |scale: f64| {
            let mut terms = Vec::new();
            for (end, share) in ends {
                shape.add_friction(map, end, scale * share, &mut terms);
            }
            terms
        };
        let far = longitudinal.constant.hypot(used) < FAR;
        if far {
            let both = [slippery(1.0), longitudinal.terms.clone()].concat();
            program.add_nonnegative(affine(1.0 + longitudinal.constant, both));
        } else {
            // A segment may lie slightly beyond the ellipse, by rounding or because the car coasts through its middle. It may
            // stay there.
            let whole = affine(longitudinal.constant.hypot(used).max(1.0), slippery(1.0));
            program.add_cone([whole, longitudinal.clone(), across.clone()]);
        }
        // Driven tyres have less. What they have is linear in the root of what the lateral share leaves, which is a variable below
        // a circle; far from it, the circle's tangent will do.
        let root = root_left(used);
        let closer = root_left((used.abs() + NEAR).min(1.0));
        let least = envelope
            .traction(v, closer, 1.0)
            .map_or(along * closer, |t| t.value);
        let traction = envelope.traction(v, root, 1.0);
        if let Some(traction) = traction.filter(|_| least < demand + NEAR * along) {
            let slope = 0.5 * per_square * (traction.by_speed - grip.drag.by_speed) / along;
            let by_root = traction.by_root / along;
            let mut change = demanding(slope, slope, -1.0);
            let spare = ((traction.value - demand) / along).max(0.0);
            if far {
                let tangent = -by_root * used / root;
                change.extend(across.terms.iter().map(|&(k, a)| (k, tangent * a)));
                change.extend(slippery(traction.value / along - tangent * used));
                program.add_nonnegative(affine(spare, change));
            } else {
                // The cone holds it below 1, and nothing gains by less than zero.
                let left = program.add_variables(std::iter::once((f64::NEG_INFINITY, f64::INFINITY)));
                let whole = affine(used.abs().max(1.0), slippery(1.0));
                program.add_cone([whole, affine(0.0, vec![(left, 1.0)]), across]);
                change.push((left, by_root));
                change.extend(slippery(traction.value / along - by_root * root));
                program.add_nonnegative(affine(spare - by_root * root, change));
            }
        }
    }
    let slope = 0.5 * per_square * (grip.drive.by_speed - grip.drag.by_speed) / along;
    let spare = affine(
        ((grip.drive.value - demand) / along).max(0.0),
        demanding(slope, slope, -1.0),
    );
    program.add_nonnegative(spare);
}
