//! Figures of candidates as kernels read them.

use crate::error::Result;
use rayon::prelude::*;

/// Figures that a thread writes at a time: as many of a candidate as share a line of the processor's cache.
const MOST_ROWS: usize = 8;
/// Candidates that it reads before it goes on to the next figure.
const CANDIDATES: usize = 64;

/// The `width` figures of `candidates` candidates, figure by figure with the distance `stride`, so that neighbouring lanes read
/// neighbouring memory; `figure` gives a figure of a candidate.
pub(in crate::evaluate) fn planes(
    [candidates, stride, width]: [usize; 3],
    figure: impl Fn(usize, usize) -> f32 + Sync,
) -> Vec<f32> {
    let mut all = vec![0.0f32; stride * width];
    let rows = (width / rayon::current_num_threads()).clamp(1, MOST_ROWS);
    all.par_chunks_mut((rows * stride).max(1))
        .enumerate()
        .for_each(|(part, planes)| {
            for first in (0..candidates).step_by(CANDIDATES) {
                let some = first..candidates.min(first + CANDIDATES);
                for (plane, k) in planes.chunks_exact_mut(stride).zip(part * rows..) {
                    for (out, candidate) in plane[some.clone()].iter_mut().zip(some.clone()) {
                        *out = figure(candidate, k);
                    }
                }
            }
        });
    all
}

/// Lets a device `work` on the figures that `make` makes of each batch, in their order. The figures of the next batch are made
/// meanwhile.
///
/// # Errors
/// The first of those of `work`.
pub(in crate::evaluate) fn made_ahead<B: Copy + Send + Sync, F: Send>(
    mut batches: impl Iterator<Item = B>,
    make: impl Fn(B) -> F + Sync,
    mut work: impl FnMut(B, F) -> Result<()> + Send,
) -> Result<()> {
    let made = |batch: B| (batch, make(batch));
    let mut next = batches.next().map(made);
    while let Some((batch, figures)) = next {
        let following = batches.next();
        let (worked, ready) = rayon::join(|| work(batch, figures), || following.map(made));
        worked?;
        next = ready;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{made_ahead, planes};
    use crate::error::Error;

    #[test]
    fn batches_are_worked_on_in_order_until_one_fails() {
        let mut seen = Vec::new();
        let work = |batch: usize, figures: usize| {
            seen.push((batch, figures));
            match batch {
                7 => Err(Error::Device("gone".to_owned())),
                _ => Ok(()),
            }
        };
        assert!(made_ahead(3..20, |batch| batch * batch, work).is_err());
        assert_eq!(seen, [(3, 9), (4, 16), (5, 25), (6, 36), (7, 49)]);
    }

    #[test]
    fn every_figure_of_every_candidate_has_its_place() {
        for (candidates, stride, width) in [(0, 0, 3), (1, 64, 1), (63, 64, 0), (130, 192, 19)] {
            let all = planes([candidates, stride, width], |candidate, k| {
                (1 + candidate * width + k) as f32
            });
            assert_eq!(all.len(), stride * width);
            for (place, value) in all.into_iter().enumerate() {
                let (k, candidate) = (place / stride, place % stride);
                let there = candidate < candidates;
                assert_eq!(
                    value,
                    if there {
                        (1 + candidate * width + k) as f32
                    } else {
                        0.0
                    }
                );
            }
        }
    }
}
