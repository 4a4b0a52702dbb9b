//! What follows the swarm: polish, hops over into deeper minima, and the polish with the noise for weights.

use super::hops::{gains, hop, looks_like_noise};
use super::identifiability::noise_of;
use super::polish::{MOST_DRIVES, polish_watched};
use super::settings::IdentifySettings;
use super::setup::{CHANNELS, Setup};
use crate::error::Result;
use crate::evaluate::Evaluator;
use std::ops::ControlFlow;

/// What the refinement came to.
pub(super) struct Refined {
    pub candidate: Vec<f64>,
    /// Drives that it took, those of the hops' starts left out.
    pub drives: usize,
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
        drives: 0,
        hops: 0,
        hops_gained: 0,
        interrupted: false,
    };
    let spread = setup.scales.map(|s| 1.0 / s);
    let Some(polished) = polish_watched(replay, candidate, spread, MOST_DRIVES, watch) else {
        return Ok(refined);
    };
    refined.drives += polished.evaluations;
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
        let noise = noise_of(&residuals.errors, &setup.scales);
        if (0..CHANNELS).all(|k| noise[k] < EXACT * setup.scales[k]) {
            return Ok(refined);
        }
        if refined.hops == hops || looks_like_noise(&residuals.errors) {
            // Maximum likelihood for white noise of these sizes.
            let weights = noise.map(|n| 1.0 / n);
            if let Some(p) = polish_watched(replay, &refined.candidate, weights, MOST_DRIVES, watch) {
                refined.drives += p.evaluations;
                refined.interrupted = p.interrupted;
                refined.candidate = p.candidate;
            }
            return Ok(refined);
        }
        let from = (&refined.candidate[..], spread);
        let hopped = hop(replay, evaluator, from, (settings.seed, refined.hops), watch)?;
        refined.hops += 1;
        if let Some(hopped) = hopped {
            refined.drives += hopped.evaluations;
            refined.interrupted = hopped.interrupted;
            if gains(&hopped, cost) {
                refined.hops_gained += 1;
                cost = hopped.cost;
                refined.candidate = hopped.candidate;
            }
        }
    }
}
