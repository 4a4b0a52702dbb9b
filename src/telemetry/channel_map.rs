//! Which logged channel plays which role: from a small TOML file, or else by the usual names.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::expression::Expression;
use super::positions;
use super::recording::{Channel, Recording};
use super::role::Role;
use super::ros;
use super::text::shown;
use super::units::Unit;
use crate::config::{line_of, read_text, refused};
use crate::{Error, Place, Result};

/// One of the car's axles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Axle {
    /// The front one.
    #[default]
    Front,
    /// The rear one.
    Rear,
}

/// One role's entry in a channel map.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChannelEntry {
    /// The channel's name in the log; `None` to look for the usual names.
    pub name: Option<String>,
    /// What it is worked out from, in place of a name.
    pub expression: Option<Expression>,
    /// The unit that replaces the one in the log; that of an expression.
    pub unit: Option<String>,
    /// Factor of the values, 1 or -1. If it is given, it is not estimated from the log.
    pub sign: Option<f64>,
    /// Delay with which the logger recorded the event, s; it is subtracted from the times. If it is given, it is not estimated.
    pub delay_s: Option<f64>,
}

/// Which channel plays which role, with the few figures of the car that are needed to convert them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChannelMap {
    /// The entries for roles. The other roles are found by the usual names.
    pub channels: BTreeMap<Role, ChannelEntry>,
    /// Steering-wheel angle over road-wheel angle, for a log of the steering-wheel angle.
    pub steering_ratio: Option<f64>,
    /// Rolling radius (m) by which wheel speeds logged in km/h are divided to give rad/s.
    pub rolling_radius_m: Option<f64>,
    /// That of the rear wheels, where it is another one.
    pub rear_rolling_radius_m: Option<f64>,
    /// The axle whose wheel speeds replace a ground speed that is not logged: the undriven one.
    pub speed_axle: Axle,
    /// Gaps of up to this (s) are bridged by a straight line, 0.2 s where it is not given. Intervals of up to three times the nominal
    /// one are no gaps.
    pub bridge_gaps_s: Option<f64>,
}

/// Longest gap that is bridged by default (s): the driver changes little in that time.
const BRIDGED_S: f64 = 0.2;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileEntry {
    name: Option<String>,
    expression: Option<Spanned<String>>,
    unit: Option<Spanned<String>>,
    sign: Option<Spanned<f64>>,
    delay_s: Option<Spanned<f64>>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileVehicle {
    steering_ratio: Option<Spanned<f64>>,
    rolling_radius_m: Option<Spanned<f64>>,
    rear_rolling_radius_m: Option<Spanned<f64>>,
    #[serde(default)]
    speed_axle: Axle,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileMap {
    bridge_gaps_s: Option<Spanned<f64>>,
    #[serde(default)]
    channels: BTreeMap<Role, FileEntry>,
    #[serde(default)]
    vehicle: FileVehicle,
}

/// A role with the channel found for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mapped<'a> {
    /// The role.
    pub role: Role,
    /// The channel that plays it.
    pub channel: &'a Channel,
    /// Its unit; none for plain numbers.
    pub unit: Option<Unit>,
    /// The sign the map declares.
    pub sign: Option<f64>,
    /// The delay the map declares, s.
    pub delay_s: Option<f64>,
    /// Whether the map names the channel; else it was found by its usual name, or is made of positions.
    pub declared: bool,
}

impl Mapped<'_> {
    /// Whether its channel is made of positions.
    pub(super) fn is_of_positions(&self) -> bool {
        positions::channel_name(self.role) == Some(self.channel.name.as_str())
    }
}

impl ChannelMap {
    /// Reads a channel map.
    ///
    /// # Errors
    /// [`Error::Io`], or [`Error::Input`] naming the line of an unknown key or a value out of range.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let text = read_text(path)?;
        Self::parse(&text, path)
    }

    /// Reads a channel map from its text; `path` is its name in error messages.
    ///
    /// # Errors
    /// As for [`ChannelMap::read`].
    pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let file: FileMap =
            toml::from_str(text).map_err(|e| refused(path, text, &e, "a channel map in TOML"))?;
        let checked =
            |value: Option<Spanned<f64>>, key: &str, expected: &str, fits: fn(f64) -> bool| match value {
                Some(value) if !fits(*value.get_ref()) => Err(Error::input(
                    path,
                    Place::line(line_of(text, value.span().start)).field(key),
                    value.get_ref().to_string(),
                    expected,
                )),
                value => Ok(value.map(Spanned::into_inner)),
            };
        let mut channels = BTreeMap::new();
        for (role, entry) in file.channels {
            if let Some(unit) = &entry.unit
                && !role.quantities().is_empty()
            {
                check_unit(unit.get_ref(), role).map_err(|expected| {
                    let line = line_of(text, unit.span().start);
                    let place = Place::line(line).field(format!("channels.{}.unit", role.key()));
                    Error::input(path, place, shown(unit.get_ref()), expected)
                })?;
            }
            let field = |name: &str| format!("channels.{}.{name}", role.key());
            let expression = entry.expression.map(|expression| {
                let place = Place::line(line_of(text, expression.span().start)).field(field("expression"));
                let refuse = |found: &str, expected: &str| {
                    Err(Error::input(path, place.clone(), found.to_owned(), expected))
                };
                if entry.name.is_some() {
                    return refuse("a name beside the expression", "one of the two");
                }
                if entry.unit.is_none() && !role.quantities().is_empty() {
                    return refuse("no unit", "the unit of the expression beside it");
                }
                Expression::parse(expression.get_ref(), path, place)
            });
            let entry = ChannelEntry {
                expression: expression.transpose()?,
                name: entry.name,
                unit: entry.unit.map(Spanned::into_inner),
                sign: checked(entry.sign, &field("sign"), "1 or -1", |v| v.abs() == 1.0)?,
                delay_s: checked(
                    entry.delay_s,
                    &field("delay_s"),
                    "a delay between -5 and 5 s",
                    |v| v.abs() <= 5.0,
                )?,
            };
            channels.insert(role, entry);
        }
        Ok(Self {
            channels,
            steering_ratio: checked(
                file.vehicle.steering_ratio,
                "vehicle.steering_ratio",
                "a ratio between 0.1 and 50",
                |v| (0.1..=50.0).contains(&v),
            )?,
            rolling_radius_m: checked(
                file.vehicle.rolling_radius_m,
                "vehicle.rolling_radius_m",
                "a radius between 0.05 and 2 m",
                |v| (0.05..=2.0).contains(&v),
            )?,
            rear_rolling_radius_m: checked(
                file.vehicle.rear_rolling_radius_m,
                "vehicle.rear_rolling_radius_m",
                "a radius between 0.05 and 2 m",
                |v| (0.05..=2.0).contains(&v),
            )?,
            speed_axle: file.vehicle.speed_axle,
            bridge_gaps_s: checked(
                file.bridge_gaps_s,
                "bridge_gaps_s",
                "a time between 0 and 60 s",
                |v| (0.0..=60.0).contains(&v),
            )?,
        })
    }

    /// Gaps of up to this (s) are bridged by a straight line.
    pub(super) fn bridged_s(&self) -> f64 {
        self.bridge_gaps_s.unwrap_or(BRIDGED_S)
    }

    /// The rolling radii (m) of the front and the rear wheels, if it gives any.
    pub fn rolling_radii_m(&self) -> Option<[f64; 2]> {
        let front = self.rolling_radius_m.or(self.rear_rolling_radius_m)?;
        Some([front, self.rear_rolling_radius_m.unwrap_or(front)])
    }

    /// Finds the channel of each role. A heading is left out where a yaw rate is logged. A log of positions has a heading once its
    /// samples are read.
    ///
    /// # Errors
    /// [`Error::Input`] when a channel the map names is not in the recording, a required role finds no channel, or a
    /// channel's unit is unknown or measures something else.
    pub fn resolve<'a>(&self, recording: &'a Recording) -> Result<Vec<Mapped<'a>>> {
        let mut mapped: Vec<Mapped<'a>> = Vec::new();
        for role in Role::ALL {
            let turns = || mapped.iter().any(|m| m.role == Role::YawRate);
            match self.find(role, recording)? {
                Some(_) if role == Role::Heading && turns() => {}
                Some(found) => mapped.push(found),
                None if role == Role::YawRate
                    && (self.find(Role::Heading, recording)?.is_some()
                        || positions::are_logged(self, recording)) => {}
                None if role.required() => return Err(Self::none_found(role, recording)),
                None => {}
            }
        }
        Ok(mapped)
    }

    fn none_found(role: Role, recording: &Recording) -> Error {
        Error::input(
            &recording.source,
            Place::default().channel(role.key()),
            format!("none with a usual name; it has {}", listed(recording)),
            format!(
                "a [channels.{}] entry with its name in the channel map",
                role.key()
            ),
        )
    }

    /// Finds the channel of a role.
    pub(super) fn find<'a>(&self, role: Role, recording: &'a Recording) -> Result<Option<Mapped<'a>>> {
        let entry = self.channels.get(&role);
        let made = entry
            .and_then(|e| e.expression.as_ref())
            .map(|e| made_name(role, e));
        let name = made.as_deref().or_else(|| entry.and_then(|e| e.name.as_deref()));
        let found = match name {
            Some(name) => Some(recording.channel(name).ok_or_else(|| {
                Error::input(
                    &recording.source,
                    Place::default().channel(role.key()),
                    format!("no channel {}; it has {}", shown(name), listed(recording)),
                    "the name that the channel map gives",
                )
            })?),
            // A column without a number in it, as of lap numbers where no line is set, is none.
            None => guess(role, recording)
                .filter(|c| role.of_motion() || !c.is_blank())
                .or_else(|| recording.channel(positions::channel_name(role)?)),
        };
        let Some(channel) = found else {
            return match entry {
                Some(_) => Err(Self::none_found(role, recording)),
                None => Ok(None),
            };
        };
        let unit_text = entry.and_then(|e| e.unit.as_deref()).unwrap_or(&channel.unit);
        // A switch has no unit.
        let switch = role == Role::Drs && unit_text.is_empty();
        let unit_text = if switch { "1" } else { unit_text };
        let unit = match check_unit(unit_text, role) {
            Ok(unit) => unit,
            // A pedal in volts cannot be used, and the map does not name it.
            Err(_)
                if name.is_none()
                    && matches!(role, Role::Throttle | Role::Brake | Role::Drs | Role::Heading) =>
            {
                return Ok(None);
            }
            Err(expected) => {
                return Err(Error::input(
                    &recording.source,
                    Place::default().channel(&channel.name),
                    format!("the unit {}", shown(unit_text)),
                    format!(
                        "{expected}; a unit in [channels.{}] of the channel map overrides it",
                        role.key()
                    ),
                ));
            }
        };
        Ok(Some(Mapped {
            role,
            channel,
            unit,
            sign: entry.and_then(|e| e.sign),
            delay_s: entry.and_then(|e| e.delay_s),
            declared: name.is_some(),
        }))
    }

    /// The recording with the channels that the map's expressions make of it, and with heading and speed of its positions where a
    /// log of steering has neither yaw rate nor heading, or no speed.
    ///
    /// # Errors
    /// [`Error::Input`] naming the map, the key, the expression and what is no channel of the recording.
    pub fn computed<'a>(&self, recording: &'a Recording) -> Result<Cow<'a, Recording>> {
        let mut made = Vec::new();
        for (role, entry) in &self.channels {
            if let Some(expression) = &entry.expression {
                let unit = entry.unit.as_deref().unwrap_or_default();
                let name = made_name(*role, expression);
                if recording.channel(&name).is_none() {
                    made.push(expression.channel(recording, name, unit)?);
                }
            }
        }
        let mut with = Cow::Borrowed(recording);
        if !made.is_empty() {
            with.to_mut().channels.extend(made);
        }
        let made = positions::channels(self, &with)?;
        if !made.is_empty() {
            with.to_mut().channels.extend(made);
        }
        Ok(with)
    }

    /// Which of a recording's channels a log is made of.
    pub(super) fn choose(&self, recording: &Recording) -> Result<Vec<bool>> {
        let computed = self.computed(recording)?;
        let mapped = self.resolve(&computed)?;
        let of_log = |channel: &Channel| mapped.iter().any(|m| std::ptr::eq(m.channel, channel));
        let mut chosen: Vec<bool> = computed.channels.iter().map(of_log).collect();
        chosen.truncate(recording.channels.len());
        for expression in self
            .channels
            .values()
            .filter_map(|entry| entry.expression.as_ref())
        {
            for place in expression.channels(recording)? {
                chosen[place] = true;
            }
        }
        Ok(chosen)
    }
}

/// The name of the channel that an expression makes.
fn made_name(role: Role, expression: &Expression) -> String {
    format!("{} = {}", role.key(), expression.text())
}

fn check_unit(text: &str, role: Role) -> Result<Option<Unit>, String> {
    let allowed = role.quantities();
    if allowed.is_empty() {
        return Ok(None);
    }
    match Unit::parse(text).filter(|unit| allowed.contains(&unit.quantity)) {
        Some(unit) => Ok(Some(unit)),
        None => Err(allowed
            .iter()
            .map(|quantity| quantity.described())
            .collect::<Vec<_>>()
            .join(" or ")),
    }
}

fn guess(role: Role, recording: &Recording) -> Option<&Channel> {
    let key = |name: &str| -> String {
        name.chars()
            .filter(char::is_ascii_alphanumeric)
            .map(|c| c.to_ascii_lowercase())
            .collect()
    };
    let called = |name: &str| recording.channels.iter().find(|c| key(&c.name) == name);
    let fits = |c: &&Channel| check_unit(&c.unit, role).is_ok();
    let mut with_unit = role.names_with_unit().iter();
    let only = || {
        let part = role.part_of_names()?;
        let of_part = |c: &&Channel| key(&c.name).contains(part) && fits(c);
        let mut all = recording.channels.iter().filter(of_part);
        all.next().filter(|_| all.next().is_none())
    };
    // The end of a path is a name if no other path ends so.
    let path = || {
        let mut names = role.usual_names().iter().chain(role.names_with_unit());
        names.find_map(|name| {
            let ends_so = |c: &&Channel| ros::tail(&c.name).is_some_and(|tail| key(&tail.concat()) == *name);
            let mut all = recording.channels.iter().filter(ends_so).filter(fits);
            all.next().filter(|_| all.next().is_none())
        })
    };
    role.usual_names()
        .iter()
        .find_map(|name| called(name))
        .or_else(|| with_unit.find_map(|name| called(name).filter(fits)))
        .or_else(path)
        .or_else(only)
}

/// The names of a recording's channels, for messages.
pub(super) fn listed(recording: &Recording) -> String {
    const MOST: usize = 40;
    let names: Vec<_> = recording
        .channels
        .iter()
        .take(MOST)
        .map(|c| c.name.as_str())
        .collect();
    let rest = recording.channels.len() - names.len();
    if rest == 0 {
        names.join(", ")
    } else {
        format!("{} and {rest} more", names.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::telemetry::{Clock, Format, Metadata};
    use proptest::prelude::*;

    fn recording(channels: &[(&str, &str)]) -> Recording {
        Recording {
            source: "a.csv".into(),
            format: Format::MotecCsv,
            channels: channels
                .iter()
                .map(|(name, unit)| Channel {
                    name: (*name).to_owned(),
                    unit: (*unit).to_owned(),
                    clock: Clock::Rate {
                        start_s: 0.0,
                        rate_hz: 10.0,
                    },
                    values: vec![0.0; 2],
                    unreadable: None,
                    lines: None,
                })
                .collect(),
            beacons_s: Vec::new(),
            metadata: Metadata::default(),
        }
    }

    const IRACING: [(&str, &str); 9] = [
        ("LFspeed", "m/s"),
        ("RFspeed", "m/s"),
        ("LRspeed", "m/s"),
        ("RRspeed", "m/s"),
        ("SteeringWheelAngle", "rad"),
        ("Speed", "m/s"),
        ("LongAccel", "m/s^2"),
        ("LatAccel", "m/s^2"),
        ("YawRate", "rad/s"),
    ];

    #[test]
    fn a_map_is_read_in_full() {
        let map = ChannelMap::parse(
            "[channels.yaw_rate]\nname = \"Gyro\"\nunit = \"deg/s\"\nsign = -1\ndelay_s = 0.1\n\
             [vehicle]\nsteering_ratio = 14\nrolling_radius_m = 0.325\nrear_rolling_radius_m = 0.328\nspeed_axle = \"rear\"\n",
            "m.toml",
        )
        .unwrap();
        assert_eq!(map.rolling_radii_m(), Some([0.325, 0.328]));
        let yaw = &map.channels[&Role::YawRate];
        assert_eq!((yaw.sign, yaw.delay_s), (Some(-1.0), Some(0.1)));
        assert_eq!(map.steering_ratio, Some(14.0));
        assert_eq!(map.speed_axle, Axle::Rear);
        assert_eq!(ChannelMap::parse("", "m.toml").unwrap(), ChannelMap::default());
    }

    #[test]
    fn each_fault_of_a_map_names_its_line() {
        for (text, parts) in [
            ("\n[channels.yaw]\nname = \"x\"", ["m.toml: line 2", "`yaw`"]),
            ("[channels.ay]\nname = \"x\"\nsing = 1", ["line 3", "`sing`"]),
            (
                "[channels.ay]\nsign = 2",
                ["line 2, field channels.ay.sign: found 2", "1 or -1"],
            ),
            (
                "[channels.ay]\ndelay_s = nan",
                ["line 2, field channels.ay.delay_s", "NaN"],
            ),
            (
                "[channels.ay]\nunit = \"deg\"",
                ["line 2, field channels.ay.unit: found \"deg\"", "an acceleration"],
            ),
            (
                "[vehicle]\nrolling_radius_m = 325",
                ["line 2, field vehicle.rolling_radius_m", "325"],
            ),
            ("[vehicle]\nmass = 1", ["line 2", "`mass`"]),
            (
                "\nbridge_gaps_s = -1",
                ["line 2, field bridge_gaps_s: found -1", "0 and 60 s"],
            ),
            ("a = ", ["line 1", "m.toml"]),
        ] {
            let error = ChannelMap::parse(text, "m.toml").unwrap_err().to_string();
            for part in parts {
                assert!(error.contains(part), "{part}: {error}");
            }
        }
    }

    #[test]
    fn usual_names_are_found() {
        let recording = recording(&IRACING);
        let mapped = ChannelMap::default().resolve(&recording).unwrap();
        assert_eq!(mapped.len(), 9);
        for (m, (name, _)) in mapped.iter().zip(IRACING) {
            assert_eq!(m.channel.name, name);
            assert!(!m.declared);
        }
    }

    /// Names that nobody has thought of, with units that tell; not where two could be meant.
    #[test]
    fn parts_of_names_are_found_by_their_units() {
        let found = |channels: &[(&str, &str)], role: Role| {
            let recording = recording(channels);
            let found = ChannelMap::default().find(role, &recording).unwrap();
            found.map(|m| m.channel.name.clone())
        };
        let truck = [
            ("SteerWheel_Actual", "deg"),
            ("Steering Torque", "Nm"),
            ("Body Yaw", "deg/s"),
        ];
        assert_eq!(found(&truck, Role::Steer).as_deref(), Some("SteerWheel_Actual"));
        assert_eq!(found(&truck, Role::YawRate).as_deref(), Some("Body Yaw"));
        let two = [("Steer Left Wheel", "deg"), ("Steer Right Wheel", "deg")];
        assert_eq!(found(&two, Role::Steer), None);
    }

    /// A heading is needed where there is no yaw rate, and left alone where there is one.
    #[test]
    fn a_heading_stands_in_for_a_yaw_rate() {
        let roles = |channels: &[(&str, &str)]| -> Result<Vec<Role>> {
            let recording = recording(channels);
            let mapped = ChannelMap::default().resolve(&recording)?;
            Ok(mapped.iter().map(|m| m.role).collect())
        };
        let kart = [("GPS Speed", "km/h"), ("Steering", "deg"), ("GPS Heading", "deg")];
        assert_eq!(roles(&kart).unwrap(), [Role::Steer, Role::Vx, Role::Heading]);
        assert!(roles(&kart[..2]).unwrap_err().to_string().contains("yaw_rate"));
        let with_gyro = [&kart[..], &[("Gyro Z", "deg/s")]].concat();
        assert_eq!(roles(&with_gyro).unwrap(), [Role::Steer, Role::Vx, Role::YawRate]);
        let unknown = [kart[0], kart[1], ("Heading", ""), ("Gyro Z", "deg/s")];
        assert_eq!(roles(&unknown).unwrap(), [Role::Steer, Role::Vx, Role::YawRate]);
    }

    #[test]
    fn no_usual_name_is_that_of_two_roles() {
        let mut names: Vec<&str> = Role::ALL
            .iter()
            .flat_map(|role| role.usual_names().iter().chain(role.names_with_unit()))
            .copied()
            .collect();
        names.sort_unstable();
        let twice = names.windows(2).find(|pair| pair[0] == pair[1]);
        assert_eq!(twice, None);
    }

    /// A wheel's name is that of its speed, if the unit is that of a speed.
    #[test]
    fn names_of_other_quantities_are_found_by_their_units() {
        let named = |channels: &[(&str, &str)]| -> Vec<Role> {
            let recording = recording(channels);
            let found = |role: &Role| ChannelMap::default().find(*role, &recording).unwrap().is_some();
            Role::ALL.into_iter().filter(found).collect()
        };
        let speeds = [
            ("Wheel FL", "km/h"),
            ("RF Wheel", "rpm"),
            ("Yaw", "deg/s"),
            ("Lateral", "g"),
        ];
        let roles = [Role::WheelSpeedFl, Role::WheelSpeedFr, Role::Ay, Role::YawRate];
        assert_eq!(named(&speeds), roles);
        let others = [
            ("Wheel FL", "C"),
            ("RF Wheel", "bar"),
            ("Yaw", "deg"),
            ("Lateral", "m"),
        ];
        assert_eq!(named(&others), []);
    }

    /// A logger's short names.
    #[test]
    fn short_names_are_found() {
        let short = [
            ("WS_FL", "km/h"),
            ("WS_FR", "km/h"),
            ("WS_RL", "km/h"),
            ("WS_RR", "km/h"),
            ("SteerAngle", "deg"),
            ("Speed", "km/h"),
            ("LongG", "g"),
            ("LatG", "g"),
            ("Gyro Z", "deg/s"),
        ];
        let recording = recording(&short);
        let mapped = ChannelMap::default().resolve(&recording).unwrap();
        let found: Vec<&str> = mapped.iter().map(|m| m.channel.name.as_str()).collect();
        assert_eq!(found, short.map(|(name, _)| name));
    }

    #[test]
    fn what_cannot_be_resolved_says_what_to_write() {
        let error = |channels: &[(&str, &str)], map: &str| {
            let map = ChannelMap::parse(map, "m.toml").unwrap();
            map.resolve(&recording(channels)).unwrap_err().to_string()
        };
        let missing = error(&IRACING[..8], "");
        assert!(missing.contains("channel yaw_rate: found none") && missing.contains("[channels.yaw_rate]"));
        let named = error(&IRACING, "[channels.ay]\nname = \"Lat\"");
        assert!(named.contains("no channel \"Lat\"; it has LFspeed"), "{named}");
        let mut units = IRACING;
        units[8].1 = "furlong";
        let unit = error(&units, "");
        assert!(
            unit.contains("channel YawRate: found the unit \"furlong\"") && unit.contains("deg/s"),
            "{unit}"
        );
        let map = ChannelMap::parse("[channels.yaw_rate]\nunit = \"deg/s\"", "m.toml").unwrap();
        assert!(map.resolve(&recording(&units)).is_ok());
    }

    proptest! {
        #[test]
        fn a_map_never_panics(text in "[\\[\\]a-z_.=\" \n0-9-]{0,80}") {
            let _ = ChannelMap::parse(&text, "m.toml");
        }
    }
}
