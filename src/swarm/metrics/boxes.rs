//! Boxes from a point to where they end, and what other points bite off them, in lanes.

/// Objectives up to which [`super::Columns`] hold points.
pub(in crate::swarm) const COLUMNS: usize = 5;

/// Points that are looked at side by side.
pub(super) const WIDE: usize = 8;

/// A value of each objective for points that are looked at side by side.
pub(super) type Block = [[f64; WIDE]; COLUMNS];

/// A corner of a box.
pub(super) type Corner = [f64; COLUMNS];

/// Bites that are taken off a box by inclusion and exclusion,
pub(super) const FEW: usize = 4;
/// and once those that others cover are left out.
pub(super) const MORE: usize = 6;

/// In how many of the first objectives each point of a block is as asked.
#[inline(always)]
pub(super) fn counted<const WIDTH: usize>(block: &Block, is: impl Fn(usize, f64) -> bool) -> [i64; WIDE] {
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
pub(super) fn lanes(count: [i64; WIDE], least: usize) -> u32 {
    let mut lanes = 0;
    for (lane, count) in count.into_iter().enumerate() {
        lanes |= u32::from(count >= least as i64) << lane;
    }
    lanes
}

/// The counts of a block of points, none for two of them.
#[inline(always)]
pub(super) fn others(number: usize, but: [usize; 2], mut count: [i64; WIDE]) -> [i64; WIDE] {
    let but = but.map(|but| but as i64 - (number * WIDE) as i64);
    for (lane, count) in count.iter_mut().enumerate() {
        let left_out = (lane as i64 == but[0]) | (lane as i64 == but[1]);
        *count = if left_out { 0 } else { *count };
    }
    count
}

/// The lowest of the lanes.
#[inline(always)]
pub(super) fn lowest(mut lanes: [f64; WIDE]) -> f64 {
    let mut half = WIDE / 2;
    while half > 0 {
        for lane in 0..half {
            let other = lanes[lane + half];
            lanes[lane] = if other < lanes[lane] { other } else { lanes[lane] };
        }
        half /= 2;
    }
    lanes[0]
}

/// The first of the highest lanes.
#[inline(always)]
pub(super) fn highest(values: &[f64; WIDE]) -> usize {
    let mut negative = *values;
    for value in &mut negative {
        *value = -*value;
    }
    let least = lowest(negative);
    let mut is = [0; WIDE];
    for (is, value) in is.iter_mut().zip(negative) {
        *is = i64::from(value == least);
    }
    lanes(is, 1).trailing_zeros() as usize
}

/// Takes the first lane of some.
#[inline(always)]
pub(super) fn next(lanes: &mut u32) -> Option<usize> {
    let lane = (*lanes != 0).then(|| lanes.trailing_zeros() as usize)?;
    *lanes &= *lanes - 1;
    Some(lane)
}

/// The volume of the box from `own` to `end` less what few bite off it, by inclusion and exclusion of their `SETS`: `1 << COUNT`.
#[inline(always)]
pub(super) fn less<const WIDTH: usize, const COUNT: usize, const SETS: usize>(
    own: &Corner,
    few: &[Corner; COUNT],
    end: &Corner,
) -> f64 {
    let mut volumes = [1.0; SETS];
    for k in 0..WIDTH {
        let mut near = [own[k]; SETS];
        for (bit, bite) in few.iter().enumerate() {
            for (set, near) in near.iter_mut().enumerate() {
                let x = if set >> bit & 1 == 1 { bite[k] } else { own[k] };
                *near = if x > *near { x } else { *near };
            }
        }
        for (volume, near) in volumes.iter_mut().zip(near) {
            *volume *= end[k] - near;
        }
    }
    let mut sum = 0.0;
    for (set, volume) in volumes.into_iter().enumerate() {
        sum += if set.count_ones() % 2 == 1 {
            -volume
        } else {
            volume
        };
    }
    if sum > 0.0 { sum } else { 0.0 }
}

/// The volume of the box from `corner` to `end`.
#[inline(always)]
pub(super) fn volume<const WIDTH: usize>(corner: &Corner, end: &Corner) -> f64 {
    let mut volume = 1.0;
    for k in 0..WIDTH {
        volume *= end[k] - corner[k];
    }
    volume
}
