//! Charge, power, energy, engine sites, maps and traces.

use crate::error::Result;
use crate::study::hybrid::{HybridSetup, Outcome};
use std::path::Path;

pub fn draw(_folder: &Path, _setup: &HybridSetup, _outcome: &Outcome) -> Result<()> {
    Ok(())
}
