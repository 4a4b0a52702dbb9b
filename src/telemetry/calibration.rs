//! What is estimated about a log's sensors, and the findings.

use crate::config::Table;
use crate::config::kinds::{Kind, of};
use crate::config::settings::{Written, settings};
use crate::error::Result;
use serde::{Deserialize, Serialize};
use std::path::Path;

use super::role::Role;

/// Whether a correction is estimated from a log and applied to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Switch {
    /// It is.
    #[default]
    On,
    /// It is not.
    Off,
}

/// A [`Switch`] in files (true or false) and flags (on or off).
struct Switched;

impl Kind<Switch> for Switched {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, _: &Path) -> Result<Option<Switch>> {
        let on = table.boolean(key)?;
        Ok(on.map(|on| if on { Switch::On } else { Switch::Off }))
    }

    fn write(&self, switch: &Switch) -> Option<Written> {
        Some(Written::Value((*switch == Switch::On).to_string()))
    }

    fn parse(&self, text: &str, _: &Switch) -> Result<Switch, String> {
        match text {
            "on" => Ok(Switch::On),
            "off" => Ok(Switch::Off),
            _ => Err("expected on or off".to_owned()),
        }
    }

    fn value_name(&self) -> &'static str {
        "on|off"
    }
}

settings! {
    /// Which corrections are estimated from the log and applied to it, in every format.
    pub struct CalibrationOptions {
        signs: Switch as "calibration.signs" ["-"] = Switch::On, of(Switched),
            "Signs of yaw rate, ay, ax and steering are found from the log";
        delays: Switch as "calibration.delays" ["-"] = Switch::On, of(Switched),
            "Delays of wheel speeds, vx, ax and yaw rate are found from the log";
        offsets: Switch as "calibration.offsets" ["-"] = Switch::On, of(Switched),
            "Zero offsets of yaw rate and ay are found from the log";
        rolling_radius: Switch as "calibration.rolling_radius" ["-"] = Switch::On, of(Switched),
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
    /// Delay of the channel, s: relative to the clock that most channels agree on where it was applied, else to the channel
    /// that it was compared with.
    Delay,
    /// Zero offset of the channel in its SI unit.
    Offset,
    /// Ground speed over angular speed of a freely rolling wheel, m.
    RollingRadius,
    /// Steering over the road wheels' angle that the yaw rate needs.
    SteeringRatio,
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
    /// Its standard error in the same unit, where there is one.
    pub standard_error: Option<f64>,
    /// What it must exceed to be applied, where there is such a limit; for a rolling radius, as a share of the car's.
    pub threshold: Option<f64>,
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
        let (channel, value) = (self.role.key(), self.value);
        match self.kind {
            FindingKind::Sign if value < 0.0 => write!(f, "{channel}: the sign is reversed")?,
            FindingKind::Sign => write!(f, "{channel}: the sign is right")?,
            FindingKind::Delay => write!(f, "{channel}: delay {value:.4} s")?,
            FindingKind::Offset => write!(f, "{channel}: zero offset {value:.5} {}", self.role.si_unit())?,
            FindingKind::RollingRadius => write!(f, "{channel}: rolling radius {value:.5} m")?,
            FindingKind::SteeringRatio => write!(f, "{channel}: {value:.2} times the road wheels' angle")?,
            FindingKind::Gain => write!(f, "{channel}: {value:.3} times what it should equal")?,
        }
        if let Some(error) = self.standard_error {
            write!(f, " (standard error {error:.5})")?;
        }
        let state = match (self.applied, self.kind) {
            (true, _) => "; corrected",
            (false, FindingKind::Sign) if value > 0.0 => "",
            (false, _) => "; not applied",
        };
        write!(f, "{state}: {}", self.evidence)
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

/// What the channel map and the car declare. It takes precedence over the log.
#[derive(Clone, Debug, Default)]
pub(super) struct Declared {
    pub signs: Vec<Role>,
    pub delays: Vec<Role>,
    /// Rolling radii of the front and the rear wheels, m.
    pub rolling_radius_m: Option<[f64; 2]>,
    /// Whether the study finds an axle's radius itself.
    pub radius_is_free: [bool; 2],
    /// Whether the rear wheels are the ones that are not driven.
    pub rear_is_undriven: bool,
    /// Ground speed was computed from wheel speeds and has no delay of its own.
    pub speed_of_wheels: bool,
    /// Accelerations that were computed from other channels, whose signs and offsets they have.
    pub made: Vec<Role>,
}
