//! Where a swarm lives.

use super::{MANY, Mopso, MopsoSettings};
use crate::error::{Error, Result};
use crate::evaluate::{BackendChoice, Problem};
use serde::{Deserialize, Serialize};

/// Where the particles of a swarm live. On a device, neither candidates nor objectives cross the bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum SwarmPlace {
    /// On the device from [`MANY`] particles on, where the backend is one GPU that has room for them; else on the host. A software
    /// driver moves particles in several times the time that the host takes in lanes (`lapswarm bench whole`).
    #[default]
    Auto,
    /// On the host.
    Host,
    /// On the device.
    Device,
}

crate::config::named!(SwarmPlace {
    Auto = "auto",
    Host = "host",
    Device = "device",
});

impl SwarmPlace {
    /// Whether a swarm of so many particles and objectives lives on the device, if candidates are evaluated by `backend`.
    ///
    /// # Errors
    /// [`Error::Input`] with the reason if the device is asked for and cannot be had.
    pub fn on_device(
        self,
        (backend, adapter): (BackendChoice, Option<&str>),
        population: usize,
        objectives: usize,
    ) -> Result<bool> {
        let gpu = backend.decided(adapter) == BackendChoice::Gpu;
        let one = !crate::evaluate::gpu::asks_for_all(adapter);
        let few = (1..=3).contains(&objectives);
        let refused = |found: String, expected: &str| {
            let found = format!("device, with {found}");
            Err(Error::input("the study", "swarm", found, expected))
        };
        match self {
            Self::Host => Ok(false),
            Self::Auto => Ok(gpu && one && few && population >= MANY),
            Self::Device if !few => {
                let found = format!("{objectives} objectives");
                refused(found, "one to three objectives, for a swarm on the device")
            }
            Self::Device if !gpu => refused(
                "lanes or the reference to evaluate".to_owned(),
                "the backend gpu, for a swarm on the device",
            ),
            Self::Device if !one => refused(
                "all adapters to evaluate".to_owned(),
                "one adapter, for a swarm on the device",
            ),
            Self::Device => Ok(true),
        }
    }

    /// Whether a swarm that may live on the device has room there for so many variables to a particle and, unless it is asked to,
    /// gains by it.
    ///
    /// # Errors
    /// [`Error::Input`] with what fits if the device is asked for and has none; those of a device that does not open.
    #[cfg(feature = "gpu")]
    pub(crate) fn has_room(self, adapter: Option<&str>, population: usize, variables: usize) -> Result<bool> {
        let context = match crate::evaluate::gpu::GpuContext::shared(adapter) {
            Ok(context) => context,
            // A study that had its device finishes without it.
            Err(_) if crate::evaluate::gpu::GpuContext::was_open(adapter) => return Ok(true),
            Err(error) => return Err(error),
        };
        let most = super::device::most_particles(&context, variables);
        if population > most && self == Self::Device {
            let expected = format!(
                "at most {most} particles of {variables} variables, for which {} has room, or swarm host",
                context.summary()
            );
            return Err(Error::input(
                "the study",
                "population",
                population.to_string(),
                expected,
            ));
        }
        let gains = self == Self::Device || context.summary().kind.is_real();
        Ok(population <= most && gains)
    }

    /// No device has any.
    #[cfg(not(feature = "gpu"))]
    pub(crate) fn has_room(self, _: Option<&str>, _: usize, _: usize) -> Result<bool> {
        Ok(false)
    }

    /// The swarm, before it goes to its place.
    ///
    /// # Errors
    /// Those of [`Mopso::new`].
    pub(crate) fn swarm(self, problem: &Problem, settings: MopsoSettings) -> Result<Mopso> {
        match self {
            Self::Device => Mopso::in_single_precision(problem, settings),
            Self::Auto | Self::Host => Mopso::new(problem, settings),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_swarms_go_to_the_device_where_there_is_one() {
        let on = |place: SwarmPlace, backend, population, objectives| {
            place.on_device((backend, None), population, objectives)
        };
        let gpu = BackendChoice::Gpu;
        assert!(on(SwarmPlace::Auto, gpu, MANY, 3).expect("an answer"));
        assert!(on(SwarmPlace::Auto, gpu, MANY, 1).expect("an answer"));
        assert!(!on(SwarmPlace::Auto, gpu, MANY - 1, 3).expect("an answer"));
        assert!(!on(SwarmPlace::Auto, gpu, MANY, 4).expect("an answer"));
        assert!(!on(SwarmPlace::Auto, BackendChoice::Simd, MANY, 2).expect("an answer"));
        assert!(!on(SwarmPlace::Host, gpu, MANY, 2).expect("an answer"));
        assert!(on(SwarmPlace::Device, gpu, 8, 2).expect("an answer"));
        let all = Some("all");
        let spread = SwarmPlace::Auto.on_device((gpu, all), MANY, 2);
        assert!(!spread.expect("an answer"));
        let refusal = SwarmPlace::Device.on_device((gpu, all), MANY, 2);
        assert!(
            refusal
                .expect_err("one device")
                .to_string()
                .contains("one adapter")
        );
        for (backend, objectives, reason) in [
            (gpu, 4, "one to three objectives"),
            (BackendChoice::Simd, 2, "the backend gpu"),
            (BackendChoice::Cpu, 2, "the backend gpu"),
        ] {
            let refusal = on(SwarmPlace::Device, backend, MANY, objectives).expect_err(reason);
            assert!(refusal.to_string().contains(reason), "{refusal}");
        }
    }
}
