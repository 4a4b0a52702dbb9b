//! The line kernel: from a candidate's variables to the shape of its line and the time of a lap on it.
//! Twin of `shaders/line.wgsl`.
//!
//! Curvature is the turn over the line's own spacing; the second differences of Gamma are over the cross-sections' spacing, which
//! makes Gamma convex. The lap is the quasi-steady-state lap of a point mass on the limit:
//! a forward pass of driving and a backward pass of braking on the speed squared, below the corner speeds (after
//! D. Brayshaw and M. Harrison, *A quasi steady state approach to race car lap simulation*, 2005; N. R. Kapania,
//! J. Subosits and J. C. Gerdes, *A sequential two-step algorithm for fast generation of vehicle racing trajectories*,
//! J. Dyn. Sys., Meas., Control 138, 2016).

#![deny(clippy::disallowed_methods)]

use super::ground::{Ground, Grounds, LevelRoad, SlopedRoad, relieve};
use super::plan::{LinePlan, SectionRow};
use super::point_mass::EnvelopeTable;
use crate::scalar::{Lookup, Real};

/// Terms that are summed before they are added to the running total. This keeps `f32` sums over long laps accurate.
pub const BLOCK: usize = 64;

/// The figures of a line that are wanted beside its length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// The integral of the curvature squared.
    pub integral: bool,
    /// The lap time.
    pub lap: bool,
}

/// Figures of one line's segments and sections, filled by [`shape`] and [`lap_time`].
#[derive(Clone, Debug)]
pub struct Course<R> {
    /// Length of each segment (m).
    pub length: Vec<R>,
    /// Curvature at each section (1/m), without a sign; on a road in three dimensions along the surface, positive in left turns.
    pub curvature: Vec<R>,
    /// Of a road that is not level and dry at each section: curvature square to the surface (1/m), gravity along the segment after it,
    /// to the left and square to the surface (m/s^2), and friction as a share of the car's own. Empty on a level and dry road.
    pub relief: Vec<[R; 5]>,
    /// Whether the DRS may be open on each segment; nowhere if empty.
    pub drs: Vec<bool>,
    /// Speed squared at each section (m^2/s^2).
    pub speed_squared: Vec<R>,
    /// Results of the first drive of a lap with a motor beside the engine, for each segment: speed squared at its end (m^2/s^2),
    /// what the motor added, what was wanted of it and for what the store had energy (m/s^2), and the store's space (J).
    pub first_drive: Vec<[R; 5]>,
}

impl<R> Default for Course<R> {
    fn default() -> Self {
        Self {
            length: Vec::new(),
            curvature: Vec::new(),
            relief: Vec::new(),
            drs: Vec::new(),
            speed_squared: Vec::new(),
            first_drive: Vec::new(),
        }
    }
}

/// Whether the DRS may be open on a segment; nowhere if `drs` is empty.
#[inline(always)]
pub(crate) fn may_open(drs: &[bool], segment: usize) -> bool {
    drs.get(segment).is_some_and(|drs| *drs)
}

/// Sums over a line.
#[derive(Clone, Copy, Debug)]
pub struct Shape<R> {
    /// Length (m).
    pub length: R,
    /// Sum of the squared lengths of the segments (m^2).
    pub length_squared: R,
    /// Sum of the squared second differences (1/m^2).
    pub second_differences: R,
    /// Integral of the curvature squared over the length (1/m): turning angle squared over spacing.
    pub integral: R,
}

/// A segment of a line.
#[derive(Clone, Copy)]
struct Segment<R> {
    direction: [R; 2],
    length: R,
    /// The step over the spacing by which second differences are computed, and one over that spacing (1/m).
    slope: [R; 2],
    inverse_spacing: R,
}

impl<R: Real> Segment<R> {
    #[inline(always)]
    fn between(row: &SectionRow<R::Storage>, here: [R; 2], next: [R; 2]) -> Self {
        let x = R::load(row.step[0]) + (next[0] - here[0]);
        let y = R::load(row.step[1]) + (next[1] - here[1]);
        // Points that coincide have no direction. A distance of a tenth of a millimetre gives them one.
        let length = (x * x + y * y).max(R::lit(1e-8)).sqrt();
        let inverse_spacing = R::load(row.inverse_spacing);
        Self {
            direction: [x / length, y / length],
            length,
            slope: [x * inverse_spacing, y * inverse_spacing],
            inverse_spacing,
        }
    }

    /// The square of the second difference between the segment before and this one (1/m^2).
    #[inline(always)]
    fn second_difference_squared(&self, before: &Self) -> R {
        let x = self.slope[0] - before.slope[0];
        let y = self.slope[1] - before.slope[1];
        let spacings = self.inverse_spacing + before.inverse_spacing;
        let scale = R::lit(2.0) * (self.inverse_spacing * before.inverse_spacing) / spacings;
        (x * x + y * y) * (scale * scale)
    }
}

/// `alpha` at a section: a sum of variables, held within the road.
#[inline(always)]
pub fn alpha<R: Real>(row: &SectionRow<R::Storage>, terms: usize, variables: &[R]) -> R {
    let mut sum = R::load(row.constant);
    for term in 0..terms {
        sum = sum + R::load(row.weights[term]) * variables[row.sources[term] as usize];
    }
    held(sum)
}

/// A share held from 0 to 1.
#[inline(always)]
pub(super) fn held<R: Real>(share: R) -> R {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    // `min` and `max` would lose the derivatives of a share exactly on the edge.
    let share = R::select(share.less_than(zero), zero, share);
    R::select(one.less_than(share), one, share)
}

/// From the right end of a cross-section to the line (m).
#[inline(always)]
fn offset<R: Real>(row: &SectionRow<R::Storage>, terms: usize, variables: &[R]) -> [R; 2] {
    let share = alpha(row, terms, variables);
    [share * R::load(row.across[0]), share * R::load(row.across[1])]
}

/// The shape of the line that `variables` give; `course` has its lengths and curvatures after. The sums are those of the plan view
/// on any road.
#[inline(always)]
pub fn shape<R: Real>(
    plan: &LinePlan<R::Storage>,
    wanted: Wanted,
    variables: &[R],
    course: &mut Course<R>,
) -> Shape<R> {
    let n = plan.rows.len();
    let zero = R::lit(0.0);
    course.length.clear();
    course.length.resize(n, zero);
    course.curvature.clear();
    course.curvature.resize(n, zero);
    course.drs.clear();
    course.drs.extend(plan.rows.iter().map(|row| row.drs));

    // This is not a closure. Code that is compiled for an instruction set has to be inlined, and closures cannot be marked so.
    let first = offset(&plan.rows[0], plan.terms, variables);
    let mut here = first;
    let mut before = None;
    if plan.closed {
        let row = &plan.rows[n - 1];
        before = Some(Segment::between(row, offset(row, plan.terms, variables), first));
    }
    let mut total = [zero; 4];
    let mut block = [zero; 4];
    for i in 0..plan.segments() {
        let next = if i + 1 < n {
            offset(&plan.rows[i + 1], plan.terms, variables)
        } else {
            first
        };
        let segment = Segment::between(&plan.rows[i], here, next);
        course.length[i] = segment.length;
        block[0] = block[0] + segment.length;
        block[1] = block[1] + segment.length * segment.length;
        if let Some(before) = before {
            let turned_x = segment.direction[0] - before.direction[0];
            let turned_y = segment.direction[1] - before.direction[1];
            let turned_squared = turned_x * turned_x + turned_y * turned_y;
            let spacing = R::lit(0.5) * (before.length + segment.length);
            let turned = turned_squared.sqrt();
            let curvature = turned / spacing;
            course.curvature[i] = curvature;
            block[2] = block[2] + segment.second_difference_squared(&before);
            if wanted.integral {
                // The difference of two directions is the chord of the turning angle on the unit circle.
                let across = (R::lit(4.0) - turned_squared).max(R::lit(1e-6)).sqrt();
                let half = (turned / across).atan();
                block[3] = block[3] + R::lit(4.0) * half * (half / spacing);
            }
        }
        if (i + 1) % BLOCK == 0 || i + 1 == plan.segments() {
            for (total, block) in total.iter_mut().zip(&mut block) {
                *total = *total + *block;
                *block = zero;
            }
        }
        before = Some(segment);
        here = next;
    }
    if !plan.closed && n > 2 {
        course.curvature[0] = course.curvature[1];
        course.curvature[n - 1] = course.curvature[n - 2];
    }
    course.relief.clear();
    if wanted.lap && !plan.relief.is_empty() {
        relieve(plan, variables, course);
    }
    let [length, length_squared, second_differences, integral] = total;
    Shape {
        length,
        length_squared,
        second_differences,
        integral,
    }
}

/// The figure `beyond` a place, from a table of figures and their rises.
#[inline(always)]
pub(super) fn look_up<R: Lookup>(table: &[R::Storage], place: R::Place, beyond: R) -> R {
    R::pick(table, place, 0) + beyond * R::pick(table, place, 1)
}

/// Greatest speed squared (m^2/s^2) in a bend.
#[inline(always)]
pub fn corner<R: Lookup>(envelope: &EnvelopeTable<R::Storage>, ground: impl Ground<R>) -> R {
    ground.corner(envelope)
}

/// The corner speed squared (m^2/s^2) at the end of a segment of a length (m), no greater than the steering follows the change of
/// curvature at. Where the bend changes sides, each of its sides is followed by itself.
#[inline(always)]
pub(super) fn steered_corner<R: Lookup, G: Ground<R>>(
    envelope: &EnvelopeTable<R::Storage>,
    length: R,
    before: G,
    ground: G,
) -> R {
    let most = corner(envelope, ground);
    let Some(rate_squared) = envelope.curvature_rate_squared else {
        return most;
    };
    let change = ground.bend() - before.bend();
    // Where there is none, one of 1e-7 1/m stands for it.
    let change_squared = (change * change).max(R::lit(1e-14));
    most.min(R::load(rate_squared) * (length * length) / change_squared)
}

/// The share of the longitudinal grip that is left for braking.
#[inline(always)]
fn left_for_braking<R: Lookup>(envelope: &EnvelopeTable<R::Storage>, root: R) -> R {
    if envelope.ellipse.is_empty() {
        return root;
    }
    let rows = envelope.ellipse.len() / 2;
    let (place, beyond) = (root * R::lit(rows as f64)).place(rows, 2);
    look_up(&envelope.ellipse, place, beyond)
}

/// The same for driving, and what the tyres take from the drive (m/s^2).
#[inline(always)]
fn left_for_driving<R: Lookup>(
    envelope: &EnvelopeTable<R::Storage>,
    speed_squared: R,
    root: R,
    ground: impl Ground<R>,
) -> [R; 2] {
    if envelope.traction.is_empty() {
        return [left_for_braking(envelope, root), R::lit(0.0)];
    }
    ground.left_for_driving(envelope, speed_squared, root)
}

/// The traction that is left, the drive that the tyres leave of what the engine gives, the drag, and what the tyres take (m/s^2) at a
/// speed squared in a bend.
#[inline(always)]
pub(super) fn driving_at<R: Lookup>(
    envelope: &EnvelopeTable<R::Storage>,
    speed_squared: R,
    ground: impl Ground<R>,
) -> [R; 4] {
    let ([_, grip, drive, drag], root) = ground.limits(envelope, speed_squared);
    let [left, lost] = left_for_driving(envelope, speed_squared, root, ground);
    [grip * left, drive - lost, drag, lost]
}

/// As [`driving_at`]. Where the DRS may be open, the driver opens it if the car then gains more speed.
#[inline(always)]
pub(super) fn driving_with_drs<R: Lookup>(
    envelope: &EnvelopeTable<R::Storage>,
    drs: bool,
    speed_squared: R,
    ground: impl Ground<R>,
) -> [R; 4] {
    let shut = driving_at(envelope, speed_squared, ground);
    let Some(open) = envelope.open.as_ref().filter(|_| drs) else {
        return shut;
    };
    let open = driving_at(open, speed_squared, ground);
    let pays = (shut[0].min(shut[1]) - shut[2]).less_than(open[0].min(open[1]) - open[2]);
    let mut best = shut;
    for i in 0..best.len() {
        best[i] = R::select(pays, open[i], shut[i]);
    }
    best
}

/// Greatest acceleration (m/s^2) at a speed squared in a bend; `drs` says whether the DRS may be open.
#[inline(always)]
pub fn acceleration<R: Lookup>(
    envelope: &EnvelopeTable<R::Storage>,
    drs: bool,
    speed_squared: R,
    ground: impl Ground<R>,
) -> R {
    let [traction, drive, drag, _] = driving_with_drs(envelope, drs, speed_squared, ground);
    ground.uphill(traction.min(drive) - drag)
}

/// Greatest deceleration (m/s^2) at a speed squared in a bend.
#[inline(always)]
pub fn deceleration<R: Lookup>(
    envelope: &EnvelopeTable<R::Storage>,
    speed_squared: R,
    ground: impl Ground<R>,
) -> R {
    let ([_, grip, _, drag], root) = ground.limits(envelope, speed_squared);
    ground.helped(grip * left_for_braking(envelope, root) + drag)
}

/// Speed squared after driving from a section to the next, on the mean of the limits at the start and at the middle. Out of a
/// bend's middle the ellipse opens within a segment: the middle alone is then optimistic and the start alone pessimistic. On
/// smooth lines at 5 to 16 m the middle was 0.4% to 1.2% of a lap off, the start 0.4% to 0.5% the other way, and the mean 0.1% to
/// 0.2%. On jagged lines no coarse grid is accurate.
#[inline(always)]
fn driven<R: Lookup, G: Ground<R>>(
    envelope: &EnvelopeTable<R::Storage>,
    drs: bool,
    from: R,
    length: R,
    [here, there]: [G; 2],
) -> R {
    let zero = R::lit(0.0);
    let start = acceleration(envelope, drs, from, here);
    let middle = (from + length * start).max(zero);
    let drive = acceleration(envelope, drs, middle, here.half_way(there));
    (from + length * (start + drive)).max(zero)
}

/// Greatest speed squared from which the car can brake to that of the next section.
#[inline(always)]
pub(super) fn braked<R: Lookup, G: Ground<R>>(
    envelope: &EnvelopeTable<R::Storage>,
    to: R,
    length: R,
    there: G,
    here: G,
) -> R {
    let end = deceleration(envelope, to, there);
    let middle = to + length * end;
    let brake = deceleration(envelope, middle, here.half_way(there));
    to + length * (end + brake)
}

/// The envelopes that a lap is driven within, section by section: an [`EnvelopeTable`] is the same at all.
pub trait Within<S> {
    /// The envelope at a section and on the segment after it.
    fn at(&self, section: usize) -> &EnvelopeTable<S>;
}

impl<S> Within<S> for EnvelopeTable<S> {
    #[inline(always)]
    fn at(&self, _: usize) -> &Self {
        self
    }
}

/// Envelopes of which each section has one. All have the same speeds.
#[derive(Clone, Copy, Debug)]
pub struct BySection<'a, S> {
    /// The envelopes.
    pub tables: &'a [EnvelopeTable<S>],
    /// The number of each section's.
    pub of: &'a [usize],
}

impl<S> Within<S> for BySection<'_, S> {
    #[inline(always)]
    fn at(&self, section: usize) -> &EnvelopeTable<S> {
        &self.tables[self.of[section]]
    }
}

/// Time of a lap (s) on `course`, whose lengths and curvatures are given; it has the speeds after.
///
/// A closed lap's passes continue beyond the section where they started until they meet themselves, so that any start
/// gives the same lap.
#[inline(always)]
pub fn lap_time<R: Lookup>(
    envelope: &impl Within<R::Storage>,
    closed: bool,
    start: usize,
    entry: R,
    course: &mut Course<R>,
) -> R {
    if course.relief.is_empty() {
        lap_on::<R, LevelRoad>(envelope, closed, start, entry, course)
    } else {
        lap_on::<R, SlopedRoad>(envelope, closed, start, entry, course)
    }
}

/// [`lap_time`] on one kind of road.
#[inline(always)]
fn lap_on<R: Lookup, G: Grounds<R>>(
    envelope: &impl Within<R::Storage>,
    closed: bool,
    start: usize,
    entry: R,
    course: &mut Course<R>,
) -> R {
    let n = course.curvature.len();
    let mut speeds = std::mem::take(&mut course.speed_squared);
    let (length, drs) = (&course.length, &course.drs);
    speeds.clear();
    speeds.resize(n, R::lit(0.0));
    let start = if closed { start } else { 0 };
    speeds[start] = if closed {
        let before = if start > 0 { start - 1 } else { n - 1 };
        let [from, to] = [G::at(course, before, before), G::at(course, start, start)];
        steered_corner(envelope.at(start), length[before], from, to)
    } else {
        corner(envelope.at(start), G::at(course, start, start))
    };
    if !closed {
        speeds[0] = speeds[0].min(entry);
    }
    // Every section has been reached after n - 1 steps; a closed lap may need as many again to meet itself.
    let steps = if closed { 2 * n } else { n - 1 };

    let mut here = start;
    for step in 0..steps {
        let next = if here + 1 < n { here + 1 } else { 0 };
        let reached = driven(
            envelope.at(here),
            may_open(drs, here),
            speeds[here],
            length[here],
            [G::at(course, here, here), G::at(course, next, here)],
        );
        // In the first round a section is limited by its corner speed alone.
        let again = step + 1 >= n;
        let most = if again {
            speeds[next]
        } else {
            let [from, to] = [G::at(course, here, here), G::at(course, next, next)];
            steered_corner(envelope.at(next), length[here], from, to)
        };
        let slower = reached.less_than(most);
        speeds[next] = R::select(slower, reached, most);
        if again && R::all(!slower) {
            break;
        }
        here = next;
    }

    let mut next = if closed { start } else { n - 1 };
    for step in 0..steps {
        let here = if next > 0 { next - 1 } else { n - 1 };
        let reached = braked(
            envelope.at(here),
            speeds[next],
            length[here],
            G::at(course, next, here),
            G::at(course, here, here),
        );
        let slower = reached.less_than(speeds[here]);
        speeds[here] = R::select(slower, reached, speeds[here]);
        if step + 1 >= n && R::all(!slower) {
            break;
        }
        next = here;
    }

    let segments = if closed { n } else { n - 1 };
    let zero = R::lit(0.0);
    let (mut total, mut block) = (zero, zero);
    let mut from = speeds[0].sqrt();
    for (here, length) in length[..segments].iter().enumerate() {
        let next = if here + 1 < n { here + 1 } else { 0 };
        let to = speeds[next].sqrt();
        block = block + R::lit(2.0) * *length / (from + to);
        from = to;
        if (here + 1) % BLOCK == 0 || here + 1 == segments {
            total = total + block;
            block = zero;
        }
    }
    course.speed_squared = speeds;
    total
}
