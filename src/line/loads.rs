//! Limits of a point mass under loads other than its weight, as roads in three dimensions ask for them.

use super::point_mass::{ENVELOPE_WIDTH, EnvelopeTable, PointMass};
use crate::error::Result;
use crate::scalar::Real;
use crate::vehicle::powertrain::GRAVITY_MPS2;

/// The load beyond which limits no longer rise, as a share of the weight: compressions of two and a half times the weight are rare,
/// and tyres gain ever less.
pub(crate) const MOST_LOAD: f64 = 2.5;

/// Tables of limits under several loads, in even steps. Between two of them, and a little beyond the outer ones, limits are linear in
/// the load. Empty for level roads.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadTables<S> {
    /// How many there are.
    pub tables: usize,
    /// Load over mass of the first (m/s^2).
    pub first: S,
    /// Tables per load over mass (s^2/m).
    pub per_load: S,
    /// The least and the greatest load that is told from others, in tables from the first.
    pub least: S,
    /// See above.
    pub most: S,
    /// Radius on the steering lock (m); tiny where steering is not limited.
    pub lock_radius: S,
    /// The share of the mass that is accelerated which rotates.
    pub coasting: S,
    /// Table after table, rows like [`EnvelopeTable::rows`].
    pub rows: Vec<S>,
    /// Table after table, cells like [`EnvelopeTable::traction`].
    pub traction: Vec<S>,
}

impl LoadTables<f64> {
    /// The tables in the precision that the scalar `R` stores tables in.
    pub fn stored<R: Real>(&self) -> LoadTables<R::Storage> {
        let all = |table: &[f64]| table.iter().map(|x| R::store(*x)).collect();
        LoadTables {
            tables: self.tables,
            first: R::store(self.first),
            per_load: R::store(self.per_load),
            least: R::store(self.least),
            most: R::store(self.most),
            lock_radius: R::store(self.lock_radius),
            coasting: R::store(self.coasting),
            rows: all(&self.rows),
            traction: all(&self.traction),
        }
    }
}

impl PointMass {
    /// The share of the tyres' grip that specific forces of the road (m/s^2) take at a speed (m/s): along the car, across it and square
    /// to the surface; the last figure is the friction. 1 is the ellipse under that load and on that surface.
    pub fn grip_used_under(
        &self,
        v_mps: f64,
        [along_mps2, across_mps2, load_mps2, friction]: [f64; 4],
    ) -> f64 {
        let share = (load_mps2 / GRAVITY_MPS2).clamp(0.0, MOST_LOAD);
        let swept = self.envelope.loads();
        let (drag, grip, lateral) = if swept.len() < 2 {
            let limits = self.envelope.at(v_mps);
            (
                limits.drag_mps2,
                share * limits.ax_grip_mps2,
                share * limits.ay_mps2,
            )
        } else {
            let after = swept
                .partition_point(|(of, _)| *of <= share)
                .clamp(1, swept.len() - 1);
            let [(low, below), (high, above)] = [&swept[after - 1], &swept[after]];
            let (below, above) = (below.at(v_mps), above.at(v_mps));
            let between = |a: f64, b: f64| a + (share - low) / (high - low) * (b - a);
            (
                between(below.drag_mps2, above.drag_mps2),
                between(below.ax_grip_mps2, above.ax_grip_mps2),
                between(below.ay_mps2, above.ay_mps2),
            )
        };
        let along = (along_mps2 + drag).abs() / (friction * grip);
        let across = across_mps2.abs() / (friction * lateral);
        let p = self.ellipse_exponent;
        (along.powf(p) + across.powf(p)).powf(1.0 / p)
    }

    /// The tables of limits under loads. A car whose limits were not swept under any has those of its weight, times the load over the
    /// weight: two tables, of none and of its weight.
    ///
    /// # Errors
    /// As [`PointMass::check`].
    pub(super) fn load_tables(&self, level: &EnvelopeTable<f64>) -> Result<LoadTables<f64>> {
        let lock_radius = self.max_steer_rad.map_or(1e-9, |lock| self.wheelbase_m / lock);
        let swept = self.envelope.loads();
        let (first, step, rows, traction) = if let [(first, _), (second, _), ..] = swept {
            let tables = swept.iter().map(|(_, envelope)| {
                let level = Self {
                    relief: false,
                    ..self.within(envelope.clone())
                };
                level.table_up_to(self.envelope.top_speed_mps())
            });
            let tables = tables.collect::<Result<Vec<_>>>()?;
            let rows = tables.iter().flat_map(|table| table.rows.clone()).collect();
            let traction = tables.iter().flat_map(|table| table.traction.clone()).collect();
            (*first, second - first, rows, traction)
        } else {
            let weightless = level.rows.iter().enumerate().map(|(i, figure)| {
                // The grip of tyres goes with the load; the engine and drag do not.
                let of_tyres = i % (ENVELOPE_WIDTH / 2) < 2;
                if of_tyres { 0.0 } else { *figure }
            });
            let rows = weightless.chain(level.rows.iter().copied()).collect();
            (
                0.0,
                1.0,
                rows,
                [level.traction.as_slice(), &level.traction].concat(),
            )
        };
        Ok(LoadTables {
            tables: swept.len().max(2),
            first: first * GRAVITY_MPS2,
            per_load: 1.0 / (step * GRAVITY_MPS2),
            least: -first / step,
            most: (MOST_LOAD - first) / step,
            lock_radius,
            coasting: 1.0 - 1.0 / self.rotating_mass_factor,
            rows,
            traction,
        })
    }
}
