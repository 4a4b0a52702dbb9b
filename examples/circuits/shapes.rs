//! Circuits that nobody has surveyed, in the racetrack database's format: what real ones have, each to its extreme.
//!
//! A circuit is a closed polygon whose corners are rounded off by arcs. Its middle line is smoothed, as roads begin to bend
//! gradually, and sampled every five metres. A survey's noise comes on top.

use std::f64::consts::TAU;
use std::fmt::Write;

/// Distance between the surveyed points (m), and between those that the shape is made of.
const SURVEY_M: f64 = 5.0;
const FINE_M: f64 = 0.5;

/// A circuit to be surveyed.
pub struct Circuit {
    /// What it is called.
    pub name: &'static str,
    /// Corners of the polygon: x, y and the radius of the arc (m).
    corners: Vec<[f64; 3]>,
    /// Standard deviation of the smoothing of the middle line (m).
    soft_m: f64,
    /// Mean width of the road, how far it varies about that, and the wave in which it does (m).
    width_m: [f64; 3],
    /// Standard deviation of the survey's errors across the road (m).
    noise_m: f64,
}

/// A number from a counter, evenly between zero and one.
fn uniform(seed: u64, index: u64) -> f64 {
    let mut z = (seed << 32)
        .wrapping_add(index)
        .wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// A normal number from a counter.
fn normal(seed: u64, index: u64) -> f64 {
    let (a, b) = (uniform(seed, 2 * index), uniform(seed, 2 * index + 1));
    (-2.0 * (1.0 - a).ln()).sqrt() * (TAU * b).cos()
}

impl Circuit {
    /// The ten circuits of the book's table.
    pub fn ten() -> Vec<Self> {
        let made = |name, soft_m, width_m, noise_m, corners: &[[f64; 3]]| Self {
            name,
            corners: corners.to_vec(),
            soft_m,
            width_m,
            noise_m,
        };
        vec![
            made(
                "hairpins",
                3.0,
                [10.0, 1.0, 400.0],
                0.02,
                &[
                    [0.0, 0.0, 10.0],
                    [700.0, 0.0, 10.0],
                    [700.0, 22.0, 10.0],
                    [180.0, 60.0, 10.0],
                    [180.0, 82.0, 10.0],
                    [820.0, 130.0, 60.0],
                    [800.0, 330.0, 10.0],
                    [778.0, 330.0, 10.0],
                    [700.0, 190.0, 40.0],
                    [260.0, 170.0, 10.0],
                    [250.0, 192.0, 10.0],
                    [560.0, 270.0, 80.0],
                    [400.0, 420.0, 50.0],
                    [0.0, 300.0, 70.0],
                ],
            ),
            made(
                "chicanes",
                4.0,
                [11.0, 1.5, 600.0],
                0.03,
                &[
                    [0.0, 0.0, 80.0],
                    [500.0, 0.0, 18.0],
                    [515.0, 16.0, 18.0],
                    [560.0, 16.0, 25.0],
                    [590.0, -6.0, 30.0],
                    [1100.0, 0.0, 90.0],
                    [1220.0, 300.0, 70.0],
                    [900.0, 420.0, 16.0],
                    [888.0, 438.0, 15.0],
                    [850.0, 440.0, 20.0],
                    [820.0, 460.0, 30.0],
                    [400.0, 500.0, 40.0],
                    [370.0, 470.0, 40.0],
                    [330.0, 470.0, 40.0],
                    [290.0, 500.0, 40.0],
                    [-150.0, 450.0, 100.0],
                ],
            ),
            made(
                "bridge",
                6.0,
                [13.0, 1.5, 700.0],
                0.05,
                &[
                    [0.0, 0.0, 150.0],
                    [900.0, 0.0, 130.0],
                    [1300.0, 420.0, 160.0],
                    [1000.0, 800.0, 90.0],
                    [820.0, 560.0, 60.0],
                    [420.0, -330.0, 130.0],
                    [60.0, -520.0, 14.0],
                    [30.0, -495.0, 14.0],
                    [120.0, -330.0, 90.0],
                    [-180.0, -240.0, 100.0],
                    [-520.0, -300.0, 130.0],
                    [-420.0, 40.0, 60.0],
                ],
            ),
            made(
                "straights",
                5.0,
                [14.0, 1.0, 900.0],
                0.05,
                &[
                    [0.0, 0.0, 28.0],
                    [2150.0, 0.0, 30.0],
                    [2180.0, 75.0, 32.0],
                    [1150.0, 110.0, 20.0],
                    [1130.0, 130.0, 20.0],
                    [1080.0, 132.0, 40.0],
                    [-20.0, 120.0, 36.0],
                ],
            ),
            made(
                "widths",
                6.0,
                [13.5, 6.5, 260.0],
                0.03,
                &[
                    [0.0, 0.0, 60.0],
                    [600.0, -40.0, 35.0],
                    [680.0, 160.0, 80.0],
                    [1100.0, 200.0, 25.0],
                    [1090.0, 300.0, 30.0],
                    [700.0, 380.0, 50.0],
                    [640.0, 620.0, 60.0],
                    [250.0, 600.0, 22.0],
                    [200.0, 330.0, 70.0],
                    [-150.0, 250.0, 45.0],
                ],
            ),
            made(
                "jagged",
                5.0,
                [11.0, 1.0, 500.0],
                0.25,
                &[
                    [0.0, 0.0, 70.0],
                    [650.0, 0.0, 40.0],
                    [700.0, 220.0, 50.0],
                    [1080.0, 330.0, 120.0],
                    [1000.0, 640.0, 15.0],
                    [960.0, 640.0, 20.0],
                    [640.0, 420.0, 90.0],
                    [300.0, 560.0, 60.0],
                    [-60.0, 420.0, 90.0],
                ],
            ),
            made(
                "street",
                3.0,
                [9.0, 1.0, 300.0],
                0.08,
                &[
                    [0.0, 0.0, 12.0],
                    [420.0, 0.0, 11.0],
                    [420.0, 160.0, 12.0],
                    [620.0, 160.0, 11.0],
                    [620.0, 420.0, 14.0],
                    [480.0, 420.0, 12.0],
                    [480.0, 560.0, 11.0],
                    [120.0, 560.0, 13.0],
                    [120.0, 330.0, 12.0],
                    [260.0, 330.0, 11.0],
                    [260.0, 190.0, 12.0],
                    [0.0, 190.0, 11.0],
                ],
            ),
            made(
                "kart",
                2.5,
                [8.0, 0.5, 120.0],
                0.03,
                &[
                    [0.0, 0.0, 18.0],
                    [190.0, 0.0, 12.0],
                    [195.0, 45.0, 14.0],
                    [110.0, 55.0, 10.0],
                    [112.0, 80.0, 10.0],
                    [240.0, 90.0, 20.0],
                    [230.0, 170.0, 11.0],
                    [205.0, 172.0, 11.0],
                    [180.0, 125.0, 12.0],
                    [90.0, 130.0, 18.0],
                    [60.0, 190.0, 22.0],
                    [-20.0, 150.0, 25.0],
                ],
            ),
            made(
                "oval",
                20.0,
                [17.0, 1.5, 1000.0],
                0.05,
                &[
                    [0.0, 0.0, 260.0],
                    [1500.0, 0.0, 260.0],
                    [1500.0, 560.0, 260.0],
                    [750.0, 640.0, 400.0],
                    [0.0, 560.0, 260.0],
                ],
            ),
            made(
                "long",
                6.0,
                [14.5, 2.4, 800.0],
                0.1,
                &[
                    [0.0, 0.0, 20.0],
                    [302.5, 302.5, 150.0],
                    [508.2, 847.0, 120.0],
                    [1815.0, 1573.0, 60.0],
                    [1887.6, 1427.8, 60.0],
                    [2117.5, 1403.6, 80.0],
                    [2274.8, 1149.5, 60.0],
                    [1815.0, 871.2, 110.0],
                    [1887.6, 508.2, 130.0],
                    [2238.5, 363.0, 60.0],
                    [2299.0, 72.6, 45.0],
                    [1815.0, -193.6, 250.0],
                    [847.0, 108.9, 300.0],
                    [399.3, -72.6, 18.0],
                    [375.1, -36.3, 18.0],
                    [290.4, -24.2, 60.0],
                ],
            ),
        ]
    }

    /// A circuit of random corners, width and noise: seven to ten corners about a middle, none of which lies behind its neighbours.
    pub fn random(seed: u64) -> Self {
        let draw = |index: u64, from: f64, to: f64| from + (to - from) * uniform(seed, 1_000_000 + index);
        let count = draw(0, 7.0, 11.0) as usize;
        let corner = |i: usize| {
            let at = 10 * (i as u64 + 1);
            let angle = TAU * (i as f64 + draw(at, -0.25, 0.25)) / count as f64;
            let far = draw(at + 1, 120.0, 320.0);
            [
                1.4 * far * angle.cos(),
                far * angle.sin(),
                draw(at + 2, 12.0, 50.0),
            ]
        };
        let width_m = draw(1, 8.0, 13.0);
        Self {
            name: "random",
            corners: (0..count).map(corner).collect(),
            soft_m: 4.0,
            width_m: [width_m, draw(2, 0.0, 0.3) * width_m, draw(3, 150.0, 500.0)],
            noise_m: draw(4, 0.0, 0.2),
        }
    }

    /// The middle line in steps of [`FINE_M`]: straights and arcs. An arc that has no room between its neighbours is tighter.
    fn middle(&self) -> Vec<[f64; 2]> {
        let (corners, n) = (&self.corners, self.corners.len());
        let way = |i: usize, j: usize| {
            let (dx, dy) = (corners[j][0] - corners[i][0], corners[j][1] - corners[i][1]);
            let length = dx.hypot(dy);
            ([dx / length, dy / length], length)
        };
        let mut points = Vec::new();
        for (i, [x, y, wanted]) in corners.iter().enumerate() {
            let (before, after) = ((i + n - 1) % n, (i + 1) % n);
            let (([ax, ay], come), ([bx, by], go)) = (way(before, i), way(i, after));
            let turn = (ax * by - ay * bx).atan2(ax * bx + ay * by);
            let half = (0.5 * turn).tan().abs();
            let tangent = (wanted * half).min(0.49 * come).min(0.49 * go);
            let radius = tangent / half;
            let (x, y) = (x - tangent * ax, y - tangent * ay);
            let steps = (radius * turn.abs() / FINE_M).ceil().max(1.0) as usize;
            for step in 0..=steps {
                let angle = turn.abs() * step as f64 / steps as f64;
                let (along, across) = (radius * angle.sin(), radius * (1.0 - angle.cos()) * turn.signum());
                points.push([x + along * ax - across * ay, y + along * ay + across * ax]);
            }
        }
        evenly(&points, FINE_M)
    }

    /// The survey: `x_m,y_m,w_tr_right_m,w_tr_left_m`.
    pub fn csv(&self) -> String {
        let sharp = self.middle();
        let reach = (3.0 * self.soft_m / FINE_M) as isize;
        let weights: Vec<f64> = (-reach..=reach)
            .map(|k| (-0.5 * (k as f64 * FINE_M / self.soft_m).powi(2)).exp())
            .collect();
        let total: f64 = weights.iter().sum();
        let n = sharp.len() as isize;
        let soft: Vec<[f64; 2]> = (0..n)
            .map(|i| {
                let near = weights.iter().zip(-reach..=reach);
                near.fold([0.0, 0.0], |[x, y], (weight, k)| {
                    let [px, py] = sharp[(i + k).rem_euclid(n) as usize];
                    [x + weight * px / total, y + weight * py / total]
                })
            })
            .collect();
        let points = evenly(&soft, SURVEY_M);
        let n = points.len();
        let mut csv = "# x_m,y_m,w_tr_right_m,w_tr_left_m\n".to_owned();
        let seed = self
            .name
            .bytes()
            .fold(7, |seed, byte| 31 * seed % 65_521 + u64::from(byte));
        let [mean, varies, wave] = self.width_m;
        let waves = (n as f64 * SURVEY_M / wave).round().max(1.0);
        for (i, [x, y]) in points.iter().enumerate() {
            let (before, after) = (points[(i + n - 1) % n], points[(i + 1) % n]);
            let (dx, dy) = (after[0] - before[0], after[1] - before[1]);
            let length = dx.hypot(dy);
            let error = |k: u64| self.noise_m * normal(seed, 4 * i as u64 + k);
            let off = error(0);
            let around = TAU * i as f64 / n as f64;
            let width = mean + varies * (waves * around).sin();
            let share = 0.5 + 0.08 * ((waves + 2.0) * around).cos();
            let _ = writeln!(
                csv,
                "{:.4},{:.4},{:.3},{:.3}",
                x - off * dy / length,
                y + off * dx / length,
                share * width + error(1),
                (1.0 - share) * width + error(2),
            );
        }
        csv
    }
}

/// A closed polygon in even steps near `step_m`.
fn evenly(points: &[[f64; 2]], step_m: f64) -> Vec<[f64; 2]> {
    let n = points.len();
    let apart = |i: usize| {
        let (a, b) = (points[i], points[(i + 1) % n]);
        (b[0] - a[0]).hypot(b[1] - a[1])
    };
    let total: f64 = (0..n).map(apart).sum();
    let count = (total / step_m).round().max(8.0) as usize;
    let (mut at, mut from) = (0, 0.0);
    (0..count)
        .map(|k| {
            let station = total * k as f64 / count as f64;
            while at + 1 < n && from + apart(at) <= station {
                from += apart(at);
                at += 1;
            }
            let length = apart(at);
            let share = if length > 0.0 {
                (station - from) / length
            } else {
                0.0
            };
            let (a, b) = (points[at], points[(at + 1) % n]);
            [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])]
        })
        .collect()
}
