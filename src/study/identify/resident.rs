//! The first swarm where it lives on the device that drives its cars.

use super::search::on_device;
use super::settings::IdentifySettings;
use super::setup::Setup;
use super::state::{Place, SearchState};
use crate::error::Result;
use crate::evaluate::{BackendInfo, Losses};
use crate::swarm::{Optimiser, Progress, SwarmAtWork, SwarmState};

/// The swarm at work. The state of the search has it as it was when the work began.
pub(super) struct Resident<'a>(SwarmAtWork<'a>);

impl<'a> Resident<'a> {
    /// The swarm of a search that is to live on the device and is not done.
    ///
    /// # Errors
    /// As [`SwarmAtWork::open`]; [`crate::Error::Input`] if it is asked to live there and cannot.
    pub fn of(settings: &'a IdentifySettings, setup: &'a Setup, state: &SearchState) -> Result<Option<Self>> {
        let Place::Front(swarm) = &state.place else {
            return Ok(None);
        };
        if !on_device(settings, setup)? {
            return Ok(None);
        }
        let begun = SwarmState {
            swarm: swarm.clone(),
            losses: Losses {
                failures: state.failures.clone(),
                device_faults: state.device_faults.clone(),
            },
        };
        let backend = (settings.backend, settings.adapter.as_deref());
        let known = &state.device_faults;
        SwarmAtWork::open(&setup.replay, begun, true, backend, known).map(|swarm| Some(Self(swarm)))
    }

    /// One iteration, as [`Place::advance`] tells it.
    ///
    /// # Errors
    /// As [`SwarmAtWork::step`].
    pub fn advance(&mut self) -> Result<Option<(&'static str, usize, Progress)>> {
        if self.0.done() {
            return Ok(None);
        }
        let progress = self.0.step()?;
        Ok(Some(("exploring", self.0.planned_iterations(), progress)))
    }

    /// The state of the search with the swarm as it is on the device. If the device does not give it, as it was before: the same
    /// comes of that.
    pub fn kept(&mut self, state: &SearchState) -> SearchState {
        let mut kept = state.clone();
        put(self.0.state(), &mut kept);
        kept
    }

    /// Puts the swarm into the state of the search; says what evaluated last.
    ///
    /// # Errors
    /// As [`SwarmAtWork::finish`].
    pub fn finish(self, state: &mut SearchState) -> Result<BackendInfo> {
        let backend = self.0.backend();
        put(&self.0.finish()?, state);
        Ok(backend)
    }
}

/// Puts a swarm into the state of its search, with what is noted of its iterations.
fn put(now: &SwarmState, state: &mut SearchState) {
    state.history.truncate(now.swarm.iteration());
    state.failures.clone_from(&now.losses.failures);
    state.device_faults.clone_from(&now.losses.device_faults);
    state.place = Place::Front(now.swarm.clone());
}
