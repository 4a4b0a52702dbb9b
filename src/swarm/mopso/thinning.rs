//! Thinning a front that is far larger than the archive: the best point of each cell of a grid.
//!
//! The cells lie side by side across the direction in which all objectives grow, so that a cell is a direction of the
//! front and not a place along it. A truncation in a few rounds of crowding gets worse as the swarm grows; the
//! best of some [`PER_PLACE`] cells per place, from which members are then deleted one at a time, does not.

use super::filter::Point;

/// Cells for each place in the archive.
pub const PER_PLACE: usize = 4;

/// At most `wanted` of the points of a front, by number of the particle.
pub fn thinned(front: Vec<Point>, width: usize, wanted: usize) -> Vec<Point> {
    if front.len() <= wanted {
        return front;
    }
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for p in &front {
        for k in 0..3 {
            low[k] = low[k].min(p.at[k]);
            high[k] = high[k].max(p.at[k]);
        }
    }
    let share = |p: &Point, k: usize| {
        if high[k] > low[k] {
            (p.at[k] - low[k]) / (high[k] - low[k])
        } else {
            0.0
        }
    };
    // Across the diagonal, each from zero to one.
    let across = |p: &Point, k: usize| 0.5 * (share(p, k) - share(p, width - 1) + 1.0);
    let cell = |p: &Point, side: usize| {
        let step = |k: usize| ((across(p, k) * side as f64) as usize).min(side - 1);
        if width == 2 {
            step(0)
        } else {
            step(0) * side + step(1)
        }
    };
    let side = if width == 2 {
        wanted
    } else {
        // As fine as leaves no more cells taken than wanted; a front takes up some part of them.
        let taken = |side: usize| {
            let mut seen = vec![false; side * side];
            let mut count = 0;
            for p in &front {
                let place = &mut seen[cell(p, side)];
                count += usize::from(!*place);
                *place = true;
            }
            count
        };
        let mut side = (wanted as f64).sqrt() as usize;
        while side < wanted {
            let finer = side + side / 6 + 1;
            if taken(finer) > wanted {
                break;
            }
            side = finer;
        }
        side.max(1)
    };
    let cells = if width == 2 { side } else { side * side };
    let mut best: Vec<Option<(f64, Point)>> = vec![None; cells];
    for p in &front {
        let sum = (0..width).map(|k| share(p, k)).sum::<f64>();
        let place = &mut best[cell(p, side)];
        if place.is_none_or(|(least, _)| sum < least) {
            *place = Some((sum, *p));
        }
    }
    let mut kept: Vec<Point> = best.into_iter().flatten().map(|(_, p)| p).collect();
    kept.sort_unstable_by_key(|p| p.who);
    kept
}
