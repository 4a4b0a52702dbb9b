//! One line alone, driven in `f64` with the greatest share of the grip that is held.

use super::corners::{CornerGrip, raise};
use super::energy::Ideal;
use super::state::DriveState;
use super::{NamedLine, Transient, planned};
use crate::drive::{Drive, DriverSettings, MotorTorque, drive_with_motor};
use crate::error::{Error, Result};
use crate::evaluate::BackendInfo;
use crate::files::run_folder::STATE;
use crate::line::energy::Mode;
use crate::line::{FineLine, PointMass};
use crate::study::framework::{Inputs, Progress, RunRecord, Watch, Work};
use crate::track::Circuit;
use crate::vehicle::{Car, Envelope, Traction};
use glam::DVec2;
use rayon::prelude::*;

/// Sample interval of the drive that is kept (s).
pub const INTERVAL_S: f64 = 0.01;
/// How much slower than the quasi-steady-state lap a driven lap may be, as a share of it.
pub const AGREEMENT: f64 = 0.005;

/// How much drivers steer against an angle to the path (rad per rad). Which is best depends on car and line: more follows the line more
/// closely, until the car swings.
pub const HEADING_GAINS: [f64; 4] = [1.0, 1.2, 1.4, 1.6];

/// Whether a driven lap, this much longer than its plan as a share of it, keeps up with the plan. One that is shorter does: the car cuts
/// the corners of a line that turns to and fro.
pub fn keeps_up(disagreement: f64) -> bool {
    disagreement <= AGREEMENT
}

/// What a line driven alone comes to.
#[derive(Clone, Debug)]
pub struct DrivenLine {
    /// The greatest share of the envelope's grip that the car and the driver held on the whole lap; where the laps agree with none,
    /// the share of the fastest driven lap.
    pub grip_share: f64,
    /// How the driver drives: the fastest of those with [`HEADING_GAINS`].
    pub driver: DriverSettings,
    /// The share that they held in each corner, where that was looked for.
    pub corners: Vec<CornerGrip>,
    /// The quasi-steady-state lap with all of the grip (s), where corners were looked at.
    pub full_grip_s: Option<f64>,
    /// The quasi-steady-state lap of a hybrid whose motor works.
    pub ideal: Option<Ideal>,
    /// Laps driven for the corners.
    pub(super) drives: usize,
    /// The envelope with that share.
    pub envelope: Envelope,
    /// The quasi-steady-state lap with the shares of the grip that were held.
    pub point_mass: FineLine,
    /// The lap that was driven.
    pub drive: Drive,
    /// Its time (s).
    pub lap_time_s: f64,
    /// The line as a circuit of its own, its widths the room that the car's side has to the edges.
    pub line: Circuit,
    /// Least room left between the car's side and an edge (m).
    pub margin_m: f64,
    /// Why greater shares failed: the share and what became of the car.
    pub failures: Vec<(f64, String)>,
    /// How it ran.
    pub record: RunRecord,
}

impl DrivenLine {
    /// How far the driven lap is off the quasi-steady-state lap, as a share of it.
    pub fn disagreement(&self) -> f64 {
        let point_mass = self.point_mass.lap_time_s().unwrap_or(f64::NAN);
        self.lap_time_s / point_mass - 1.0
    }
}

/// Drives the first of the lines; nothing if the observer ends it.
///
/// # Errors
/// [`Error::Study`] if the car gets round with none of the shares; [`Error::Input`] if the state belongs to other inputs;
/// [`Error::Io`] if it cannot be saved.
pub(super) fn drive(work: Work<'_, Transient>) -> Result<Option<DrivenLine>> {
    let watch = Watch::begin();
    let mut record = RunRecord::of(&BackendInfo::reference());
    let found = greatest_share(work)?;
    Ok(found.map(|mut found| {
        let elapsed_s = watch.elapsed_s();
        record.took(
            (HEADING_GAINS.len() * (found.failures.len() + 1) + found.drives) as u64,
            elapsed_s,
            elapsed_s,
        );
        found.record = record;
        found
    }))
}

fn greatest_share(work: Work<'_, Transient>) -> Result<Option<DrivenLine>> {
    let (car, limits) = (&work.prepared.car, &work.prepared.road.car);
    let Some(line) = work.prepared.lines.first() else {
        return Err(Error::input("the study", "line", "none", "a line to drive"));
    };
    let NamedLine {
        points_m, circuit, ..
    } = line;
    let parts = (car, limits, line);
    let motor = &work.prepared.motor;
    let Work {
        settings,
        state,
        state_file,
        observe,
        ..
    } = work;
    let racing = DriverSettings::racing(car)?;
    let drivers = HEADING_GAINS.map(|heading_gain| DriverSettings {
        heading_gain,
        ..racing.clone()
    });
    // The greatest first.
    let shares: Vec<f64> = settings.shares().into_iter().rev().collect();
    let mut inputs = Inputs::new("transient");
    inputs.add(&(car, limits, points_m, circuit, &shares, motor));
    let inputs = inputs.key();
    let mut state = match state {
        Some(state) => state.line()?,
        None => DriveState::new(settings.clone()),
    };
    if state.inputs.as_ref().is_some_and(|began| *began != inputs) {
        let expected = "the files that the drive reads as they were when it began";
        return Err(Error::input(STATE, "inputs of the study", "others", expected));
    }
    state.inputs = Some(inputs);
    state_file.save(&state)?;
    let traction = Traction::of(car, &limits.envelope);
    let attempt = |share: f64| -> Result<Option<DrivenLine>> {
        let (envelope, mut point_mass, mut plan) = planned(limits, &traction, line, share)?;
        let ideal = match motor {
            Some(motor) => {
                let within = PointMass {
                    envelope: envelope.clone(),
                    ..limits.clone()
                };
                let ideal = motor.ideal(&within, Traction::of(car, &envelope), &point_mass, &line.drs)?;
                let (lap, speeds) = ideal.profile(&point_mass);
                (point_mass.lap, plan) = (Some(lap), speeds);
                Some(ideal)
            }
            None => None,
        };
        let torque_nm = |station_m, speed_mps| {
            let of = |ideal: &Ideal| ideal.torque_nm(station_m, speed_mps);
            ideal.as_ref().map_or(0.0, of)
        };
        // In the engine's place the motor adds nothing to what the driver can have.
        let adds = motor.as_ref().is_some_and(|motor| motor.mode == Mode::Additional);
        let driven = drivers.par_iter().map(|driver| {
            let motor = adds.then_some(&torque_nm as MotorTorque<'_>);
            let drive = drive_with_motor(car, circuit, plan.clone(), driver, INTERVAL_S, motor)?;
            let lap_time_s = drive.lap_time_s(circuit.length_m, INTERVAL_S);
            Ok(lap_time_s.map(|lap_time_s| (lap_time_s, (driver, drive))))
        });
        let driven: Vec<Result<_>> = driven.collect();
        let Some((lap_time_s, (driver, drive))) = fastest(driven)? else {
            return Ok(None);
        };
        Ok(Some(DrivenLine {
            ideal,
            grip_share: share,
            driver: driver.clone(),
            corners: Vec::new(),
            full_grip_s: None,
            drives: 0,
            envelope,
            point_mass,
            lap_time_s,
            margin_m: drive.least_room_m(circuit),
            drive,
            line: circuit.clone(),
            failures: Vec::new(),
            record: RunRecord::default(),
        }))
    };
    let mut best = state.best.map(attempt).transpose()?.flatten();
    if let Some(best) = &mut best {
        let before = state.failures.iter();
        let before = before.take_while(|(failed, _)| *failed != best.grip_share);
        best.failures = before.cloned().collect();
    }
    if state.corners.is_some()
        && let Some(base) = best
    {
        return raise(parts, &shares, base, &mut state, state_file, observe);
    }
    let planned = shares.len();
    let beyond_lock = beyond_lock(car, points_m)?;
    // A car that leaves such a line with the least grip, at its slowest, leaves it with any.
    if state.tried == 0
        && !beyond_lock.is_empty()
        && let Some(least) = shares.last()
        && let Err(Error::Study(why)) = attempt(*least)
    {
        state.failures.push((*least, why));
        state.tried = planned;
    }
    // A few at once: the greatest that works ends the search.
    let together = rayon::current_num_threads().max(2);
    while state.tried < planned {
        if observe(&Progress::counted(state.tried as u64, planned as u64)).is_break() {
            state_file.save(&state)?;
            return Ok(None);
        }
        let end = planned.min(state.tried + together);
        let batch = &shares[state.tried..end];
        let found: Vec<_> = batch.par_iter().map(|share| (*share, attempt(*share))).collect();
        for (share, driven) in found {
            match driven {
                Ok(None) => {}
                Ok(Some(mut outcome)) => {
                    outcome.failures.clone_from(&state.failures);
                    let off = outcome.disagreement();
                    if keeps_up(off) {
                        state.best = Some(share);
                        // Accounts are those of a lap with one share of the grip.
                        if outcome.ideal.is_some() {
                            state.tried = end;
                            return Ok(Some(outcome));
                        }
                        return raise(parts, &shares, outcome, &mut state, state_file, observe);
                    }
                    // It gets round, but more slowly than its plan: the limits are not held yet.
                    let why = format!(
                        "the driven lap is {:+.2}% off the quasi-steady-state lap",
                        100.0 * off
                    );
                    state.failures.push((share, why));
                    let faster = best
                        .as_ref()
                        .is_none_or(|b: &DrivenLine| outcome.lap_time_s < b.lap_time_s);
                    if faster {
                        state.best = Some(share);
                        best = Some(outcome);
                    }
                }
                Err(error @ (Error::Input { .. } | Error::Memory { .. })) => return Err(error),
                Err(error) => state.failures.push((share, error.to_string())),
            }
        }
        state.tried = end;
        if state_file.due() {
            state_file.save_or_warn(&state);
        }
    }
    if let Some(best) = best {
        return Ok(Some(best));
    }
    let last = state
        .failures
        .last()
        .map_or(String::new(), |(share, why)| format!(" (at {share:.2}: {why})"));
    Err(Error::Study(format!(
        "the car does not get round the line with any share of the envelope's grip that was tried{last}; {beyond_lock}a line with \
         more room to the edges (found for a wider car), or through more sections, is easier to drive"
    )))
}

/// The fastest of several laps with their times (s); where none came round, what became of the first.
fn fastest<T>(driven: Vec<Result<Option<(f64, T)>>>) -> Result<Option<(f64, T)>> {
    let (mut best, mut lost): (Option<(f64, T)>, _) = (None, None);
    for lap in driven {
        match lap {
            Ok(Some(lap)) => {
                if best.as_ref().is_none_or(|(best_s, _)| lap.0 < *best_s) {
                    best = Some(lap);
                }
            }
            Ok(None) => {}
            Err(error @ Error::Study(_)) => lost = lost.or(Some(error)),
            Err(error) => return Err(error),
        }
    }
    match (best, lost) {
        (None, Some(lost)) => Err(lost),
        (best, _) => Ok(best),
    }
}

/// Room that a driver needs to correct on his steering lock, as a share of it.
const LOCK_SPARE: f64 = 0.05;

/// Where the line bends more than the car can on its steering lock, but for what a driver needs to correct; nothing where it does not.
fn beyond_lock(car: &Car, points_m: &[DVec2]) -> Result<String> {
    let line = FineLine::new(points_m, true, 1.0, None, 0.0)?;
    let bends = line.curvature_1pm.iter().zip(&line.station_m);
    let Some((bend, station_m)) = bends.max_by(|a, b| a.0.abs().total_cmp(&b.0.abs())) else {
        return Ok(String::new());
    };
    let wheelbase_m = car.chassis.cg_to_front + car.chassis.cg_to_rear;
    let least_m = wheelbase_m / car.max_steer_rad;
    let radius_m = 1.0 / bend.abs();
    Ok(if radius_m * (1.0 - LOCK_SPARE) < least_m {
        format!(
            "the line has a radius of {radius_m:.1} m at {station_m:.0} m, and the car turns one of {least_m:.1} m on its steering lock; "
        )
    } else {
        String::new()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fastest_driver_is_taken() {
        let lost = |why: &str| Err(Error::Study(why.to_owned()));
        let driven = vec![
            lost("spins"),
            Ok(Some((81.0, 'b'))),
            Ok(Some((80.0, 'c'))),
            Ok(None),
        ];
        assert_eq!(fastest(driven).expect("laps"), Some((80.0, 'c')));
        assert_eq!(fastest::<char>(vec![Ok(None)]).expect("no lap"), None);
        let all_lost = fastest::<char>(vec![lost("spins"), lost("leaves the track")]);
        assert_eq!(all_lost.expect_err("none comes round").to_string(), "spins");
        let bad = Err(Error::input("the line", "points", "2", "a lap"));
        let bad = fastest(vec![Ok(Some((80.0, 'c'))), bad]);
        assert!(matches!(bad, Err(Error::Input { .. })));
    }
}
