//! The road under a point mass: a bend of a level road, or a place of one that is not level and dry. Twin of the same functions in
//! `shaders/line.wgsl`.
//!
//! The line's own frame on the road is T forward, L left and N up from the surface. With `dT/ds = k_g L + k_n N` the specific forces
//! of the tyres are `f_T = dv/dt + g e_z.T`, `f_L = v^2 k_g + g e_z.L` and `f_N = v^2 k_n + g e_z.N` (D. J. N. Limebeer, G. Perantoni,
//! *Optimal control of a Formula One car on a three-dimensional track, part 2*, J. Dyn. Sys., Meas., Control 137, 2015). Limits are those
//! of the load `f_N`, of which [`EnvelopeTable::loads`] has several. What tyres can do goes with the friction of the road; what they take
//! from the drive in a bend goes with its square, since their slip angles go with it, too.

#![deny(clippy::disallowed_methods)]

use super::kernel::{Course, alpha, held, look_up};
use super::loads::LoadTables;
use super::plan::{LinePlan, ReliefRow};
use super::point_mass::{ENVELOPE_WIDTH, EnvelopeTable, TRACTION_ROOTS, TRACTION_SPEEDS, TRACTION_WIDTH};
use crate::scalar::{Lookup, Real};
use crate::vehicle::powertrain::GRAVITY_MPS2;

/// Steps in which the corner speed of a road in three dimensions is found. Newton's method settles in four to six.
const CORNER_STEPS: usize = 12;
/// Least lateral limit and least grip that are left of a car without load (m/s^2).
const LEAST_GRIP: f64 = 0.05;

/// A place of the road as the laws of motion need it. A number is the curvature of a level road.
pub trait Ground<R: Lookup>: Copy {
    /// Whether the road is level.
    const LEVEL: bool;
    /// Curvature (1/m) without a sign: what a driver steers for.
    fn bend(self) -> R;
    /// The part of gravity that the car climbs against (m/s^2).
    fn climb(self) -> R;
    /// Half-way to another place on the same segment.
    fn half_way(self, there: Self) -> Self;
    /// Limits at a speed squared: lateral, grip, drive and drag (m/s^2), and the root of what the lateral share leaves.
    fn limits(self, envelope: &EnvelopeTable<R::Storage>, speed_squared: R) -> ([R; 4], R);
    /// The share of the longitudinal grip that is left for driving, and what the tyres take from the drive (m/s^2), where the envelope
    /// has a table of it.
    fn left_for_driving(self, envelope: &EnvelopeTable<R::Storage>, speed_squared: R, root: R) -> [R; 2];
    /// Greatest speed squared (m^2/s^2).
    fn corner(self, envelope: &EnvelopeTable<R::Storage>) -> R;
    /// An acceleration by forces (m/s^2), less the part of gravity that the car climbs against.
    fn uphill(self, acceleration: R) -> R;
    /// A deceleration by forces (m/s^2), with the part of gravity that helps.
    fn helped(self, deceleration: R) -> R;
}

/// The cell of the tables of traction at a speed squared and a root of what the lateral share leaves, and how far beyond its start
/// that is along both.
#[inline(always)]
fn traction_cell<R: Lookup>(envelope: &EnvelopeTable<R::Storage>, speed_squared: R, root: R) -> (R, [R; 2]) {
    // Cells are counted in whole numbers, which scalars hold exactly.
    let rows = envelope.rows.len() / ENVELOPE_WIDTH;
    let per_row = R::lit(TRACTION_SPEEDS as f64 / rows as f64);
    let (speeds, roots) = (R::lit(TRACTION_SPEEDS as f64), R::lit(TRACTION_ROOTS as f64));
    let along = speed_squared * R::load(envelope.rows_per_speed_squared) * per_row;
    let along = along.max(R::lit(0.0)).min(speeds);
    let across = root * roots;
    let (speed, cell) = (along.whole(TRACTION_SPEEDS - 1), across.whole(TRACTION_ROOTS - 1));
    (speed * roots + cell, [along - speed, across - cell])
}

/// The two figures of a cell, so far beyond its start.
#[inline(always)]
fn traction_in<R: Real>(figures: [R; TRACTION_WIDTH], [along, across]: [R; 2]) -> [R; 2] {
    let of = |i: usize| {
        let start = figures[i] + along * figures[i + 1];
        start + across * (figures[i + 2] + along * figures[i + 3])
    };
    [of(0), of(TRACTION_WIDTH / 2)]
}

impl<R: Lookup> Ground<R> for R {
    const LEVEL: bool = true;

    #[inline(always)]
    fn bend(self) -> R {
        self
    }

    #[inline(always)]
    fn climb(self) -> R {
        R::lit(0.0)
    }

    #[inline(always)]
    fn half_way(self, there: Self) -> Self {
        R::lit(0.5) * (self + there)
    }

    #[inline(always)]
    fn limits(self, envelope: &EnvelopeTable<R::Storage>, speed_squared: R) -> ([R; 4], R) {
        let argument = speed_squared * R::load(envelope.rows_per_speed_squared);
        let limits = argument.between_rows(&envelope.rows);
        let share = self * speed_squared / limits[0];
        let root = (R::lit(1.0) - share * share).max(R::lit(0.0)).sqrt();
        (limits, root)
    }

    #[inline(always)]
    fn left_for_driving(self, envelope: &EnvelopeTable<R::Storage>, speed_squared: R, root: R) -> [R; 2] {
        let (cell, beyond) = traction_cell(envelope, speed_squared, root);
        let (place, _) = cell.place(TRACTION_SPEEDS * TRACTION_ROOTS, TRACTION_WIDTH);
        traction_in(R::pick_row(&envelope.traction, place), beyond)
    }

    #[inline(always)]
    fn corner(self, envelope: &EnvelopeTable<R::Storage>) -> R {
        // Straights have no radius; a thousand kilometres stand for it.
        let radius = R::lit(1.0) / self.max(R::lit(1e-6));
        let (place, beyond) =
            (radius * R::load(envelope.rows_per_radius)).place(envelope.corners.len() / 2, 2);
        look_up(&envelope.corners, place, beyond)
    }

    #[inline(always)]
    fn uphill(self, acceleration: R) -> R {
        acceleration
    }

    #[inline(always)]
    fn helped(self, deceleration: R) -> R {
        deceleration
    }
}

/// A place of a road that is not level and dry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sloped<R> {
    /// Curvature along the surface (1/m), positive in left turns.
    pub bend: R,
    /// Curvature square to the surface (1/m), positive in a dip.
    pub dip: R,
    /// Gravity along T (m/s^2), positive uphill,
    pub climb: R,
    /// along L, positive where the left side is up,
    pub lean: R,
    /// and along N.
    pub press: R,
    /// Friction as a share of the car's own.
    pub friction: R,
}

/// Where a load lies between two of the tables of limits.
#[derive(Clone, Copy)]
struct Layer<R> {
    /// The lower of the two, a whole number.
    below: R,
    /// How far the load is beyond it, as a share of the step to the next. It passes 0 and 1 beyond the outer tables.
    share: R,
}

impl<R: Lookup> Sloped<R> {
    /// The specific force of the tyres across the car (m/s^2), positive to the left, at a speed squared.
    #[inline(always)]
    pub fn across(self, speed_squared: R) -> R {
        speed_squared * self.bend + self.lean
    }

    /// The specific force of the road square to its surface (m/s^2), at a speed squared.
    #[inline(always)]
    pub fn load(self, speed_squared: R) -> R {
        speed_squared * self.dip + self.press
    }

    #[inline(always)]
    fn layer(self, loads: &LoadTables<R::Storage>, speed_squared: R) -> Layer<R> {
        let place = (self.load(speed_squared) - R::load(loads.first)) * R::load(loads.per_load);
        let place = place.max(R::load(loads.least)).min(R::load(loads.most));
        let below = place.max(R::lit(0.0)).whole(loads.tables - 2);
        Layer {
            below,
            share: place - below,
        }
    }

    /// The row in which a speed squared lies, a whole number, and how far it is beyond its start.
    #[inline(always)]
    fn row_of(envelope: &EnvelopeTable<R::Storage>, speed_squared: R) -> [R; 2] {
        let rows = envelope.rows.len() / ENVELOPE_WIDTH;
        let argument = speed_squared * R::load(envelope.rows_per_speed_squared);
        let argument = argument.max(R::lit(0.0)).min(R::lit(rows as f64));
        let row = argument.whole(rows - 1);
        [row, argument - row]
    }

    /// A figure of one table, and its rise over a row.
    #[inline(always)]
    fn figure_of(envelope: &EnvelopeTable<R::Storage>, table: R, row: R, column: usize) -> [R; 2] {
        let (loads, rows) = (&envelope.loads, envelope.rows.len() / ENVELOPE_WIDTH);
        let (place, _) = (table * R::lit(rows as f64) + row).place(loads.tables * rows, ENVELOPE_WIDTH);
        [
            R::pick(&loads.rows, place, column),
            R::pick(&loads.rows, place, ENVELOPE_WIDTH / 2 + column),
        ]
    }

    /// A figure under a load.
    #[inline(always)]
    fn figure(
        envelope: &EnvelopeTable<R::Storage>,
        layer: Layer<R>,
        [row, beyond]: [R; 2],
        column: usize,
    ) -> R {
        let low = Self::figure_of(envelope, layer.below, row, column);
        let high = Self::figure_of(envelope, layer.below + R::lit(1.0), row, column);
        let figure = low[0] + layer.share * (high[0] - low[0]);
        let rise = low[1] + layer.share * (high[1] - low[1]);
        figure + beyond * rise
    }

    /// The figures of a cell of one table, so far beyond its start.
    #[inline(always)]
    fn traction_of(loads: &LoadTables<R::Storage>, table: R, cell: R, beyond: [R; 2]) -> [R; 2] {
        let cells = TRACTION_SPEEDS * TRACTION_ROOTS;
        let (place, _) = (table * R::lit(cells as f64) + cell).place(loads.tables * cells, TRACTION_WIDTH);
        traction_in(R::pick_row(&loads.traction, place), beyond)
    }

    /// The lateral limit (m/s^2) at a speed squared, and its slope over it.
    #[inline(always)]
    fn lateral(self, envelope: &EnvelopeTable<R::Storage>, speed_squared: R) -> [R; 2] {
        let [row, beyond] = Self::row_of(envelope, speed_squared);
        let layer = self.layer(&envelope.loads, speed_squared);
        let low = Self::figure_of(envelope, layer.below, row, 0);
        let high = Self::figure_of(envelope, layer.below + R::lit(1.0), row, 0);
        let figure = low[0] + layer.share * (high[0] - low[0]);
        let rise = low[1] + layer.share * (high[1] - low[1]);
        let by_load = (high[0] + beyond * high[1]) - (low[0] + beyond * low[1]);
        let slope = rise * R::load(envelope.rows_per_speed_squared)
            + by_load * R::load(envelope.loads.per_load) * self.dip;
        [
            (self.friction * (figure + beyond * rise)).max(R::lit(LEAST_GRIP)),
            self.friction * slope,
        ]
    }
}

impl<R: Lookup> Ground<R> for Sloped<R> {
    const LEVEL: bool = false;

    #[inline(always)]
    fn bend(self) -> R {
        self.bend.abs()
    }

    #[inline(always)]
    fn climb(self) -> R {
        self.climb
    }

    #[inline(always)]
    fn half_way(self, there: Self) -> Self {
        let half = R::lit(0.5);
        Self {
            bend: half * (self.bend + there.bend),
            dip: half * (self.dip + there.dip),
            // The gradient is that of the segment, at its start and at its end.
            climb: self.climb,
            lean: half * (self.lean + there.lean),
            press: half * (self.press + there.press),
            friction: half * (self.friction + there.friction),
        }
    }

    #[inline(always)]
    fn limits(self, envelope: &EnvelopeTable<R::Storage>, speed_squared: R) -> ([R; 4], R) {
        let row = Self::row_of(envelope, speed_squared);
        let layer = self.layer(&envelope.loads, speed_squared);
        let least = R::lit(LEAST_GRIP);
        let lateral = (self.friction * Self::figure(envelope, layer, row, 0)).max(least);
        let limits = [
            lateral,
            (self.friction * Self::figure(envelope, layer, row, 1)).max(least),
            // The engine climbs with the car alone: what rotates need not be lifted.
            Self::figure(envelope, layer, row, 2) + R::load(envelope.loads.coasting) * self.climb,
            Self::figure(envelope, layer, row, 3),
        ];
        let share = self.across(speed_squared) / lateral;
        let root = (R::lit(1.0) - share * share).max(R::lit(0.0)).sqrt();
        (limits, root)
    }

    #[inline(always)]
    fn left_for_driving(self, envelope: &EnvelopeTable<R::Storage>, speed_squared: R, root: R) -> [R; 2] {
        let loads = &envelope.loads;
        let (cell, beyond) = traction_cell(envelope, speed_squared, root);
        let layer = self.layer(loads, speed_squared);
        let low = Self::traction_of(loads, layer.below, cell, beyond);
        let high = Self::traction_of(loads, layer.below + R::lit(1.0), cell, beyond);
        // Beyond the loads that were swept the tyres give nothing back.
        let mut left = [R::lit(0.0); 2];
        for i in 0..2 {
            left[i] = (low[i] + layer.share * (high[i] - low[i])).max(left[i]);
        }
        [left[0], self.friction * self.friction * left[1]]
    }

    /// Where the lateral limit is passed: by Newton's method from above, which bisection helps where it leaves what is known.
    #[inline(always)]
    fn corner(self, envelope: &EnvelopeTable<R::Storage>) -> R {
        let zero = R::lit(0.0);
        let mut low = zero;
        let mut high = R::load(envelope.top);
        let mut speed_squared = high;
        for _ in 0..CORNER_STEPS {
            let [limit, by_speed] = self.lateral(envelope, speed_squared);
            let across = self.across(speed_squared);
            let spare = limit - across.abs();
            let leftward = zero.less_than(across);
            let slope = by_speed - R::select(leftward, self.bend, -self.bend);
            let short = spare.less_than(zero);
            low = R::select(short, low, speed_squared);
            high = R::select(short, speed_squared, high);
            let next = speed_squared - spare / slope;
            // A place that is found stays: there the next is the last that holds.
            let within = !next.less_than(low) & next.less_than(high);
            speed_squared = R::select(within, next, R::lit(0.5) * (low + high));
        }
        // A bend beyond the lock, as on a level road.
        let radius = R::lit(1.0) / self.bend.abs().max(R::lit(1e-6));
        let share = (radius / R::load(envelope.loads.lock_radius)).min(R::lit(1.0));
        let squared = share * share;
        speed_squared * (squared * squared)
    }

    #[inline(always)]
    fn uphill(self, acceleration: R) -> R {
        acceleration - self.climb
    }

    #[inline(always)]
    fn helped(self, deceleration: R) -> R {
        deceleration + self.climb
    }
}

/// How a lap sees the road of a course.
pub trait Grounds<R: Lookup> {
    /// A place of it.
    type Place: Ground<R>;
    /// The place at a section, on a segment before or after it.
    fn at(course: &Course<R>, section: usize, segment: usize) -> Self::Place;
}

/// A level road.
#[derive(Clone, Copy, Debug)]
pub struct LevelRoad;

impl<R: Lookup> Grounds<R> for LevelRoad {
    type Place = R;

    #[inline(always)]
    fn at(course: &Course<R>, section: usize, _: usize) -> R {
        course.curvature[section]
    }
}

/// A road that is not level and dry.
#[derive(Clone, Copy, Debug)]
pub struct SlopedRoad;

impl<R: Lookup> Grounds<R> for SlopedRoad {
    type Place = Sloped<R>;

    #[inline(always)]
    fn at(course: &Course<R>, section: usize, segment: usize) -> Sloped<R> {
        let [dip, _, lean, press, friction] = course.relief[section];
        Sloped {
            bend: course.curvature[section],
            dip,
            climb: course.relief[segment][1],
            lean,
            press,
            friction,
        }
    }
}

/// A segment's direction in space and its length.
#[derive(Clone, Copy)]
pub(super) struct Rising<R> {
    /// East, north and up, of length one.
    pub direction: [R; 3],
    /// Length (m).
    pub length: R,
}

impl<R: Real> Rising<R> {
    /// The segment of this step (m) that rises by `rise` (m).
    #[inline(always)]
    pub fn of([x, y]: [R; 2], rise: R) -> Self {
        // As in the plane, points that coincide are a tenth of a millimetre apart.
        let length = (x * x + y * y + rise * rise).max(R::lit(1e-8)).sqrt();
        Self {
            direction: [x / length, y / length, rise / length],
            length,
        }
    }

    /// Curvature along and square to a surface that is banked by an angle of this sine and cosine, where this segment follows
    /// `before`, and gravity along L and N (m/s^2).
    #[inline(always)]
    pub fn turned(&self, before: &Self, [sin, cos]: [R; 2]) -> [R; 4] {
        let (half, one) = (R::lit(0.5), R::lit(1.0));
        let (after, before_it) = (self.direction, before.direction);
        let (x, y, up) = (
            after[0] - before_it[0],
            after[1] - before_it[1],
            after[2] - before_it[2],
        );
        let forward_x = half * (after[0] + before_it[0]);
        let forward_y = half * (after[1] + before_it[1]);
        let slope = half * (after[2] + before_it[2]);
        let level = (forward_x * forward_x + forward_y * forward_y)
            .max(R::lit(1e-8))
            .sqrt();
        let (forward_x, forward_y) = (forward_x / level, forward_y / level);
        let spacing = half * (before.length + self.length);
        let flat = (one - slope * slope).max(R::lit(0.0)).sqrt();
        let turn = (forward_x * y - forward_y * x) / spacing;
        let bow = (flat * up - slope * (forward_x * x + forward_y * y)) / spacing;
        let gravity = R::lit(GRAVITY_MPS2) * flat;
        [
            turn * cos + bow * sin,
            bow * cos - turn * sin,
            gravity * sin,
            gravity * cos,
        ]
    }
}

/// Where a line crosses cross-section `i`, from its right end (m): east, north and up; and the friction there, as a share of the car's
/// own.
#[inline(always)]
fn crossing<R: Real>(plan: &LinePlan<R::Storage>, i: usize, variables: &[R]) -> [R; 4] {
    let (row, relief) = (&plan.rows[i], &plan.relief[i]);
    let share = alpha(row, plan.terms, variables);
    let steps = R::load(relief.friction_from) + share * R::load(relief.friction_across);
    let mut friction = R::load(relief.friction);
    for (k, rise) in relief.friction_rises.iter().enumerate() {
        friction = friction + held(steps - R::lit(k as f64)) * R::load(*rise);
    }
    [
        share * R::load(row.across[0]),
        share * R::load(row.across[1]),
        share * R::load(relief.across_rise),
        friction,
    ]
}

/// The segment from cross-section `i` to the next.
#[inline(always)]
fn segment<R: Real>(plan: &LinePlan<R::Storage>, i: usize, here: [R; 4], next: [R; 4]) -> Rising<R> {
    let step = plan.rows[i].step;
    Rising::of(
        [
            R::load(step[0]) + (next[0] - here[0]),
            R::load(step[1]) + (next[1] - here[1]),
        ],
        R::load(plan.relief[i].step_rise) + (next[2] - here[2]),
    )
}

/// Gives `course` the lengths and curvatures of a line in three dimensions, in the place of those of the plane.
#[inline(always)]
pub(super) fn relieve<R: Real>(plan: &LinePlan<R::Storage>, variables: &[R], course: &mut Course<R>) {
    let n = plan.rows.len();
    let zero = R::lit(0.0);
    course.relief.clear();
    course.relief.resize(n, [zero; 5]);
    let first = crossing(plan, 0, variables);
    let mut here = first;
    let mut before = None;
    if plan.closed {
        before = Some(segment(plan, n - 1, crossing(plan, n - 1, variables), first));
    }
    for i in 0..plan.segments() {
        let next = if i + 1 < n {
            crossing(plan, i + 1, variables)
        } else {
            first
        };
        let rising = segment(plan, i, here, next);
        course.length[i] = rising.length;
        let climb = R::lit(GRAVITY_MPS2) * rising.direction[2];
        let mut place = [zero, climb, zero, zero, here[3]];
        if let Some(before) = before {
            let ReliefRow { sin, cos, .. } = plan.relief[i];
            let [bend, dip, lean, press] = rising.turned(&before, [R::load(sin), R::load(cos)]);
            course.curvature[i] = bend;
            (place[0], place[2], place[3]) = (dip, lean, press);
        }
        course.relief[i] = place;
        before = Some(rising);
        here = next;
    }
    if !plan.closed && n > 2 {
        // The last that was crossed is the end of the line.
        for (end, inner, friction) in [(0, 1, first[3]), (n - 1, n - 2, here[3])] {
            let climb = course.relief[end.min(n - 2)][1];
            course.curvature[end] = course.curvature[inner];
            course.relief[end] = course.relief[inner];
            course.relief[end][1] = climb;
            course.relief[end][4] = friction;
        }
    }
}
