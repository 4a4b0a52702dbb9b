//! The parts of a lap's energy strategy.

use crate::config::kinds::named;
use crate::scalar::Real;
use serde::{Deserialize, Serialize};

/// How the power of the motor is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// It replaces power of the engine: the lap takes the same time and less fuel.
    Offset,
    /// It adds to the engine at full power: the lap takes less time.
    Additional,
}

named!(Mode {
    Offset = "offset",
    Additional = "additional",
});

/// Where the motor may work.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gates {
    /// Greatest steering angle at the wheels (rad).
    pub steer_rad: f64,
    /// Greatest speed (m/s).
    pub speed_mps: f64,
    /// Least acceleration (m/s^2), which must be exceeded.
    pub ax_mps2: f64,
    /// Least state of charge.
    pub soc: f64,
    /// Energy that may leave the store in a lap (MJ).
    pub energy_mj: f64,
    /// Torque and power of the MGU-K, as shares of the car's own.
    pub motor_share: f64,
}

impl Gates {
    /// Gates that are open wherever the car accelerates and the store is not empty.
    pub const OPEN: Self = Self {
        steer_rad: 2.0,
        speed_mps: 200.0,
        ax_mps2: 0.0,
        soc: 0.0,
        energy_mj: 1000.0,
        motor_share: 1.0,
    };

    /// Gates that leave all to the zones, but for the energy (MJ).
    pub fn of_zones(energy_mj: f64) -> Self {
        Self {
            ax_mps2: -1e3,
            soc: -1e6,
            energy_mj,
            ..Self::OPEN
        }
    }

    /// The kernels' figures: curvature (1/m), speed squared (m^2/s^2), acceleration (m/s^2), least change of the charge (J),
    /// energy (J) and share of the motor, for a wheelbase (m), a capacity (J) and a state of charge at the start.
    pub fn figures(&self, wheelbase_m: f64, capacity_j: f64, start_soc: f64) -> [f64; GATES] {
        [
            self.steer_rad / wheelbase_m,
            self.speed_mps * self.speed_mps,
            self.ax_mps2,
            (self.soc - start_soc) * capacity_j,
            1e6 * self.energy_mj,
            self.motor_share,
        ]
    }
}

/// Figures of [`Gates`] at the head of a strategy; shares of zones follow.
pub const GATES: usize = 6;

/// The zone of a segment. The motor works in the first part of each zone, whose share the strategy gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZoneRow<S> {
    /// Number of the zone.
    pub zone: u32,
    /// Share of the zone before the segment.
    pub position: S,
    /// One over the segment's share of the zone.
    pub per_share: S,
}

/// The zones of the segments, and where the lap begins.
#[derive(Clone, Debug, PartialEq)]
pub struct EnergyPlan<S> {
    /// One for each section.
    pub zones: Vec<ZoneRow<S>>,
    /// A slow section late in the lap, from which the speed at the start line is found.
    pub run_in: usize,
    /// How the power of the motor is used.
    pub mode: Mode,
    /// Whether the state of charge is among the gates.
    pub counts_charge: bool,
}

impl EnergyPlan<f64> {
    /// The whole lap as one zone, a share of which the strategy opens.
    pub fn whole(sections: usize, run_in: usize, mode: Mode) -> Self {
        let row = ZoneRow {
            zone: 0,
            position: 0.0,
            per_share: 1.0,
        };
        Self {
            zones: vec![row; sections],
            run_in,
            mode,
            counts_charge: true,
        }
    }

    /// Each segment as a zone of its own.
    pub fn single(sections: usize, run_in: usize, mode: Mode) -> Self {
        let mut plan = Self::whole(sections, run_in, mode);
        for (zone, row) in plan.zones.iter_mut().enumerate() {
            row.zone = zone as u32;
        }
        plan
    }

    /// Zones from each of `starts` (ascending sections) to the next, on segments of these lengths (m). Segments before the
    /// first start belong to the last zone, as its beginning or, on an open line, to the first.
    pub fn zoned(length_m: &[f64], starts: &[usize], closed: bool, run_in: usize, mode: Mode) -> Self {
        let n = length_m.len();
        let mut plan = Self::whole(n, run_in, mode);
        for (zone, &start) in starts.iter().enumerate() {
            let first = if zone == 0 && !closed { 0 } else { start };
            let count = match starts.get(zone + 1) {
                Some(next) => next - first,
                None if closed => n - start + starts[0],
                None => n - first,
            };
            let segments: Vec<usize> = (0..count).map(|i| (first + i) % n).collect();
            let total: f64 = segments.iter().map(|&i| length_m[i]).sum();
            let mut before = 0.0;
            for i in segments {
                // The last section of an open line has no segment.
                let share = (length_m[i] / total).max(1e-9);
                plan.zones[i] = ZoneRow {
                    zone: zone as u32,
                    position: before,
                    per_share: share.recip(),
                };
                before += share;
            }
        }
        plan
    }

    /// Sections of these lengths (m) where the zones of this plan, whose own sections are evenly spaced, begin.
    pub fn starts_along(&self, length_m: &[f64]) -> Vec<usize> {
        let n = self.zones.len();
        let total: f64 = length_m.iter().sum();
        let place = |i: usize| {
            let station = i as f64 / n as f64 * total;
            let mut along = 0.0;
            let reached = length_m.iter().position(|h| {
                along += h;
                along > station
            });
            reached.unwrap_or(0)
        };
        let first = |i: &usize| self.zones[*i].zone != self.zones[(i + n - 1) % n].zone;
        let mut starts: Vec<usize> = (0..n).filter(first).map(place).collect();
        starts.sort_unstable();
        starts.dedup();
        if starts.is_empty() { vec![0] } else { starts }
    }

    /// Number of zones.
    pub fn count(&self) -> usize {
        self.zones
            .iter()
            .map(|row| row.zone as usize + 1)
            .max()
            .unwrap_or(1)
    }

    /// The plan in the precision that the scalar `R` stores tables in.
    pub fn stored<R: Real>(&self) -> EnergyPlan<R::Storage> {
        EnergyPlan {
            zones: self
                .zones
                .iter()
                .map(|row| ZoneRow {
                    zone: row.zone,
                    position: R::store(row.position),
                    per_share: R::store(row.per_share),
                })
                .collect(),
            run_in: self.run_in,
            mode: self.mode,
            counts_charge: self.counts_charge,
        }
    }
}
