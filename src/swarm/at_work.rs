//! A swarm of several objectives at work in a study: on the host, or resident on the device that evaluates it.
//!
//! A resident swarm is read back when its state is to be saved. Steps since then follow from that state: after a fault of
//! the device they are taken again, on the device opened anew or in lanes on the host.

use super::{FrontSwarm, Optimiser, Progress, step};
use crate::error::Result;
#[cfg(feature = "gpu")]
use crate::evaluate::GpuBackend;
use crate::evaluate::{
    BackendChoice, BackendInfo, DeviceFaults, Evaluator, Losses, OnDevice, open_evaluator,
};
use serde::{Deserialize, Serialize};

#[cfg(feature = "gpu")]
use super::device::{DeviceMopso, DeviceObjectives};
#[cfg(feature = "gpu")]
use super::{Counters, Mopso};
#[cfg(feature = "gpu")]
use crate::error::Error;
#[cfg(feature = "gpu")]
use crate::evaluate::gpu::GpuContext;
#[cfg(feature = "gpu")]
use crate::evaluate::simd::InstructionSet;

/// A swarm off its device, and what went wrong until then: all that it takes to go on.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct SwarmState {
    pub swarm: FrontSwarm,
    pub losses: Losses,
}

/// A swarm on a device, and what evaluates it there.
#[cfg(feature = "gpu")]
type OnBoard<'a> = (DeviceMopso, Box<dyn DeviceObjectives + 'a>);

/// Brings a swarm to a device.
#[cfg(feature = "gpu")]
type Opening<'a> = Box<dyn Fn(&FrontSwarm) -> Result<OnBoard<'a>> + 'a>;

/// What it takes to bring a swarm to a device, and back if that fails.
#[cfg(feature = "gpu")]
struct Resident<'a> {
    /// `None` while the device is opened.
    on_board: Option<OnBoard<'a>>,
    open: Opening<'a>,
    lanes: Box<dyn Fn() -> Result<Box<dyn Evaluator + 'a>> + 'a>,
    /// Steps told when the device last failed.
    failed_at: Option<usize>,
}

enum Place<'a> {
    Host(Box<dyn Evaluator + 'a>, DeviceFaults),
    #[cfg(feature = "gpu")]
    Device(Box<Resident<'a>>),
}

/// A swarm at work.
pub(crate) struct SwarmAtWork<'a> {
    /// As it was last on the host: where it lives there, as it is.
    state: SwarmState,
    /// What has gone wrong until now.
    losses: Losses,
    /// Steps that have been told.
    told: usize,
    place: Place<'a>,
}

impl<'a> SwarmAtWork<'a> {
    /// The swarm of `state` over the variables of `kind`, `on_device` or on the host. Opened anew, a device may meet what is
    /// `known`.
    ///
    /// # Errors
    /// As [`open_evaluator`].
    pub fn open<K: OnDevice>(
        kind: &'a K,
        state: SwarmState,
        on_device: bool,
        (choice, adapter): (BackendChoice, Option<&'a str>),
        known: &[String],
    ) -> Result<Self> {
        let begin = |place, state: SwarmState| Self {
            losses: state.losses.clone(),
            told: state.swarm.iteration(),
            place,
            state,
        };
        #[cfg(not(feature = "gpu"))]
        if on_device {
            return Err(crate::evaluate::gpu::none());
        }
        #[cfg(feature = "gpu")]
        if on_device {
            let open = move |swarm: &FrontSwarm| -> Result<OnBoard<'a>> {
                let context = GpuContext::shared(adapter)?;
                let objectives = GpuBackend::new(kind, context.clone())?;
                let state = swarm.alone().and_then(Mopso::to_device).ok_or_else(|| {
                    Error::Study(
                        "only one swarm, in single precision and without constraints, goes to a device"
                            .to_owned(),
                    )
                })?;
                Ok((DeviceMopso::from_state(state, context)?, Box::new(objectives)))
            };
            let resident = Resident {
                on_board: None,
                open: Box::new(open),
                lanes: Box::new(move || open_evaluator(kind, BackendChoice::Simd, None)),
                failed_at: None,
            };
            let mut swarm = begin(Place::Device(Box::new(resident)), state);
            swarm.board(known, adapter)?;
            return Ok(swarm);
        }
        let evaluator = open_evaluator(kind, choice, adapter)?;
        let faults = DeviceFaults::beyond(known, evaluator.as_ref());
        Ok(begin(Place::Host(evaluator, faults), state))
    }

    /// What evaluates it now.
    pub fn backend(&self) -> BackendInfo {
        match &self.place {
            Place::Host(evaluator, _) => evaluator.backend(),
            #[cfg(feature = "gpu")]
            Place::Device(resident) => match &resident.on_board {
                Some((swarm, _)) => swarm.backend(),
                None => BackendInfo::of_lanes(InstructionSet::best()),
            },
        }
    }

    /// Iterations that it is to have.
    pub fn planned_iterations(&self) -> usize {
        self.state.swarm.planned_iterations()
    }

    /// Whether its planned iterations are done.
    pub fn done(&self) -> bool {
        self.told >= self.state.swarm.planned_iterations()
    }

    /// Asks, evaluates and tells once.
    ///
    /// # Errors
    /// Those of [`step`]. Faults of devices are among the losses instead.
    pub fn step(&mut self) -> Result<Progress> {
        let progress = self.reach(self.told + 1)?.unwrap_or_default();
        self.told += 1;
        match &mut self.place {
            Place::Host(evaluator, faults) => {
                self.losses.note(&progress.failures, faults, evaluator.as_ref());
            }
            #[cfg(feature = "gpu")]
            Place::Device(_) => crate::evaluate::add_failures(&mut self.losses.failures, &progress.failures),
        }
        Ok(progress)
    }

    /// Its state now. A device that does not give it leaves the last one, of which the same comes.
    pub fn state(&mut self) -> &SwarmState {
        if let Err(error) = self.read_back() {
            tracing::debug!("the swarm is not read back: {error}");
        }
        &self.state
    }

    /// The swarm after its last step, on the host.
    ///
    /// # Errors
    /// As [`SwarmAtWork::step`].
    pub fn finish(mut self) -> Result<SwarmState> {
        while let Err(error) = self.read_back() {
            self.survive(error)?;
            self.reach(self.told)?;
        }
        Ok(self.state)
    }

    fn read_back(&mut self) -> Result<()> {
        #[cfg(feature = "gpu")]
        if let Place::Device(resident) = &self.place {
            let (swarm, _) = resident.on_board.as_ref().ok_or_else(no_device)?;
            let swarm = Mopso::from_device(swarm.state()?);
            self.state.swarm.take_back(swarm);
        }
        self.state.losses.clone_from(&self.losses);
        Ok(())
    }

    /// Steps until so many iterations are done, whatever becomes of the device; what the last of them told, if any was needed.
    fn reach(&mut self, iterations: usize) -> Result<Option<Progress>> {
        loop {
            match self.go_to(iterations) {
                Ok(latest) => return Ok(latest),
                Err(error) => self.survive(error)?,
            }
        }
    }

    /// Only a device's errors are survived.
    #[cfg(not(feature = "gpu"))]
    fn survive(&mut self, error: crate::Error) -> Result<()> {
        Err(error)
    }

    fn go_to(&mut self, iterations: usize) -> Result<Option<Progress>> {
        let mut latest = None;
        match &mut self.place {
            Place::Host(evaluator, _) => {
                while self.state.swarm.iteration() < iterations {
                    latest = Some(step(&mut self.state.swarm, evaluator.as_mut())?);
                }
            }
            #[cfg(feature = "gpu")]
            Place::Device(resident) => {
                let (swarm, objectives) = resident.on_board.as_mut().ok_or_else(no_device)?;
                let planned = self.state.swarm.planned_iterations();
                let trail = self.state.swarm.trail_mut();
                while swarm.iteration() < iterations {
                    trail.begin();
                    let progress = swarm.step(objectives.as_mut())?;
                    let now = Counters {
                        iteration: progress.iteration,
                        evaluations: progress.evaluations,
                    };
                    trail.note(now, planned, || swarm.front().objectives);
                    latest = Some(progress);
                }
            }
        }
        Ok(latest)
    }
}

#[cfg(feature = "gpu")]
fn no_device() -> Error {
    Error::Device("there is no device".to_owned())
}

#[cfg(feature = "gpu")]
impl SwarmAtWork<'_> {
    /// Only a device's errors are survived.
    fn survive(&mut self, error: Error) -> Result<()> {
        match error {
            Error::Device(message) if matches!(self.place, Place::Device(_)) => self.recover(&message),
            error => Err(error),
        }
    }

    /// Brings the swarm to its device for the first time.
    fn board(&mut self, known: &[String], adapter: Option<&str>) -> Result<()> {
        let Place::Device(resident) = &mut self.place else {
            return Ok(());
        };
        let met = match (resident.open)(&self.state.swarm) {
            Ok(on_board) => {
                resident.on_board = Some(on_board);
                return Ok(());
            }
            Err(Error::Device(message)) => return self.recover(&message),
            // A study that had its device finishes without it.
            Err(error @ Error::NoDevice(_)) if GpuContext::was_open(adapter) => error.to_string(),
            Err(error) => return Err(error),
        };
        let before = self.losses.device_faults.len();
        self.take_over(&met)?;
        // Those that have been told of before are not told again.
        let new = self.losses.device_faults.split_off(before);
        self.losses
            .device_faults
            .extend(new.into_iter().filter(|fault| !known.contains(fault)));
        Ok(())
    }

    fn note(&mut self, fault: String) {
        tracing::warn!("{fault}");
        self.losses.device_faults.push(fault);
    }

    /// Brings the swarm to the device opened anew as it was last on the host, or takes over there if no step was taken since the
    /// last fault.
    fn recover(&mut self, message: &str) -> Result<()> {
        let Place::Device(resident) = &mut self.place else {
            return Ok(());
        };
        // The failed one closes first.
        resident.on_board = None;
        GpuContext::forget();
        if resident.failed_at.replace(self.told) == Some(self.told) {
            return self.take_over(&format!("the device failed again ({message})"));
        }
        match (resident.open)(&self.state.swarm) {
            Ok(on_board) => {
                resident.on_board = Some(on_board);
                self.note(format!("the device failed ({message}) and was opened anew"));
                Ok(())
            }
            Err(error) => self.take_over(&format!(
                "the device failed ({message}) and does not open again ({error})"
            )),
        }
    }

    fn take_over(&mut self, reason: &str) -> Result<()> {
        let Place::Device(resident) = &mut self.place else {
            return Ok(());
        };
        let lanes = (resident.lanes)()?;
        let faults = DeviceFaults::of(lanes.as_ref());
        self.place = Place::Host(lanes, faults);
        self.note(format!("{reason}; the backend simd takes over"));
        Ok(())
    }
}
