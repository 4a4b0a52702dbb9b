//! What a point alone dominates of three objectives.

use super::boxes::WIDE;
use super::columns::Columns;
use std::cmp::Ordering;

impl Columns {
    /// What point `i` alone dominates, up to `reference`.
    #[inline(always)]
    pub(super) fn exclusive_of_three(&self, i: usize, reference: &[f64]) -> f64 {
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

/// The order of points inside a window.
fn place(a: &(f64, f64, f64), b: &(f64, f64, f64)) -> Ordering {
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
