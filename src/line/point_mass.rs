//! The point mass of quasi-steady-state laps, and its envelope as tables that every backend looks up in the same way.

use super::loads::LoadTables;
use crate::error::{Error, Result};
use crate::scalar::Real;
use crate::vehicle::Envelope;
use crate::vehicle::envelope::root_left;

/// A point mass within a car's g-g-v envelope.
#[derive(Clone, Debug, PartialEq)]
pub struct PointMass {
    /// Its g-g-v envelope.
    pub envelope: Envelope,
    /// Exponent of the friction ellipse, 1 to 4: 2 is the ellipse itself.
    pub ellipse_exponent: f64,
    /// Wheelbase (m), by which a curvature asks for a steering angle.
    pub wheelbase_m: f64,
    /// Greatest steering angle at the wheels (rad), if steering is limited.
    ///
    /// A bend tighter than the lock allows cannot be driven. The line does not fail: the corner speed squared falls with the
    /// fourth power of the radius, so that a search is led back to lines that can be driven.
    pub max_steer_rad: Option<f64>,
    /// Greatest steering rate at the wheels (rad/s), if it is limited: the speed falls where the curvature would change faster than
    /// this over the wheelbase.
    pub max_steer_rate_radps: Option<f64>,
    /// Mass that the engine accelerates over that of the car; what rotates is not lifted on a climb.
    pub rotating_mass_factor: f64,
    /// Whether its tables have limits under loads, for laps on roads in three dimensions.
    pub relief: bool,
}

/// The envelope of a [`PointMass`] over even steps of the speed squared, the variable of its equation of motion.
///
/// Each row of a table has the figures at its start, then their rises to its end.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvelopeTable<S> {
    /// Greatest speed squared (m^2/s^2).
    pub top: S,
    /// Rows of [`EnvelopeTable::rows`] per speed squared (s^2/m^2).
    pub rows_per_speed_squared: S,
    /// Lateral, grip, drive, drag (m/s^2), then their rises.
    pub rows: Vec<S>,
    /// Rows of [`EnvelopeTable::corners`] per radius (1/m).
    pub rows_per_radius: S,
    /// Corner speed squared (m^2/s^2) over the radius, then its rise.
    pub corners: Vec<S>,
    /// The share of the longitudinal grip that is left over `sqrt(1 - (lateral share)^2)`, then its rise. Empty where the
    /// ellipse has exponent 2 and that root is the share itself.
    pub ellipse: Vec<S>,
    /// The share of the longitudinal grip that is left for driving, in cells over [`TRACTION_SPEEDS`] even steps of the speed squared
    /// and [`TRACTION_ROOTS`] of the same root: the figure at a cell's start, its rise over the speed squared, its rise over the
    /// root, and what that rise gains over the speed squared. Behind them in each cell the same of what the tyres take from the
    /// drive (m/s^2). Empty where the envelope says nothing of it and driving has what braking has.
    pub traction: Vec<S>,
    /// The table of the same car with its DRS open, over the same speeds, if it has one. Its corners are not used: a driver shuts
    /// the flap where it costs speed.
    pub open: Option<Box<Self>>,
    /// Limits under loads; empty for level roads.
    pub loads: LoadTables<S>,
    /// Square of the greatest rate at which the curvature may change in time (1/(m^2 s^2)), if that is limited.
    pub curvature_rate_squared: Option<S>,
}

/// Cells of [`EnvelopeTable::traction`] over the speed squared. The share changes with downforce alone.
pub const TRACTION_SPEEDS: usize = 32;
/// Cells over the root of what the lateral share leaves.
pub const TRACTION_ROOTS: usize = 32;
/// Figures of a cell.
pub const TRACTION_WIDTH: usize = 8;

/// Figures of a row of [`EnvelopeTable::rows`].
pub const ENVELOPE_WIDTH: usize = 8;
/// Rows over speed squared. At 70 m/s a step is 9.6 m^2/s^2: 0.2 m/s at 25 m/s.
const ENVELOPE_ROWS: usize = 512;
/// Rows over radius. Corner speed squared bends so little over it that a step of the usual 0.3 m costs 1e-6 of it.
const CORNER_ROWS: usize = 1024;
/// Rows over the lateral share.
const ELLIPSE_ROWS: usize = 256;

impl PointMass {
    /// A point mass within `envelope`, on an ellipse of exponent 2, with a wheelbase (m) and no limit of steering.
    pub fn new(envelope: Envelope, wheelbase_m: f64) -> Self {
        Self {
            envelope,
            ellipse_exponent: 2.0,
            wheelbase_m,
            max_steer_rad: None,
            max_steer_rate_radps: None,
            rotating_mass_factor: 1.0,
            relief: false,
        }
    }

    /// # Errors
    /// [`Error::Input`] naming the first setting that is out of range.
    pub fn check(&self) -> Result<()> {
        let within = |name: &str, x: f64, least: f64, most: f64| {
            if x >= least && x <= most {
                return Ok(());
            }
            Err(Error::input(
                self.envelope.name(),
                name,
                x.to_string(),
                format!("{least} to {most}"),
            ))
        };
        within("ellipse_exponent", self.ellipse_exponent, 1.0, 4.0)?;
        within("wheelbase_m", self.wheelbase_m, 0.1, 20.0)?;
        within("rotating_mass_factor", self.rotating_mass_factor, 1.0, 3.0)?;
        self.max_steer_rate_radps
            .map_or(Ok(()), |x| within("max_steer_rate_radps", x, 1e-3, 1e3))?;
        self.max_steer_rad
            .map_or(Ok(()), |x| within("max_steer_rad", x, 0.01, 1.5))
    }

    /// Greatest rate at which the path's curvature may change in time (1/(m s)), if that is limited.
    pub fn curvature_rate(&self) -> Option<f64> {
        self.max_steer_rate_radps.map(|rate| rate / self.wheelbase_m)
    }

    /// The share of the tyres' grip that accelerations along and across the car (m/s^2) take at a speed (m/s): 1 on the ellipse. Drag is
    /// no force of the tyres.
    pub fn grip_used(&self, v_mps: f64, [ax_mps2, ay_mps2]: [f64; 2]) -> f64 {
        let limits = self.envelope.at(v_mps);
        let along = (ax_mps2 + limits.drag_mps2).abs() / limits.ax_grip_mps2;
        let across = ay_mps2.abs() / limits.ay_mps2;
        let p = self.ellipse_exponent;
        (along.powf(p) + across.powf(p)).powf(1.0 / p)
    }

    /// The tables of its envelope.
    ///
    /// # Errors
    /// As [`PointMass::check`].
    pub fn table(&self) -> Result<EnvelopeTable<f64>> {
        let mut table = self.table_up_to(self.envelope.top_speed_mps())?;
        if self.relief {
            table.loads = self.load_tables(&table)?;
        }
        Ok(table)
    }

    /// The tables up to a speed (m/s), without those under loads.
    ///
    /// # Errors
    /// As [`PointMass::check`].
    pub(super) fn table_up_to(&self, top_mps: f64) -> Result<EnvelopeTable<f64>> {
        self.check()?;
        let top = top_mps.powi(2);
        let at_knot = |knot: usize| {
            let row = self
                .envelope
                .at((top * knot as f64 / ENVELOPE_ROWS as f64).sqrt());
            [row.ay_mps2, row.ax_grip_mps2, row.ax_drive_mps2, row.drag_mps2]
        };
        let mut knots: Vec<[f64; 4]> = (0..=ENVELOPE_ROWS).map(at_knot).collect();
        // Speed is limited to the greatest one, so the drive need not fall to zero within a row.
        let last = self.envelope.rows()[self.envelope.rows().len() - 1];
        knots[ENVELOPE_ROWS][2] = last.ax_drive_mps2;
        let (radius_top, corner_knots) = self.corners(top, &knots);
        Ok(EnvelopeTable {
            top,
            rows_per_speed_squared: ENVELOPE_ROWS as f64 / top,
            rows: with_rises(&knots),
            rows_per_radius: CORNER_ROWS as f64 / radius_top,
            corners: with_rises(&corner_knots),
            ellipse: if self.ellipse_exponent == 2.0 {
                Vec::new()
            } else {
                with_rises(&self.ellipse_knots())
            },
            traction: self.traction_cells(top),
            open: match self.envelope.open() {
                Some(open) => Some(Box::new(self.within(open.clone()).table()?)),
                None => None,
            },
            loads: LoadTables::default(),
            curvature_rate_squared: self.curvature_rate().map(|rate| rate * rate),
        })
    }

    /// The same point mass within another envelope.
    pub(super) fn within(&self, envelope: Envelope) -> Self {
        Self {
            envelope,
            ..self.clone()
        }
    }

    /// The cells of traction in bends. Tyres that drive never have more than the ellipse.
    fn traction_cells(&self, top: f64) -> Vec<f64> {
        let knot = |speed: usize, root: usize| {
            let v = (top * speed as f64 / TRACTION_SPEEDS as f64).sqrt();
            let root = root as f64 / TRACTION_ROOTS as f64;
            // The share whose root it is has that root in turn.
            let share = root_left(root);
            let most = self.envelope.traction_at(v, share)? / self.envelope.at(v).ax_grip_mps2;
            Some([
                most.min(self.left_for_braking(root)),
                self.envelope.lost_at(v, share),
            ])
        };
        let cell = |(speed, root): (usize, usize)| {
            let start = knot(speed, root)?;
            let (faster, straighter) = (knot(speed + 1, root)?, knot(speed, root + 1)?);
            let both = knot(speed + 1, root + 1)?;
            let of = |i: usize| {
                let across = straighter[i] - start[i];
                [
                    start[i],
                    faster[i] - start[i],
                    across,
                    both[i] - faster[i] - across,
                ]
            };
            Some([of(0), of(1)])
        };
        let cells = (0..TRACTION_SPEEDS).flat_map(|speed| (0..TRACTION_ROOTS).map(move |root| (speed, root)));
        cells.filter_map(cell).flatten().flatten().collect()
    }

    /// The radius from which on no speed is too great, and the corner speed squared at even steps up to it: the least
    /// `w` at which `w / radius` exceeds the lateral limit, which itself rises with downforce.
    fn corners(&self, top: f64, knots: &[[f64; 4]]) -> (f64, Vec<[f64; 1]>) {
        let step = top / ENVELOPE_ROWS as f64;
        let lateral = |knot: usize| knots[knot][0];
        let radius_top = (0..=ENVELOPE_ROWS)
            .map(|k| k as f64 * step / lateral(k))
            .fold(0.0, f64::max);
        let lock_radius = self.max_steer_rad.map_or(0.0, |lock| self.wheelbase_m / lock);
        let mut row = 0;
        let corners = (0..=CORNER_ROWS).map(|i| {
            let radius = radius_top * i as f64 / CORNER_ROWS as f64;
            // The first row at whose end the limit is passed; it moves up as the radius grows.
            while row < ENVELOPE_ROWS && (row + 1) as f64 * step <= lateral(row + 1) * radius {
                row += 1;
            }
            let corner = if row == ENVELOPE_ROWS {
                top
            } else {
                let start = row as f64 * step;
                let slope = (lateral(row + 1) - lateral(row)) / step;
                ((lateral(row) - slope * start) * radius / (1.0 - slope * radius)).clamp(start, start + step)
            };
            let beyond_lock = if radius < lock_radius {
                radius / lock_radius
            } else {
                1.0
            };
            [corner * beyond_lock.powi(4)]
        });
        (radius_top, corners.collect())
    }

    /// The share of the longitudinal grip that the ellipse leaves at a root of what the lateral share leaves.
    fn left_for_braking(&self, root: f64) -> f64 {
        let p = self.ellipse_exponent;
        if p == 2.0 {
            return root;
        }
        let lateral_squared = 1.0 - root * root;
        (1.0 - lateral_squared.powf(p / 2.0)).powf(1.0 / p)
    }

    fn ellipse_knots(&self) -> Vec<[f64; 1]> {
        let roots = (0..=ELLIPSE_ROWS).map(|i| i as f64 / ELLIPSE_ROWS as f64);
        roots.map(|root| [self.left_for_braking(root)]).collect()
    }
}

/// Rows of the figures at each knot but the last and their rises to the next.
fn with_rises<const N: usize>(knots: &[[f64; N]]) -> Vec<f64> {
    knots
        .windows(2)
        .flat_map(|pair| {
            let rises = std::array::from_fn::<f64, N, _>(|i| pair[1][i] - pair[0][i]);
            pair[0].into_iter().chain(rises)
        })
        .collect()
}

impl EnvelopeTable<f64> {
    /// The tables in the precision that the scalar `R` stores tables in.
    pub fn stored<R: Real>(&self) -> EnvelopeTable<R::Storage> {
        let all = |table: &[f64]| table.iter().map(|x| R::store(*x)).collect();
        EnvelopeTable {
            top: R::store(self.top),
            rows_per_speed_squared: R::store(self.rows_per_speed_squared),
            rows: all(&self.rows),
            rows_per_radius: R::store(self.rows_per_radius),
            corners: all(&self.corners),
            ellipse: all(&self.ellipse),
            traction: all(&self.traction),
            open: self.open.as_ref().map(|open| Box::new(open.stored::<R>())),
            loads: self.loads.stored::<R>(),
            curvature_rate_squared: self.curvature_rate_squared.map(R::store),
        }
    }
}
