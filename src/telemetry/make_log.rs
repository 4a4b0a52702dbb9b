//! From a recording to the log that an identification works on.

use std::borrow::Cow;
use std::path::Path;

use super::audit::{check_gains, check_magnitude, frozen_tail_s};
use super::build::{Build, RATES_HZ, alike, one_clock, signals};
use super::calibrate::{self, steering_ratio};
use super::calibration::{Calibration, Declared, FindingKind, Switch};
use super::channel_map::{Axle, ChannelMap, Mapped};
use super::delays::{Evidence, delays};
use super::log::{Log, LogOptions};
use super::recording::{Channel, Clock, Format, Reading, Recording};
use super::role::Role;
use super::text::shown;
use crate::config::{check_memory, memory_limit};
use crate::{Error, Result};

/// Bytes of a recorded sample while a log is made: as it was recorded, in SI, its time, the interval to the next, and a sum.
const SIGNAL_SAMPLE: u64 = 5 * 8;
/// Bytes of a sample of the log while it is made: its eleven numbers, those of the log before delays were found, and as many
/// again for what is estimated from them.
const SAMPLE: u64 = 3 * 11 * 8;

impl Log {
    /// Reads a log file. A native file without lap columns is one complete lap, and its values come through bit for
    /// bit as long as no other rate and no calibration is asked for.
    ///
    /// # Errors
    /// [`Error::Io`] when the file cannot be read; [`Error::Input`], naming line or time and channel, for missing
    /// channels, unknown units, samples that are not numbers, times that do not rise, gaps, and values that no car
    /// reaches.
    pub fn read(path: impl AsRef<Path>, map: &ChannelMap, options: &LogOptions) -> Result<Self> {
        Self::read_within(path, map, options, memory_limit())
    }

    /// As [`Log::read`], within a limit of memory (bytes) of its own.
    ///
    /// # Errors
    /// As for [`Log::read`].
    pub fn read_within(
        path: impl AsRef<Path>,
        map: &ChannelMap,
        options: &LogOptions,
        limit: u64,
    ) -> Result<Self> {
        let choose = |recording: &Recording| map.choose(recording);
        let reading = Reading {
            choose: &choose,
            limit,
        };
        Self::made_within(
            &Recording::read_some(path.as_ref(), &reading)?,
            map,
            options,
            limit,
        )
    }

    /// Makes a log of a recording.
    ///
    /// # Errors
    /// As for [`Log::read`], save [`Error::Io`].
    pub fn from_recording(recording: &Recording, map: &ChannelMap, options: &LogOptions) -> Result<Self> {
        Self::made_within(recording, map, options, memory_limit())
    }

    fn made_within(
        recording: &Recording,
        map: &ChannelMap,
        options: &LogOptions,
        limit: u64,
    ) -> Result<Self> {
        check_options(options)?;
        let computed = map.computed(recording)?;
        let mut calibration = Calibration::default();
        let joined = without_gaps(computed, map, &mut calibration)?;
        let recording = &*joined;
        let source = recording.source.display().to_string();
        let radius = map.rolling_radii_m().or(options.rolling_radius_m);
        let mapped = map.resolve(recording)?;
        let declared = Declared {
            signs: roles(&mapped, |m| m.sign.is_some()),
            delays: roles(&mapped, |m| m.delay_s.is_some()),
            // What the model multiplies wheel speeds by, whatever the logger divided them by.
            rolling_radius_m: options.rolling_radius_m.or(radius),
            radius_is_free: options.radius_is_free,
            rear_is_undriven: map.speed_axle == Axle::Rear,
            speed_of_wheels: !mapped.iter().any(|m| m.role == Role::Vx),
            made: [Role::Ax, Role::Ay]
                .into_iter()
                .filter(|role| !mapped.iter().any(|m| m.role == *role))
                .collect(),
        };
        for m in mapped
            .iter()
            .filter(|m| !m.declared && recording.format != Format::Native)
        {
            calibration.notes.push(if m.is_of_positions() {
                format!("{}: not logged; it is that of the positions", m.role.key())
            } else {
                format!(
                    "{}: channel {}, by its name",
                    m.role.key(),
                    shown(&m.channel.name)
                )
            });
        }
        let recorded: u64 = recording.channels.iter().map(|c| c.values.len() as u64).sum();
        let fits = |samples: usize| {
            let needed = (samples as u64).saturating_mul(SAMPLE);
            let needed = needed.saturating_add(recorded.saturating_mul(SIGNAL_SAMPLE));
            let size = format!("{recorded} samples, {samples} on one clock");
            check_memory(&recording.source, &size, needed, limit)
        };
        let mut signals = signals(&source, &mapped, map, radius)?;
        let build = Build {
            source: &source,
            recording,
            map,
            options,
            radius,
            fits: &fits,
        };
        let mut log = build.assemble(&signals, calibration)?;
        if recording.format != Format::Native && map.steering_ratio.is_none() {
            let ratio = options.steering.and_then(|s| steering_ratio(&mut log, s));
            if let Some(ratio) = ratio {
                for signal in signals.iter_mut().filter(|s| s.mapped.role == Role::Steer) {
                    signal.values.to_mut().iter_mut().for_each(|v| *v /= ratio);
                }
            } else {
                log.calibration.notes.push(
                    "steer: taken as the road wheels' angle; steering_ratio in the channel map says otherwise"
                        .to_owned(),
                );
            }
        }
        for steer in signals.iter().filter(|s| s.mapped.role == Role::Steer) {
            check_magnitude(&source, &steer.mapped, &steer.values)?;
        }
        check_gains(&log)?;
        if options.calibration.delays == Switch::On {
            let mut calibration = std::mem::take(&mut log.calibration);
            let undriven = match map.speed_axle {
                Axle::Front => [0, 1],
                Axle::Rear => [2, 3],
            };
            // An export has all channels on one clock, whatever clocks they were sampled by.
            let exported = recording.format == Format::MotecCsv;
            let one_clock = |a, b| !exported && one_clock(&signals, a, b);
            let evidence = Evidence {
                log: &log,
                declared: &declared,
                undriven,
                one_clock: &one_clock,
                one_accelerometer: alike(&signals, Role::Ax, Role::Ay),
            };
            delays(&evidence, &mut calibration);
            let mut late = false;
            for signal in &mut signals {
                if let Some(delay) = calibration.applied(signal.mapped.role, FindingKind::Delay) {
                    signal.delay_s += delay;
                    late = true;
                }
            }
            if late {
                log = build.assemble(&signals, calibration)?;
            } else {
                log.calibration = calibration;
            }
        }
        if let Some(frozen_s) = frozen_tail_s(&log) {
            log.calibration.notes.push(format!(
                "the last {frozen_s:.1} s repeat one sample: the sensors were off before the logger"
            ));
        }
        calibrate::apply(&mut log, &options.calibration, &declared);
        Ok(log)
    }
}

/// Gives the channels that a log is made of clocks of their own where samples are missing: empty cells of a table, or channels that
/// are slower than its rows. Straight lines then join the samples, within the limits that hold for missing rows.
fn without_gaps<'a>(
    recording: Cow<'a, Recording>,
    map: &ChannelMap,
    calibration: &mut Calibration,
) -> Result<Cow<'a, Recording>> {
    let joined: Vec<(usize, Channel)> = {
        let mapped = map.resolve(&recording)?;
        // Lap numbers and positions may be left out, and pedals are not read.
        let left_out = [Role::Lap, Role::LapComplete, Role::Throttle, Role::Brake];
        let needed = |channel: &Channel| {
            let of = |m: &&Mapped<'_>| std::ptr::eq(m.channel, channel);
            mapped
                .iter()
                .filter(of)
                .any(|m| !left_out.contains(&m.role) && !m.role.of_place())
        };
        let channels = recording.channels.iter().enumerate();
        channels
            .filter(|(_, channel)| needed(channel))
            .filter_map(|(i, channel)| Some((i, channel.without_gaps()?)))
            .collect()
    };
    if joined.is_empty() {
        return Ok(recording);
    }
    let mut recording = recording.into_owned();
    let mut clocks: Vec<Clock> = Vec::new();
    for (i, mut channel) in joined {
        let (all, left) = (recording.channels[i].values.len(), channel.values.len());
        calibration.notes.push(format!(
            "{}: {} of {all} samples are missing; straight lines join the others",
            shown(&channel.name),
            all - left
        ));
        match clocks.iter().find(|clock| **clock == channel.clock) {
            Some(known) => channel.clock = known.clone(),
            None => clocks.push(channel.clock.clone()),
        }
        recording.channels[i] = channel;
    }
    Ok(Cow::Owned(recording))
}

fn check_options(options: &LogOptions) -> Result<()> {
    let checks = [
        ("sample rate", options.rate_hz, RATES_HZ, "Hz"),
        (
            "rolling radius",
            options.rolling_radius_m.map(|r| r[0]),
            0.05..=2.0,
            "m",
        ),
        (
            "rolling radius",
            options.rolling_radius_m.map(|r| r[1]),
            0.05..=2.0,
            "m",
        ),
    ];
    for (name, value, range, unit) in checks {
        if let Some(value) = value.filter(|v| !range.contains(v)) {
            return Err(Error::input(
                "log options",
                name,
                value.to_string(),
                format!("{} to {} {unit}", range.start(), range.end()),
            ));
        }
    }
    Ok(())
}

fn roles(mapped: &[Mapped<'_>], which: fn(&Mapped<'_>) -> bool) -> Vec<Role> {
    mapped.iter().filter(|m| which(m)).map(|m| m.role).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::telemetry::synthetic::{Car, native_text};
    use crate::telemetry::{CalibrationOptions, Channel, Clock, Metadata, Switch};

    fn channel(name: &str, unit: &str, rate_hz: f64, f: impl Fn(f64) -> f64) -> Channel {
        let samples = (8.0 * rate_hz) as usize;
        Channel {
            name: name.to_owned(),
            unit: unit.to_owned(),
            clock: Clock::Rate {
                start_s: 0.0,
                rate_hz,
            },
            values: (0..samples).map(|i| f(i as f64 / rate_hz)).collect(),
            unreadable: None,
            lines: None,
        }
    }

    /// Channels of different rates, as in a `.ld`.
    fn mixed() -> Recording {
        let mut channels: Vec<Channel> = ["FL", "FR", "RL", "RR"]
            .map(|w| channel(&format!("Wheel Speed {w}"), "km/h", 100.0, |t| 72.0 + 3.6 * t))
            .into();
        channels.push(channel("Steered Angle", "deg", 20.0, |t| t));
        channels.push(channel("G Force Lat", "G", 50.0, |_| 0.5));
        channels.push(channel("G Force Long", "G", 50.0, |_| 0.1));
        channels.push(channel("Gyro Yaw Velocity", "deg/s", 50.0, |t| 2.0 * t));
        channels.push(channel(
            "Lap Number",
            "",
            1.0,
            |t| {
                if t < 3.0 { 4.0 } else { 5.0 }
            },
        ));
        Recording {
            source: "a.ld".into(),
            format: Format::MotecLd,
            channels,
            beacons_s: Vec::new(),
            metadata: Metadata::default(),
        }
    }

    fn off() -> LogOptions {
        LogOptions {
            calibration: CalibrationOptions::all(Switch::Off),
            ..LogOptions::default()
        }
    }

    fn map(text: &str) -> ChannelMap {
        ChannelMap::parse(text, "m.toml").unwrap()
    }

    /// Headings that turn to the left by 2 t degrees per second, past north: the gyro's 2 t, where differences are central.
    #[test]
    fn a_heading_tells_the_yaw_rate() {
        let mut recording = mixed();
        let gyro = recording
            .channels
            .iter()
            .position(|c| c.name == "Gyro Yaw Velocity");
        recording.channels[gyro.unwrap()] =
            channel("GPS Heading", "deg", 50.0, |t| (30.0 - t * t).rem_euclid(360.0));
        let map = map("[vehicle]\nsteering_ratio = 10\nrolling_radius_m = 0.5");
        let log = Log::from_recording(&recording, &map, &off()).unwrap();
        for i in [50, 400, 700] {
            let expected = (2.0 * log.time_s[i]).to_radians();
            assert!(
                (log.yaw_rate_radps[i] - expected).abs() < 1e-9,
                "{i}: {}",
                log.yaw_rate_radps[i]
            );
        }
        let notes = &log.calibration.notes;
        assert!(
            notes
                .iter()
                .any(|n| n.contains("change of the heading stands in"))
        );
    }

    #[test]
    fn channels_of_different_rates_meet_on_the_fastest() {
        let map = map("[vehicle]\nsteering_ratio = 10\nrolling_radius_m = 0.5");
        let log = Log::from_recording(&mixed(), &map, &off()).unwrap();
        assert_eq!(log.dt_s, 0.01);
        // The slowest needed channel ends first.
        assert_eq!(log.samples(), 796);
        for i in [0, 3, 500, 795] {
            let t = log.time_s[i];
            assert!((log.steer_rad[i] - (t / 10.0).to_radians()).abs() < 1e-12);
            assert!((log.wheel_speed_radps[1][i] - (20.0 + t) / 0.5).abs() < 1e-9);
            assert!((log.vx_mps[i] - (20.0 + t)).abs() < 1e-9);
            assert!((log.yaw_rate_radps[i] - (2.0 * t).to_radians()).abs() < 1e-12);
        }
        assert!(
            log.calibration
                .notes
                .iter()
                .any(|n| n.contains("front wheel speeds stand"))
        );
        let numbers: Vec<_> = log.laps.iter().map(|l| (l.number, l.start, l.end)).collect();
        assert_eq!(numbers, [(4, 0, 300), (5, 300, 796)]);
        assert_eq!(log.distance_m[300], 0.0);
        assert!((log.distance_m[299] - (20.0 * 2.99 + 2.99 * 2.99 / 2.0)).abs() < 1e-6);
    }

    #[test]
    fn declared_delays_and_signs_are_taken_off() {
        let text = "[vehicle]\nrolling_radius_m = 0.5\n[channels.yaw_rate]\nsign = -1\ndelay_s = 0.205";
        let log = Log::from_recording(&mixed(), &map(text), &off()).unwrap();
        let expected = -(2.0 * (log.time_s[10] + 0.205)).to_radians();
        assert!((log.yaw_rate_radps[10] - expected).abs() < 1e-12);
    }

    #[test]
    fn linear_wheel_speeds_need_a_radius() {
        let error = Log::from_recording(&mixed(), &ChannelMap::default(), &off()).unwrap_err();
        assert!(
            error.to_string().contains("rolling_radius_m in [vehicle]"),
            "{error}"
        );
    }

    #[test]
    fn a_broken_lap_number_names_its_place() {
        let mut recording = mixed();
        recording.channels[8].values[2] = 4.5;
        let map = map("[vehicle]\nrolling_radius_m = 0.5");
        let error = Log::from_recording(&recording, &map, &off()).unwrap_err();
        assert!(
            error
                .to_string()
                .contains("t = 2.000 s, channel Lap Number: found 4.5"),
            "{error}"
        );
    }

    #[test]
    fn another_rate_is_made_when_asked_for() {
        let text = native_text(&Car::default().drive(10.0, 50.0));
        let recording = Recording::parse(text.as_bytes(), "a.csv").unwrap();
        let read = |rate_hz| {
            let options = LogOptions {
                rate_hz,
                ..LogOptions::default()
            };
            Log::from_recording(&recording, &ChannelMap::default(), &options)
        };
        let log = read(Some(10.0)).unwrap();
        assert_eq!((log.dt_s, log.samples()), (0.1, 100));
        assert_eq!(read(Some(50.0)).unwrap(), read(None).unwrap());
        assert!(
            read(Some(f64::NAN))
                .unwrap_err()
                .to_string()
                .contains("sample rate: found NaN")
        );
        assert!(read(Some(1e5)).is_ok() && read(Some(1e9)).is_err());
    }

    #[test]
    fn slices_and_laps() {
        let map = map("[vehicle]\nrolling_radius_m = 0.5");
        let mut log = Log::from_recording(&mixed(), &map, &off()).unwrap();
        log.laps[0].complete = true;
        assert_eq!(log.lap(5).unwrap().samples(), 496);
        assert!(log.lap(4).unwrap().laps[0].complete);
        let cut = log.slice(100..400).unwrap();
        assert_eq!(
            (cut.laps[0].end, cut.laps[0].complete, cut.laps[1].end),
            (200, false, 300)
        );
        let error = log.lap(9).unwrap_err().to_string();
        assert!(error.contains("lap: found 9, expected one of 4, 5"), "{error}");
        assert!(log.slice(5..5).is_err() && log.slice(0..9999).is_err());
        assert!(log.check_length(7.95).is_ok());
        let error = log.check_length(8.0).unwrap_err().to_string();
        assert!(
            error.contains("found 7.950 s of log, expected at least one window of 8 s"),
            "{error}"
        );
    }

    fn refused(path: &Path, limit: u64) -> String {
        let log = Log::read_within(path, &ChannelMap::default(), &off(), limit);
        let error = log.map(|log| log.samples()).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        error.to_string()
    }

    #[test]
    fn a_log_that_does_not_fit_is_refused_before_it_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lap.csv");
        let head = "time_s,wheel_speed_fl_radps,wheel_speed_fr_radps,wheel_speed_rl_radps,wheel_speed_rr_radps,\
                    steer_rad,vx_mps,ax_mps2,ay_mps2,yaw_rate_radps,spare\n";
        let rows = 10_000;
        let text: String = (0..rows)
            .map(|i| format!("{},60,60,60,60,0.01,20,0,0.5,0.025,1\n", f64::from(i) / 100.0))
            .collect();
        std::fs::write(&path, head.to_owned() + &text).unwrap();
        let size = std::fs::metadata(&path).unwrap().len();
        // As it is; with its nine columns and times that are read, lines, and both once more; and as a log on one clock.
        let read = size + 8 * (rows as u64 + 2) * 13;
        let made = rows as u64 * (9 * SIGNAL_SAMPLE + SAMPLE);
        for (limit, part) in [
            (size - 1, format!("{size} bytes")),
            (read - 1, format!("{size} bytes")),
            (made - 1, format!("{} samples", 9 * rows)),
        ] {
            let said = refused(&path, limit);
            assert!(said.contains("lap.csv") && said.contains(&part), "{said}");
            assert!(said.contains("a file that fits into"), "{said}");
        }
        assert!(read < made);
        let log = Log::read_within(&path, &ChannelMap::default(), &off(), made).unwrap();
        assert_eq!(log.samples(), rows as usize);
    }

    #[test]
    fn of_channels_that_no_log_is_made_of_no_samples_are_kept() {
        let text = "time_s,wheel_speed_fl_radps,wheel_speed_fr_radps,wheel_speed_rl_radps,wheel_speed_rr_radps,\
                    steer_rad,vx_mps,ax_mps2,ay_mps2,yaw_rate_radps,spare\n0,1,1,1,1,0,9,0,0,0,7\n1,1,1,1,1,0,9,0,0,0,7\n";
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lap.csv");
        std::fs::write(&path, text).unwrap();
        let map = ChannelMap::default();
        let reading = Reading {
            choose: &|recording| map.choose(recording),
            limit: u64::MAX,
        };
        let some = Recording::read_some(&path, &reading).unwrap();
        let whole = Recording::read(&path).unwrap();
        assert_eq!(some.channels.len(), whole.channels.len());
        for (some, whole) in some.channels.iter().zip(&whole.channels) {
            if some.name == "spare" {
                assert!(some.values.is_empty() && whole.values == [7.0, 7.0]);
            } else {
                assert_eq!(some, whole);
            }
        }
    }
}
