//! What the parity tests and the benchmark share: a made-up lap, problems on it, and a small random generator.

#![allow(dead_code)] // Each of the crates that include this module uses a part of it.

pub mod line;

use lapswarm::evaluate::Objective;
use lapswarm::evaluate::replay::{
    CHANNEL_NAMES, CHANNEL_UNITS, ChannelWeights, Norm, ReplayProblem, Sample, Window, trace,
};
use lapswarm::vehicle::{Car, CarParameter, LinearTyre, Tyres};

/// The 22 unknowns of the identification (`physics.md` section 3).
pub const UNKNOWNS: [&str; 22] = [
    "rBx1", "rBx2", "rCx1", "rEx1", "rEx2", "rHx1", "rBy1", "rBy2", "rBy3", "rCy1", "rEy1", "rEy2", "rHy1",
    "rHy2", "rVy1", "rVy2", "rVy3", "rVy4", "rVy5", "rVy6", "K", "C",
];

/// Sample interval of the made-up lap, s.
pub const INTERVAL_S: f64 = 0.01;

/// Greatest sensor noise in the made-up log, channel by channel (m/s, m/s^2, m/s^2, rad/s): a good logger's.
pub const NOISE: [f64; 4] = [0.05, 0.3, 0.3, 0.01];

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

/// Inputs of a made-up lap: speeds of 28 to 62 m/s and corners that ask for `grip` (m/s^2) at most. The wheels
/// roll at the speed of their place on a car that follows its steering, so slip follows from what the car does.
pub fn inputs(car: &Car, count: usize, grip: f64) -> Vec<Sample<f64>> {
    let c = &car.chassis;
    let wheelbase = c.cg_to_front + c.cg_to_rear;
    (0..count)
        .map(|i| {
            let t = i as f64 * INTERVAL_S;
            let turns = |period: f64| (t * std::f64::consts::TAU / period).sin();
            let speed = 45.0 + 12.0 * turns(23.0) + 5.0 * turns(7.3);
            // Rises from a straight start; the mix of periods never repeats within a lap.
            let ay = grip * (t / 3.0).min(1.0) * (0.65 * turns(11.0) + 0.35 * turns(4.7));
            let yaw_rate = ay / speed;
            let rim = |side: f64, radius: f64| (speed - yaw_rate * side) / radius;
            Sample {
                wheel_speed: [
                    rim(c.half_track_front, c.radius_front),
                    rim(-c.half_track_front, c.radius_front),
                    rim(c.half_track_rear, c.radius_rear),
                    rim(-c.half_track_rear, c.radius_rear),
                ],
                steer: wheelbase * ay / (speed * speed) + 0.0015 * ay,
                measured: [0.0; 4],
            }
        })
        .collect()
}

/// How a test cuts the lap.
#[derive(Clone, Copy, Debug)]
pub struct Lap {
    pub samples: usize,
    pub windows: usize,
    pub substeps: usize,
    pub norm: Norm,
    /// The greatest lateral acceleration that the lap asks for, m/s^2.
    pub grip: f64,
}

impl Default for Lap {
    fn default() -> Self {
        Self {
            samples: 6_000,
            windows: 1,
            substeps: 1,
            norm: Norm::Two,
            grip: 9.0,
        }
    }
}

/// The problem of finding `free` (all between 0.2 and 1.8 times their value in `car`) from a lap that `car` drove.
pub fn problem(car: Car, free: &[&str], lap: Lap) -> ReplayProblem {
    let parameters: Vec<CarParameter> = free
        .iter()
        .map(|name| {
            car.parameter(name)
                .unwrap_or_else(|| panic!("a parameter {name}"))
        })
        .collect();
    let flat = car.to_flat();
    let bounds = |p: &CarParameter| {
        let value = flat[p.slots[0]];
        let reach = 0.8 * value.abs().max(1e-3);
        (value - reach, value + reach)
    };
    let free: Vec<_> = parameters
        .iter()
        .map(|p| (p.clone(), bounds(p).0, bounds(p).1))
        .collect();
    let mut samples = inputs(&car, lap.samples, lap.grip);
    let initial = [
        samples[0].wheel_speed[0] * car.chassis.radius_front,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
    ];
    let whole = Window {
        start: 0,
        end: lap.samples,
        scored_from: 0,
        initial,
    };
    let objectives: Vec<_> = (0..4)
        .map(|k| ChannelWeights {
            objective: Objective {
                name: CHANNEL_NAMES[k].to_owned(),
                unit: CHANNEL_UNITS[k].to_owned(),
            },
            weights: std::array::from_fn(|j| f64::from(u8::from(j == k))),
        })
        .collect();
    let build = |samples: Vec<Sample<f64>>, windows| {
        ReplayProblem::new(
            car.clone(),
            free.clone(),
            samples,
            windows,
            (INTERVAL_S, lap.substeps),
            lap.norm,
            objectives.clone(),
        )
        .expect("a sound problem")
    };
    let reference = build(samples.clone(), vec![whole]);
    let (outputs, drives) = trace(&flat, car.tyre_model(), &reference.plan, &whole);
    assert!(drives, "the reference car must drive the made-up lap to its end");
    let mut random = Random(1);
    for (sample, output) in samples.iter_mut().zip(&outputs) {
        sample.measured = std::array::from_fn(|k| output[k] + random.within(-NOISE[k], NOISE[k]));
    }
    // Windows start from the logged speed and yaw rate; their first tenth settles what is not logged.
    let length = lap.samples / lap.windows;
    let windows = (0..lap.windows)
        .map(|w| {
            let start = w * length;
            let end = if w + 1 == lap.windows {
                lap.samples
            } else {
                start + length
            };
            Window {
                start,
                end,
                scored_from: if w == 0 { 0 } else { length / 10 },
                initial: [
                    outputs[start][0],
                    0.0,
                    outputs[start][3],
                    0.0,
                    0.0,
                    outputs[start][1],
                ],
            }
        })
        .collect();
    build(samples, windows)
}

/// `count` candidates about the problem's own car, each variable off by at most `share` of itself.
pub fn candidates(problem: &ReplayProblem, count: usize, share: f64, random: &mut Random) -> Vec<f64> {
    let centre: Vec<f64> = problem
        .problem
        .variables
        .iter()
        .map(|v| (v.lower + v.upper) / 2.0)
        .collect();
    (0..count)
        .flat_map(|_| {
            centre
                .iter()
                .map(|x| x + x.abs().max(1e-3) * random.within(-share, share))
                .collect::<Vec<_>>()
        })
        .collect()
}
