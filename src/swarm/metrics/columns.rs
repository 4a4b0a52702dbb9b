//! Points by objective, and what each of them alone dominates, in lanes.

use crate::evaluate::simd::{InstructionSet, LaneWork, dispatch};
use crate::scalar::lanes::Lanes;
use serde::{Deserialize, Serialize};

/// Objectives up to which [`Columns`] hold points.
pub(in crate::swarm) const COLUMNS: usize = 5;

/// Points of up to five objectives by objective; missing ones are zero, against a reference of one.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(in crate::swarm) struct Columns {
    /// Infinite where the last has no point.
    blocks: Vec<Block>,
    count: usize,
}

/// A value of each objective for points that are looked at side by side.
type Block = [[f64; WIDE]; COLUMNS];

/// A corner of a box.
type Corner = [f64; COLUMNS];

/// Points that are looked at side by side.
const WIDE: usize = 8;

impl Columns {
    pub fn push(&mut self, row: &[f64]) {
        if self.count.is_multiple_of(WIDE) {
            self.blocks.push([[f64::INFINITY; WIDE]; COLUMNS]);
        }
        let (last, lane) = (self.count / WIDE, self.count % WIDE);
        for (k, lanes) in self.blocks[last].iter_mut().enumerate() {
            lanes[lane] = row.get(k).copied().unwrap_or(0.0);
        }
        self.count += 1;
    }

    pub fn swap_remove(&mut self, i: usize) {
        self.count -= 1;
        let last = self.point(self.count);
        for (k, x) in last.into_iter().enumerate() {
            self.blocks[i / WIDE][k][i % WIDE] = x;
            self.blocks[self.count / WIDE][k][self.count % WIDE] = f64::INFINITY;
        }
        self.blocks.truncate(self.count.div_ceil(WIDE));
    }

    pub fn clear(&mut self) {
        self.blocks.clear();
        self.count = 0;
    }

    /// The points without objective `k`.
    pub fn without(&self, k: usize) -> Self {
        let mut columns = self.clone();
        for block in &mut columns.blocks {
            block[k..].rotate_left(1);
            block[COLUMNS - 1] = [0.0; WIDE];
        }
        columns
    }

    #[inline(always)]
    fn point(&self, i: usize) -> Corner {
        let ([x, y, z, v, w], lane) = (&self.blocks[i / WIDE], i % WIDE);
        [x[lane], y[lane], z[lane], v[lane], w[lane]]
    }

    /// The exclusive volume of point `i`.
    ///
    /// Up to three objectives by a sweep along the third over a window that the others leave in the first two. The window is small
    /// in a set of non-dominated points, so that nearly all of the others are dismissed by two comparisons: some
    /// `n` steps for a point instead of the `n log n` of a whole hypervolume. With more, by a sweep along the last: each point
    /// that bites into the box takes what it alone dominates of the objectives before.
    pub fn exclusive(&self, i: usize, reference: &[f64]) -> f64 {
        let work = Exclusive {
            columns: self,
            i,
            reference,
        };
        dispatch(InstructionSet::best(), work)
    }

    /// No less than [`Columns::exclusive`], in less time.
    pub fn exclusive_at_most(&self, i: usize, reference: &[f64]) -> f64 {
        let work = AtMost {
            columns: self,
            i,
            reference,
        };
        dispatch(InstructionSet::best(), work)
    }

    /// The points of which a point that came or left has changed what they alone dominate, as no third one dominates what both of
    /// them do, and by how much at the most. `came` is the number of that point, if it is here; it is not among them.
    pub fn touched(&self, change: &[f64], came: Option<usize>, reference: &[f64]) -> Vec<(usize, f64)> {
        let work = Touched {
            columns: self,
            change,
            came: came.unwrap_or(self.count),
            reference,
        };
        dispatch(InstructionSet::best(), work)
    }

    /// The nearer corners of what the others than point `but` bite off the box from `own` to `end`, with their numbers. One that
    /// another covers comes behind it; many of these are left out.
    #[inline(always)]
    fn bites<const WIDTH: usize>(&self, own: Corner, but: usize, end: Corner) -> Vec<(Corner, usize)> {
        let mut corners: Vec<(Corner, usize)> = Vec::with_capacity(self.count);
        let (mut most, mut greatest) = (f64::NEG_INFINITY, own);
        for (number, block) in self.blocks.iter().enumerate() {
            let from = number * WIDE;
            let mut bites = [false; WIDE];
            for lane in 0..WIDE {
                bites[lane] = from + lane != but;
                for k in 0..WIDTH {
                    bites[lane] &= block[k][lane] < end[k];
                }
            }
            if !bites.contains(&true) {
                continue;
            }
            for lane in 0..WIDE {
                if !bites[lane] {
                    continue;
                }
                let mut corner = own;
                let mut bite = 1.0;
                for k in 0..WIDTH {
                    let x = block[k][lane];
                    corner[k] = if x > own[k] { x } else { own[k] };
                    bite *= end[k] - corner[k];
                }
                if bite > most {
                    (most, greatest) = (bite, corner);
                }
                corners.push((corner, from + lane));
            }
        }
        let mut count = 0;
        for i in 0..corners.len() {
            let (corner, who) = corners[i];
            let mut covered = corner != greatest;
            for k in 0..WIDTH {
                covered &= corner[k] >= greatest[k];
            }
            if !covered {
                corners[count] = (corner, who);
                count += 1;
            }
        }
        corners.truncate(count);
        corners.sort_unstable_by(|(a, _), (b, _)| {
            let mut order = a[WIDTH - 1].total_cmp(&b[WIDTH - 1]);
            for k in 0..WIDTH - 1 {
                order = order.then_with(|| a[k].total_cmp(&b[k]));
            }
            order
        });
        corners
    }

    /// Whether one of these points is at least as good as `corner` in the first objectives.
    #[inline(always)]
    fn covers<const WIDTH: usize>(&self, corner: &Corner) -> bool {
        for block in &self.blocks {
            let mut covers = [true; WIDE];
            for lane in 0..WIDE {
                for k in 0..WIDTH {
                    covers[lane] &= block[k][lane] <= corner[k];
                }
            }
            if covers.contains(&true) {
                return true;
            }
        }
        false
    }

    #[inline(always)]
    fn touched_in_lanes<const WIDTH: usize, const BEFORE: usize>(
        &self,
        work: &Touched<'_>,
    ) -> Vec<(usize, f64)> {
        let of = |row: &[f64], k: usize, missing: f64| row.get(k).copied().unwrap_or(missing);
        let own: Corner = std::array::from_fn(|k| of(work.change, k, 0.0));
        let end: Corner = std::array::from_fn(|k| of(work.reference, k, 1.0));
        if (0..WIDTH).any(|k| own[k] >= end[k]) {
            return Vec::new();
        }
        let corners = self.bites::<WIDTH>(own, work.came, end);
        let mut before = Columns::default();
        let mut bare: Vec<(Corner, usize)> = Vec::new();
        for (corner, who) in corners {
            // Of two that are the same, each hides the other.
            match bare.last_mut() {
                Some((last, who)) if *last == corner => *who = self.count,
                _ if before.covers::<BEFORE>(&corner) => (),
                _ => {
                    before.push(&corner[..BEFORE]);
                    bare.push((corner, who));
                }
            }
        }
        let mut touched = Vec::new();
        for (i, (own, who)) in bare.iter().enumerate() {
            if *who == self.count {
                continue;
            }
            // What bites it alone is in a box that is closed as in [`Columns::exclusive_by_sweep`], less the most that another takes.
            let mut end = end;
            for (j, (other, _)) in bare.iter().enumerate() {
                let mut low = [false; WIDTH];
                let mut count = 0;
                for k in 0..WIDTH {
                    low[k] = other[k] <= own[k];
                    count += usize::from(low[k]);
                }
                for k in 0..WIDTH {
                    let closes = (j != i) & (count == WIDTH - 1) & !low[k] & (other[k] < end[k]);
                    end[k] = if closes { other[k] } else { end[k] };
                }
            }
            let (mut whole, mut most) = (1.0, 0.0);
            for k in 0..WIDTH {
                whole *= end[k] - own[k];
            }
            for (j, (other, _)) in bare.iter().enumerate() {
                let mut bite = 1.0;
                for k in 0..WIDTH {
                    let near = if other[k] > own[k] { other[k] } else { own[k] };
                    bite *= if near < end[k] { end[k] - near } else { 0.0 };
                }
                most = if (bite > most) & (j != i) { bite } else { most };
            }
            touched.push((*who, whole - most));
        }
        touched
    }

    /// Where the box from `own` to `end` ends at the latest: what is no worse in all objectives but one closes it in that one. Point
    /// `but` is left out.
    #[inline(always)]
    fn closed<const WIDTH: usize>(&self, own: &Corner, but: usize, end: &Corner) -> Corner {
        let mut end = *end;
        for (number, block) in self.blocks.iter().enumerate() {
            let low = counted::<WIDTH>(block, |k, x| x <= own[k]);
            let mut closing = lanes(low, WIDTH - 1);
            while let Some(lane) = next(&mut closing) {
                if number * WIDE + lane == but {
                    continue;
                }
                for k in 0..WIDTH {
                    let x = block[k][lane];
                    let closes = (x > own[k] || low[lane] == WIDTH as i64) && x < end[k];
                    end[k] = if closes { x } else { end[k] };
                }
            }
        }
        end
    }

    /// [`Columns::exclusive`] of more than three objectives. `Last` is the same for the last point in the objectives before the last.
    #[inline(always)]
    fn exclusive_by_sweep<const WIDTH: usize, const BEFORE: usize, Last: LastExclusive>(
        &self,
        i: usize,
        reference: &[f64],
    ) -> f64 {
        let own = self.point(i);
        let mut end = own;
        end[..WIDTH].copy_from_slice(&reference[..WIDTH]);
        let end = self.closed::<WIDTH>(&own, i, &end);
        if (0..WIDTH).any(|k| own[k] >= end[k]) {
            return 0.0;
        }
        let mut volume = room::<WIDTH>(&own, &end);
        let mut before = Columns::default();
        for (corner, _) in self.bites::<WIDTH>(own, i, end) {
            // What is covered changes nothing, not even how the sum is rounded.
            if before.covers::<BEFORE>(&corner) {
                continue;
            }
            before.push(&corner[..BEFORE]);
            volume -= (end[BEFORE] - corner[BEFORE]) * Last::of(&before, &end[..BEFORE]);
        }
        volume.max(0.0)
    }

    #[inline(always)]
    fn exclusive_of_three(&self, i: usize, reference: &[f64]) -> f64 {
        let [x, y, z, ..] = self.point(i);
        let end = |k: usize| reference.get(k).copied().unwrap_or(1.0);
        let (mut right, mut top, mut ceiling) = (end(0), end(1), end(2));
        if !(x < right && y < top && z < ceiling) {
            return 0.0;
        }
        // The window at the point's own level, and the level where it closes.
        let mut least = [[f64::INFINITY; WIDE]; 3];
        for (number, [us, vs, ws, ..]) in self.blocks.iter().enumerate() {
            let from = number * WIDE;
            for lane in 0..WIDE {
                let (u, v, w) = (us[lane], vs[lane], ws[lane]);
                let (here, other) = (w <= z, from + lane != i);
                let (left, low) = ((u <= x) & other, (v <= y) & other);
                let found = [
                    if here & left { v } else { f64::INFINITY },
                    if here & low { u } else { f64::INFINITY },
                    if !here & left & low { w } else { f64::INFINITY },
                ];
                for (least, found) in least.iter_mut().zip(found) {
                    least[lane] = if found < least[lane] { found } else { least[lane] };
                }
            }
        }
        let [above, beside, over] = least.map(|lanes| lanes.into_iter().fold(f64::INFINITY, f64::min));
        (top, right, ceiling) = (top.min(above), right.min(beside), ceiling.min(over));
        if top <= y || right <= x {
            return 0.0;
        }
        // Points inside the window bite its far corner off, now or from their level on.
        let mut inside: Vec<(f64, f64, f64)> = Vec::new();
        let mut above: Vec<(f64, f64, f64)> = Vec::new();
        for (number, [us, vs, ws, ..]) in self.blocks.iter().enumerate() {
            let from = number * WIDE;
            let mut counts = [false; WIDE];
            for lane in 0..WIDE {
                let below = (us[lane] < right) & (vs[lane] < top) & (ws[lane] < ceiling);
                counts[lane] = below & (from + lane != i);
            }
            if !counts.contains(&true) {
                continue;
            }
            for lane in (0..WIDE).filter(|&lane| counts[lane]) {
                let (u, v, w) = (us[lane], vs[lane], ws[lane]);
                if w > z {
                    above.push((w, u, v));
                } else {
                    inside.push((u, v, w));
                }
            }
        }
        // One that bites much off spares the sorting of those behind it.
        let bite = |p: &(f64, f64, f64)| (p.0 - x) * (top - y) + (p.1 - y) * (right - x);
        if let Some(first) = inside.iter().copied().min_by(|a, b| bite(a).total_cmp(&bite(b))) {
            inside.retain(|p| p.0 < first.0 || p.1 < first.1 || *p == first);
            above.retain(|p| p.1 < first.0 || p.2 < first.1);
        }
        above.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        inside.sort_unstable_by(place);
        let mut area = window(&mut inside, (x, y), (right, top));
        let (mut level, mut volume) = (z, 0.0);
        for (w, u, v) in above {
            // What lies behind others changes nothing, not even how the sum is rounded.
            let before = inside.partition_point(|p| p.0 <= u);
            let hidden = before > 0 && inside[before - 1].1 <= v;
            if u >= right || v >= top || hidden {
                continue;
            }
            volume += area * (w - level);
            level = w;
            match (u <= x, v <= y) {
                // Both is not met: the window would have closed there.
                (true, _) => top = v,
                (false, true) => right = u,
                (false, false) => inside.insert(before, (u, v, w)),
            }
            area = window(&mut inside, (x, y), (right, top));
        }
        volume + area * (ceiling - level)
    }
}

/// In how many of the first objectives each point of a block is as asked.
#[inline(always)]
fn counted<const WIDTH: usize>(block: &Block, is: impl Fn(usize, f64) -> bool) -> [i64; WIDE] {
    let mut count = [0; WIDE];
    for (k, values) in block.iter().take(WIDTH).enumerate() {
        for (count, x) in count.iter_mut().zip(values) {
            *count += i64::from(is(k, *x));
        }
    }
    count
}

/// The lanes of at least so many, one bit each.
#[inline(always)]
fn lanes(count: [i64; WIDE], least: usize) -> u32 {
    let mut lanes = 0;
    for (lane, count) in count.into_iter().enumerate() {
        lanes |= u32::from(count >= least as i64) << lane;
    }
    lanes
}

/// Takes the first lane of some.
#[inline(always)]
fn next(lanes: &mut u32) -> Option<usize> {
    let lane = (*lanes != 0).then(|| lanes.trailing_zeros() as usize)?;
    *lanes &= *lanes - 1;
    Some(lane)
}

/// The volume of the box from `corner` to `end`.
#[inline(always)]
fn room<const WIDTH: usize>(corner: &Corner, end: &Corner) -> f64 {
    let mut room = 1.0;
    for k in 0..WIDTH {
        room *= end[k] - corner[k];
    }
    room
}

/// What the last point alone dominates. Closures would not be compiled for the instruction set of what calls them.
trait LastExclusive {
    fn of(columns: &Columns, reference: &[f64]) -> f64;
}

/// In up to three objectives.
struct OfThree;

/// In four.
struct OfFour;

impl LastExclusive for OfThree {
    #[inline(always)]
    fn of(columns: &Columns, reference: &[f64]) -> f64 {
        columns.exclusive_of_three(columns.count - 1, reference)
    }
}

impl LastExclusive for OfFour {
    #[inline(always)]
    fn of(columns: &Columns, reference: &[f64]) -> f64 {
        columns.exclusive_by_sweep::<4, 3, OfThree>(columns.count - 1, reference)
    }
}

/// [`Columns::exclusive`], compiled for each instruction set.
struct Exclusive<'a> {
    columns: &'a Columns,
    i: usize,
    reference: &'a [f64],
}

impl LaneWork for Exclusive<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        match self.reference.len() {
            5 => self
                .columns
                .exclusive_by_sweep::<5, 4, OfFour>(self.i, self.reference),
            4 => self
                .columns
                .exclusive_by_sweep::<4, 3, OfThree>(self.i, self.reference),
            _ => self.columns.exclusive_of_three(self.i, self.reference),
        }
    }
}

/// [`Columns::exclusive_at_most`], compiled for each instruction set.
struct AtMost<'a> {
    columns: &'a Columns,
    i: usize,
    reference: &'a [f64],
}

impl AtMost<'_> {
    #[inline(always)]
    fn closed<const WIDTH: usize>(&self) -> f64 {
        let own = self.columns.point(self.i);
        let mut end = own;
        for (k, end) in end.iter_mut().take(WIDTH).enumerate() {
            *end = self.reference.get(k).copied().unwrap_or(1.0);
        }
        let end = self.columns.closed::<WIDTH>(&own, self.i, &end);
        if (0..WIDTH).any(|k| own[k] >= end[k]) {
            return 0.0;
        }
        room::<WIDTH>(&own, &end)
    }
}

impl LaneWork for AtMost<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        match self.reference.len() {
            5 => self.closed::<5>(),
            4 => self.closed::<4>(),
            _ => self.closed::<3>(),
        }
    }
}

/// [`Columns::touched`], compiled for each instruction set.
struct Touched<'a> {
    columns: &'a Columns,
    change: &'a [f64],
    came: usize,
    reference: &'a [f64],
}

impl LaneWork for Touched<'_> {
    type Output = Vec<(usize, f64)>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<(usize, f64)> {
        match self.reference.len() {
            5 => self.columns.touched_in_lanes::<5, 4>(&self),
            4 => self.columns.touched_in_lanes::<4, 3>(&self),
            _ => self.columns.touched_in_lanes::<3, 2>(&self),
        }
    }
}

/// The order of points inside a window.
fn place(a: &(f64, f64, f64), b: &(f64, f64, f64)) -> std::cmp::Ordering {
    a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
}

/// The area of the window from `(x, y)` to `(right, top)` less what the points inside, in order, dominate; drops
/// points that are no longer inside or dominate nothing of their own.
fn window(inside: &mut Vec<(f64, f64, f64)>, (x, y): (f64, f64), (right, top): (f64, f64)) -> f64 {
    let mut ceiling = top;
    inside.retain(|&(u, v, _)| {
        let counts = u < right && v < ceiling;
        if counts {
            ceiling = v;
        }
        counts
    });
    let mut from = x;
    let mut height = top - y;
    let mut area = 0.0;
    for &(u, v, _) in inside.iter() {
        area += (u - from) * height;
        from = u;
        height = v - y;
    }
    area + (right - from) * height
}
