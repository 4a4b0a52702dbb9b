//! The cubic spline through points, over the chord length (C. de Boor, *A Practical Guide to Splines*, 1978, ch. IV).

use glam::DVec2;

/// A parametric cubic spline: periodic if closed, else with ends of constant second derivative.
pub(super) struct Spline {
    points: Vec<DVec2>,
    /// Second derivatives at the points.
    bends: Vec<DVec2>,
    /// Chord lengths (m), one per segment.
    chords: Vec<f64>,
}

/// A place on a spline.
pub(super) struct Place {
    pub point: DVec2,
    /// Length of the curve per unit of the parameter.
    pub speed: f64,
    /// Curvature (1/m), positive in left turns.
    pub curvature: f64,
}

impl Spline {
    /// The spline through `points`, no two neighbours the same; at least three if it is closed, else two.
    pub fn through(points: &[DVec2], closed: bool) -> Self {
        let n = points.len();
        let segments = n - usize::from(!closed);
        let chords: Vec<f64> = (0..segments)
            .map(|i| points[i].distance(points[(i + 1) % n]))
            .collect();
        let slope = |i: usize| (points[(i + 1) % n] - points[i]) / chords[i];
        let mut below = vec![0.0; n];
        let mut middle = vec![1.0; n];
        let mut above = vec![0.0; n];
        let mut right = vec![DVec2::ZERO; n];
        for i in 0..n {
            if !closed && (i == 0 || i == n - 1) {
                // As its neighbour; a lone segment is straight.
                let neighbour = if n > 2 { -1.0 } else { 0.0 };
                if i == 0 {
                    above[i] = neighbour;
                } else {
                    below[i] = neighbour;
                }
                continue;
            }
            let before = (i + segments - 1) % segments;
            below[i] = chords[before];
            middle[i] = 2.0 * (chords[before] + chords[i]);
            above[i] = chords[i];
            right[i] = 6.0 * (slope(i) - slope(before));
        }
        let bends = if closed {
            solve_cyclic(&below, &middle, &above, &right)
        } else {
            solve(&below, &middle, &above, &right)
        };
        Self {
            points: points.to_vec(),
            bends,
            chords,
        }
    }

    /// Number of segments.
    pub fn segments(&self) -> usize {
        self.chords.len()
    }

    /// The chord of a segment (m), which is the range of its parameter.
    pub fn chord(&self, segment: usize) -> f64 {
        self.chords[segment]
    }

    /// The place at the parameter `t`, from zero to the chord, of a segment.
    pub fn at(&self, segment: usize, t: f64) -> Place {
        let n = self.points.len();
        let (h, from, to) = (self.chords[segment], segment, (segment + 1) % n);
        let (m0, m1) = (self.bends[from], self.bends[to]);
        let rise = (m1 - m0) / h;
        let slope = (self.points[to] - self.points[from]) / h - h / 6.0 * (2.0 * m0 + m1);
        let velocity = slope + t * (m0 + t / 2.0 * rise);
        let bend = m0 + t * rise;
        let speed = velocity.length();
        Place {
            point: self.points[from] + t * (slope + t * (m0 / 2.0 + t / 6.0 * rise)),
            speed,
            curvature: velocity.perp_dot(bend) / (speed * speed * speed).max(1e-12),
        }
    }

    /// The integral over the parameter of a segment from `from` to `to`, by three Gauss points.
    pub fn integral(&self, segment: usize, from: f64, to: f64, f: impl Fn(&Place) -> f64) -> f64 {
        let (centre, half) = (0.5 * (from + to), 0.5 * (to - from));
        let reach = half * 0.6f64.sqrt();
        [(-reach, 5.0), (0.0, 8.0), (reach, 5.0)]
            .into_iter()
            .map(|(off, weight)| weight / 9.0 * half * f(&self.at(segment, centre + off)))
            .sum()
    }
}

/// Solves a diagonally dominant tridiagonal system.
fn solve(below: &[f64], middle: &[f64], above: &[f64], right: &[DVec2]) -> Vec<DVec2> {
    let n = right.len();
    let (mut ratio, mut x) = (vec![0.0; n], vec![DVec2::ZERO; n]);
    for i in 0..n {
        let (before, carried) = if i > 0 {
            (ratio[i - 1], x[i - 1])
        } else {
            (0.0, DVec2::ZERO)
        };
        let pivot = middle[i] - below[i] * before;
        ratio[i] = above[i] / pivot;
        x[i] = (right[i] - below[i] * carried) / pivot;
    }
    for i in (0..n - 1).rev() {
        x[i] = x[i] - ratio[i] * x[i + 1];
    }
    x
}

/// The same for a periodic system, with `below[0]` and `above[n - 1]` in the corners, by the formula of Sherman and Morrison.
fn solve_cyclic(below: &[f64], middle: &[f64], above: &[f64], right: &[DVec2]) -> Vec<DVec2> {
    let n = right.len();
    let (corner_high, corner_low) = (below[0], above[n - 1]);
    let gamma = -middle[0];
    let mut changed = middle.to_vec();
    changed[0] -= gamma;
    changed[n - 1] -= corner_low * corner_high / gamma;
    let (mut low, mut high) = (below.to_vec(), above.to_vec());
    (low[0], high[n - 1]) = (0.0, 0.0);
    let mut column = vec![DVec2::ZERO; n];
    column[0] = DVec2::splat(gamma);
    column[n - 1] = DVec2::splat(corner_low);
    let x = solve(&low, &changed, &high, right);
    let z = solve(&low, &changed, &high, &column);
    let share = corner_high / gamma;
    let factor = (x[0] + share * x[n - 1]) / (DVec2::ONE + z[0] + share * z[n - 1]);
    x.iter().zip(&z).map(|(x, z)| *x - factor * *z).collect()
}
