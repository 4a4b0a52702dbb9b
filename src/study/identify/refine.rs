//! What follows the swarm: polish, hops over into deeper minima, and the polish with the noise for weights where the errors
//! that remain are noise.

use super::hops::{self, STARTS, gains, hop, looks_like_noise};
use super::identifiability::{noise_of, weights_of};
use super::polish::{DRIVES_A_STEP, MOST_STEPS, polish_observed};
use super::settings::IdentifySettings;
use super::setup::{CHANNELS, Setup};
use crate::error::Result;
use crate::evaluate::Evaluator;
use std::ops::ControlFlow;

/// What the refinement came to.
pub(super) struct Refined {
    pub candidate: Vec<f64>,
    /// Hops that were tried, and that led further down.
    pub hops: usize,
    pub hops_gained: usize,
    pub interrupted: bool,
}

/// Errors of every channel under this share of its spread are rounding, and there is no noise to weight by.
const EXACT: f64 = 1e-7;

/// Refines the swarm's `candidate`. `watch` is asked before each drive and may break it off.
///
/// # Errors
/// Those of the evaluator.
pub(super) fn refine(
    settings: &IdentifySettings,
    setup: &Setup,
    evaluator: &mut dyn Evaluator,
    candidate: &[f64],
    watch: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<Refined> {
    let replay = &setup.replay;
    let mut refined = Refined {
        candidate: candidate.to_vec(),
        hops: 0,
        hops_gained: 0,
        interrupted: false,
    };
    let spread = setup.scales.map(|s| 1.0 / s);
    let Some(polished) = polish_observed(replay, candidate, spread, MOST_STEPS, watch) else {
        return Ok(refined);
    };
    refined.interrupted = polished.interrupted;
    refined.candidate = polished.candidate;
    let mut cost = polished.cost;
    // Of several objectives the front is the answer, and its middle has no one minimum.
    let hops = if settings.objectives.len() == 1 {
        settings.hops
    } else {
        0
    };
    loop {
        if refined.interrupted {
            return Ok(refined);
        }
        let Some(residuals) = replay.residuals(&refined.candidate) else {
            return Ok(refined);
        };
        let noise = noise_of(&residuals.errors, &setup.scales, replay.dimensions());
        if (0..CHANNELS).all(|k| noise[k] < EXACT * setup.scales[k]) {
            return Ok(refined);
        }
        if refined.hops == hops || looks_like_noise(&residuals.errors) {
            let weights = weights_of(&residuals.errors, &setup.scales, replay.dimensions());
            if weights == spread {
                return Ok(refined);
            }
            if let Some(p) = polish_observed(replay, &refined.candidate, weights, MOST_STEPS, watch) {
                refined.interrupted = p.interrupted;
                refined.candidate = p.candidate;
            }
            return Ok(refined);
        }
        let hopped = hop(
            replay,
            evaluator,
            spread,
            cost,
            (settings.seed, refined.hops),
            watch,
        )?;
        refined.hops += 1;
        if let Some(hopped) = hopped {
            refined.interrupted = hopped.interrupted;
            if gains(&hopped, cost) {
                refined.hops_gained += 1;
                cost = hopped.cost;
                refined.candidate = hopped.candidate;
            }
        }
    }
}

/// Rounds of [`restarted`] at the most. Each leaves a small share of what the one before was off by.
const ROUNDS: usize = 4;
/// Steps that a round may take: it begins close to where it ends.
const ROUND_STEPS: usize = 25;
/// A round that moves no parameter by more than this share of its range is the last.
const MOVED: f64 = 1e-5;

/// Drives of the polish at the most, with hops and rounds, and the starts that hops draw.
pub(super) fn most_drives(settings: &IdentifySettings) -> u64 {
    if !settings.polish {
        return 0;
    }
    let hops = if settings.objectives.len() == 1 {
        settings.hops
    } else {
        0
    };
    let polished = |steps: usize| (1 + DRIVES_A_STEP * steps) as u64;
    let hop = STARTS as u64 + polished(hops::MOST_STEPS);
    (2 * polished(MOST_STEPS) + ROUNDS as u64 * polished(ROUND_STEPS))
        .saturating_add(hop.saturating_mul(hops as u64))
}

/// Goes on with windows that start where the car found so far comes, until that changes nothing any more: a car is to be judged
/// from its own sideslip and roll, and not from those of the starting car. The candidate, and whether this was interrupted.
pub(super) fn restarted(
    setup: &Setup,
    mut candidate: Vec<f64>,
    watch: &mut dyn FnMut() -> ControlFlow<()>,
) -> (Vec<f64>, bool) {
    let mut replay = setup.replay.clone();
    for _ in 0..ROUNDS {
        let before = replay.plan.windows.clone();
        replay.start_as_driven_by(&replay.flat(&candidate));
        if replay.plan.windows == before {
            break;
        }
        let Some(residuals) = replay.residuals(&candidate) else {
            break;
        };
        let weights = weights_of(&residuals.errors, &setup.scales, replay.dimensions());
        let Some(polished) = polish_observed(&replay, &candidate, weights, ROUND_STEPS, watch) else {
            break;
        };
        let variables = replay.problem.variables.iter();
        let moved = variables
            .zip(candidate.iter().zip(&polished.candidate))
            .map(|(v, (a, b))| (a - b).abs() / (v.upper - v.lower))
            .fold(0.0, f64::max);
        candidate = polished.candidate;
        if polished.interrupted || moved < MOVED {
            return (candidate, polished.interrupted);
        }
    }
    (candidate, false)
}

#[cfg(test)]
mod tests {
    use super::super::{set_up, total_parameter_error};
    use super::*;
    use crate::evaluate::replay::open_evaluator;

    /// Where the swarm ended with seed 7: a minimum of the bundled lap that least squares does not leave.
    const SECOND_MINIMUM: [f64; 22] = [
        10.0291, 10.078, 1.35272, 0.881518, -0.295207, 0.0118127, 10.344, 9.05526, -0.0295591, 0.971715,
        -1.25888, 0.388244, 0.0109837, 0.0212609, 0.0580326, 0.0483849, -0.702109, 12.117, 2.3486, 9.19599,
        101461.0, 20281.1,
    ];

    #[test]
    #[ignore = "full tier: a whole polish"]
    fn a_second_minimum_is_left() {
        let settings = IdentifySettings::default();
        let setup = set_up(&settings).unwrap();
        let truth = setup.truth.clone().unwrap();
        let error = |candidate: &[f64]| total_parameter_error(candidate, &truth, |_| true);
        assert!(error(&SECOND_MINIMUM) > 3.0);
        let mut evaluator = open_evaluator(&setup.replay, settings.backend, None).unwrap();
        let mut refined = |hops: usize| {
            let settings = IdentifySettings {
                hops,
                seed: 7,
                ..settings.clone()
            };
            let mut watch = || ControlFlow::Continue(());
            refine(&settings, &setup, evaluator.as_mut(), &SECOND_MINIMUM, &mut watch).unwrap()
        };
        let stuck = refined(0);
        assert!(stuck.hops == 0 && error(&stuck.candidate) > 1.0);
        let free = refined(settings.hops);
        assert!(
            free.hops_gained > 0 && error(&free.candidate) < 1e-3,
            "{}",
            error(&free.candidate)
        );
    }
}
