//! Which candidates take a lane, and their results in their places among those that do not.

use super::Failure;
use rayon::prelude::*;

/// Why candidates need not be evaluated, if so, and those that must.
pub(crate) fn sound<'c>(
    candidates: &[&'c [f64]],
    preliminary: impl Fn(&[f64]) -> Option<Failure> + Sync,
) -> (Vec<Option<Failure>>, Vec<&'c [f64]>) {
    let failures: Vec<_> = candidates.par_iter().map(|c| preliminary(c)).collect();
    let both = candidates.iter().zip(&failures);
    let rows = both.filter(|(_, failure)| failure.is_none()).map(|(c, _)| *c);
    let rows = rows.collect();
    (failures, rows)
}

/// What was found of those that were evaluated, in their places among those that were not.
pub(crate) fn joined<T>(
    preliminary: Vec<Option<Failure>>,
    mut found: impl Iterator<Item = T>,
) -> Vec<Result<T, Failure>> {
    preliminary
        .into_iter()
        .map(|failure| match failure {
            Some(failure) => Err(failure),
            None => found.next().ok_or(Failure::Undefined),
        })
        .collect()
}
