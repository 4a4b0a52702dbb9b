//! Studies through the library: what they find, what they write, and that they go on where they were.

mod circuits;
mod hybrid;
mod identify;
#[path = "../../examples/circuits/shapes.rs"]
mod made;
mod models;
mod registry;
mod reproduce;
mod resume;
mod roads;
mod sensitivity;
#[path = "../common/studies.rs"]
#[allow(dead_code)] // Others kill longer ones.
mod small_studies;
mod states;
mod surface;
mod sweep;
mod transient;

use lapswarm::study::framework::state_file::StateFile;
use lapswarm::study::framework::{Progress, Study, Work};
use std::ops::ControlFlow;
use std::sync::Arc;

/// Solves a study that is watched, from a state if one is given.
fn solve<S: Study>(
    settings: &S::Settings,
    prepared: &S::Prepared,
    (state, state_file): (Option<S::State>, &mut StateFile),
    mut observe: impl FnMut(&Progress) -> ControlFlow<()>,
) -> lapswarm::Result<Option<S::Outcome>> {
    S::solve(Work {
        settings,
        prepared,
        state,
        state_file,
        observe: &mut observe,
        stop: Arc::default(),
    })
}
