//! Points by objective, and what each of them alone dominates, in lanes.

use super::boxes::{
    Block, COLUMNS, Corner, FEW, MORE, WIDE, counted, highest, lanes, less, lowest, next, others, volume,
};
use super::within::{Asked, Within};
use crate::evaluate::simd::{InstructionSet, LaneWork, dispatch};
use crate::scalar::lanes::Lanes;
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::cmp::Ordering;

/// Points of up to five objectives by objective; missing ones are zero, against a reference of one.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(in crate::swarm) struct Columns {
    /// Infinite where the last has no point.
    pub(super) blocks: Vec<Block>,
    count: usize,
}

/// Greatest bites of so many that are not sorted where these cover them: one in sixteen.
const PIVOTS: usize = 16;

/// What finding and sweeping the bites of a box needs room for, so that each does not ask for it anew.
#[derive(Default)]
struct Room<Inner> {
    /// How much each point bites off; less than nothing where that does not count.
    bites: Vec<[f64; WIDE]>,
    /// The nearer corners of bites, and whose they are.
    corners: Vec<(Corner, usize)>,
    /// Their last objective, and which they are.
    order: Vec<(f64, usize)>,
    /// What was swept.
    before: Columns,
    /// The same for one objective fewer.
    inner: Inner,
}

impl<Inner> Room<Inner> {
    /// Puts the corners in the order of the last objective, and then of the others.
    #[inline(always)]
    fn sort<const WIDTH: usize>(&mut self) {
        let Self { corners, order, .. } = self;
        order.clear();
        for (i, (corner, _)) in corners.iter().enumerate() {
            order.push((corner[WIDTH - 1], i));
        }
        order.sort_unstable_by(|(a, i), (b, j)| {
            let others = || corners[*i].0.iter().zip(&corners[*j].0);
            let differs = || others().map(|(a, b)| a.total_cmp(b)).find(|order| order.is_ne());
            a.total_cmp(b).then_with(|| differs().unwrap_or(Ordering::Equal))
        });
    }
}

thread_local! {
    /// The room for five objectives; that for four is inside.
    static ROOM: RefCell<Room<Room<()>>> = RefCell::default();
}

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
    pub(super) fn point(&self, i: usize) -> Corner {
        let ([x, y, z, v, w], lane) = (&self.blocks[i / WIDE], i % WIDE);
        [x[lane], y[lane], z[lane], v[lane], w[lane]]
    }

    /// The exclusive volume of point `i`.
    ///
    /// Up to three objectives by a sweep along the third over a window that the others leave in the first two. The window is small
    /// in a set of non-dominated points, so that nearly all of the others are dismissed by two comparisons: some
    /// `n` steps for a point instead of the `n log n` of a whole hypervolume. With more, by a sweep along one objective: each point
    /// that bites into the box takes what it alone dominates of the others, from its level on. A box that few points bite into is found
    /// by inclusion and exclusion.
    pub fn exclusive(&self, i: usize, reference: &[f64]) -> f64 {
        self.exclusive_within(i, reference, Asked::ALL).least
    }

    /// As much of [`Columns::exclusive`] as is asked for.
    pub fn exclusive_within(&self, i: usize, reference: &[f64], asked: Asked) -> Within {
        self.of_pair([i; 2], reference, asked)
    }

    /// The volume that points `i` and `j` dominate and no other does, of more than three objectives.
    pub fn shared(&self, i: usize, j: usize, reference: &[f64]) -> f64 {
        self.of_pair([i, j], reference, Asked::ALL).least
    }

    fn of_pair(&self, pair: [usize; 2], reference: &[f64], asked: Asked) -> Within {
        ROOM.with_borrow_mut(|room| {
            let work = Exclusive {
                columns: self,
                pair,
                reference,
                asked,
                room,
            };
            dispatch(InstructionSet::best(), work)
        })
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
        ROOM.with_borrow_mut(|room| {
            let work = Touched {
                columns: self,
                change,
                came: came.unwrap_or(self.count),
                reference,
                room,
            };
            dispatch(InstructionSet::best(), work)
        })
    }

    /// The nearer corners of what the others than points `but` bite off the box from `own` to `end`, with their numbers. Many that
    /// others cover are left out.
    #[inline(always)]
    fn bites<const WIDTH: usize, Inner>(
        &self,
        own: &Corner,
        but: [usize; 2],
        end: &Corner,
        room: &mut Room<Inner>,
    ) {
        let Room { bites, corners, .. } = room;
        bites.clear();
        corners.clear();
        let mut count = 0;
        for (number, block) in self.blocks.iter().enumerate() {
            let inside = others(number, but, counted::<WIDTH>(block, |k, x| x < end[k]));
            count += lanes(inside, WIDTH).count_ones() as usize;
            let mut bite = [1.0; WIDE];
            for k in 0..WIDTH {
                for lane in 0..WIDE {
                    let x = block[k][lane];
                    bite[lane] *= end[k] - if x > own[k] { x } else { own[k] };
                }
            }
            for lane in 0..WIDE {
                bite[lane] = if inside[lane] == WIDTH as i64 {
                    bite[lane]
                } else {
                    -1.0
                };
            }
            bites.push(bite);
        }
        // The greatest cover many of the others, which need not be sorted.
        for _ in 0..count / PIVOTS {
            let mut most = [0.0; WIDE];
            let mut at = [0; WIDE];
            for (number, bite) in bites.iter().enumerate() {
                for lane in 0..WIDE {
                    let more = bite[lane] > most[lane];
                    most[lane] = if more { bite[lane] } else { most[lane] };
                    at[lane] = if more { number as i64 } else { at[lane] };
                }
            }
            let lane = highest(&most);
            let (greatest, number) = (most[lane], at[lane] as usize);
            if greatest <= 0.0 {
                break;
            }
            let corner = self.nearer::<WIDTH>(own, number, lane);
            // It stays, and is not found again.
            bites[number][lane] = 0.0;
            for (bite, block) in bites.iter_mut().zip(&self.blocks) {
                let behind =
                    counted::<WIDTH>(block, |k, x| (if x > own[k] { x } else { own[k] }) >= corner[k]);
                for lane in 0..WIDE {
                    let less = (bite[lane] < greatest) & (bite[lane] != 0.0);
                    let covered = less & (behind[lane] == WIDTH as i64);
                    bite[lane] = if covered { -1.0 } else { bite[lane] };
                }
            }
        }
        for (number, bite) in bites.iter().enumerate() {
            let mut stays = [0; WIDE];
            for lane in 0..WIDE {
                stays[lane] = i64::from(bite[lane] >= 0.0);
            }
            let mut stays = lanes(stays, 1);
            while let Some(lane) = next(&mut stays) {
                corners.push((self.nearer::<WIDTH>(own, number, lane), number * WIDE + lane));
            }
        }
    }

    /// The nearer corner of what a point bites off a box.
    #[inline(always)]
    fn nearer<const WIDTH: usize>(&self, own: &Corner, number: usize, lane: usize) -> Corner {
        let mut corner = *own;
        for k in 0..WIDTH {
            let x = self.blocks[number][k][lane];
            corner[k] = if x > own[k] { x } else { own[k] };
        }
        corner
    }

    /// Whether one of these points is at least as good as `corner` in the first objectives.
    #[inline(always)]
    fn covers<const WIDTH: usize>(&self, corner: &Corner) -> bool {
        for block in &self.blocks {
            if lanes(counted::<WIDTH>(block, |k, x| x <= corner[k]), WIDTH) != 0 {
                return true;
            }
        }
        false
    }

    /// They are those that bite into the box of the point and that no other covers.
    #[inline(always)]
    fn touched_in_lanes<const WIDTH: usize, const BEFORE: usize>(
        &self,
        work: Touched<'_>,
    ) -> Vec<(usize, f64)> {
        let of = |row: &[f64], k: usize, missing: f64| row.get(k).copied().unwrap_or(missing);
        let own: Corner = std::array::from_fn(|k| of(work.change, k, 0.0));
        let end: Corner = std::array::from_fn(|k| of(work.reference, k, 1.0));
        if (0..WIDTH).any(|k| own[k] >= end[k]) {
            return Vec::new();
        }
        let (room, but) = (work.room, [work.came; 2]);
        let closed = self.closed::<WIDTH>(&own, but, &end);
        // Who closes it in each objective; of two that do so, each hides the other.
        let mut closers = [(0, 0); WIDTH];
        let (mut over, mut dominating) = (0, 0);
        for (number, block) in self.blocks.iter().enumerate() {
            let low = others(number, but, counted::<WIDTH>(block, |k, x| x <= own[k]));
            let mut closing = lanes(low, WIDTH - 1);
            while let Some(lane) = next(&mut closing) {
                let who = number * WIDE + lane;
                if low[lane] == WIDTH as i64 {
                    (over, dominating) = (who, dominating + 1);
                }
                for k in 0..WIDTH {
                    let x = block[k][lane];
                    if x > own[k] && x == closed[k] && x < end[k] {
                        closers[k] = (who, closers[k].1 + 1);
                    }
                }
            }
        }
        match dominating {
            0 => (),
            1 => return vec![(over, volume::<WIDTH>(&own, &end))],
            _ => return Vec::new(),
        }
        self.bites::<WIDTH, _>(&own, but, &closed, room);
        room.sort::<WIDTH>();
        let Room {
            corners,
            order,
            before: bare,
            ..
        } = room;
        bare.clear();
        let mut whose: Vec<usize> = Vec::with_capacity(corners.len());
        let mut last = None;
        for (_, i) in order {
            let (corner, who) = corners[*i];
            if last == Some(corner) {
                whose.pop();
                whose.push(self.count);
            } else if !bare.covers::<BEFORE>(&corner) {
                bare.push(&corner[..WIDTH]);
                whose.push(who);
                last = Some(corner);
            }
        }
        let mut touched = Vec::with_capacity(whose.len() + WIDTH);
        for (k, (who, count)) in closers.into_iter().enumerate() {
            if count == 1 {
                let (mut own, mut beyond) = (own, closed);
                (own[k], beyond[k]) = (closed[k], end[k]);
                touched.push((who, bare.at_most::<WIDTH>(&own, usize::MAX, &beyond)));
            }
        }
        for (i, who) in whose.into_iter().enumerate() {
            if who < self.count {
                touched.push((who, bare.at_most::<WIDTH>(&bare.point(i), i, &closed)));
            }
        }
        touched
    }

    /// No less than what the others than `but` leave of the box from `own` to `end`: what closes it and two bites are taken off.
    #[inline(always)]
    fn at_most<const WIDTH: usize>(&self, own: &Corner, but: usize, end: &Corner) -> f64 {
        let end = &self.closed::<WIDTH>(own, [but; 2], end);
        let (greatest, first) = self.greatest::<WIDTH>(own, but, end, end);
        let (_, second) = self.greatest::<WIDTH>(own, but, end, &greatest);
        volume::<WIDTH>(own, end) - (first + second)
    }

    /// The greatest of the bites that the others than `but` take off the box from `own` to `end`, less what the bite at `taken` took.
    #[inline(always)]
    fn greatest<const WIDTH: usize>(
        &self,
        own: &Corner,
        but: usize,
        end: &Corner,
        taken: &Corner,
    ) -> (Corner, f64) {
        let mut most = [0.0; WIDE];
        let mut at = [0; WIDE];
        for (number, block) in self.blocks.iter().enumerate() {
            let but = but as i64 - (number * WIDE) as i64;
            let (mut bites, mut both) = ([1.0; WIDE], [1.0; WIDE]);
            for k in 0..WIDTH {
                for lane in 0..WIDE {
                    let x = block[k][lane];
                    let corner = if x > own[k] { x } else { own[k] };
                    let corner = if corner < end[k] { corner } else { end[k] };
                    bites[lane] *= end[k] - corner;
                    both[lane] *= end[k] - if corner > taken[k] { corner } else { taken[k] };
                }
            }
            for lane in 0..WIDE {
                let bite = bites[lane] - both[lane];
                let more = (bite > most[lane]) & (lane as i64 != but);
                most[lane] = if more { bite } else { most[lane] };
                at[lane] = if more { number as i64 } else { at[lane] };
            }
        }
        let lane = highest(&most);
        match most[lane] > 0.0 {
            true => (self.nearer::<WIDTH>(own, at[lane] as usize, lane), most[lane]),
            false => (*end, 0.0),
        }
    }

    /// Where the box from `own` to `end` ends at the latest: what is no worse in all objectives but one closes it in that one. Points
    /// `but` are left out.
    #[inline(always)]
    fn closed<const WIDTH: usize>(&self, own: &Corner, but: [usize; 2], end: &Corner) -> Corner {
        let mut least = [[f64::INFINITY; WIDE]; WIDTH];
        for (number, block) in self.blocks.iter().enumerate() {
            let low = others(number, but, counted::<WIDTH>(block, |k, x| x <= own[k]));
            for k in 0..WIDTH {
                for lane in 0..WIDE {
                    let x = block[k][lane];
                    let closes = (low[lane] >= WIDTH as i64 - i64::from(x > own[k])) & (x < least[k][lane]);
                    least[k][lane] = if closes { x } else { least[k][lane] };
                }
            }
        }
        let mut end = *end;
        for k in 0..WIDTH {
            let least = lowest(least[k]);
            end[k] = if least < end[k] { least } else { end[k] };
        }
        end
    }

    /// The volume of the box from `own` to `end` less what the others than `but` bite off it, if no more than [`FEW`] do.
    #[inline(always)]
    fn less_few<const WIDTH: usize>(&self, own: &Corner, but: [usize; 2], end: &Corner) -> Option<f64> {
        // What is missing bites nothing.
        let mut few = [*end; FEW];
        let mut count = 0;
        for (number, block) in self.blocks.iter().enumerate() {
            let inside = others(number, but, counted::<WIDTH>(block, |k, x| x < end[k]));
            let mut inside = lanes(inside, WIDTH);
            while let Some(lane) = next(&mut inside) {
                if count == FEW {
                    return None;
                }
                few[count] = self.nearer::<WIDTH>(own, number, lane);
                count += 1;
            }
        }
        Some(match count {
            0 => volume::<WIDTH>(own, end),
            _ => less::<WIDTH, FEW, { 1 << FEW }>(own, &few, end),
        })
    }

    /// [`Columns::exclusive`] of more than three objectives. `Last` is the same for the last point in the objectives before the last.
    #[inline(always)]
    fn exclusive_by_sweep<const WIDTH: usize, const BEFORE: usize, Last: LastExclusive>(
        &self,
        own: Corner,
        but: [usize; 2],
        reference: &[f64],
        asked: Asked,
        room: &mut Room<Last::Room>,
    ) -> Within {
        let (mut own, mut end) = (own, own);
        end[..WIDTH].copy_from_slice(&reference[..WIDTH]);
        let mut end = self.closed::<WIDTH>(&own, but, &end);
        for k in 0..WIDTH {
            if own[k] >= end[k] {
                return Within::exactly(0.0);
            }
        }
        if let Some(volume) = self.less_few::<WIDTH>(&own, but, &end) {
            return Within::exactly(volume);
        }
        self.bites::<WIDTH, _>(&own, but, &end, room);
        if room.corners.len() <= MORE {
            let mut few = [end; MORE];
            for (few, (corner, _)) in few.iter_mut().zip(&room.corners) {
                *few = *corner;
            }
            return Within::exactly(less::<WIDTH, MORE, { 1 << MORE }>(&own, &few, &end));
        }
        // Along the objective in which most bites begin beyond the point, fewest of them take from what is swept first.
        let mut beyond = [0; WIDTH];
        for (corner, _) in &room.corners {
            for k in 0..WIDTH {
                beyond[k] += u32::from(corner[k] > own[k]);
            }
        }
        let mut along = BEFORE;
        for k in 0..BEFORE {
            along = if beyond[k] > beyond[along] { k } else { along };
        }
        own.swap(along, BEFORE);
        end.swap(along, BEFORE);
        for (corner, _) in &mut room.corners {
            corner.swap(along, BEFORE);
        }
        room.sort::<WIDTH>();
        let Room {
            corners,
            order,
            before,
            inner,
            ..
        } = room;
        let mut area = volume::<BEFORE>(&own, &end);
        let (mut swept, mut level) = (0.0, own[BEFORE]);
        before.clear();
        for (_, i) in order {
            let corner = &corners[*i].0;
            // What is covered changes nothing, not even how the sum is rounded.
            if before.covers::<BEFORE>(corner) {
                continue;
            }
            swept += area * (corner[BEFORE] - level);
            level = corner[BEFORE];
            let within = Within {
                least: swept,
                most: swept + area * (end[BEFORE] - level),
            };
            if within.least > asked.enough || within.most < asked.little {
                return within;
            }
            before.push(&corner[..BEFORE]);
            area -= Last::of(before, &end[..BEFORE], inner);
            area = if area > 0.0 { area } else { 0.0 };
        }
        Within::exactly(swept + area * (end[BEFORE] - level))
    }
}

/// What the last point alone dominates. Closures would not be compiled for the instruction set of what calls them.
trait LastExclusive {
    /// What it needs room for.
    type Room;

    fn of(columns: &Columns, reference: &[f64], room: &mut Self::Room) -> f64;
}

/// In up to three objectives.
struct OfThree;

/// In four.
struct OfFour;

impl LastExclusive for OfThree {
    type Room = ();

    #[inline(always)]
    fn of(columns: &Columns, reference: &[f64], (): &mut ()) -> f64 {
        let last = columns.count - 1;
        let own = columns.point(last);
        let mut end = own;
        end[..3].copy_from_slice(&reference[..3]);
        let end = columns.closed::<3>(&own, [last; 2], &end);
        if (0..3).any(|k| own[k] >= end[k]) {
            return 0.0;
        }
        match columns.less_few::<3>(&own, [last; 2], &end) {
            Some(volume) => volume,
            None => columns.exclusive_of_three(last, reference),
        }
    }
}

impl LastExclusive for OfFour {
    type Room = Room<()>;

    #[inline(always)]
    fn of(columns: &Columns, reference: &[f64], room: &mut Room<()>) -> f64 {
        let last = columns.count - 1;
        let own = columns.point(last);
        let share = columns.exclusive_by_sweep::<4, 3, OfThree>(own, [last; 2], reference, Asked::ALL, room);
        share.least
    }
}

/// [`Columns::exclusive`] and [`Columns::shared`], compiled for each instruction set.
struct Exclusive<'a> {
    columns: &'a Columns,
    pair: [usize; 2],
    reference: &'a [f64],
    asked: Asked,
    room: &'a mut Room<Room<()>>,
}

impl LaneWork for Exclusive<'_> {
    type Output = Within;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Within {
        let Self {
            columns,
            pair,
            reference,
            asked,
            room,
        } = self;
        let [mut corner, other] = pair.map(|i| columns.point(i));
        for k in 0..COLUMNS {
            corner[k] = if other[k] > corner[k] { other[k] } else { corner[k] };
        }
        match reference.len() {
            5 => columns.exclusive_by_sweep::<5, 4, OfFour>(corner, pair, reference, asked, room),
            4 => columns.exclusive_by_sweep::<4, 3, OfThree>(corner, pair, reference, asked, &mut room.inner),
            _ => Within::exactly(columns.exclusive_of_three(pair[0], reference)),
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
        let end = self.columns.closed::<WIDTH>(&own, [self.i; 2], &end);
        if (0..WIDTH).any(|k| own[k] >= end[k]) {
            return 0.0;
        }
        volume::<WIDTH>(&own, &end)
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
    room: &'a mut Room<Room<()>>,
}

impl LaneWork for Touched<'_> {
    type Output = Vec<(usize, f64)>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<(usize, f64)> {
        match self.reference.len() {
            5 => self.columns.touched_in_lanes::<5, 4>(self),
            4 => self.columns.touched_in_lanes::<4, 3>(self),
            _ => self.columns.touched_in_lanes::<3, 2>(self),
        }
    }
}
