//! What limits the results of an identification, in words.

use super::results::Summary;
use super::setup::Setup;
use crate::evaluate::Failure;
use crate::evaluate::replay::ReplayProblem;

/// The notes of a run.
pub(super) fn notes(setup: &Setup, summary: &Summary) -> Vec<String> {
    let mut notes = Vec::new();
    if let Some(choice) = &summary.choice {
        notes.push(choice.to_text());
    } else if summary.total_parameter_error.is_none()
        && 2 * summary.unidentifiable.len() >= summary.parameters.len()
    {
        notes.push(
            "Half of the parameters or more cannot be told from this log. With free = \"auto\" those that it can tell are found.".to_owned(),
        );
    }
    let given = setup.replay.free.values_in(setup.replay.free.base());
    for (v, value) in setup.replay.problem.variables.iter().zip(given) {
        if !(v.lower..=v.upper).contains(&value) {
            notes.push(format!(
                "The starting car has {} = {value} {}, outside of the bounds within which it was looked for ({} to {}).",
                v.name, v.unit, v.lower, v.upper
            ));
        }
    }
    if let Some(window_s) = setup.windows_instead_s {
        notes.push(format!(
            "The starting car does not drive the laps to their end, and few others would. The log is scored in windows of {window_s} s \
             that start from the logged state (window_s sets their length)."
        ));
    }
    if setup.windows_left_out > 0 {
        let all = setup.windows_left_out + setup.replay.plan.windows.len();
        notes.push(format!(
            "{} of {all} windows are not fitted: the car that the choice of parameters came to is lost in them. It was driven beyond \
             what this model of it can do, or starts too far from the car that drove.",
            setup.windows_left_out
        ));
    }
    let (taken, needed) = (summary.substeps, summary.substeps_needed);
    if needed > taken {
        notes.push(format!(
            "The steps were too long for the car that was found: it needs {needed} steps per sample, {taken} were taken. Its \
             motions are not reliable; fit again with substeps = {needed}."
        ));
    }
    let word = Failure::StepTooLong.word();
    if let Some(lost) = summary.record.failures.get(word) {
        let finer = steps_at_bounds(&setup.replay).max(taken + 1);
        notes.push(format!(
            "Of the candidates that were lost, {lost} need more steps per sample than {taken} and may be no worse than others. If \
             stiff cars are to be found, fit with substeps = {finer}."
        ));
    }
    if setup.without_run_up > 0 {
        let (settle_s, places) = (setup.settle_s, setup.without_run_up);
        notes.push(format!(
            "Sideslip and roll are not logged, so that each window is driven for {settle_s:.1} s before it is scored. The log has no \
             such time ahead of {places} of the laps or sections fitted: their first {settle_s:.1} s do not count."
        ));
    }
    if setup
        .circuit
        .as_ref()
        .is_some_and(|circuit| circuit.relief.is_some())
    {
        notes.push(
            "The track has height, banking or friction. Replays are those of a level and dry road: what these do to the car is taken \
             for the car's own."
                .to_owned(),
        );
    }
    let freed = ["drs_drag_percent", "drs_downforce_percent"];
    let frees = setup
        .replay
        .problem
        .variables
        .iter()
        .any(|v| freed.contains(&v.name.as_str()));
    let has_drs = frees || setup.replay.free.car.chassis.with_open_drs().is_some();
    if has_drs && setup.log.drs.iter().all(|open| *open == 0.0) {
        notes.push("The car has a DRS, and the log has no channel in which it is open: it counts as shut throughout.".to_owned());
    }
    notes
}

/// Steps per sample that the starting car needs with any one of its unknowns at either bound.
fn steps_at_bounds(replay: &ReplayProblem) -> usize {
    let given = replay.free.values_in(replay.free.base());
    let mut most = 1;
    for (k, v) in replay.problem.variables.iter().enumerate() {
        for bound in [v.lower, v.upper] {
            let mut candidate = given.clone();
            candidate[k] = bound;
            most = most.max(replay.steps_needed(&replay.flat(&candidate)));
        }
    }
    most
}
