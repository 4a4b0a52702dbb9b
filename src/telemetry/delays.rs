//! Delays of channels that must coincide: wheel speeds with ground speed and with each other, the speed difference of an axle's
//! wheels with yaw rate, and longitudinal acceleration with the change of ground speed.
//!
//! Lateral acceleration and steering coincide with nothing. Lateral acceleration follows speed times yaw rate by the car's sideslip,
//! and yaw rate follows steering by the car's inertia: a lag between these is the car's, and belongs to the fit. But one
//! accelerometer measures both accelerations: as late as it is along the car, it is across.

use super::calibration::{Calibration, Declared, Finding, FindingKind};
use super::derived::{acceleration, acceleration_span, moving, product, unbraked};
use super::log::Log;
use super::role::Role;
use super::statistics::{Lag, best_lag, smoothed};

/// Greatest delay in the search, s.
const MOST_DELAY_S: f64 = 0.5;
/// Shortest delay that is taken off, s: the geometry of wheels and turning looks like a few milliseconds.
const LEAST_DELAY_S: f64 = 0.02;
/// Shortest delay that is taken off, sample intervals: interpolating would blur more than it moves.
const LEAST_SHIFT: f64 = 0.5;
/// A delay is this many standard errors long, at least.
const SURE: f64 = 5.0;
/// Share of the squared difference of two channels that a delay explains, at least: of channels with clocks of their own, and of
/// those that were logged on one clock, which are late relative to each other less often.
const EXPLAINS: [f64; 2] = [0.05, 0.15];
/// Share of a channel's variance that the other one accounts for, at least: less is noise.
const FOLLOWS: f64 = 0.3;

/// What the delays of a log are found from.
pub(super) struct Evidence<'a> {
    /// The log before any correction.
    pub log: &'a Log,
    pub declared: &'a Declared,
    /// The wheels of the axle that is not driven, left and right.
    pub undriven: [usize; 2],
    /// Whether two channels are known to have been sampled at the same times.
    pub one_clock: &'a dyn Fn(Role, Role) -> bool,
    /// Whether one sensor may measure both accelerations: they have the same times and unit.
    pub one_accelerometer: bool,
}

impl Evidence<'_> {
    fn shortest(&self) -> f64 {
        LEAST_DELAY_S.max(LEAST_SHIFT * self.log.dt_s)
    }

    fn most(&self) -> usize {
        (MOST_DELAY_S / self.log.dt_s).ceil() as usize
    }

    /// Least share that a delay between two channels must explain.
    fn share(&self, a: Role, b: Role) -> f64 {
        EXPLAINS[usize::from((self.one_clock)(a, b))]
    }

    /// Why a lag that differs from the expected one (both in s) is not believed; empty if it is.
    fn doubt(&self, lag: &Lag, expected_s: f64, (a, b): (Role, Role)) -> Option<String> {
        let delay = lag.samples * self.log.dt_s - expected_s;
        if delay.abs() < self.shortest() {
            return Some(format!("below the threshold of {:.3} s", self.shortest()));
        }
        if delay.abs() < SURE * lag.standard_error * self.log.dt_s {
            return Some(format!("shorter than {SURE} standard errors"));
        }
        let share = self.share(a, b);
        (lag.explained < share).then(|| {
            format!(
                "it explains {:.0} % of the squared difference, where {:.0} % are needed",
                100.0 * lag.explained,
                100.0 * share
            )
        })
    }

    fn believed(&self, lag: &Lag, pair: (Role, Role)) -> bool {
        self.doubt(lag, 0.0, pair).is_none()
    }
}

/// Where a channel stands relative to ground speed, and why.
struct Placed {
    role: Role,
    /// s later than ground speed.
    late_s: f64,
    /// The lag that it has if it is right, s.
    expected_s: f64,
    lag: Lag,
    against: (Role, &'static str),
}

/// The clock that most channels agree on, s later than ground speed; of two with as many channels, that of yaw rate, or else the
/// earlier one: sensors are late, never early.
fn common_clock(votes: &[f64], yaw: Option<f64>, shortest: f64) -> f64 {
    let agreeing = |clock: f64| votes.iter().filter(|v| (*v - clock).abs() < shortest).count();
    let of_yaw = |clock: f64| yaw.is_some_and(|yaw| (yaw - clock).abs() < shortest);
    let better = |a: f64, b: f64| {
        let rank = |clock: f64| (agreeing(clock), of_yaw(clock));
        match rank(b).cmp(&rank(a)) {
            std::cmp::Ordering::Greater => b,
            std::cmp::Ordering::Equal if b < a => b,
            _ => a,
        }
    };
    votes.iter().copied().reduce(better).unwrap_or(0.0)
}

/// Adds the delays of a log's channels to its calibration.
pub(super) fn delays(evidence: &Evidence<'_>, calibration: &mut Calibration) {
    let Evidence {
        log,
        declared,
        undriven,
        ..
    } = evidence;
    let (dt, most) = (log.dt_s, evidence.most());
    let accel = acceleration(log);
    let (moving, free) = (moving(log), unbraked(log, &accel));
    let mut untold: Vec<&str> = Vec::new();

    // Free wheels roll with the ground. Their paths differ from the car's by its turning.
    let rolling = "ground speed, while the wheel is neither driven nor braked";
    let mut placed: Vec<Placed> = Vec::new();
    let logged = |wheel: &usize| !log.wheel_speed_radps[*wheel].is_empty();
    for wheel in undriven.iter().copied().filter(logged) {
        let role = Role::WHEELS[wheel];
        let columns = [&log.vx_mps[..], &log.yaw_rate_radps[..]];
        let lag = best_lag(&log.wheel_speed_radps[wheel], columns, &free, most, 0.0);
        match lag.filter(|lag| lag.follows >= FOLLOWS && !declared.speed_of_wheels) {
            Some(lag) => {
                let believed = evidence.believed(&lag, (role, Role::Vx));
                placed.push(Placed {
                    role,
                    late_s: if believed { lag.samples * dt } else { 0.0 },
                    expected_s: 0.0,
                    lag,
                    against: (Role::Vx, rolling),
                });
            }
            None if !declared.speed_of_wheels => untold.push(role.key()),
            None => {}
        }
    }
    let agree = |a: f64, b: f64| (a - b).abs() < evidence.shortest();
    let wheels_s = match &placed[..] {
        [left, right] if agree(left.late_s, right.late_s) => Some((left.late_s + right.late_s) / 2.0),
        [left, right] => Some(
            if left.late_s.abs() < right.late_s.abs() {
                left
            } else {
                right
            }
            .late_s,
        ),
        [one] => Some(one.late_s),
        _ => None,
    };
    let one_board = placed
        .iter()
        .all(|p| wheels_s.is_some_and(|s| agree(p.late_s, s)));
    if let (true, Some(late_s)) = (one_board, wheels_s) {
        placed.iter_mut().for_each(|p| p.late_s = late_s);
    }

    // A driven wheel's delay cannot be told from its slip; that it is late beside the other wheel of its axle can.
    let beside = "the other wheel of its axle";
    for (wheel, other) in [(0, 1), (1, 0), (2, 3), (3, 2)] {
        if undriven.contains(&wheel) || !logged(&wheel) || !logged(&other) {
            continue;
        }
        let (role, partner) = (Role::WHEELS[wheel], Role::WHEELS[other]);
        let columns = [&log.wheel_speed_radps[other][..], &log.yaw_rate_radps[..]];
        let lag = best_lag(&log.wheel_speed_radps[wheel], columns, &free, most, 0.0);
        let Some(lag) = lag.filter(|lag| lag.follows >= FOLLOWS) else {
            untold.push(role.key());
            continue;
        };
        let late = evidence.believed(&lag, (role, partner)) && lag.samples > 0.0;
        placed.push(Placed {
            role,
            late_s: wheels_s.unwrap_or(0.0) + if late { lag.samples * dt } else { 0.0 },
            expected_s: 0.0,
            lag,
            against: (partner, beside),
        });
    }

    // An axle's wheels differ by the track times yaw rate, and by their radii.
    let turning = "the speed difference of the wheels that are not driven";
    let [left, right] = undriven.map(|w| &log.wheel_speed_radps[w]);
    let difference: Vec<f64> = right.iter().zip(left).map(|(r, l)| r - l).collect();
    let columns = [&log.yaw_rate_radps[..], &log.vx_mps[..]];
    // Yaw rate is late where the difference comes early.
    let both = undriven.iter().all(logged);
    let lag = both.then(|| best_lag(&difference, columns, &free, most, 0.0));
    let lag = lag
        .flatten()
        .filter(|lag| one_board && lag.follows >= FOLLOWS)
        .map(|lag| Lag {
            samples: -lag.samples,
            ..lag
        });
    let pair = (Role::YawRate, Role::WHEELS[undriven[0]]);
    let yaw_s = lag.map(|lag| {
        let late_s = if evidence.believed(&lag, pair) {
            lag.samples * dt
        } else {
            0.0
        };
        let late_s = wheels_s.unwrap_or(0.0) + late_s;
        placed.push(Placed {
            role: Role::YawRate,
            late_s,
            expected_s: 0.0,
            lag,
            against: (pair.1, turning),
        });
        late_s
    });
    if let (true, Some(lag)) = (declared.speed_of_wheels, lag) {
        let lag = Lag {
            samples: -lag.samples,
            ..lag
        };
        placed.extend(undriven.map(|wheel| Placed {
            role: Role::WHEELS[wheel],
            late_s: 0.0,
            expected_s: 0.0,
            lag,
            against: (Role::YawRate, "yaw rate, by the speed difference of both wheels"),
        }));
    }
    if yaw_s.is_none() {
        untold.push(Role::YawRate.key());
    }

    let change = "the change of ground speed";
    let ax = smoothed(&log.ax_mps2, acceleration_span(log));
    let one = vec![1.0; log.samples()];
    let along = |expected_s: f64| {
        let lag = best_lag(&ax, [&accel, &one], &moving, most, expected_s / dt);
        lag.filter(|lag| lag.follows >= FOLLOWS)
    };
    // Without clear evidence either way it has no vote.
    let ax_vote = along(0.0).and_then(|lag| {
        let late_s = lag.samples * dt;
        let near = agree(late_s, 0.0);
        (near || evidence.believed(&lag, (Role::Ax, Role::Vx))).then_some(if near { 0.0 } else { late_s })
    });
    let votes = [Some(0.0), wheels_s, yaw_s, ax_vote];
    let votes: Vec<f64> = votes.into_iter().flatten().collect();
    let clock_s = match (declared.speed_of_wheels, yaw_s) {
        // Nothing is there to move the wheels by.
        (true, None) => 0.0,
        _ => common_clock(&votes, yaw_s, evidence.shortest()),
    };
    match along(clock_s) {
        Some(lag) => {
            let sure = evidence.doubt(&lag, clock_s, (Role::Ax, Role::Vx)).is_none();
            placed.push(Placed {
                role: Role::Ax,
                late_s: if sure { lag.samples * dt } else { clock_s },
                expected_s: clock_s,
                lag,
                against: (Role::Vx, change),
            });
        }
        None => untold.push(Role::Ax.key()),
    }

    if !declared.speed_of_wheels
        && let Some(wheel) = placed.iter().find(|p| p.role == Role::WHEELS[undriven[0]])
    {
        let lag = Lag {
            samples: -wheel.lag.samples,
            ..wheel.lag
        };
        placed.push(Placed {
            role: Role::Vx,
            late_s: 0.0,
            expected_s: 0.0,
            lag,
            against: (
                wheel.role,
                "the wheels that are not driven, where they are not braked",
            ),
        });
    }
    placed.sort_by_key(|p| p.role);
    for p in placed {
        let delay_s = p.late_s - clock_s;
        let seen_s = p.lag.samples * dt - p.expected_s;
        let is_declared = declared.delays.contains(&p.role);
        let applied = !is_declared && delay_s.abs() >= evidence.shortest();
        let mut said = format!(
            "against {}, which it follows by {:.4} s",
            p.against.1,
            p.lag.samples * dt
        );
        if applied {
            said.push_str(&format!(
                "; the lag explains {:.0} % of the squared difference, and the clock is the one on which most channels agree",
                100.0 * p.lag.explained
            ));
        } else if is_declared {
            said.push_str("; left alone: the channel map declares a delay");
        } else if let Some(doubt) = evidence.doubt(&p.lag, p.expected_s, (p.role, p.against.0)) {
            said.push_str("; ");
            said.push_str(&doubt);
        } else {
            said.push_str("; the other channel is the one that is off");
        }
        calibration.findings.push(Finding {
            role: p.role,
            kind: FindingKind::Delay,
            value: if applied { delay_s } else { seen_s },
            standard_error: Some(p.lag.standard_error * dt),
            threshold: Some(evidence.shortest().max(SURE * p.lag.standard_error * dt)),
            applied,
            correlation: None,
            samples: p.lag.used,
            evidence: said,
        });
    }
    if !untold.is_empty() {
        let note = format!(
            "{}: nothing tells clearly whether they are late",
            untold.join(", ")
        );
        calibration.notes.push(note);
    }
    let of_ax = calibration.finding(Role::Ax, FindingKind::Delay);
    let of_ax = of_ax.filter(|f| f.applied && f.value > 0.0 && evidence.one_accelerometer);
    if let Some(ax) = of_ax.filter(|_| !declared.delays.contains(&Role::Ay)) {
        let turning = product(&log.vx_mps, &log.yaw_rate_radps);
        let lag = best_lag(&log.ay_mps2, [&turning, &one], &moving, most, 0.0);
        if let Some(lag) = lag.filter(|lag| lag.follows >= FOLLOWS) {
            // The car's own lag comes on top of the sensor's.
            let behind_s = lag.samples * dt + yaw_s.map_or(0.0, |yaw_s| yaw_s - clock_s);
            let applied = behind_s >= ax.value - 0.5 * evidence.shortest();
            let mut said = format!(
                "from ax, which the same sensor measures; ay follows ground speed times yaw rate by {behind_s:.4} s, the car's own lag \
                 with it"
            );
            if !applied {
                said.push_str("; left alone: that is less than the delay of ax");
            }
            let finding = Finding {
                role: Role::Ay,
                applied,
                samples: lag.used,
                evidence: said,
                ..ax.clone()
            };
            calibration.findings.push(finding);
        }
    }
    let note = "ay, steer: no delay of their own is looked for, since their lags are the car's; delay_s in the channel map sets one";
    calibration.notes.push(note.to_owned());
}

#[cfg(test)]
mod tests {
    use super::common_clock;

    #[test]
    fn the_clock_is_that_of_most_channels() {
        let clock = |votes: &[f64], yaw| common_clock(votes, yaw, 0.02);
        assert_eq!(clock(&[0.0, 0.0, 0.14, 0.0], Some(0.14)), 0.0);
        assert_eq!(clock(&[0.0, -0.05, -0.05], Some(-0.05)), -0.05);
        assert_eq!(clock(&[0.0, 0.14, 0.0, 0.0], Some(0.0)), 0.0);
        // Of as many: that of yaw rate, or the earlier one.
        assert_eq!(clock(&[0.0, -0.04, -0.07, 0.05], Some(-0.07)), -0.07);
        assert_eq!(clock(&[0.0, -0.05], None), -0.05);
        assert_eq!(clock(&[0.0], None), 0.0);
    }
}
