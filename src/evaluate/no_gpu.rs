//! In the place of `gpu` in a build without that feature: there is no device.

pub use super::dispatches::DispatchWatch;

use super::{BackendChoice, BackendInfo, Evaluator, ProblemKind};
use crate::error::{Error, Result};

/// What devices would want of a kind of problem: nothing.
pub trait OnDevice: ProblemKind {}

impl<K: ProblemKind> OnDevice for K {}

pub(crate) fn none() -> Error {
    Error::NoDevice("this program was built without the feature `gpu`".to_owned())
}

/// There are none.
pub fn asks_for_all(_: Option<&str>) -> bool {
    false
}

pub(super) fn is_real() -> bool {
    false
}

pub(super) fn would_be(_: Option<&str>) -> Result<BackendInfo> {
    Err(none())
}

pub(super) fn open<'a, K: OnDevice>(
    _: &'a K,
    _: (BackendChoice, Option<&str>),
    _: impl Fn() -> Box<dyn Evaluator + 'a> + 'a,
) -> Result<Box<dyn Evaluator + 'a>> {
    Err(none())
}
