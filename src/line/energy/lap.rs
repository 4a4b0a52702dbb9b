//! The passes of a lap with energy, on a line's lengths and curvatures. The end of the twin of `shaders/energy.wgsl`.
//!
//! Braking comes first. A backward pass from the corner speeds gives the greatest speed at every section from which the car can
//! still brake for all that follows. The lap itself is a forward pass below these speeds. It goes from section to section, so it
//! knows the charge of the store and the energy used so far, on which the gates of the motor depend. Energies are counted from
//! the start line. The car must cross it at the speed with which it ends the lap, so a closed lap is driven twice: once to find
//! that speed and once for the accounts. The passes are those of [`super::super::kernel`].

#![deny(clippy::disallowed_methods)]

use super::super::ground::{Grounds, LevelRoad, SlopedRoad};
use super::super::kernel::{BLOCK, Course, braked, corner, steered_corner};
use super::super::point_mass::EnvelopeTable;
use super::figures::{EnergyLap, SegmentEnergy};
use super::kernel::{Car, State, gated};
use super::plan::{EnergyPlan, Mode};
use super::table::EnergyTable;
use crate::scalar::{Lookup, Part, Real};
use std::marker::PhantomData;

/// Fills `speeds` with the greatest speeds squared from which all that follows can be braked for.
struct Ceilings<'a, R: Real, G> {
    envelope: &'a EnvelopeTable<R::Storage>,
    begin: Begin<R>,
    course: &'a Course<R>,
    speeds: &'a mut Vec<R>,
    road: PhantomData<G>,
}

impl<R: Lookup, G: Grounds<R>> Part for Ceilings<'_, R, G> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self {
            envelope,
            begin: (closed, start, entry),
            course,
            speeds,
            ..
        } = self;
        let n = course.curvature.len();
        speeds.clear();
        speeds.resize(n, R::lit(0.0));
        let previous = |section: usize| if section > 0 { section - 1 } else { n - 1 };
        let mut next = if closed { start } else { n - 1 };
        let mut here = previous(next);
        let [from, to] = [G::at(course, here, here), G::at(course, next, next)];
        speeds[next] = steered_corner(envelope, course.length[here], from, to);
        // In the first round a section is limited by its corner speed alone. On a closed line the pass continues until it meets its
        // own values.
        let steps = if closed { 2 * n } else { n - 1 };
        for step in 0..steps {
            let before = previous(here);
            let reached = braked(
                envelope,
                speeds[next],
                course.length[here],
                G::at(course, next, here),
                G::at(course, here, here),
            );
            let again = step + 1 >= n;
            let most = if again {
                speeds[here]
            } else if !closed && here == 0 {
                corner(envelope, G::at(course, here, here))
            } else {
                let [from, to] = [G::at(course, before, before), G::at(course, here, here)];
                steered_corner(envelope, course.length[before], from, to)
            };
            let slower = reached.less_than(most);
            speeds[here] = R::select(slower, reached, most);
            if again && R::all(!slower) {
                break;
            }
            (next, here) = (here, before);
        }
        if !closed {
            speeds[0] = speeds[0].min(entry);
        }
    }
}

/// A lap with energy on `course`, whose lengths, curvatures and relief are given; afterwards its speeds squared are those from which the
/// car can still brake. `start` is the section where the braking pass begins, as in [`super::super::kernel::lap_time`]; `entry`
/// is the greatest speed squared at the start of an open line. `strategy` has the figures of the gates, then the share of each
/// zone. `record` receives every segment of the lap that is accounted.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
pub fn energy_lap<R: Lookup>(
    envelope: &EnvelopeTable<R::Storage>,
    table: &EnergyTable<R::Storage>,
    plan: &EnergyPlan<R::Storage>,
    (closed, start, entry): (bool, usize, R),
    strategy: &[R],
    course: &mut Course<R>,
    record: impl FnMut(usize, &SegmentEnergy<R>),
) -> EnergyLap<R> {
    let tables = (envelope, table, plan);
    let begin = (closed, start, entry);
    if course.relief.is_empty() {
        lap_on::<R, LevelRoad>(tables, begin, strategy, course, record)
    } else {
        lap_on::<R, SlopedRoad>(tables, begin, strategy, course, record)
    }
}

/// What a lap reads: envelope, energy and zones.
type Tables<'a, S> = (&'a EnvelopeTable<S>, &'a EnergyTable<S>, &'a EnergyPlan<S>);

/// Whether the line is closed, the section where the braking pass begins, and the greatest speed squared at the start of an open line.
type Begin<R> = (bool, usize, R);

/// The section after `here` on a lap of `n`.
#[inline(always)]
fn after(n: usize, here: usize) -> usize {
    if here + 1 < n { here + 1 } else { 0 }
}

/// A segment: its length (m), the ground at both ends, and the greatest speed squared at the end, of those at every section.
#[inline(always)]
fn way<R: Lookup, G: Grounds<R>>(course: &Course<R>, most: &[R], here: usize) -> (R, [G::Place; 2], R) {
    let there = after(course.curvature.len(), here);
    let ground = [G::at(course, here, here), G::at(course, there, here)];
    (course.length[here], ground, most[there])
}

/// The drive of a closed lap that finds the speed at the start line, with which it begins and ends.
struct FirstDrive<'a, R: Real, G> {
    car: &'a Car<'a, R>,
    course: &'a Course<R>,
    /// The greatest speeds squared.
    most: &'a [R],
    /// Filled with the results of the drive for each segment, with motors beside the engine.
    drive: &'a mut Vec<[R; 5]>,
    road: PhantomData<G>,
}

impl<R: Lookup, G: Grounds<R>> Part for FirstDrive<'_, R, G> {
    /// Speeds squared at the line: where the lap begins, and where this drive began.
    type Output = [R; 2];

    #[inline(always)]
    fn run(self) -> [R; 2] {
        let Self {
            car, course, most, ..
        } = self;
        let n = course.curvature.len();
        // From a slow section late in the lap to the start line, with the store taken as full enough.
        let mut speed_squared = most[car.plan.run_in];
        for here in car.plan.run_in..n {
            let (h, bend, held) = way::<R, G>(course, most, here);
            speed_squared = match car.plan.mode {
                Mode::Additional => {
                    let enough = car.strategy[4];
                    let space = R::load(car.table.store_room) + enough;
                    car.additional(here, speed_squared, h, bend, held, [enough, space])
                        .end
                }
                Mode::Offset => car.engine_only(here, speed_squared, h, bend, held),
            };
        }
        if car.plan.mode == Mode::Offset {
            return [speed_squared, R::lit(0.0)];
        }
        let mut state = State::at(speed_squared);
        for here in 0..n {
            let (h, bend, held) = way::<R, G>(course, most, here);
            let step = car.provisional(&mut state, here, h, bend, held);
            self.drive
                .push([step.end, step.motor, step.wanted, step.boost, step.space]);
        }
        [state.speed_squared, speed_squared]
    }
}

/// [`energy_lap`] on one kind of road.
#[inline(always)]
fn lap_on<R: Lookup, G: Grounds<R>>(
    tables: Tables<'_, R::Storage>,
    begin: Begin<R>,
    strategy: &[R],
    course: &mut Course<R>,
    record: impl FnMut(usize, &SegmentEnergy<R>),
) -> EnergyLap<R> {
    R::apart(Lap {
        tables,
        begin,
        strategy,
        course,
        record,
        road: PhantomData::<G>,
    })
}

/// What [`lap_on`] works on.
struct Lap<'a, R: Real, G, F> {
    tables: Tables<'a, R::Storage>,
    begin: Begin<R>,
    strategy: &'a [R],
    course: &'a mut Course<R>,
    record: F,
    road: PhantomData<G>,
}

impl<R: Lookup, G: Grounds<R>, F: FnMut(usize, &SegmentEnergy<R>)> Part for Lap<'_, R, G, F> {
    type Output = EnergyLap<R>;

    #[inline(always)]
    fn run(self) -> EnergyLap<R> {
        let Self {
            tables: (envelope, table, plan),
            begin,
            strategy,
            course,
            mut record,
            road,
        } = self;
        let mut most = std::mem::take(&mut course.speed_squared);
        R::apart(Ceilings::<R, G> {
            envelope,
            begin,
            course,
            speeds: &mut most,
            road,
        });
        let n = course.curvature.len();
        let zero = R::lit(0.0);
        let mut first_drive = std::mem::take(&mut course.first_drive);
        first_drive.clear();
        let car = Car {
            envelope,
            table,
            plan,
            strategy,
            drs: &course.drs,
        };
        let (closed, ..) = begin;
        let [speed_squared, mut first_speed_squared] = if closed {
            R::apart(FirstDrive::<R, G> {
                car: &car,
                course,
                most: &most,
                drive: &mut first_drive,
                road,
            })
        } else {
            [most[0], zero]
        };

        let mut state = State::at(speed_squared);
        let mut root = speed_squared.sqrt();
        let (mut greatest, mut least) = (zero, zero);
        let mut total = [zero; 6];
        let mut block = [zero; 6];
        let segments = if closed { n } else { n - 1 };
        for here in 0..segments {
            let first = first_drive.get(here).copied();
            let along = way::<R, G>(course, &most, here);
            let s = car.segment(&mut state, &mut root, here, along, (first, first_speed_squared));
            first_speed_squared = first.map_or(zero, |[end, ..]| end);
            record(here, &s);
            let motor_time = gated(zero.less_than(s.deployed), s.time);
            let terms = [
                s.time,
                s.fuel,
                s.deployed,
                s.harvested_k,
                s.harvested_h,
                motor_time,
            ];
            for (block, term) in block.iter_mut().zip(terms) {
                *block = *block + term;
            }
            greatest = greatest.max(state.change);
            least = least.min(state.change);
            if (here + 1) % BLOCK == 0 || here + 1 == segments {
                for (total, block) in total.iter_mut().zip(&mut block) {
                    *total = *total + *block;
                    *block = zero;
                }
            }
        }
        (course.speed_squared, course.first_drive) = (most, first_drive);
        let [time, fuel, deployed, harvested_k, harvested_h, motor_time] = total;
        EnergyLap {
            time,
            fuel,
            deployed,
            harvested_k,
            harvested_h,
            change: state.change,
            swing: greatest - least,
            motor_time,
        }
    }
}
