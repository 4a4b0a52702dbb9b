//! What a driver knows of a car: its steady cornering, as a map over the speed and the share of the grip that is used.

#![deny(clippy::disallowed_methods)]

use super::driver::STEER_LAG_S;
use super::plan::load_mps2;
use crate::error::{Error, Result};
use crate::scalar::{Lookup, Real};
use crate::vehicle::{Car, Trim, Turn, steady_car};

/// Rows of the map, at even steps of the speed, and the speed of the first and that between rows (m/s).
pub const SPEEDS: usize = 8;
const FIRST_MPS: f64 = 10.0;
const STEP_MPS: f64 = 10.0;
/// Even steps of the share of the grip from none to all.
pub const SHARES: usize = 8;
/// Figures of a place of the map: steering beyond the geometry's (rad), slip angle of the rear axle (rad), the friction at this speed,
/// and by how much steering has to be ahead of a bend (s).
pub const CORNERING_WIDTH: usize = 4;
/// Figures of a row.
const ROW: usize = (SHARES + 1) * CORNERING_WIDTH;
/// Share of the greatest lateral acceleration up to which states are looked at: beyond it the axle that gives way first takes any angle.
const MOST_SHARE: f64 = 0.96;
/// Share beyond which angles grow no more.
const FURTHEST: f64 = 1.1;

/// A car's steady cornering over speed and share of the grip: where the wheels point and how the rear axle slips, linear between places.
#[derive(Clone, Debug, PartialEq)]
pub struct CorneringMap<S> {
    /// [`SPEEDS`] rows; each has one place more than [`SHARES`], of [`CORNERING_WIDTH`] figures.
    pub figures: Vec<S>,
}

impl CorneringMap<f64> {
    /// From the car's steady states in bends, up to 0.96 of the greatest lateral acceleration at each speed.
    ///
    /// # Errors
    /// [`Error::Study`] if the car has none.
    pub fn of_car(car: &Car) -> Result<Self> {
        let steady = steady_car(car);
        let mut rows: Vec<Option<Vec<f64>>> = Vec::new();
        for row in 0..SPEEDS {
            let speed = FIRST_MPS + STEP_MPS * row as f64;
            let trims = steady.cornering(speed, car.max_steer_rad.max(0.3), Turn::Left);
            rows.push(row_of(car, speed, &trims));
        }
        // A speed without states has those of the speed below it, and the lowest speeds those of the first that has some.
        let Some(first) = rows.iter().position(Option::is_some) else {
            return Err(Error::Study(format!("{} has no steady state in bends", car.name)));
        };
        let mut figures = Vec::new();
        let mut known = first;
        for row in 0..SPEEDS {
            if rows[row].is_some() {
                known = row;
            }
            figures.extend(rows[known].iter().flatten());
        }
        Ok(Self { figures })
    }

    /// What a driver takes for granted who does not know the car: steering in proportion to the share of the grip, so much at all
    /// of it (rad) and so far ahead (s).
    pub fn guessed(steer_rad: f64, preview_s: f64) -> Self {
        let place = |k: usize| [steer_rad * k as f64 / SHARES as f64, 0.0, 1.0, preview_s];
        let row: Vec<f64> = (0..=SHARES).flat_map(place).collect();
        Self {
            figures: row.repeat(SPEEDS),
        }
    }

    /// The map in the precision that the scalar `R` stores tables in.
    pub fn stored<R: Real>(&self) -> CorneringMap<R::Storage> {
        CorneringMap {
            figures: self.figures.iter().map(|figure| R::store(*figure)).collect(),
        }
    }
}

/// The places of a speed (m/s), from its steady states; nothing if there are none.
fn row_of(car: &Car, speed: f64, trims: &[Trim]) -> Option<Vec<f64>> {
    let c = &car.chassis;
    let most = trims.iter().map(|trim| trim.ay_mps2).fold(0.0, f64::max);
    let ridge = trims.iter().position(|trim| trim.ay_mps2 == most)?;
    // Straight on nothing slips.
    let mut states = vec![[0.0; 3]];
    for trim in &trims[..ridge] {
        let share = trim.ay_mps2 / most;
        if share > states[states.len() - 1][0] && share < MOST_SHARE {
            // Without slip the axles follow the path. That part of the angles is geometry.
            let bend = trim.ay_mps2 / (speed * speed);
            let understeer = trim.steer_rad - (c.cg_to_front + c.cg_to_rear) * bend;
            states.push([share, understeer, c.cg_to_rear * bend - trim.sideslip_rad]);
        }
    }
    if states.len() < 2 {
        return None;
    }
    let friction = most / load_mps2(c, speed);
    let place = |k: usize| {
        let share = k as f64 / SHARES as f64;
        // The last two states say what lies beyond them.
        let after = states
            .partition_point(|state| state[0] < share)
            .clamp(1, states.len() - 1);
        let (from, to) = (states[after - 1], states[after]);
        let part = (share - from[0]) / (to[0] - from[0]);
        let angle = |k: usize| from[k] + part * (to[k] - from[k]);
        [angle(1), angle(2), friction]
    };
    let half = place(SHARES / 2);
    let preview_s = preview_s(car, speed, 0.5 * most, [half[0] + half[1], half[1]]);
    let places = (0..=SHARES).flat_map(|k| {
        let [understeer, rear_slip, friction] = place(k);
        [understeer, rear_slip, friction, preview_s]
    });
    Some(places.collect())
}

/// Least and greatest time by which steering is ahead of a bend (s).
pub(super) const PREVIEW_S: (f64, f64) = (0.05, 0.5);

/// By how much steering has to be ahead of a bend (s): the lag of the arms, and that of the lateral acceleration behind the steering in
/// slow changes. That of a single-track car (M. Mitschke, H. Wallentowitz, *Dynamik der Kraftfahrzeuge*) whose axles slip by these
/// angles (rad, front and rear) at this speed (m/s) and lateral acceleration (m/s^2).
#[allow(clippy::disallowed_methods, reason = "no part of a kernel")]
fn preview_s(car: &Car, speed: f64, ay: f64, slips: [f64; 2]) -> f64 {
    let c = &car.chassis;
    let (mass, inertia, a, b) = (c.mass, c.inertia_yaw, c.cg_to_front, c.cg_to_rear);
    let [front, rear] =
        [(b, slips[0]), (a, slips[1])].map(|(arm, slip)| mass * ay * arm / (a + b) / slip.max(1e-4));
    let damping = (mass * (a * a * front + b * b * rear) + inertia * (front + rear)) / speed;
    let stiffness = front * rear * ((a + b) / speed).powi(2) + mass * (b * rear - a * front);
    let lag = if stiffness > 0.0 {
        damping / stiffness - b / speed
    } else {
        PREVIEW_S.1
    };
    (STEER_LAG_S + lag).clamp(PREVIEW_S.0, PREVIEW_S.1)
}

/// A speed in the map: the row below it, a whole number, and the share of the way to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct SpeedPlace<R> {
    row: R,
    share: R,
}

impl<R: Lookup> SpeedPlace<R> {
    /// Of a speed (m/s); rows end where the map does.
    #[inline(always)]
    pub fn of(speed: R) -> Self {
        let rows = (speed - R::lit(FIRST_MPS)) * R::lit(1.0 / STEP_MPS);
        let row = rows.whole(SPEEDS - 2);
        let share = (rows - row).max(R::lit(0.0)).min(R::lit(1.0));
        Self { row, share }
    }

    /// The friction, the lateral acceleration that the tyres give over the load over mass; and by how much steering is ahead (s).
    #[inline(always)]
    pub fn limits(&self, map: &CorneringMap<R::Storage>) -> [R; 2] {
        let number = self.row * R::lit((SHARES + 1) as f64);
        let (place, _) = number.place(map.figures.len() / CORNERING_WIDTH, CORNERING_WIDTH);
        let mut limits = [R::lit(0.0); 2];
        for (k, limit) in limits.iter_mut().enumerate() {
            let below = R::pick(&map.figures, place, 2 + k);
            *limit = below + self.share * (R::pick(&map.figures, place, ROW + 2 + k) - below);
        }
        limits
    }

    /// Steering beyond the geometry's and the slip angle of the rear axle (rad) at a share of the grip, which has the sign of the bend.
    #[inline(always)]
    pub fn angles(&self, map: &CorneringMap<R::Storage>, share: R) -> [R; 2] {
        let (zero, steps) = (R::lit(0.0), R::lit(SHARES as f64));
        let used = share.abs().min(R::lit(FURTHEST)) * steps;
        let column = used.whole(SHARES - 1);
        let part = used - column;
        let number = self.row * R::lit((SHARES + 1) as f64) + column;
        let (place, _) = number.place(map.figures.len() / CORNERING_WIDTH, CORNERING_WIDTH);
        let mut angles = [zero; 2];
        for (k, angle) in angles.iter_mut().enumerate() {
            let a = R::pick(&map.figures, place, k);
            let b = R::pick(&map.figures, place, CORNERING_WIDTH + k);
            let c = R::pick(&map.figures, place, ROW + k);
            let d = R::pick(&map.figures, place, ROW + CORNERING_WIDTH + k);
            let (below, above) = (a + part * (b - a), c + part * (d - c));
            let size = below + self.share * (above - below);
            *angle = R::select(share.less_than(zero), -size, size);
        }
        angles
    }
}
