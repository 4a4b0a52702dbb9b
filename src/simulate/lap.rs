//! A simulated log: the driver's inputs and the model's outputs.

use super::sensors::{SensorSettings, distort};
use crate::drive::{Drive, DriverSettings, drive};
use crate::error::{Error, Result};
use crate::evaluate::replay::{Norm, Plan, Sample, Traced, Window, initial_state, step_fractions, trace};
use crate::telemetry::{Calibration, Lap, Log};
use crate::track::Circuit;
use crate::vehicle::modes::{fastest_mode, stable_steps};
use crate::vehicle::wheels::{Moment, moments_of, moments_under};
use crate::vehicle::{Car, CarState};

/// How a lap is simulated and logged.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulateSettings {
    /// The driver.
    pub driver: DriverSettings,
    /// Sample rate of the log, Hz.
    pub rate_hz: f64,
    /// Runge-Kutta steps per sample interval with which the outputs are worked out; as many as the car needs if none.
    pub substeps: Option<usize>,
    /// Noise and delay of the outputs.
    pub sensors: SensorSettings,
    /// Seed of the noise.
    pub seed: u64,
}

impl Default for SimulateSettings {
    fn default() -> Self {
        Self {
            driver: DriverSettings::default(),
            rate_hz: 50.0,
            substeps: None,
            sensors: SensorSettings::default(),
            seed: 1,
        }
    }
}

/// A simulated log, and how it was worked out.
#[derive(Clone, Debug)]
pub struct Simulated {
    /// The log.
    pub log: Log,
    /// Runge-Kutta steps per sample interval of the outputs: a fit with the same takes them up exactly.
    pub substeps: usize,
    /// What each tyre did at each sample, as the log's outputs have it before the sensors.
    pub moments: Vec<Moment>,
}

impl SimulateSettings {
    /// Checks that a lap of the circuit can be driven and logged with these settings.
    ///
    /// # Errors
    /// [`Error::Input`] for a setting out of range or an open road.
    pub fn check(&self, circuit: &Circuit) -> Result<()> {
        if !(self.rate_hz >= 5.0 && self.rate_hz <= 1000.0) {
            let found = format!("{} Hz", self.rate_hz);
            return Err(Error::input("simulate", "rate_hz", found, "5 to 1000 Hz"));
        }
        if self.substeps == Some(0) {
            return Err(Error::input("simulate", "substeps", "0", "1 or more"));
        }
        if !circuit.closed {
            return Err(Error::input(
                &circuit.name,
                "track",
                "an open road",
                "a closed circuit: the lap driven is a flying one",
            ));
        }
        Ok(())
    }
}

/// Decimal places of the logged inputs: wheel speeds (rad/s) and steering (rad). The outputs are computed from the rounded
/// inputs, so that the log contains exactly the inputs of its outputs.
const INPUT_DECIMALS: [i32; 2] = [6, 8];

/// Greatest difference of yaw rate between the lap driven and its replay, as a share of the lap's greatest. Linear inputs
/// between samples cost 0.3 % at 50 Hz and 8 % at 5 Hz; a replay whose steps are too long is off by more than the whole.
const MOST_APART: f64 = 0.25;

fn rounded(x: f64, decimals: i32) -> f64 {
    let scale = 10f64.powi(decimals);
    (x * scale).round() / scale
}

/// Drives one flying lap and logs it.
///
/// The driver's closed loop runs at a fine step. The logged outputs are those of the model with the logged inputs, linear between
/// samples, from the start that an identification assumes. The true parameters therefore fit the log exactly if the fit takes the
/// same steps.
///
/// # Errors
/// [`Error::Input`] for a setting out of range, an open road, or steps that are too long for the car; [`Error::Study`] if the car
/// does not get round, or if its replay leaves the lap that was driven.
pub fn simulate_lap(car: &Car, circuit: &Circuit, settings: &SimulateSettings) -> Result<Simulated> {
    settings.check(circuit)?;
    let interval = 1.0 / settings.rate_hz;
    let lap = drive(car, circuit, &settings.driver, interval)?;
    let mut samples: Vec<Sample<f64>> = lap
        .inputs
        .iter()
        .zip(&lap.states)
        .map(|(input, state)| Sample {
            wheel_speed: input.wheel_speed.map(|w| rounded(w, INPUT_DECIMALS[0])),
            steer: rounded(input.steer, INPUT_DECIMALS[1]),
            flap: input.flap,
            measured: [
                rounded(state[0], INPUT_DECIMALS[0]),
                0.0,
                0.0,
                rounded(state[2], INPUT_DECIMALS[1]),
            ],
        })
        .collect();
    let window = Window {
        start: 0,
        end: samples.len(),
        scored_from: 0,
        initial: initial_state(&samples[0]),
    };
    let flat = car.to_flat();
    let slowest = lap
        .states
        .iter()
        .map(|s| s[0])
        .fold(f64::INFINITY, f64::min)
        .max(1.0);
    let needed = stable_steps(interval, fastest_mode(&flat, car.tyre_model(), slowest));
    let substeps = settings.substeps.unwrap_or(needed);
    if substeps < needed {
        return Err(Error::input(
            "simulate",
            "substeps",
            format!("{substeps} at {} Hz", settings.rate_hz),
            format!(
                "{needed} or more: the car's own motions at {slowest:.1} m/s are too fast for longer steps"
            ),
        ));
    }
    let (outputs, moments) = if lap.loads_mps2.is_empty() {
        replayed(car, (&lap, &samples), &window, substeps, settings)?
    } else {
        // A replay of the inputs knows no road. The log is that of the lap driven.
        let driven = lap.states.iter().map(|state| CarState::from_array(*state));
        let driven: Vec<_> = driven.zip(lap.inputs.iter().copied()).collect();
        let moments = moments_under(car, &driven, &lap.loads_mps2);
        let outputs = driven.iter().zip(&moments).map(|((state, _), moment)| {
            let body = &state.body;
            [body.vx, moment.ax_mps2, moment.ay_mps2, body.yaw_rate]
        });
        (outputs.collect(), moments)
    };
    for (sample, output) in samples.iter_mut().zip(outputs) {
        sample.measured = output;
    }
    distort(&mut samples, interval, &settings.sensors, settings.seed);

    let column = |k: usize| samples.iter().map(|s| s.measured[k]).collect();
    let mut road = String::new();
    if let (Some(relief), Some(facts)) = (&circuit.relief, circuit.relief_facts()) {
        if !relief.is_level() {
            road += " in three dimensions";
        }
        if !relief.is_dry() {
            let [least, most] = facts.friction;
            road += &format!(" with friction of {least:.2} to {most:.2}");
        }
    }
    let log = Log {
        source: format!("{} on {}{road}, simulated", car.name, circuit.name),
        dt_s: interval,
        time_s: (0..samples.len()).map(|i| i as f64 * interval).collect(),
        distance_m: lap.station_m,
        wheel_speed_radps: std::array::from_fn(|wheel| {
            samples.iter().map(|s| s.wheel_speed[wheel]).collect()
        }),
        steer_rad: samples.iter().map(|s| s.steer).collect(),
        drs: samples.iter().map(|s| s.flap).collect(),
        vx_mps: column(0),
        ax_mps2: column(1),
        ay_mps2: column(2),
        yaw_rate_radps: column(3),
        laps: vec![Lap {
            number: 1,
            start: 0,
            end: samples.len(),
            complete: true,
        }],
        calibration: Calibration::default(),
    };
    Ok(Simulated {
        log,
        substeps,
        moments,
    })
}

/// Outputs of a replay of the logged inputs, and what the tyres did in it.
fn replayed(
    car: &Car,
    (lap, samples): (&Drive, &[Sample<f64>]),
    window: &Window<f64>,
    substeps: usize,
    settings: &SimulateSettings,
) -> Result<(Vec<[f64; 4]>, Vec<Moment>)> {
    let flat = car.to_flat();
    let interval = 1.0 / settings.rate_hz;
    let plan = Plan {
        samples: samples.to_vec(),
        windows: vec![*window],
        step: interval / substeps as f64,
        fractions: step_fractions(substeps),
        norm: Norm::Two,
    };
    let Traced {
        outputs,
        states,
        drives,
    } = trace(&flat, car.tyre_model(), &plan, window);
    if !drives {
        return Err(Error::Study(format!(
            "the car, replayed open loop from its logged inputs at {} Hz in {substeps} steps per sample, is lost; try \
             more steps per sample, a higher rate or a lower pace than {}",
            settings.rate_hz, settings.driver.pace
        )));
    }
    let most = lap.states.iter().map(|s| s[2].abs()).fold(0.0, f64::max);
    let apart = outputs.iter().zip(&lap.states).map(|(o, s)| (o[3] - s[2]).abs());
    let apart = apart.fold(0.0, f64::max) / most;
    if apart > MOST_APART {
        return Err(Error::Study(format!(
            "the car, replayed open loop from its logged inputs at {} Hz in {substeps} steps per sample, leaves the lap that was \
             driven: its yaw rate is off by {:.0} % of the lap's greatest, where {:.0} % may be; try more steps per sample or a \
             higher rate",
            settings.rate_hz,
            100.0 * apart,
            100.0 * MOST_APART
        )));
    }
    let driven = states.iter().copied().zip(samples.iter().map(Sample::input));
    let moments = moments_of(car, &driven.collect::<Vec<_>>());
    Ok((outputs, moments))
}
