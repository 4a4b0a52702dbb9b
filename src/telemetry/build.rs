//! From mapped channels to the arrays of a log: conversion to SI, one clock, laps and distance.

use std::borrow::Cow;
use std::ops::RangeInclusive;
use std::sync::Arc;

use super::audit::check_magnitude;
use super::calibration::Calibration;
use super::channel_map::{Axle, ChannelMap, Mapped};
use super::derived::{acceleration, acceleration_span, product};
use super::laps::{LEAST_M, Lap, Marks, restarts};
use super::log::{Log, LogOptions};
use super::path::{STANDING_MPS, start_line};
use super::recording::{Channel, Clock, Format, Recording, Unreadable};
use super::resample::{Grid, check_times, onto, uniform_interval};
use super::role::Role;
use super::statistics::derivative;
use super::text::shown;
use super::units::Quantity;
use crate::{Error, Place, Result};

/// A mapped channel in SI, with its times.
pub(super) struct Signal<'a> {
    pub mapped: Mapped<'a>,
    times: Arc<[f64]>,
    nominal_s: f64,
    pub values: Cow<'a, [f64]>,
    /// Delay that is subtracted from its times, s.
    pub delay_s: f64,
}

/// Converts the channels that a log is made of to SI, and checks their samples and clocks.
pub(super) fn signals<'a>(
    source: &str,
    mapped: &[Mapped<'a>],
    map: &ChannelMap,
    radius: Option<[f64; 2]>,
) -> Result<Vec<Signal<'a>>> {
    let mut signals: Vec<Signal<'a>> = Vec::new();
    for m in mapped {
        if matches!(m.role, Role::Throttle | Role::Brake) || m.role.of_place() {
            continue;
        }
        let channel = m.channel;
        if m.role != Role::Lap {
            check_samples(source, channel)?;
        }
        let known = signals.iter().find(|s| same_clock(s.mapped.channel, channel));
        let (times, nominal_s) = match known {
            Some(signal) => (Arc::clone(&signal.times), signal.nominal_s),
            None => {
                let times = times(source, channel)?;
                let nominal = check_times(source, channel, &times, map.bridged_s())?;
                (times, nominal)
            }
        };
        if times.len() != channel.values.len() {
            return Err(Error::input(
                source,
                Place::default().channel(&channel.name),
                format!("{} samples at {} times", channel.values.len(), times.len()),
                "as many samples as times",
            ));
        }
        let factor = factor(source, m, map, radius)?;
        let values = if factor == 1.0 {
            Cow::Borrowed(&channel.values[..])
        } else {
            channel.values.iter().map(|v| v * factor).collect()
        };
        let values = if m.role == Role::Heading {
            Cow::Owned(turned(&values))
        } else {
            values
        };
        // Steering is checked once it is known which angle it is.
        if m.role != Role::Steer {
            check_magnitude(source, m, &values)?;
        }
        signals.push(Signal {
            mapped: *m,
            times,
            nominal_s,
            values,
            delay_s: m.delay_s.unwrap_or(0.0),
        });
    }
    Ok(signals)
}

/// Headings (rad, clockwise) without the jumps of full turns.
fn turned(headings: &[f64]) -> Vec<f64> {
    let full = std::f64::consts::TAU;
    let mut turns = 0.0;
    let mut last: Option<f64> = None;
    let on = |&heading: &f64| {
        turns -= last
            .replace(heading)
            .map_or(0.0, |last| ((heading - last) / full).round());
        heading + turns * full
    };
    headings.iter().map(on).collect()
}

/// The yaw rate (rad/s, to the left) from headings (rad, to the right, without jumps); zero where the car hardly moves and its heading
/// is noise.
fn yaw_rate(log: &Log, headings: &[f64]) -> Vec<f64> {
    let change = derivative(headings, log.dt_s, acceleration_span(log)).into_iter();
    let speeds = log.vx_mps.iter();
    change
        .zip(speeds)
        .map(|(rate, v)| if *v > STANDING_MPS { -rate } else { 0.0 })
        .collect()
}

/// Refuses a channel with samples that are no numbers.
pub(super) fn check_samples(source: &str, channel: &Channel) -> Result<()> {
    let Some(bad) = &channel.unreadable else {
        return Ok(());
    };
    let (place, found) = if channel.values.is_empty() {
        (Place::default().channel(&channel.name), bad.text.clone())
    } else if bad.text.is_empty() {
        (channel.place(bad.sample), "an empty cell".to_owned())
    } else {
        (channel.place(bad.sample), shown(&bad.text))
    };
    Err(Error::input(source, place, found, "a finite number"))
}

fn same_clock(a: &Channel, b: &Channel) -> bool {
    match (&a.clock, &b.clock) {
        (Clock::Times(a), Clock::Times(b)) => Arc::ptr_eq(a, b),
        (a_clock, b_clock) => a_clock == b_clock && a.values.len() == b.values.len(),
    }
}

fn times(source: &str, channel: &Channel) -> Result<Arc<[f64]>> {
    match &channel.clock {
        Clock::Times(times) => Ok(Arc::clone(times)),
        Clock::Rate { rate_hz, .. } if *rate_hz > 0.0 => {
            Ok((0..channel.values.len()).map(|i| channel.time_s(i)).collect())
        }
        Clock::Rate { rate_hz, .. } => Err(Error::input(
            source,
            Place::default().channel(&channel.name),
            format!("a sample rate of {rate_hz} Hz"),
            "one above 0",
        )),
    }
}

/// The factor that turns a channel's values into SI with the declared sign.
fn factor(source: &str, m: &Mapped<'_>, map: &ChannelMap, radius: Option<[f64; 2]>) -> Result<f64> {
    let mut factor = m.sign.unwrap_or(1.0);
    let Some(unit) = m.unit else {
        return Ok(factor);
    };
    factor *= unit.factor;
    if m.role == Role::Steer {
        factor /= map.steering_ratio.unwrap_or(1.0);
    }
    if Role::WHEELS.contains(&m.role) && unit.quantity == Quantity::Speed {
        let rear = matches!(m.role, Role::WheelSpeedRl | Role::WheelSpeedRr);
        let radius = radius.map(|radii| radii[usize::from(rear)]);
        factor /= radius.ok_or_else(|| {
            Error::input(
                source,
                Place::default().channel(&m.channel.name),
                "a linear wheel speed and no rolling radius to turn it into rad/s",
                "rolling_radius_m in [vehicle] of the channel map",
            )
        })?;
    }
    Ok(factor)
}

fn both<'s, 'a>(signals: &'s [Signal<'a>], a: Role, b: Role) -> Option<[&'s Signal<'a>; 2]> {
    let of = |role| signals.iter().find(|s| s.mapped.role == role);
    Some([of(a)?, of(b)?])
}

/// Whether two roles' channels were sampled at the same times.
pub(super) fn one_clock(signals: &[Signal<'_>], a: Role, b: Role) -> bool {
    both(signals, a, b).is_some_and(|[a, b]| Arc::ptr_eq(&a.times, &b.times))
}

/// Whether two roles' channels have the same times and the same unit, as those of one sensor.
pub(super) fn alike(signals: &[Signal<'_>], a: Role, b: Role) -> bool {
    both(signals, a, b)
        .is_some_and(|[a, b]| a.times == b.times && a.mapped.channel.unit == b.mapped.channel.unit)
}

/// Notes what stands in for a channel. A log is assembled anew when delays are found, and says it once.
fn note(log: &mut Log, text: &str) {
    if !log.calibration.notes.iter().any(|said| said == text) {
        log.calibration.notes.push(text.to_owned());
    }
}

/// What the arrays of a log are made from.
pub(super) struct Build<'a> {
    pub source: &'a str,
    pub recording: &'a Recording,
    pub map: &'a ChannelMap,
    pub options: &'a LogOptions,
    /// Rolling radii of the front and the rear wheels, m.
    pub radius: Option<[f64; 2]>,
    /// Checks that a log of so many samples fits into memory.
    pub fits: &'a dyn Fn(usize) -> Result<()>,
}

impl Build<'_> {
    /// The log with the signals' present delays and no other calibration.
    ///
    /// # Errors
    /// [`Error::Input`] for gaps, times that do not fit one clock, and what does not fit into memory.
    pub fn assemble(&self, signals: &[Signal<'_>], calibration: Calibration) -> Result<Log> {
        let grid = self.grid(signals)?;
        let (grid, through) = match grid {
            Clocked::AsLogged(grid) => (grid, true),
            Clocked::Resampled(grid) => (grid, false),
        };
        let rate_hz = 1.0 / grid.dt_s;
        if !RATES_HZ.contains(&rate_hz) {
            let expected = format!("{} to {} Hz", RATES_HZ.start(), RATES_HZ.end());
            return Err(Error::input(
                self.source,
                "time",
                format!("samples at {rate_hz} Hz"),
                expected,
            ));
        }
        (self.fits)(grid.samples)?;
        let sampled = |signal: &Signal<'_>| -> Vec<f64> {
            if through {
                signal.values.to_vec()
            } else {
                onto(
                    &signal.times,
                    &signal.values,
                    signal.nominal_s,
                    signal.delay_s,
                    &grid,
                )
            }
        };
        let find = |role| signals.iter().find(|s| s.mapped.role == role);
        let needed = |role: Role| match find(role) {
            Some(signal) => Ok(sampled(signal)),
            None => Err(Error::input(
                self.source,
                Place::default().channel(role.key()),
                "none",
                "one",
            )),
        };
        let wheel_speed_radps = Role::WHEELS.map(|wheel| find(wheel).map(sampled).unwrap_or_default());
        let mut log = Log {
            source: self.source.to_owned(),
            dt_s: grid.dt_s,
            time_s: match signals.first() {
                Some(signal) if through => signal.times.to_vec(),
                _ => (0..grid.samples).map(|i| grid.time_s(i)).collect(),
            },
            distance_m: Vec::new(),
            vx_mps: Vec::new(),
            steer_rad: needed(Role::Steer)?,
            drs: Vec::new(),
            ax_mps2: Vec::new(),
            ay_mps2: Vec::new(),
            yaw_rate_radps: Vec::new(),
            wheel_speed_radps,
            laps: Vec::new(),
            calibration,
        };
        let unlogged: Vec<Role> = Role::WHEELS
            .into_iter()
            .filter(|wheel| find(*wheel).is_none())
            .collect();
        for wheel in &unlogged {
            self.refuse_other_unit(*wheel)?;
        }
        if let [first, others @ ..] = &unlogged[..] {
            let others: String = others.iter().map(|wheel| format!(", {}", wheel.key())).collect();
            let text = format!(
                "{}{others}: not logged; the car's own motion stands in for them, and the log does not tell how its tyres slip \
                 along the car",
                first.key()
            );
            note(&mut log, &text);
        }
        log.vx_mps = match find(Role::Vx) {
            Some(signal) => sampled(signal),
            None => self.speed_of_wheels(&mut log)?,
        };
        log.yaw_rate_radps = match (find(Role::YawRate), find(Role::Heading)) {
            (None, Some(heading)) => {
                note(
                    &mut log,
                    "yaw_rate: not logged; the change of the heading stands in for it",
                );
                yaw_rate(&log, &sampled(heading))
            }
            _ => needed(Role::YawRate)?,
        };
        // What stands in leaves out how the sideslip changes.
        log.ax_mps2 = match find(Role::Ax) {
            Some(signal) => sampled(signal),
            None => {
                self.refuse_other_unit(Role::Ax)?;
                note(&mut log, "ax: not logged; the change of speed stands in for it");
                acceleration(&log)
            }
        };
        log.ay_mps2 = match find(Role::Ay) {
            Some(signal) => sampled(signal),
            None => {
                self.refuse_other_unit(Role::Ay)?;
                note(&mut log, "ay: not logged; speed times yaw rate stands in for it");
                product(&log.vx_mps, &log.yaw_rate_radps)
            }
        };
        log.drs = find(Role::Drs).map_or_else(|| vec![0.0; grid.samples], sampled);
        if let Some(beyond) = log.drs.iter().find(|open| !(0.0..=1.0).contains(*open)) {
            let text = format!(
                "drs: left out, the flap counts as shut; found {beyond}, expected 0 (shut) to 1 (open)"
            );
            note(&mut log, &text);
            log.drs.fill(0.0);
        }
        let driven = integrated(&log.vx_mps, grid.dt_s);
        log.laps = self.laps(signals, &log.time_s, &driven, &mut log.calibration)?;
        let logged = find(Role::Distance).map(|signal| {
            let goes_on = |lap: &Lap| {
                let values = signal.values.get(lap.start..lap.end).unwrap_or_default();
                !values.windows(2).any(|pair| restarts(pair[0], pair[1]))
            };
            if through && self.recording.format == Format::Native && log.laps.iter().all(goes_on) {
                return signal.values.to_vec();
            }
            let running = running_distance(&signal.values);
            let all = onto(&signal.times, &running, signal.nominal_s, signal.delay_s, &grid);
            from_lap_start(&all, &log.laps)
        });
        log.distance_m = match logged {
            Some(logged) if advances(&logged, &driven, &log.laps) => logged,
            Some(_) => {
                let note = "the logged distance does not go with the speed: distances are the speed's";
                log.calibration.notes.push(note.to_owned());
                from_lap_start(&driven, &log.laps)
            }
            None => from_lap_start(&driven, &log.laps),
        };
        Ok(log)
    }

    fn grid(&self, signals: &[Signal<'_>]) -> Result<Clocked> {
        let Some(first) = signals.first() else {
            return Err(Error::input(self.source, "channels", "none", "those of a car"));
        };
        let asked = self.options.rate_hz.map(|rate| 1.0 / rate);
        let fits = |dt: f64| asked.is_none_or(|asked| (asked - dt).abs() <= 1e-9 * dt);
        let shared = signals
            .iter()
            .all(|s| s.delay_s == 0.0 && Arc::ptr_eq(&s.times, &first.times));
        if shared && let Some(dt_s) = uniform_interval(&first.times).filter(|dt| fits(*dt)) {
            return Ok(Clocked::AsLogged(Grid {
                start_s: first.times[0],
                dt_s,
                samples: first.times.len(),
            }));
        }
        // Lap numbers and distance may be logged slowly or start late. They do not shorten the log.
        let driving = || signals.iter().filter(|s| s.mapped.role.of_motion());
        let fastest = driving()
            .min_by(|a, b| a.nominal_s.total_cmp(&b.nominal_s))
            .unwrap_or(first);
        // A channel with missing samples has a clock of its own, which is not uniform, beside one that is.
        let as_fast = driving().filter(|s| s.nominal_s <= (1.0 + 1e-6) * fastest.nominal_s);
        let dt_s = asked
            .or_else(|| {
                as_fast
                    .map(|s| &s.times)
                    .find_map(|times| uniform_interval(times))
            })
            .unwrap_or(fastest.nominal_s);
        let (mut start, mut end) = (f64::NEG_INFINITY, f64::INFINITY);
        for signal in driving() {
            if let [first, .., last] = &signal.times[..] {
                start = start.max(first - signal.delay_s);
                end = end.min(last - signal.delay_s);
            }
        }
        Grid::within(self.source, fastest.times[0], start, end, dt_s).map(Clocked::Resampled)
    }

    /// Refuses a log that has the role's channel in an unknown unit. To make it of others without notice would be wrong.
    fn refuse_other_unit(&self, role: Role) -> Result<()> {
        let key = format!("{}_", role.key());
        let Some(channel) = self.recording.channels.iter().find(|c| c.name.starts_with(&key)) else {
            return Ok(());
        };
        Err(Error::input(
            self.source,
            Place::default().channel(&channel.name),
            "a unit that is not known",
            format!(
                "{} in {}, or the channel's unit in the channel map",
                role.key(),
                role.si_unit()
            ),
        ))
    }

    fn speed_of_wheels(&self, log: &mut Log) -> Result<Vec<f64>> {
        self.refuse_other_unit(Role::Vx)?;
        let [fl, fr, rl, rr] = &log.wheel_speed_radps;
        let (left, right, axle, name) = match self.map.speed_axle {
            Axle::Front => (fl, fr, 0, "front"),
            Axle::Rear => (rl, rr, 1, "rear"),
        };
        if left.is_empty() || right.is_empty() {
            return Err(Error::input(
                self.source,
                Place::default().channel("vx"),
                format!("no ground speed, and no speeds of the {name} wheels to make one of"),
                "a ground speed channel",
            ));
        }
        let Some(radius) = self.radius else {
            return Err(Error::input(
                self.source,
                Place::default().channel("vx"),
                "no ground speed, and no rolling radius to make one of wheel speeds",
                "a ground speed channel, or rolling_radius_m in [vehicle] of the channel map",
            ));
        };
        let speed = left
            .iter()
            .zip(right)
            .map(|(l, r)| (l + r) / 2.0 * radius[axle])
            .collect();
        note(
            log,
            &format!("vx: no ground speed is logged; the mean of the {name} wheel speeds stands in for it"),
        );
        Ok(speed)
    }

    fn laps(
        &self,
        signals: &[Signal<'_>],
        times_s: &[f64],
        driven_m: &[f64],
        calibration: &mut Calibration,
    ) -> Result<Vec<Lap>> {
        let channel = |role| signals.iter().find(|s| s.mapped.role == role);
        let timed = |role| channel(role).map(|s| (&*s.times, &*s.values));
        let numbers = channel(Role::Lap).map(|lap| {
            let numbers = lap_numbers(self.source, lap.mapped.channel, &lap.values)?;
            Ok((&*lap.times, numbers))
        });
        let numbers = numbers.transpose()?;
        let line = start_line(self.recording, self.map, numbers.is_some())?;
        let marks = Marks {
            beacons_s: &self.recording.beacons_s,
            line: line.as_ref(),
            numbers,
            complete: timed(Role::LapComplete),
            distance_m: timed(Role::Distance),
            whole: self.recording.is_one_lap(),
        };
        let laps = marks.laps(times_s, driven_m);
        let untold = marks.beacons_s.is_empty() && marks.numbers.is_none() && laps.len() == 1;
        let note = match &line {
            Some(line) => line.words.as_str(),
            None if untold && !marks.whole => {
                "laps: no beacons and no lap number are logged; the whole file is taken as one lap that may not be complete"
            }
            None => return Ok(laps),
        };
        if !calibration.notes.iter().any(|n| n == note) {
            calibration.notes.push(note.to_owned());
        }
        Ok(laps)
    }
}

enum Clocked {
    /// The samples as they were logged.
    AsLogged(Grid),
    /// New samples between them.
    Resampled(Grid),
}

/// Longest pause (s) between two different lap numbers that counts as part of the lap before it.
const LAP_GAP_S: f64 = 1.0;

/// Lap numbers from the values of their channel. A number that is missing between two equal ones is that number.
pub(super) fn lap_numbers(source: &str, channel: &Channel, values: &[f64]) -> Result<Vec<u32>> {
    // RaceChrono leaves the number out before the first line and after the last.
    let is_empty = channel.unreadable.as_ref().is_some_and(Unreadable::is_missing);
    let number = |(at, &value): (usize, &f64)| {
        if value.is_nan() && is_empty {
            Ok(0)
        } else if value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&value) {
            Ok(value as u32)
        } else {
            Err(Error::input(
                source,
                channel.place(at),
                value.to_string(),
                "a lap number: whole, 0 or more",
            ))
        }
    };
    let mut numbers: Vec<u32> = values.iter().enumerate().map(number).collect::<Result<_>>()?;
    let mut last: Option<usize> = None;
    for next in (0..values.len()).filter(|i| !values[*i].is_nan()) {
        if let Some(before) = last.replace(next) {
            let same = numbers[before] == numbers[next];
            if same || channel.time_s(next) - channel.time_s(before) <= LAP_GAP_S {
                let lap = numbers[before];
                numbers[before..next].fill(lap);
            }
        }
    }
    Ok(numbers)
}

/// Rates that a log may have (Hz).
pub(super) const RATES_HZ: RangeInclusive<f64> = 0.1..=100_000.0;

/// Distance that continues where the logged one restarts at zero.
fn running_distance(values: &[f64]) -> Vec<f64> {
    let mut carried = 0.0;
    let mut last = values.first().copied().unwrap_or(0.0);
    values
        .iter()
        .map(|&value| {
            if restarts(last, value) {
                carried += last;
            }
            last = value;
            value + carried
        })
        .collect()
}

/// Distance (m) by the trapezoidal rule from speeds (m/s) at this interval (s).
fn integrated(vx_mps: &[f64], dt_s: f64) -> Vec<f64> {
    let mut sum = 0.0;
    let mut last = vx_mps.first().copied().unwrap_or(0.0);
    let mut first = true;
    let step = |&v: &f64| {
        sum += (last + v) / 2.0 * if std::mem::take(&mut first) { 0.0 } else { dt_s };
        last = v;
        sum
    };
    vx_mps.iter().map(step).collect()
}

/// Whether a logged distance (m) advances about as the integrated speed does, all laps together: a dead sensor stands still, and
/// a broken one gives any value. A factor of two is more than wheel slip or a correction at a beacon can explain.
fn advances(logged_m: &[f64], driven_m: &[f64], laps: &[Lap]) -> bool {
    let span = |part: &[f64]| {
        let greatest = part.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (greatest - part.iter().copied().fold(f64::INFINITY, f64::min)).max(0.0)
    };
    let length = |distance_m: &[f64]| -> f64 {
        if laps.is_empty() {
            return span(distance_m);
        }
        let parts = laps.iter().filter_map(|lap| distance_m.get(lap.start..lap.end));
        parts.map(span).sum()
    };
    let (said, went) = (length(logged_m), length(driven_m));
    // A car that hardly moves gives no evidence.
    went < LEAST_M || (0.5 * went..=2.0 * went).contains(&said)
}

fn from_lap_start(all: &[f64], laps: &[Lap]) -> Vec<f64> {
    let mut out = all.to_vec();
    for lap in laps {
        if let Some(part) = out.get_mut(lap.start..lap.end)
            && let Some(&start) = part.first()
        {
            part.iter_mut().for_each(|d| *d -= start);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_distance_that_does_not_go_with_the_speed_is_not_believed() {
        let lap = |start, end| Lap {
            number: 1,
            start,
            end,
            complete: true,
        };
        let laps = [lap(0, 100), lap(100, 200)];
        let speeds = vec![30.0; 200];
        let driven = integrated(&speeds, 0.1);
        assert!((driven[199] - 30.0 * 19.9).abs() < 1e-9);
        let near: Vec<f64> = driven.iter().map(|d| 1.02 * d).collect();
        for laps in [&laps[..], &[]] {
            assert!(advances(&near, &driven, laps));
            for broken in [0.0, 1e300, -7.0] {
                assert!(!advances(&[broken; 200], &driven, laps), "{broken}");
            }
            let wild: Vec<f64> = driven.iter().map(|d| 1e9 * d).collect();
            assert!(!advances(&wild, &driven, laps));
        }
        // A car that stands in its box.
        assert!(advances(&[0.0; 200], &integrated(&[0.01; 200], 0.1), &laps));
    }

    /// A sensor that drops out does not end a lap. RaceChrono leaves the number out where there is none.
    #[test]
    fn missing_lap_numbers_are_those_about_them() {
        let none = f64::NAN;
        let values = vec![
            none, 1.0, none, none, none, 1.0, none, 2.0, none, none, none, 3.0, none,
        ];
        let lap = Channel {
            name: "Lap".into(),
            unit: String::new(),
            clock: Clock::Rate {
                start_s: 0.0,
                rate_hz: 2.5,
            },
            unreadable: Some(Unreadable {
                sample: 0,
                text: String::new(),
            }),
            lines: None,
            values,
        };
        // A pause of 0.8 s between two laps, and one of 1.6 s.
        let numbers = lap_numbers("a.csv", &lap, &lap.values).unwrap();
        assert_eq!(numbers, [0, 1, 1, 1, 1, 1, 1, 2, 0, 0, 0, 3, 0]);
    }

    /// A lap of a circle to the left in 10 s: a compass goes from 1 through north to 1 again.
    #[test]
    fn headings_turn_without_jumps() {
        let compass =
            |i: usize| (1.0 - std::f64::consts::TAU * i as f64 / 100.0).rem_euclid(std::f64::consts::TAU);
        let headings = turned(&(0..=100).map(compass).collect::<Vec<_>>());
        for (i, heading) in headings.iter().enumerate() {
            let expected = 1.0 - std::f64::consts::TAU * i as f64 / 100.0;
            assert!((heading - expected).abs() < 1e-12, "{i}: {heading}");
        }
    }

    #[test]
    fn logged_distance_starts_again_with_the_counter() {
        assert_eq!(
            running_distance(&[0.0, 100.0, 200.0, 1.0, 11.0]),
            [0.0, 100.0, 200.0, 201.0, 211.0]
        );
    }
}
