//! The energy kernel: a segment of a line with engine, motor-generators and store. `lap.rs` goes through them.
//! Twin of `shaders/energy.wgsl`, with that file.
//!
//! On a road in three dimensions the forces at the wheels also lift the car.
//!
//! The MGU-H is a machine on the turbocharger's shaft: what it generates costs power at the crank. At part load the engine burns
//! for it by its map. At full load the engine cannot give more, and the car is slower for it. Where the motor replaces the engine,
//! the speed is kept, and the MGU-H takes only what the engine has to spare. Below the speed from which it generates it may drive the
//! compressor where the motor works beside the engine: the engine then gives more, and the store pays for it, at a price of its own.
//!
//! After R. Lot and S. A. Evangelou, *Lap time optimization of a sports series hybrid electric vehicle*, World Congress on
//! Engineering 2013, for the energies that are accounted.

#![deny(clippy::disallowed_methods)]

use super::super::ground::Ground;
use super::super::kernel::{driving_with_drs, may_open};
use super::super::point_mass::EnvelopeTable;
use super::figures::SegmentEnergy;
use super::plan::{EnergyPlan, GATES, Mode, ZoneRow};
use super::table::EnergyTable;
use crate::scalar::{Lookup, Real};

/// The part of a lap that later segments depend on.
#[derive(Clone, Copy)]
pub(super) struct State<R> {
    pub(super) speed_squared: R,
    pub(super) change: R,
    pub(super) deployed: R,
    pub(super) harvested_k: R,
}

impl<R: Real> State<R> {
    /// At a speed squared, before anything has left the store.
    #[inline(always)]
    pub(super) fn at(speed_squared: R) -> Self {
        let zero = R::lit(0.0);
        Self {
            speed_squared,
            change: zero,
            deployed: zero,
            harvested_k: zero,
        }
    }
}

/// A remainder below this (J) is left in the store, and the MGU-H does not fill a lesser room. In single precision, rounding would
/// spend it in ever smaller shares, or take the engine's power for a room that is none.
const LEAST_J: f64 = 5.0;

/// Least energy at the wheels for a joule of the MGU-H that is told from none.
const LEAST_COST: f64 = 1e-6;

/// All that does not change along a lap.
pub(super) struct Car<'a, R: Real> {
    pub(super) envelope: &'a EnvelopeTable<R::Storage>,
    pub(super) table: &'a EnergyTable<R::Storage>,
    pub(super) plan: &'a EnergyPlan<R::Storage>,
    pub(super) strategy: &'a [R],
    pub(super) drs: &'a [bool],
}

/// A way of a lap.
pub(super) struct Along<R> {
    /// Speed squared at its ends,
    pub(super) ends: [R; 2],
    /// and the mean of them (m^2/s^2).
    pub(super) mean: R,
    /// Acceleration (m/s^2).
    pub(super) ax: R,
    /// Length (m).
    pub(super) length: R,
    /// Time (s).
    pub(super) time: R,
}

/// A step along a segment.
pub(super) struct Step<R> {
    /// Speed squared at the end.
    pub(super) end: R,
    /// What the motor, and the MGU-H as one, add to the acceleration (m/s^2).
    pub(super) motor: R,
    /// The part of the MGU-H (m/s^2).
    assist: R,
    /// What gates and zone allow the MGU-K (m/s^2),
    pub(super) wanted: R,
    /// and that for which the store has energy.
    pub(super) boost: R,
    /// What the store took yet (J): with room in it the MGU-H lowered the engine's part.
    pub(super) space: R,
}

/// The share of a segment in which its zone allows the motor to work.
#[inline(always)]
fn zone_share<R: Real>(row: &ZoneRow<R::Storage>, strategy: &[R]) -> R {
    let into = (strategy[GATES + row.zone as usize] - R::load(row.position)) * R::load(row.per_share);
    into.max(R::lit(0.0)).min(R::lit(1.0))
}

/// Where both hold, `x`, else zero.
#[inline(always)]
pub(super) fn gated<R: Real>(mask: R::Mask, x: R) -> R {
    R::select(mask, x, R::lit(0.0))
}

/// The flow of fuel at a load, between those at 0, 1/3, 2/3 and 1.
#[inline(always)]
fn flow_at<R: Real>(flows: [R; 4], load: R) -> R {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let thirds = R::lit(3.0) * load;
    flows[0]
        + (flows[1] - flows[0]) * thirds.min(one)
        + (flows[2] - flows[1]) * (thirds - one).max(zero).min(one)
        + (flows[3] - flows[2]) * (thirds - R::lit(2.0)).max(zero)
}

impl<R: Lookup> Car<'_, R> {
    /// The traction that is left, the drive that the tyres leave, the drag and what the tyres take (m/s^2) on a segment, at a speed
    /// squared.
    #[inline(always)]
    fn driving_at(&self, here: usize, speed_squared: R, ground: impl Ground<R>) -> [R; 4] {
        driving_with_drs(self.envelope, may_open(self.drs, here), speed_squared, ground)
    }

    /// The drag with the DRS shut, what an open one sheds of it, and what the tyres take (m/s^2) on a segment, at a mean speed squared.
    /// `level` is the drag on a level road.
    #[inline(always)]
    fn resistance<G: Ground<R>>(&self, here: usize, speed_squared: R, ground: G, level: R) -> [R; 3] {
        let zero = R::lit(0.0);
        if G::LEVEL && self.envelope.traction.is_empty() && self.envelope.open.is_none() {
            return [level, zero, zero];
        }
        let [.., shut, lost] = driving_with_drs(self.envelope, false, speed_squared, ground);
        let drag = if G::LEVEL { level } else { shut };
        if self.envelope.open.is_none() || !may_open(self.drs, here) {
            return [drag, zero, lost];
        }
        let [.., open, lost] = self.driving_at(here, speed_squared, ground);
        [drag, shut - open, lost]
    }

    /// Whether the gates of steering and speed are open at a section.
    #[inline(always)]
    fn open(&self, curvature: R, speed_squared: R) -> R::Mask {
        !self.strategy[0].less_than(curvature) & !self.strategy[1].less_than(speed_squared)
    }

    /// Energy that may still leave the store (J).
    #[inline(always)]
    pub(super) fn left(&self, state: &State<R>) -> R {
        let of_charge = state.change - self.strategy[3];
        let of_budget = self.strategy[4] - state.deployed;
        let left = of_charge.min(of_budget);
        R::select(left.less_than(R::lit(LEAST_J)), R::lit(0.0), left)
    }

    /// Greatest part of the acceleration by the motor (m/s^2) with `left` (J) of energy for a segment.
    #[inline(always)]
    fn boost(&self, left: R, inverse: R) -> R {
        self.reach(left, inverse) / R::load(self.table.rotating)
    }

    /// Greatest force of the motor over the mass (m/s^2) with `left` (J) of energy for a segment; `inverse` is one over its
    /// length (1/m).
    #[inline(always)]
    pub(super) fn reach(&self, left: R, inverse: R) -> R {
        left * R::load(self.table.force_per_deployed) * inverse
    }

    /// Whether the MGU-H may generate at this speed squared and this acceleration.
    #[inline(always)]
    fn spins(&self, speed_squared: R, ax: R) -> R::Mask {
        !speed_squared.less_than(R::load(self.table.exhaust_from))
            & R::lit(0.0).less_than(ax)
            & !R::load(self.table.exhaust_to_ax).less_than(ax)
    }

    /// Drives along a segment, with the motor beside the engine in as much of it as the store's energy suffices for, up to the
    /// greatest speed squared at its end. `store` has the energy that may leave the store and the space that is in it (J): while
    /// there is some, the MGU-H lowers what an engine at full load gives.
    #[inline(always)]
    pub(super) fn additional<G: Ground<R>>(
        &self,
        here: usize,
        from: R,
        length: R,
        bends: [G; 2],
        most: R,
        store: [R; 2],
    ) -> Step<R> {
        let [left, space] = store;
        let inverse = R::lit(1.0) / length;
        let zero = R::lit(0.0);
        let [traction, drive, drag, _] = self.driving_at(here, from, bends[0]);
        let alone = bends[0].uphill(traction.min(drive) - drag);
        let ahead = (from + length * alone).max(zero);
        let argument = ahead * R::load(self.table.rows_per_speed_squared);
        let [motor, room, exhaust, beside] = argument.between_rows(&self.table.boosts);
        let greatest = (motor * self.strategy[5]).min(room);
        let open = self.open(bends[0].bend(), from) & self.strategy[2].less_than(alone);
        let share = zone_share(&self.plan.zones[here], self.strategy);
        let reach = self.boost(left, inverse);
        let gain = if self.table.assists {
            let slow = from.less_than(R::load(self.table.exhaust_from));
            gated(slow, beside.min(room - greatest))
        } else {
            zero
        };
        // The MGU-K first, whose joules are cheaper.
        let both_wanted = gated(open, (greatest + gain) * share);
        let wanted = both_wanted.min(greatest);
        let own = wanted.min(reach);
        let assist = (both_wanted - wanted).min((reach - own) * R::load(self.table.assist_share));
        let boost = own + assist;
        let ax = bends[0].uphill(traction.min(drive + boost) - drag);
        let spins = self.spins(from, ax) & R::lit(LEAST_J).less_than(space);
        let exhaust = gated(spins, exhaust);

        let drive = drive - exhaust;
        let engine = traction.min(drive);
        let both = traction.min(drive + boost);
        let first = bends[0].uphill(both - drag);
        let middle = (from + length * first).max(zero);
        let half_way = bends[0].half_way(bends[1]);
        let [traction, drive, later_drag, _] = self.driving_at(here, middle, half_way);
        let drive = drive - exhaust;
        let later_both = traction.min(drive + boost);
        let motor = R::lit(0.5) * ((both - engine) + (later_both - traction.min(drive)));
        let second = half_way.uphill(later_both - later_drag);
        let reached = (from + length * (first + second)).max(zero);
        let end = reached.min(most);
        // Where less force is needed than both can give, the motor is reduced first, and of the motors the dearer one.
        let spare = R::lit(0.5) * (reached - end) * inverse;
        let motor = (motor - spare).max(zero);
        Step {
            end,
            motor,
            assist: assist.min((motor - own).max(zero)),
            wanted,
            boost: own,
            space,
        }
    }

    /// As the function above, but reuses the results of the first drive if that entered the segment at the same speed and with
    /// the same energy and space in every lane. After the first slow bend the two drives differ only where the store runs out.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    fn additional_again<G: Ground<R>>(
        &self,
        first: Option<[R; 5]>,
        before: R,
        here: usize,
        from: R,
        length: R,
        bends: [G; 2],
        most: R,
        store: [R; 2],
    ) -> Step<R> {
        if let (Some([end, motor, wanted, boost, space]), false) = (first, self.table.assists) {
            let now = wanted.min(self.boost(store[0], R::lit(1.0) / length));
            let least = R::lit(LEAST_J);
            let (had, has) = (least.less_than(space), least.less_than(store[1]));
            let differs = from.less_than(before)
                | before.less_than(from)
                | now.less_than(boost)
                | boost.less_than(now)
                | (had & !has)
                | (has & !had);
            if R::all(!differs) {
                return Step {
                    end,
                    motor,
                    assist: R::lit(0.0),
                    wanted,
                    boost,
                    space,
                };
            }
        }
        self.additional(here, from, length, bends, most, store)
    }

    /// Drives along a segment by the engine alone.
    #[inline(always)]
    pub(super) fn engine_only<G: Ground<R>>(
        &self,
        here: usize,
        from: R,
        length: R,
        bends: [G; 2],
        most: R,
    ) -> R {
        let zero = R::lit(0.0);
        let [traction, drive, drag, _] = self.driving_at(here, from, bends[0]);
        let first = bends[0].uphill(traction.min(drive) - drag);
        let middle = (from + length * first).max(zero);
        let half_way = bends[0].half_way(bends[1]);
        let [traction, drive, drag, _] = self.driving_at(here, middle, half_way);
        let second = half_way.uphill(traction.min(drive) - drag);
        (from + length * (first + second)).max(zero).min(most)
    }

    /// One segment of the lap that only finds the speed at the start line, with the motor beside the engine: what is deployed,
    /// and what the MGU-K harvests where the charge matters. The small charge by the MGU-H is left out here.
    #[inline(always)]
    pub(super) fn provisional<G: Ground<R>>(
        &self,
        state: &mut State<R>,
        here: usize,
        length: R,
        bends: [G; 2],
        most: R,
    ) -> Step<R> {
        let zero = R::lit(0.0);
        let table = self.table;
        let from = state.speed_squared;
        let space = R::load(table.store_room) - state.change;
        let step = self.additional(here, from, length, bends, most, [self.left(state), space]);
        let joules = R::load(table.mass) * length;
        let rotating = R::load(table.rotating);
        let deployed = joules * (rotating * step.motor) * R::load(table.deploy_cost)
            + joules * (rotating * step.assist) * R::load(table.assist_extra);
        state.speed_squared = step.end;
        state.deployed = state.deployed + deployed;
        state.change = state.change - deployed;
        if self.plan.counts_charge {
            let mean = R::lit(0.5) * (from + step.end);
            let argument = mean * R::load(table.rows_per_speed_squared);
            let [_, _, generator_most, level] = argument.between_rows(&table.forces);
            let inverse = R::lit(1.0) / length;
            let ground = bends[0].half_way(bends[1]);
            let [drag, _, lost] = self.resistance(here, mean, ground, level);
            let force = rotating * (R::lit(0.5) * (step.end - from) * inverse) + drag + lost + ground.climb();
            let unharvested = (R::load(table.harvest_most) - state.harvested_k).min(space);
            let room = (unharvested * R::load(table.force_per_harvested) * inverse).max(zero);
            let most = generator_most * self.strategy[5];
            let generator = (-force).max(zero).min(most).min(room);
            let harvested_k = joules * generator * R::load(table.harvest_gain);
            state.change = state.change + harvested_k;
            state.harvested_k = state.harvested_k + harvested_k;
        }
        step
    }

    /// One segment with its accounts, up to the greatest speed squared at its end. `first` has the results of the first drive for
    /// this segment and the speed squared with which that drive entered it.
    #[inline(always)]
    pub(super) fn segment<G: Ground<R>>(
        &self,
        state: &mut State<R>,
        root: &mut R,
        here: usize,
        (length, bends, most): (R, [G; 2], R),
        first: (Option<[R; 5]>, R),
    ) -> SegmentEnergy<R> {
        let zero = R::lit(0.0);
        let table = self.table;
        let from = state.speed_squared;
        let left = self.left(state);
        let space = R::load(table.store_room) - state.change;
        let step = match self.plan.mode {
            Mode::Additional => {
                self.additional_again(first.0, first.1, here, from, length, bends, most, [left, space])
            }
            Mode::Offset => Step {
                end: self.engine_only(here, from, length, bends, most),
                motor: zero,
                assist: zero,
                wanted: zero,
                boost: zero,
                space,
            },
        };
        let end = step.end;
        let mean = R::lit(0.5) * (from + end);
        let argument = mean * R::load(table.rows_per_speed_squared);
        let [greatest, motor_most, generator_most, level] = argument.between_rows(&table.forces);
        let inverse = R::lit(1.0) / length;
        let ax = R::lit(0.5) * (end - from) * inverse;
        // The force at the wheels, driving or braking.
        let rotating = R::load(table.rotating);
        let ground = bends[0].half_way(bends[1]);
        let [drag, opened, lost] = self.resistance(here, mean, ground, level);
        let shut = rotating * ax + drag + lost + ground.climb();
        let open = shut - opened;
        // A driver shuts the flap on the brakes.
        let force = open.max(zero) + shut.min(zero);
        let demand = force.max(zero);
        let shed = (-force).max(zero);
        let [motor, assist] = match self.plan.mode {
            Mode::Additional => {
                let motor = (rotating * step.motor).min(demand);
                let unneeded = rotating * step.motor - motor;
                [motor, (rotating * step.assist - unneeded).max(zero)]
            }
            Mode::Offset => {
                let open = self.open(bends[0].bend(), from) & self.strategy[2].less_than(ax);
                let share = zone_share(&self.plan.zones[here], self.strategy);
                let motor = gated(open, motor_most * self.strategy[5] * share);
                [motor.min(demand).min(self.reach(left, inverse)), zero]
            }
        };
        let end_root = end.sqrt();
        let time = R::lit(2.0) * length / (*root + end_root);
        *root = end_root;
        let along = Along {
            ends: [from, end],
            mean,
            ax,
            length,
            time,
        };
        state.speed_squared = end;
        let most = [greatest, generator_most * self.strategy[5]];
        SegmentEnergy {
            lost,
            ..self.accounts(state, &along, [demand, shed, motor, assist], most, space)
        }
    }

    /// The accounts of a way whose forces over the mass (m/s^2) at the wheels are known: what drives the car, what holds it back and
    /// the generator may take, the motors' part of the first, and the MGU-H's part of that. With them stand the most that engine and
    /// generator do there, and what the store takes yet (J). The shader, which drives no car, has it as the end of `segment_energy`.
    #[inline(always)]
    pub(super) fn accounts(
        &self,
        state: &mut State<R>,
        along: &Along<R>,
        [demand, shed, motor, assist]: [R; 4],
        [greatest, generator_most]: [R; 2],
        space: R,
    ) -> SegmentEnergy<R> {
        let (zero, one) = (R::lit(0.0), R::lit(1.0));
        let table = self.table;
        let (length, time) = (along.length, along.time);
        let inverse = one / length;
        let joules = R::load(table.mass) * length;
        let engine = demand - motor;
        let unharvested = (R::load(table.harvest_most) - state.harvested_k).min(space);
        let room = unharvested * R::load(table.force_per_harvested) * inverse;
        let generator = shed.min(generator_most).min(room.max(zero));
        let deployed =
            joules * motor * R::load(table.deploy_cost) + joules * assist * R::load(table.assist_extra);
        let harvested_k = joules * generator * R::load(table.harvest_gain);

        let argument = along.mean * R::load(table.rows_per_speed_squared);
        let flows = argument.between_rows(&table.flows);
        // The MGU-H generates by the flow of the exhaust, while the store has space and the engine power to spare for it. The
        // engine then burns for its load at the wheels and for this.
        let cost = R::load(table.exhaust_cost);
        let space = (space + (deployed - harvested_k)).max(zero);
        let spare = joules * (greatest - engine).max(zero) / cost.max(R::lit(LEAST_COST));
        let driving = (engine / greatest.max(R::lit(1e-3))).min(one);
        let exhaust = R::load(table.exhaust_gain) * (flow_at(flows, driving) * time);
        let spins = self.spins(along.mean, along.ax) & !zero.less_than(assist);
        let harvested_h = gated(spins, exhaust.min(spare).min(space));
        let crank = engine + cost * harvested_h / joules;
        let load = (crank / greatest.max(R::lit(1e-3))).min(one);

        state.change = state.change + ((harvested_k + harvested_h) - deployed);
        state.deployed = state.deployed + deployed;
        state.harvested_k = state.harvested_k + harvested_k;
        let [start, end] = along.ends;
        SegmentEnergy {
            start,
            end,
            time,
            engine,
            motor,
            assist,
            generator,
            hydraulic: shed - generator,
            lost: zero,
            load,
            fuel: flow_at(flows, load) * time,
            deployed,
            harvested_k,
            harvested_h,
        }
    }
}

/// A segment of one lap by itself: the speed squared reached with the motors at a share of their force beside the engine, without a
/// limit at the end, their force over the mass (m/s^2), and the MGU-H's part of it.
pub fn motors_step<G: Ground<f64>>(
    envelope: &EnvelopeTable<f64>,
    table: &EnergyTable<f64>,
    from: f64,
    length: f64,
    (bends, drs): ([G; 2], bool),
    share: f64,
) -> [f64; 3] {
    let car = Car {
        envelope,
        table,
        plan: &EnergyPlan::whole(1, 0, Mode::Additional),
        strategy: &[
            f64::INFINITY,
            f64::INFINITY,
            f64::NEG_INFINITY,
            0.0,
            0.0,
            1.0,
            share,
        ],
        drs: &[drs],
    };
    let step = car.additional(0, from, length, bends, f64::INFINITY, [f64::INFINITY; 2]);
    [
        step.end,
        table.rotating * step.motor,
        table.rotating * step.assist,
    ]
}
