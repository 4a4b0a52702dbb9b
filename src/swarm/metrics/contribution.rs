//! What each point of a set alone dominates.

use super::hypervolume::{Point, bites, hypervolume, point, volume};
use crate::error::Result;
use crate::evaluate::simd::{InstructionSet, LaneWork, dispatch};
use crate::scalar::lanes::Lanes;
use serde::{Deserialize, Serialize};

/// The volume, up to `reference`, that each of `points` dominates and no other does. Zero for a point that another equals or
/// dominates, or that is not better than the reference.
///
/// # Errors
/// As [`hypervolume`].
pub fn contributions(points: &[Vec<f64>], reference: &[f64]) -> Result<Vec<f64>> {
    // It checks the widths.
    hypervolume(points, reference)?;
    if reference.len() > COLUMNS {
        let shares = (0..points.len()).map(|i| exclusive_of(points, i, reference));
        return Ok(shares.collect());
    }
    let mut columns = Columns::default();
    points.iter().for_each(|row| columns.push(row));
    Ok((0..points.len())
        .map(|i| columns.exclusive(i, reference).0)
        .collect())
}

/// Objectives up to which [`Columns`] hold points.
pub(in crate::swarm) const COLUMNS: usize = 3;

/// The volume that point `i` alone dominates, where there are more objectives than [`Columns`] hold: its box less what the others bite
/// off.
pub(in crate::swarm) fn exclusive_of(points: &[Vec<f64>], i: usize, reference: &[f64]) -> f64 {
    let better = |corner: &Point| corner.iter().zip(reference).all(|(x, end)| x < end);
    let own = point(&points[i]);
    if !better(&own) {
        return 0.0;
    }
    let others: Vec<Point> = points.iter().map(|row| point(row)).collect();
    let others = others.iter().enumerate().filter(|(j, _)| *j != i);
    let mut bitten = bites(&own, others.map(|(_, other)| other), reference.len());
    if bitten.contains(&own) {
        return 0.0;
    }
    bitten.retain(better);
    let whole: f64 = own.iter().zip(reference).map(|(x, end)| end - x).product();
    (whole - volume(&mut bitten, reference)).max(0.0)
}

/// [`Columns::touches`], where there are more objectives.
pub(in crate::swarm) fn touches_of(
    points: &[Vec<f64>],
    change: &[f64],
    came: Option<usize>,
    i: usize,
    reference: &[f64],
) -> bool {
    let corner: Vec<f64> = points[i].iter().zip(change).map(|(a, b)| a.max(*b)).collect();
    let hides = |j: usize| j != i && Some(j) != came && points[j].iter().zip(&corner).all(|(x, c)| x <= c);
    corner.iter().zip(reference).all(|(x, end)| x < end) && !(0..points.len()).any(hides)
}

/// Points of up to three objectives by objective; missing ones are zero, against a reference of one.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(in crate::swarm) struct Columns {
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
}

impl Columns {
    pub fn push(&mut self, row: &[f64]) {
        let at = |k: usize| row.get(k).copied().unwrap_or(0.0);
        self.x.push(at(0));
        self.y.push(at(1));
        self.z.push(at(2));
    }

    pub fn swap_remove(&mut self, i: usize) {
        for column in [&mut self.x, &mut self.y, &mut self.z] {
            column.swap_remove(i);
        }
    }

    pub fn clear(&mut self) {
        for column in [&mut self.x, &mut self.y, &mut self.z] {
            column.clear();
        }
    }

    /// The exclusive volume of point `i`, and the far corner of the least box from the point that holds it. Another
    /// point changes the volume only if it is at or below that corner in every objective.
    ///
    /// A sweep along the third objective over a window that the others leave in the first two. The window is small
    /// in a set of non-dominated points, so that nearly all of the others are dismissed by two comparisons: some
    /// `n` steps for a point instead of the `n log n` of a whole hypervolume.
    pub fn exclusive(&self, i: usize, reference: &[f64]) -> (f64, [f64; 3]) {
        let work = Exclusive {
            columns: self,
            i,
            reference,
        };
        dispatch(InstructionSet::best(), work)
    }

    /// Whether a point that came or left can have changed the volume that point `i` alone dominates: no other than these two
    /// dominates what both of them do. `came` is the number of that point, if it is here.
    pub fn touches(&self, point: &[f64], came: Option<usize>, i: usize, reference: &[f64]) -> bool {
        let work = Touches {
            columns: self,
            point,
            came: came.unwrap_or(i),
            i,
            reference,
        };
        dispatch(InstructionSet::best(), work)
    }

    #[inline(always)]
    fn touches_in_lanes(&self, work: &Touches<'_>) -> bool {
        let own = [self.x[work.i], self.y[work.i], self.z[work.i]];
        let at = |k: usize| work.point.get(k).map_or(own[k], |x| x.max(own[k]));
        let [x, y, z] = [at(0), at(1), at(2)];
        if [x, y, z].iter().zip(work.reference).any(|(x, end)| x >= end) {
            return false;
        }
        for from in (0..self.x.len()).step_by(WIDE) {
            let [us, vs, ws] = self.block(from);
            let mut hidden = [false; WIDE];
            for lane in 0..WIDE {
                let other = (from + lane != work.i) & (from + lane != work.came);
                hidden[lane] = (us[lane] <= x) & (vs[lane] <= y) & (ws[lane] <= z) & other;
            }
            if hidden.contains(&true) {
                return false;
            }
        }
        true
    }

    /// The block of points that number `from` is the first of; infinite ones fill up the last.
    #[inline(always)]
    fn block(&self, from: usize) -> [[f64; WIDE]; 3] {
        let mut lanes = [[f64::INFINITY; WIDE]; 3];
        for (lanes, column) in lanes.iter_mut().zip([&self.x, &self.y, &self.z]) {
            match column[from..].first_chunk::<WIDE>() {
                Some(whole) => *lanes = *whole,
                None => lanes[..column.len() - from].copy_from_slice(&column[from..]),
            }
        }
        lanes
    }

    #[inline(always)]
    fn exclusive_in_lanes(&self, i: usize, reference: &[f64]) -> (f64, [f64; 3]) {
        let (x, y, z) = (self.x[i], self.y[i], self.z[i]);
        let end = |k: usize| reference.get(k).copied().unwrap_or(1.0);
        let (mut right, mut top, mut ceiling) = (end(0), end(1), end(2));
        let nothing = (0.0, [x, y, z]);
        if !(x < right && y < top && z < ceiling) {
            return nothing;
        }
        // The window at the point's own level, and the level where it closes.
        let mut least = [[f64::INFINITY; WIDE]; 3];
        for from in (0..self.x.len()).step_by(WIDE) {
            let [us, vs, ws] = self.block(from);
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
            return nothing;
        }
        // Points inside the window bite its far corner off, now or from their level on.
        let mut inside: Vec<(f64, f64, f64)> = Vec::new();
        let mut above: Vec<(f64, f64, f64)> = Vec::new();
        for from in (0..self.x.len()).step_by(WIDE) {
            let [us, vs, ws] = self.block(from);
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
        let far = (right, top);
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
        (volume + area * (ceiling - level), [far.0, far.1, ceiling])
    }
}

/// Points that are looked at side by side.
const WIDE: usize = 8;

/// [`Columns::exclusive`], compiled for each instruction set.
struct Exclusive<'a> {
    columns: &'a Columns,
    i: usize,
    reference: &'a [f64],
}

impl LaneWork for Exclusive<'_> {
    type Output = (f64, [f64; 3]);

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        self.columns.exclusive_in_lanes(self.i, self.reference)
    }
}

/// [`Columns::touches`], compiled for each instruction set.
struct Touches<'a> {
    columns: &'a Columns,
    point: &'a [f64],
    came: usize,
    i: usize,
    reference: &'a [f64],
}

impl LaneWork for Touches<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        self.columns.touches_in_lanes(&self)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn by_hand() {
        let points = vec![vec![1.0, 3.0], vec![2.0, 2.0], vec![3.0, 1.0], vec![3.0, 3.0]];
        assert_eq!(contributions(&points, &[4.0, 4.0]).unwrap(), [1.0, 1.0, 1.0, 0.0]);
        assert_eq!(
            contributions(&[vec![1.0], vec![3.0]], &[4.0]).unwrap(),
            [2.0, 0.0]
        );
        let corner = vec![vec![0.0, 0.0, 1.5], vec![1.0, 1.0, 1.0]];
        assert_eq!(contributions(&corner, &[2.0; 3]).unwrap(), [1.5, 0.5]);
    }

    /// Against the difference of two hypervolumes; coordinates are multiples of 1/8, so both are exact. The box
    /// is held against what it claims: points beyond its corner change nothing.
    #[test]
    fn is_the_difference() {
        let random = Random::new(5);
        for case in 0..400 {
            let width = 1 + case as usize % 5;
            let count = 1 + random.below(14, 1, case, 0, 0);
            let points: Vec<Vec<f64>> = (0..count as u32)
                .map(|i| {
                    (0..width as u32)
                        .map(|k| random.below(10, 2, case, i, k) as f64 / 8.0 - 0.25)
                        .collect()
                })
                .collect();
            let reference = vec![0.875; width];
            let whole = hypervolume(&points, &reference).unwrap();
            let found = contributions(&points, &reference).unwrap();
            for i in 0..count {
                let mut rest = points.clone();
                rest.remove(i);
                let difference = whole - hypervolume(&rest, &reference).unwrap();
                assert_eq!(found[i], difference, "{i} of {points:?}");
                if width > COLUMNS {
                    continue;
                }
                let columns = |points: &[Vec<f64>]| {
                    let mut columns = Columns::default();
                    points.iter().for_each(|row| columns.push(row));
                    columns
                };
                let (volume, corner) = columns(&points).exclusive(i, &reference);
                let mut near = vec![points[i].clone()];
                let touches = |p: &&Vec<f64>| p.iter().zip(&corner).all(|(x, c)| x <= c);
                near.extend(rest.iter().filter(touches).cloned());
                assert_eq!(columns(&near).exclusive(0, &reference).0, volume);
            }
        }
    }

    /// What comes or leaves touches exactly the shares that change; on a curve its neighbours'.
    #[test]
    fn touches_what_changes() {
        let random = Random::new(6);
        let columns = |points: &[Vec<f64>]| {
            let mut columns = Columns::default();
            points.iter().for_each(|row| columns.push(row));
            columns
        };
        for case in 0..400 {
            let width = 1 + case as usize % 5;
            let count = 2 + random.below(14, 1, case, 0, 0);
            let draw = |i: u32, k: u32| random.below(10, 2, case, i, k) as f64 / 8.0 - 0.25;
            let row = |i: u32| (0..width as u32).map(|k| draw(i, k)).collect();
            let points: Vec<Vec<f64>> = (0..count as u32).map(row).collect();
            let reference = vec![0.875; width];
            let (last, rest) = points.split_last().unwrap();
            for i in (0..rest.len()).filter(|_| width > COLUMNS) {
                let share = |points: &[Vec<f64>]| exclusive_of(points, i, &reference);
                let changes = share(&points) != share(rest);
                assert_eq!(
                    touches_of(&points, last, Some(rest.len()), i, &reference),
                    changes
                );
                assert_eq!(touches_of(rest, last, None, i, &reference), changes);
            }
            let (with, without) = (columns(&points), columns(rest));
            for i in (0..rest.len()).filter(|_| width <= COLUMNS) {
                let share = |columns: &Columns| columns.exclusive(i, &reference).0;
                let changes = share(&with) != share(&without);
                assert_eq!(with.touches(last, Some(rest.len()), i, &reference), changes);
                assert_eq!(
                    without.touches(last, None, i, &reference),
                    changes,
                    "{i} of {points:?}"
                );
            }
        }
        let on = |t: f64| vec![t, t + 1e-9 * (1e3 * t).sin(), 1.0 - t * t];
        let curve: Vec<Vec<f64>> = (0..100).map(|i| on(f64::from(i) / 99.0)).collect();
        let members = columns(&curve);
        for i in 0..99 {
            let new = on((f64::from(i) + 0.5) / 99.0);
            let touched = (0..100)
                .filter(|&i| members.touches(&new, None, i, &[1.1, 1.1, 1.1]))
                .count();
            assert!((1..=2).contains(&touched), "{touched} at {i}");
        }
    }
}
