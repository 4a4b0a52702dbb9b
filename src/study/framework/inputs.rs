//! What a result depends on, as one number.

use std::fmt::{Debug, Write as _};
use std::hash::{DefaultHasher, Hasher};
use std::sync::OnceLock;

/// What went into a stage, as one number: the program's version, and whatever is [added](Inputs::add).
pub struct Inputs(DefaultHasher);

impl Inputs {
    /// Of a stage of this name.
    pub fn new(stage: &str) -> Self {
        let mut inputs = Self(DefaultHasher::new());
        inputs.add(&(stage, env!("CARGO_PKG_VERSION")));
        inputs
    }

    /// As [`Inputs::new`], and of the very program that runs: what it finds may differ from build to build of one version.
    pub fn of_program(stage: &str) -> Self {
        static PROGRAM: OnceLock<Option<u64>> = OnceLock::new();
        let mut inputs = Self::new(stage);
        // Where the program cannot be read its version has to do.
        inputs.add(PROGRAM.get_or_init(|| {
            let mut hasher = DefaultHasher::new();
            hasher.write(&std::fs::read(std::env::current_exe().ok()?).ok()?);
            Some(hasher.finish())
        }));
        inputs
    }

    /// Adds a value with all that it holds.
    pub fn add(&mut self, value: &impl Debug) {
        struct Into<'a>(&'a mut DefaultHasher);
        impl std::fmt::Write for Into<'_> {
            fn write_str(&mut self, text: &str) -> std::fmt::Result {
                self.0.write(text.as_bytes());
                Ok(())
            }
        }
        // Writing to a hasher cannot fail.
        let _ = write!(Into(&mut self.0), "{value:?};");
    }

    /// The number, as text.
    pub fn key(&self) -> String {
        format!("{:016x}", self.0.finish())
    }
}
