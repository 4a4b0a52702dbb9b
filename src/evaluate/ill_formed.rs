//! Why a candidate's tyre is none. It stands among the failures, which are the same whether cars are built in or not.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Why a set of coefficients makes no tyre.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum IllFormed {
    /// A coefficient is not a finite number.
    NotFinite,
    /// Peak friction is not positive (or next to zero) somewhere in the working range of loads.
    Friction,
    /// Slip or cornering stiffness has the wrong sign or vanishes somewhere in the working range of loads.
    Stiffness,
    /// A combined-slip weight divides by (nearly) zero, or leaves a negative force at slips driven daily.
    Weighting,
}

impl fmt::Display for IllFormed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "a coefficient that is not a finite number",
            Self::Friction => "friction that is not positive",
            Self::Stiffness => {
                "slip stiffness that is not positive or cornering stiffness that is not negative"
            }
            Self::Weighting => "combined-slip weights that vanish or turn negative",
        })
    }
}
