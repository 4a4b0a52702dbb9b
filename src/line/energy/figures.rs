//! Figures of a lap with energy, and of its segments.

/// Figures of a lap.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergyLap<R> {
    /// Time (s).
    pub time: R,
    /// Fuel (kg).
    pub fuel: R,
    /// Energy out of the store (J).
    pub deployed: R,
    /// Energy of the MGU-K into the store (J).
    pub harvested_k: R,
    /// Energy of the MGU-H into the store (J).
    pub harvested_h: R,
    /// Change of the charge over the lap (J), summed by itself.
    pub change: R,
    /// Greatest charge less least charge along the lap (J).
    pub swing: R,
    /// Time with the motor on (s).
    pub motor_time: R,
}

/// Figures of [`EnergyLap`].
pub const FIGURES: usize = 8;

impl<R: Copy> EnergyLap<R> {
    /// The figures in their order.
    pub fn to_array(self) -> [R; FIGURES] {
        [
            self.time,
            self.fuel,
            self.deployed,
            self.harvested_k,
            self.harvested_h,
            self.change,
            self.swing,
            self.motor_time,
        ]
    }

    /// From the figures in their order.
    pub fn from_array(
        [
            time,
            fuel,
            deployed,
            harvested_k,
            harvested_h,
            change,
            swing,
            motor_time,
        ]: [R; FIGURES],
    ) -> Self {
        Self {
            time,
            fuel,
            deployed,
            harvested_k,
            harvested_h,
            change,
            swing,
            motor_time,
        }
    }
}

/// One segment of a lap.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SegmentEnergy<R> {
    /// Speed squared at its start (m^2/s^2).
    pub start: R,
    /// Speed squared at its end (m^2/s^2).
    pub end: R,
    /// Time (s).
    pub time: R,
    /// Force over mass at the wheels by the engine (m/s^2),
    pub engine: R,
    /// by the motor, with what the MGU-H adds as one,
    pub motor: R,
    /// which is this,
    pub assist: R,
    /// by the generator,
    pub generator: R,
    /// and by the hydraulic brakes.
    pub hydraulic: R,
    /// What the tyres take of these by slip and by their drag in bends (m/s^2), where a point mass knows it.
    pub lost: R,
    /// Share of the engine's greatest power.
    pub load: R,
    /// Fuel (kg).
    pub fuel: R,
    /// Energy out of the store (J).
    pub deployed: R,
    /// Energy of the MGU-K into the store (J).
    pub harvested_k: R,
    /// Energy of the MGU-H into the store (J).
    pub harvested_h: R,
}
