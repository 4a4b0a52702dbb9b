//! Starts elsewhere after the polish: a lap can have minima that least squares does not leave, and least squares comes to the
//! deepest from more than half of the starts that are the best of a thousand.

use super::polish::{Polished, polish_below};
use super::setup::CHANNELS;
use crate::error::Result;
use crate::evaluate::replay::ReplayProblem;
use crate::evaluate::{Evaluator, Logarithmic};
use crate::random::Random;
use std::ops::ControlFlow;

/// Starts that are drawn for a hop, anywhere within the bounds; the best of them is polished.
pub(super) const STARTS: usize = 1024;
/// Steps that a hop may take.
pub(super) const MOST_STEPS: usize = 60;
/// A hop counts that gains this share of the cost.
const LEAST_GAIN: f64 = 1e-3;
/// Purpose of the draws in the counter.
const DRAWS: u32 = 0x40b5;

/// Whether errors (row-major, one column for each channel) look like noise: none of the channels has neighbours more alike
/// than chance makes them in one of several thousand fits. What a wrong minimum leaves over is smooth along the lap.
pub(super) fn looks_like_noise(errors: &[f64]) -> bool {
    let count = errors.len() / CHANNELS;
    // The correlation of white noise with itself one sample later is normal, of variance 1/n: four deviations are exceeded by
    // one channel in 32,000, and there are four.
    let most = 4.0 / (count.max(1) as f64).sqrt();
    (0..CHANNELS).all(|k| {
        let channel = || errors.iter().skip(k).step_by(CHANNELS);
        let squares: f64 = channel().map(|e| e * e).sum();
        let products: f64 = channel().zip(channel().skip(1)).map(|(a, b)| a * b).sum();
        products <= most * squares
    })
}

/// Polishes the best of the starts of hop number `hop`, to the end if that comes to less than the cost `known`; `None` if none of the
/// starts drives.
///
/// # Errors
/// Those of the evaluator.
pub(super) fn hop(
    replay: &ReplayProblem,
    evaluator: &mut dyn Evaluator,
    weights: [f64; CHANNELS],
    known: f64,
    (seed, hop): (u64, usize),
    watch: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<Option<Polished>> {
    let mut seen = Logarithmic::new(evaluator);
    let random = Random::new(seed);
    let variables = &seen.problem().variables;
    let (dimensions, width) = (variables.len(), seen.problem().objectives.len());
    let starts: Vec<f64> = (0..STARTS)
        .flat_map(|start| {
            variables.iter().enumerate().map(move |(k, v)| {
                let share = random.uniform(DRAWS, hop as u32, start as u32, k as u32);
                v.lower + share * (v.upper - v.lower)
            })
        })
        .collect();
    let worths = seen.evaluate(&starts)?.worths(width);
    let best = (0..STARTS)
        .min_by(|&a, &b| worths[a].order(&worths[b]))
        .unwrap_or(0);
    if !worths[best].succeeded() {
        return Ok(None);
    }
    let start = seen.to_parameters(&starts[best * dimensions..(best + 1) * dimensions]);
    Ok(polish_below(
        gaining(known),
        replay,
        &start,
        weights,
        MOST_STEPS,
        watch,
    ))
}

/// The cost below which a hop counts, beside a minimum that is known.
fn gaining(known: f64) -> f64 {
    (1.0 - LEAST_GAIN) * known
}

/// Whether a polished hop is further down than the minimum that it began from.
pub(super) fn gains(hopped: &Polished, cost: f64) -> bool {
    hopped.cost < gaining(cost)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_looks_like_noise_and_a_ripple_under_it_does_not() {
        let random = Random::new(3);
        let rows = 7000;
        let errors = |ripple: f64| -> Vec<f64> {
            (0..rows * CHANNELS)
                .map(|i| {
                    let smooth = ripple * (i as f64 / 400.0).sin();
                    random.normal(1, 0, i as u32, 0) + if i % CHANNELS == 2 { smooth } else { 0.0 }
                })
                .collect()
        };
        assert!(looks_like_noise(&errors(0.0)));
        // A tenth of the noise's variance in one channel.
        assert!(!looks_like_noise(&errors(0.45)));
    }
}
