//! From a log to a problem: samples, windows, step size, scales of the channels.

use super::choose::{Choice, choose};
use super::settings::{FreeParameter, IdentifySettings, ObjectiveChoice};
use super::stand_in::StandIn;
use crate::error::{Error, Result};
use crate::evaluate::Objective;
use crate::evaluate::replay::{
    CHANNEL_NAMES, CHANNEL_UNITS, ChannelWeights, Norm, Plan as ReplayPlan, ReplayProblem, Sample, Window,
    initial_state, step_fractions, trace,
};
use crate::study::framework::{Plan, Subject};
use crate::telemetry::{Axle, ChannelMap, Log, LogOptions, NativeFormat, Recording};
use crate::track::{Circuit, Track};
use crate::vehicle::Car;
use crate::vehicle::modes::{fastest_mode, slowest_decay, stable_steps};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// Number of compared channels.
pub(super) const CHANNELS: usize = CHANNEL_NAMES.len();

const BUNDLED_LAP: &str = include_str!("../../../data/laps/gt_silverstone.csv");
/// The circuit that the bundled lap was driven on.
const BUNDLED_TRACK: &str = "silverstone_gp";

/// Everything an identification works with.
pub struct Setup {
    /// The log, calibrated and on one clock.
    pub log: Log,
    /// The problem over the laps to fit.
    pub replay: ReplayProblem,
    /// The same problem over the laps held out, if any.
    pub holdout: Option<ReplayProblem>,
    /// The true value of each free parameter, where the truth is known.
    pub truth: Option<Vec<f64>>,
    /// The circuit, where one is named.
    pub circuit: Option<Circuit>,
    /// Standard deviation of each channel over the scored samples, which its errors are set against.
    pub scales: [f64; CHANNELS],
    /// Time that each window is driven before it is scored, s.
    pub settle_s: f64,
    /// Laps and sections whose first moments are not scored, because the log has nothing to drive ahead of them.
    pub without_run_up: usize,
    /// Length of the windows (s) where none was set and the starting car does not drive the laps to their end.
    pub windows_instead_s: Option<f64>,
    /// Windows of the laps to fit that are left out, since the car that the choice came to is lost in them.
    pub windows_left_out: usize,
    /// How the free parameters were chosen, where the log chose them.
    pub choice: Option<Choice>,
}

/// Time constants of its slowest motion in which a car forgets where it started. A thousandth is left after seven. In corners, near
/// the limit of its tyres, a car settles about half as fast as straight ahead, where its motions are worked out.
const TIME_CONSTANTS: f64 = 14.0;
/// Windows where none are set: those on which free parameters are chosen, and those of laps that the starting car does not drive, s.
const WINDOW_S: f64 = 5.0;
/// Windows where the starting car does not drive those to their end either, and how long a car may settle ahead of them, s: the further
/// a car is from the one that drove, and the nearer that was to its limits, the sooner it goes elsewhere.
const SHORT_S: [f64; 2] = [2.0, 1.0];
/// The least and the most that a car is given to settle, s.
const SETTLE_S: [f64; 2] = [0.5, 10.0];

/// How long the starting car takes to settle on these laps, at most half of the shortest.
fn settling_time(car: &Car, samples: &[Sample<f64>], laps: &[(usize, usize)], dt_s: f64) -> f64 {
    let within = laps.iter().flat_map(|(start, end)| &samples[*start..*end]);
    let fastest = within.map(|s| s.measured[0]).fold(1.0, f64::max);
    let decay = slowest_decay(&car.to_flat(), car.tyre_model(), fastest);
    let needed = if decay > 0.0 {
        TIME_CONSTANTS / decay
    } else {
        f64::INFINITY
    };
    let shortest = laps.iter().map(|(start, end)| end - start).min().unwrap_or(0);
    needed
        .clamp(SETTLE_S[0], SETTLE_S[1])
        .min(0.5 * shortest as f64 * dt_s)
}

/// Reads what the settings name and puts the problem together.
///
/// # Errors
/// [`Error::Input`] naming file and field for anything that does not fit.
pub fn set_up(settings: &IdentifySettings) -> Result<Setup> {
    set_up_until(settings, &AtomicBool::new(false))
}

/// The same; once `stop` is raised, the choice of what to find ends with what it has.
///
/// # Errors
/// Those of [`set_up`].
pub(in crate::study) fn set_up_until(settings: &IdentifySettings, stop: &AtomicBool) -> Result<Setup> {
    let car = settings.model.of(Car::load(&settings.car)?);
    let mut freed = settings.freed(&car)?;
    let bundled = settings.log.is_none();
    let map = match &settings.channel_map {
        Some(path) => ChannelMap::read(path)?,
        None => ChannelMap::default(),
    };
    let options = LogOptions {
        rate_hz: settings.rate_hz,
        radius_is_free: ["front_rolling_radius_m", "rear_rolling_radius_m"]
            .map(|radius| freed.iter().any(|free| free.name == radius)),
        calibration: settings.calibration.clone(),
        ..LogOptions::of(&car)
    };
    let log = match &settings.log {
        Some(path) => Log::read(path, &map, &options)?,
        None => {
            let name = Path::new("the bundled lap gt_silverstone.csv");
            Log::from_recording(&Recording::parse(BUNDLED_LAP.as_bytes(), name)?, &map, &options)?
        }
    };
    let track = settings.track.as_deref().or(bundled.then_some(BUNDLED_TRACK));
    let circuit = track.map(|name| Track::load(name)?.circuit()).transpose()?;
    let truth_car = settings.truth.as_deref().or(bundled.then_some("gt"));
    let truth_car = truth_car.map(Car::load).transpose()?;

    let samples = samples_of(&log, &car, map.speed_axle);
    let (fitted, held) = choose_laps(settings, &log)?;
    let settle_s = settings
        .settle_s
        .unwrap_or_else(|| settling_time(&car, &samples, &fitted, log.dt_s));
    let windowed = |(window_s, settle_s): (Option<f64>, f64), laps: &[(usize, usize)]| {
        let settings = IdentifySettings {
            window_s,
            ..settings.clone()
        };
        windows_over(&settings, settle_s, &log, &samples, laps, circuit.as_ref())
    };
    let driven = |cut: (Option<f64>, f64)| {
        windowed(cut, &fitted)
            .is_ok_and(|(windows, _)| drives(&car, &samples, windows, settings.substeps, log.dt_s))
    };
    let as_set = (settings.window_s, settle_s);
    let in_windows = (Some(WINDOW_S), settle_s);
    let shorter = (
        Some(SHORT_S[0]),
        settings.settle_s.unwrap_or(settle_s.min(SHORT_S[1])),
    );
    let may_choose = settings.window_s.is_none() && settings.log.is_some();
    let can_be = |cut: (Option<f64>, f64)| windowed(cut, &fitted).is_ok() && windowed(cut, &held).is_ok();
    let cut = if !may_choose || !can_be(in_windows) || driven(as_set) {
        as_set
    } else if driven(in_windows) || !can_be(shorter) {
        in_windows
    } else {
        shorter
    };
    let settle_s = cut.1;
    let (mut fit_windows, without_run_up) = windowed(cut, &fitted)?;
    if fit_windows.is_empty() {
        let found = format!(
            "no stretch of the laps chosen above {} m/s",
            settings.least_speed_mps
        );
        return Err(Error::input(
            &log.source,
            "windows",
            found,
            "at least one window of the length asked for",
        ));
    }
    let (held_windows, _) = windowed(cut, &held)?;
    let slowest = fit_windows
        .iter()
        .chain(&held_windows)
        .flat_map(|w| &samples[w.start..w.end])
        .map(|s| s.measured[0])
        .fold(f64::INFINITY, f64::min);
    // As fine as the car that the search starts from needs it at the slowest place.
    let mut substeps = settings
        .substeps
        .unwrap_or_else(|| steps_of(&car, slowest, log.dt_s));
    let scales = channel_scales(&samples, &fit_windows);
    let problem =
        |freed: &[FreeParameter], windows: Vec<Window<f64>>, substeps: usize| -> Result<ReplayProblem> {
            let weights = objective_weights(settings, &scales, &windows, log.dt_s);
            let mut problem = ReplayProblem::new(
                car.clone(),
                free_parameters(freed, &car)?,
                samples.clone(),
                windows,
                (log.dt_s, substeps),
                settings.norm,
                weights,
            )?;
            problem.start_as_driven_by(&car.to_flat());
            Ok(problem)
        };
    let choice = if settings.chooses() {
        let looked_at = match cut.0 {
            Some(_) => fit_windows.clone(),
            None => windowed(in_windows, &fitted)?.0,
        };
        let mut watch = || match stop.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        };
        let looked_at = problem(&freed, looked_at, substeps)?;
        let choice = choose(&looked_at, &scales, &mut watch)?;
        // A choice has the names that the car gives its parameters, and not what they may be called besides.
        let chosen = |free: &FreeParameter| {
            car.parameter(&free.name)
                .is_some_and(|p| choice.names.contains(&p.name))
        };
        freed.retain(chosen);
        // The car that is found may be stiffer than the one that the search starts from.
        if settings.substeps.is_none() {
            let replay = problem(&freed, fit_windows.clone(), substeps)?;
            let found = choice.candidate(&replay).map(|found| replay.flat(&found));
            substeps = found.map_or(substeps, |flat| replay.steps_needed(&flat).max(substeps));
        }
        Some(choice)
    } else {
        None
    };
    let mut windows_left_out = 0;
    if let Some(choice) = choice.as_ref().filter(|_| cut.0.is_some()) {
        // A window in which the chosen car is lost would lose nearly every candidate, and all that the others tell with it.
        let replay = problem(&freed, fit_windows.clone(), substeps)?;
        if let Some(found) = choice.candidate(&replay) {
            let flat = replay.flat(&found);
            let windows = replay.plan.windows.iter();
            let driven: Vec<bool> = windows
                .map(|w| trace(&flat, replay.tyre_model(), &replay.plan, w).drives)
                .collect();
            let lost = driven.iter().filter(|driven| !**driven).count();
            if 2 * lost < driven.len() {
                windows_left_out = lost;
                let mut keeps = driven.into_iter();
                fit_windows.retain(|_| keeps.next().unwrap_or(true));
            }
        }
    }
    let replay = problem(&freed, fit_windows, substeps)?;
    let holdout = (!held_windows.is_empty())
        .then(|| problem(&freed, held_windows, substeps))
        .transpose()?;
    let truth = truth_car.map(|truth| replay.free.values_in(&truth.to_flat()));
    Ok(Setup {
        truth,
        circuit,
        scales,
        holdout,
        replay,
        log,
        settle_s,
        without_run_up,
        windows_instead_s: cut.0.filter(|_| may_choose),
        windows_left_out,
        choice,
    })
}

/// Steps per sample that a car needs at a speed (m/s).
fn steps_of(car: &Car, slowest_mps: f64, dt_s: f64) -> usize {
    stable_steps(
        dt_s,
        fastest_mode(&car.to_flat(), car.tyre_model(), slowest_mps.max(1.0)),
    )
}

/// Whether a car drives all windows to their end.
fn drives(
    car: &Car,
    samples: &[Sample<f64>],
    windows: Vec<Window<f64>>,
    substeps: Option<usize>,
    dt_s: f64,
) -> bool {
    let driven = windows.iter().flat_map(|w| &samples[w.start..w.end]);
    let slowest = driven.map(|s| s.measured[0]).fold(f64::INFINITY, f64::min);
    let substeps = substeps.unwrap_or_else(|| steps_of(car, slowest, dt_s));
    let plan = ReplayPlan {
        samples: samples.to_vec(),
        windows,
        step: dt_s / substeps as f64,
        fractions: step_fractions(substeps),
        norm: Norm::Two,
    };
    let (flat, tyre) = (car.to_flat(), car.tyre_model());
    plan.windows
        .iter()
        .all(|window| trace(&flat, tyre, &plan, window).drives)
}

/// A study file whose log is given by a flag names laps that the bundled log does not have: a check does not look for them.
pub(in crate::study) fn without_laps(settings: &IdentifySettings) -> IdentifySettings {
    let mut settings = settings.clone();
    if settings.log.is_none() {
        settings.laps.clear();
        settings.holdout.clear();
    }
    settings
}

/// Says that car, log and track were read, and what evaluates.
///
/// # Errors
/// [`crate::Error::NoDevice`] where there is no device that is to be used.
pub(in crate::study) fn planned(settings: &IdentifySettings, setup: &Setup, plan: Plan) -> Result<Plan> {
    let (log, replay) = (&setup.log, &setup.replay);
    let plan = plan.reads(format!("car {}", replay.free.car.name)).reads(format!(
        "log {}: {} samples at {:.0} Hz, {} windows",
        log.source,
        log.samples(),
        1.0 / log.dt_s,
        replay.plan.windows.len()
    ));
    let plan = match &setup.circuit {
        Some(circuit) => plan.reads(format!("track {}, {:.1} m", circuit.name, circuit.length_m)),
        None => plan,
    };
    plan.seed(settings.seed)
        .backend(settings.backend, settings.adapter.as_deref())
}

/// What a study of a replayed lap is about.
pub(in crate::study) fn subject(settings: &IdentifySettings, setup: &Setup) -> Subject {
    Subject {
        seed: settings.seed,
        car: setup.replay.free.car.name.clone(),
        log: Some(setup.log.source.clone()),
        track: None,
    }
}

fn samples_of(log: &Log, car: &Car, undriven: Axle) -> Vec<Sample<f64>> {
    let stand_in = StandIn::new(log, car, undriven);
    (0..log.samples())
        .map(|i| Sample {
            wheel_speed: stand_in.wheel_speeds(i),
            steer: log.steer_rad[i],
            flap: log.drs[i],
            measured: [
                log.vx_mps[i],
                log.ax_mps2[i],
                log.ay_mps2[i],
                log.yaw_rate_radps[i],
            ],
        })
        .collect()
}

/// Sample ranges of the laps to fit and of those held out.
type LapRanges = Vec<(usize, usize)>;

fn choose_laps(settings: &IdentifySettings, log: &Log) -> Result<(LapRanges, LapRanges)> {
    let range_of = |number: &u32| -> Result<(usize, usize)> {
        let lap = log.laps.iter().find(|lap| lap.number == *number).ok_or_else(|| {
            let there: Vec<String> = log.laps.iter().map(|l| l.number.to_string()).collect();
            Error::input(
                &log.source,
                "laps",
                format!("lap {number} asked for"),
                format!("one of {}", there.join(", ")),
            )
        })?;
        Ok((lap.start, lap.end))
    };
    if let Some(both) = settings.holdout.iter().find(|lap| settings.laps.contains(lap)) {
        return Err(Error::input(
            &log.source,
            "holdout",
            format!("lap {both}, which is fitted too"),
            "laps that are not fitted",
        ));
    }
    let held: LapRanges = settings.holdout.iter().map(range_of).collect::<Result<_>>()?;
    let fitted: LapRanges = if settings.laps.is_empty() {
        // A log that tells of no line is one stretch, which a fit takes as it is.
        let whole = log.laps.len() == 1;
        let wanted = log
            .laps
            .iter()
            .filter(|l| (l.complete || whole) && !settings.holdout.contains(&l.number));
        wanted.map(|l| (l.start, l.end)).collect()
    } else {
        settings.laps.iter().map(range_of).collect::<Result<_>>()?
    };
    if fitted.is_empty() {
        let expected = "at least one from line to line; the setting `laps` takes others, and a column lap_complete (0 or 1) \
                        says which are complete";
        return Err(Error::input(
            &log.source,
            "laps",
            "no complete lap to fit",
            expected,
        ));
    }
    Ok((fitted, held))
}

/// The windows over some laps, and on how many stretches the first window has less than `settle_s` ahead of it to settle in.
fn windows_over(
    settings: &IdentifySettings,
    settle_s: f64,
    log: &Log,
    samples: &[Sample<f64>],
    laps: &[(usize, usize)],
    circuit: Option<&Circuit>,
) -> Result<(Vec<Window<f64>>, usize)> {
    let settle = (settle_s / log.dt_s).round() as usize;
    let fast = |s: &Sample<f64>| s.measured[0] >= settings.least_speed_mps;
    let mut without_run_up = 0;
    let section = match (&settings.section, circuit) {
        (Some(name), Some(circuit)) => Some(circuit.section(name)?.clone()),
        (Some(name), None) => {
            return Err(Error::input(
                "the study",
                "section",
                name,
                "a track on which the section is named (the setting track)",
            ));
        }
        (None, _) => None,
    };
    let mut windows = Vec::new();
    for &(start, end) in laps {
        let stretches: Vec<(usize, usize)> = match &section {
            None => vec![(start, end)],
            Some(section) => {
                let inside: Vec<usize> = (start..end)
                    .filter(|&i| section.contains(log.distance_m[i]))
                    .collect();
                match (inside.first(), inside.last()) {
                    (Some(&first), Some(&last)) => vec![(first, last + 1)],
                    _ => Vec::new(),
                }
            }
        };
        for (first, to) in stretches {
            // Whatever lap the samples ahead are of, as long as the car is on its way there.
            let mut ahead = samples[..first].iter().rev().take(settle);
            let run_up = ahead.position(|s| !fast(s)).unwrap_or(settle.min(first));
            without_run_up += usize::from(run_up < settle);
            let from = first - run_up;
            let length = match settings.window_s {
                // The settling time is driven besides.
                Some(window) => ((window / log.dt_s).round() as usize).max(1) + settle,
                None => to - from,
            };
            if length > to - from || length <= settle + 1 {
                let found = format!("a stretch of {:.2} s", (to - from) as f64 * log.dt_s);
                let expected = format!(
                    "at least one window of {:.2} s with {:.2} s to settle",
                    settings.window_s.unwrap_or(0.0),
                    settle_s
                );
                return Err(Error::input(&log.source, "windows", found, expected));
            }
            let mut at = from;
            while at + length <= to {
                let window = Window {
                    start: at,
                    end: at + length,
                    scored_from: settle,
                    initial: initial_state(&samples[at]),
                };
                let whole_lap = settings.window_s.is_none();
                if samples[at..at + length].iter().all(fast) {
                    windows.push(window);
                } else if whole_lap {
                    let found = format!("samples slower than {} m/s in the lap", settings.least_speed_mps);
                    return Err(Error::input(
                        &log.source,
                        "windows",
                        found,
                        "a window_s, so that slow parts are left out",
                    ));
                }
                at += length - settle;
            }
        }
    }
    Ok((windows, without_run_up))
}

fn channel_scales(samples: &[Sample<f64>], windows: &[Window<f64>]) -> [f64; CHANNELS] {
    std::array::from_fn(|k| {
        let values: Vec<f64> = windows
            .iter()
            .flat_map(|w| &samples[w.start + w.scored_from..w.end])
            .map(|s| s.measured[k])
            .collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / values.len() as f64;
        // A channel that does not move has no scale of its own.
        if variance > 0.0 { variance.sqrt() } else { 1.0 }
    })
}

fn free_parameters(
    freed: &[FreeParameter],
    car: &Car,
) -> Result<Vec<(crate::vehicle::CarParameter, f64, f64)>> {
    freed
        .iter()
        .map(|free| {
            let parameter = car.known_parameter("the study", "table [free]", &free.name)?;
            let info = parameter.info;
            if !(info.admits(free.lower) && info.admits(free.upper)) {
                let found = format!("{} to {}", free.lower, free.upper);
                let expected = format!("bounds within {} to {} {}", info.minimum, info.maximum, info.unit);
                return Err(Error::input(
                    "the study",
                    format!("bounds of {}", free.name),
                    found,
                    expected,
                ));
            }
            Ok((parameter, free.lower, free.upper))
        })
        .collect()
}

fn objective_weights(
    settings: &IdentifySettings,
    scales: &[f64; CHANNELS],
    windows: &[Window<f64>],
    dt_s: f64,
) -> Vec<ChannelWeights> {
    let scored: usize = windows.iter().map(|w| w.end - w.start - w.scored_from).sum();
    let time = scored as f64 * dt_s;
    // The cost that an error of one standard deviation of the channel would have.
    let unit_cost = |scale: f64| match settings.norm {
        Norm::One => scale * time,
        Norm::Two => scale * time.sqrt(),
        Norm::Infinity => scale,
        Norm::MeanSquare => scale * scale,
    };
    // So that errors of one standard deviation in all channels are one.
    let channels = CHANNELS as f64;
    let share = match settings.norm {
        Norm::One | Norm::MeanSquare => channels,
        Norm::Two => channels.sqrt(),
        Norm::Infinity => 1.0,
    };
    settings
        .objectives
        .iter()
        .map(|choice| match *choice {
            ObjectiveChoice::All => ChannelWeights {
                objective: Objective {
                    name: "all".to_owned(),
                    unit: "-".to_owned(),
                },
                weights: scales.map(|s| 1.0 / (unit_cost(s) * share)),
            },
            ObjectiveChoice::Channel(channel) => ChannelWeights {
                objective: Objective {
                    name: CHANNEL_NAMES[channel].to_owned(),
                    unit: cost_unit(settings.norm, CHANNEL_UNITS[channel]),
                },
                weights: std::array::from_fn(|k| if k == channel { 1.0 } else { 0.0 }),
            },
        })
        .collect()
}

/// The unit of a channel's cost.
pub fn cost_unit(norm: Norm, unit: &str) -> String {
    match norm {
        Norm::One => format!("({unit}) s"),
        Norm::Two => format!("({unit}) s^0.5"),
        Norm::Infinity => unit.to_owned(),
        Norm::MeanSquare => format!("({unit})^2"),
    }
}

/// How the bundled laps are written: inputs as rounded when driven, outputs to 1e-11.
pub fn lap_format() -> NativeFormat {
    ["vx_mps", "ax_mps2", "ay_mps2", "yaw_rate_radps"]
        .into_iter()
        .fold(NativeFormat::exact(), |format, column| {
            format.decimals(column, 11)
        })
        .decimals("time_s", 4)
        .decimals("distance_m", 3)
}
