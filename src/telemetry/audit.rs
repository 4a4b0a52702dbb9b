//! Values that contradict their declared unit, which is nearly always wrong then.

use super::channel_map::Mapped;
use super::derived::{acceleration, moving, product};
use super::log::Log;
use super::role::Role;
use super::statistics::fit;
use crate::{Error, Place, Result};

/// Largest plausible magnitude in SI, and the usual error beyond it.
fn limit(role: Role) -> Option<(f64, &'static str, &'static str)> {
    Some(match role {
        Role::WheelSpeedFl | Role::WheelSpeedFr | Role::WheelSpeedRl | Role::WheelSpeedRr => {
            (1000.0, "rad/s", "is it a linear speed, or rpm?")
        }
        Role::Steer => (
            1.3,
            "rad at the road wheels",
            "is it in degrees, or the steering wheel's angle without a steering_ratio?",
        ),
        Role::Vx => (150.0, "m/s", "is it in km/h?"),
        Role::Ax | Role::Ay => (60.0, "m/s^2", "is the unit right?"),
        Role::YawRate => (10.0, "rad/s", "is it in deg/s?"),
        Role::Heading
        | Role::Distance
        | Role::Lap
        | Role::LapComplete
        | Role::Throttle
        | Role::Brake
        | Role::Drs
        | Role::Latitude
        | Role::Longitude
        | Role::X
        | Role::Y => return None,
    })
}

/// Refuses a channel (its values in SI) that goes beyond what a car can do.
pub(super) fn check_magnitude(source: &str, mapped: &Mapped<'_>, values: &[f64]) -> Result<()> {
    let Some((most, unit, hint)) = limit(mapped.role) else {
        return Ok(());
    };
    let Some(at) = values.iter().position(|v| v.abs() > most) else {
        return Ok(());
    };
    Err(Error::input(
        source,
        mapped.channel.place(at),
        format!(
            "{} {} = {:.3} {unit}",
            mapped.channel.values.get(at).copied().unwrap_or(f64::NAN),
            mapped.channel.unit,
            values[at]
        ),
        format!("at most {most} {unit} for {}; {hint}", mapped.role.key()),
    ))
}

/// Refuses a log whose accelerations correlate well with what they should equal, but differ by a factor that only a wrong unit
/// explains: `ay` against `vx` times yaw rate, `ax` against the change of `vx`.
pub(super) fn check_gains(log: &Log) -> Result<()> {
    const CLOSELY: f64 = 0.8;
    let (moving, accel) = (moving(log), acceleration(log));
    let turning = product(&log.vx_mps, &log.yaw_rate_radps);
    for (name, values, reference, against) in [
        ("ay", &log.ay_mps2, &turning, "ground speed times yaw rate"),
        ("ax", &log.ax_mps2, &accel, "the change of ground speed"),
    ] {
        let Some(found) = fit(reference, values, &moving) else {
            continue;
        };
        let gain = found.slope.abs();
        if found.correlation.abs() > CLOSELY && !(0.4..=2.5).contains(&gain) {
            return Err(Error::input(
                &log.source,
                Place::default().channel(name),
                format!("values {gain:.3} times {against}"),
                "about the same size; is one of the units wrong?",
            ));
        }
    }
    Ok(())
}

/// Time (s) for which the end of the log repeats its last sample. `None` if sensors at rest would explain it.
pub(super) fn frozen_tail_s(log: &Log) -> Option<f64> {
    const LONGEST_S: f64 = 2.0;
    let frozen = [&log.vx_mps, &log.ax_mps2, &log.ay_mps2, &log.yaw_rate_radps]
        .into_iter()
        .map(|values| {
            let last = values.last().copied();
            values.iter().rev().take_while(|v| Some(**v) == last).count()
        })
        .min()?;
    let frozen_s = frozen as f64 * log.dt_s;
    (frozen_s > LONGEST_S && frozen < log.samples()).then_some(frozen_s)
}

#[cfg(test)]
mod tests {
    use crate::telemetry::synthetic::{Car, native_text};
    use crate::telemetry::{ChannelMap, Log, LogOptions, Recording};

    fn error(text: &str) -> String {
        let recording = Recording::parse(text.as_bytes(), "a.csv").unwrap();
        Log::from_recording(&recording, &ChannelMap::default(), &LogOptions::default())
            .unwrap_err()
            .to_string()
    }

    #[test]
    fn units_that_cannot_be_are_refused_with_line_channel_and_value() {
        let text = native_text(&Car::default().drive(20.0, 50.0));
        let with = |column: usize, factor: f64| {
            let mut out = String::new();
            for (i, line) in text.lines().enumerate() {
                let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
                if i > 0 {
                    let value: f64 = cells[column].parse().unwrap();
                    cells[column] = (value * factor).to_string();
                }
                out += &(cells.join(",") + "\n");
            }
            out
        };
        for (column, factor, parts) in [
            (10, 57.3, ["channel yaw_rate_radps", "at most 10 rad/s", "deg/s?"]),
            (7, 3.6, ["channel vx_mps", "at most 150 m/s", "km/h?"]),
            (6, 57.3, ["channel steer_rad", "at most 1.3 rad", "degrees"]),
            (9, 9.81, ["line ", "channel ay_mps2", "at most 60 m/s^2"]),
            (
                9,
                0.10197,
                ["channel ay", "times ground speed times yaw rate", "units wrong?"],
            ),
            (
                8,
                0.10197,
                ["channel ax", "times the change of ground speed", "units wrong?"],
            ),
        ] {
            let error = error(&with(column, factor));
            for part in parts {
                assert!(error.contains(part), "{part}: {error}");
            }
        }
    }
}
