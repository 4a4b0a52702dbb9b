//! What is estimated about a log's sensors, and the findings.

use crate::config::Table;
use crate::config::kinds::{Kind, of};
use crate::config::settings::{Written, settings};
use crate::error::Result;
use serde::{Deserialize, Serialize};
use std::path::Path;

use super::recording::Format;
use super::role::Role;

/// On, off, or as the file format suggests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Switch {
    /// On for foreign files, off for native ones, which are calibrated already.
    #[default]
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

impl Switch {
    pub(super) fn is_on(self, format: Format) -> bool {
        match self {
            Self::Auto => format != Format::Native,
            Self::On => true,
            Self::Off => false,
        }
    }
}

/// A [`Switch`] in files and flags: true, false, or no value for `Auto`.
struct Switched;

impl Kind<Switch> for Switched {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, _: &Path) -> Result<Option<Switch>> {
        let on = table.boolean(key)?;
        Ok(on.map(|on| if on { Switch::On } else { Switch::Off }))
    }

    fn write(&self, switch: &Switch) -> Option<Written> {
        let on = match switch {
            Switch::Auto => return None,
            Switch::On => true,
            Switch::Off => false,
        };
        Some(Written::Value(on.to_string()))
    }

    fn parse(&self, text: &str, _: &Switch) -> Result<Switch, String> {
        match text {
            "auto" => Ok(Switch::Auto),
            "on" => Ok(Switch::On),
            "off" => Ok(Switch::Off),
            _ => Err("expected auto, on or off".to_owned()),
        }
    }

    fn value_name(&self) -> &'static str {
        "auto|on|off"
    }
}

settings! {
    /// Which corrections are estimated from the log and applied to it.
    pub struct CalibrationOptions {
        signs: Switch as "calibration.signs" ["-"] = Switch::Auto, of(Switched).example("true"),
            "Signs of yaw rate, ay, ax and steering are found from the log";
        delays: Switch as "calibration.delays" ["-"] = Switch::Auto, of(Switched).example("true"),
            "Delays of the channels relative to yaw rate are found from the log";
        offsets: Switch as "calibration.offsets" ["-"] = Switch::Auto, of(Switched).example("true"),
            "Zero offsets of yaw rate and ay are found from the log";
        rolling_radius: Switch as "calibration.rolling_radius" ["-"] = Switch::Auto, of(Switched).example("true"),
            "The rolling radius of each wheel is found from the log";
    }
}

impl CalibrationOptions {
    /// Everything on, or everything off.
    pub fn all(switch: Switch) -> Self {
        Self {
            signs: switch,
            delays: switch,
            offsets: switch,
            rolling_radius: switch,
        }
    }
}

/// What was estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FindingKind {
    /// 1 or -1, by which the channel was multiplied.
    Sign,
    /// Delay of the channel relative to yaw rate, s; it was corrected.
    Delay,
    /// Zero offset of the channel in its SI unit; it was corrected.
    Offset,
    /// Ground speed over angular speed of a freely rolling wheel, m.
    RollingRadius,
    /// Slope of the channel on what it should equal; 1 is right. It is never applied.
    Gain,
}

/// One thing that was estimated from the log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// The channel.
    pub role: Role,
    /// What was estimated.
    pub kind: FindingKind,
    /// Its value, in the unit that `kind` names.
    pub value: f64,
    /// Whether the log was corrected by it.
    pub applied: bool,
    /// The correlation behind it, if there is one.
    pub correlation: Option<f64>,
    /// Number of samples behind it.
    pub samples: usize,
    /// What it was measured against, and the reason if it was not applied.
    pub evidence: String,
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let state = if self.applied {
            "corrected"
        } else {
            "left as it is"
        };
        write!(
            f,
            "{:?} {:?}: {:.4}, {state} ({})",
            self.role, self.kind, self.value, self.evidence
        )
    }
}

/// Everything that was estimated from a log, and whether it was applied.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// What was estimated, in the order it was applied.
    pub findings: Vec<Finding>,
    /// Notes for readers of the results: channels that were guessed, speeds that were computed from wheels, missing evidence.
    pub notes: Vec<String>,
}

impl Calibration {
    /// The finding of a kind for a channel.
    pub fn finding(&self, role: Role, kind: FindingKind) -> Option<&Finding> {
        self.findings.iter().find(|f| f.role == role && f.kind == kind)
    }

    /// The value of a finding that was applied.
    pub fn applied(&self, role: Role, kind: FindingKind) -> Option<f64> {
        self.finding(role, kind).filter(|f| f.applied).map(|f| f.value)
    }
}

/// What the channel map declares. It takes precedence over the log.
#[derive(Clone, Debug, Default)]
pub(super) struct Declared {
    pub signs: Vec<Role>,
    pub delays: Vec<Role>,
    pub rolling_radius_m: Option<f64>,
    /// Ground speed was computed from wheel speeds and has no delay of its own.
    pub speed_of_wheels: bool,
}
