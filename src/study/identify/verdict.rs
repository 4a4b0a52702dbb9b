//! The one verdict on what a log tells: the strictest of what applies.

use super::results::Summary;
use serde::{Deserialize, Serialize};

/// What may be said of the unknowns. Each says less than the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Nothing: the car is at no minimum of the cost, and standard errors hold near a minimum only.
    NotAtMinimum,
    /// Some unknowns are at their bounds, and the others hold with these bounds only.
    AtBounds,
    /// Some unknowns cannot be told by themselves.
    NotAllTold,
    /// All are told, but the errors that remain are no noise, for which standard errors take them.
    NotNoise,
    /// All are told.
    AllTold,
}

/// Parameters that the log does not tell apart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Untold {
    /// Their names.
    pub parameters: Vec<String>,
    /// How many independent combinations of them it tells.
    pub combinations_told: usize,
}

/// Least squares may still move a parameter by this many of its standard errors at what counts as a minimum.
const AT_MINIMUM: f64 = 1.0;

impl Verdict {
    /// The verdict on a fit, and what applies in words, the strictest first.
    pub(super) fn of(summary: &Summary) -> (Self, String) {
        let count = summary.parameters.len();
        let at_bounds: Vec<&str> = summary
            .parameters
            .iter()
            .filter(|p| p.at_bound)
            .map(|p| p.name.as_str())
            .collect();
        let told = count - summary.unidentifiable.len();
        let minimum = summary.step_in_standard_errors.is_some_and(|s| s <= AT_MINIMUM);
        let mut found = Vec::new();
        if !minimum {
            let step = summary.step_in_standard_errors.map_or(String::new(), |s| {
                format!(" (least squares would move a parameter by {s:.0} of its standard errors)")
            });
            let text = format!(
                "What this log tells is not known: the car is not at a minimum of the cost{step}, and standard errors hold near \
                 a minimum only."
            );
            found.push((Self::NotAtMinimum, text));
        }
        if !at_bounds.is_empty() {
            let text = format!(
                "At their bounds: {}. Either the bounds are too narrow, or these parameters stand in for something that the \
                 model lacks; the others hold with these bounds only.",
                at_bounds.join(", ")
            );
            found.push((Self::AtBounds, text));
        }
        if told < count {
            let near = if minimum {
                ""
            } else {
                ", as far as can be said here"
            };
            let groups: Vec<String> = summary.untold_groups.iter().map(Untold::in_words).collect();
            let text = format!(
                "The log tells {told} of {count} parameters by themselves{near}. {} The car has the values that were fitted \
                 and judged together.",
                groups.join(" ")
            );
            found.push((Self::NotAllTold, text));
        }
        if minimum && !summary.errors_look_like_noise {
            let text = "The residuals do not look like noise: the model lacks something of this car, and the standard errors \
                        are too small.";
            found.push((Self::NotNoise, text.to_owned()));
        }
        if found.is_empty() {
            let text = format!("The log tells all {count} parameters.");
            found.push((Self::AllTold, text));
        }
        let texts: Vec<&str> = found.iter().map(|(_, text)| text.as_str()).collect();
        (found[0].0, texts.join(" "))
    }
}

impl Untold {
    fn in_words(&self) -> String {
        let names = self.parameters.join(", ");
        match (self.parameters.len(), self.combinations_told) {
            (1, _) => format!("Not told: {names}."),
            (_, 0) => format!("Not told, nor apart from one another: {names}."),
            (count, told) => format!("Of {names} only {told} of {count} combinations are told."),
        }
    }
}
