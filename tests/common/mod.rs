//! What tests and benchmarks share: a harness, problems, runs of the program, and a small random generator.

#![allow(dead_code)] // Each of the crates that include this module uses a part of it.

#[macro_use]
pub mod harness;
pub mod kernels;
pub mod kinds;
pub mod line;
pub mod radv;
pub mod runs;
pub mod studies;

use lapswarm::evaluate::replay::ReplayProblem;
use lapswarm::parity::synthetic_lap;
use lapswarm::parity::synthetic_lap::Lap;
use lapswarm::vehicle::{Car, LinearTyre, Tyres};

/// The 22 unknowns of the identification.
pub const UNKNOWNS: [&str; 22] = [
    "rBx1", "rBx2", "rCx1", "rEx1", "rEx2", "rHx1", "rBy1", "rBy2", "rBy3", "rCy1", "rEy1", "rEy2", "rHy1",
    "rHy2", "rVy1", "rVy2", "rVy3", "rVy4", "rVy5", "rVy6", "K", "C",
];

/// A small generator (SplitMix64) whose numbers are the same everywhere.
pub struct Random(pub u64);

impl Random {
    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number from `low` to `high`.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// The bundled car.
pub fn bundled_car() -> Car {
    Car::bundled().expect("the bundled car parses")
}

/// The bundled car on linear tyres.
pub fn linear_car() -> Car {
    let tyre = |cornering_stiffness| LinearTyre {
        nominal_load: 3000.0,
        slip_stiffness: 60_000.0,
        cornering_stiffness,
        trail: 0.03,
    };
    Car {
        tyres: Tyres::Linear {
            front: tyre(52_000.0),
            rear: tyre(60_000.0),
        },
        ..bundled_car()
    }
}

/// The problem of finding `free` (all between 0.2 and 1.8 times their value in `car`) from a lap that `car` drove.
pub fn problem(car: Car, free: &[&str], lap: Lap) -> ReplayProblem {
    synthetic_lap::problem(car, free, lap).expect("a sound problem")
}
