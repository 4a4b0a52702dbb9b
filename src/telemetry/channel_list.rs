//! What a recording holds: each channel, what it is taken for and why, and what a log of a car still lacks.

use std::fmt::Write as _;

use super::channel_map::{ChannelMap, Mapped};
use super::positions::channel_name;
use super::recording::{Channel, Clock, Recording};
use super::role::Role;
use super::units::Unit;

/// One channel of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct ListedChannel {
    /// Its name.
    pub name: String,
    /// Its unit as the file spells it; empty where the file gives none.
    pub unit: String,
    /// Samples per second, Hz; the mean where they are not even.
    pub rate_hz: f64,
    /// Least and greatest value, in its unit; `None` where no sample is a number.
    pub range: Option<[f64; 2]>,
    /// Samples that are not finite numbers.
    pub unreadable: usize,
    /// The role that it plays, if any.
    pub role: Option<Role>,
    /// Why it plays that role, or why not.
    pub why: &'static str,
}

/// A role that no channel plays.
#[derive(Clone, Debug, PartialEq)]
pub struct Missing {
    /// The role.
    pub role: Role,
    /// What stands in for it, or what it is needed for.
    pub without: &'static str,
    /// What is wrong with the channel that the map names or that has a usual name.
    pub refused: Option<String>,
    /// For a role of the car's motion: names of the channels that no role has and whose unit fits.
    pub candidates: Vec<String>,
}

/// The channels of a recording, and the roles that none of them plays.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelList {
    /// The file.
    pub source: String,
    /// Its channels, in file order.
    pub channels: Vec<ListedChannel>,
    /// The roles that no channel plays.
    pub missing: Vec<Missing>,
}

impl ChannelList {
    /// Lists a recording's channels, with the roles that the map or their names give them.
    pub fn of(recording: &Recording, map: &ChannelMap) -> Self {
        let found: Vec<_> = Role::ALL
            .iter()
            .map(|&role| (role, map.find(role, recording)))
            .collect();
        let taken: Vec<&Mapped<'_>> = found
            .iter()
            .filter_map(|(_, found)| found.as_ref().ok()?.as_ref())
            .collect();
        let has_heading = taken.iter().any(|m| m.role == Role::Heading);
        let free = |channel: &Channel| !taken.iter().any(|m| std::ptr::eq(m.channel, channel));
        let missing = found.iter().filter_map(|(role, found)| {
            let refused = match found {
                Ok(Some(_)) => return None,
                // Positions help where laps are not told, a heading where the yaw rate is not, and no log lacks them otherwise.
                Ok(None) if role.of_place() || *role == Role::Heading => return None,
                Ok(None) => None,
                Err(error) => Some(error.to_string()),
            };
            let fits = |channel: &&Channel| {
                role.of_motion()
                    && free(channel)
                    && Unit::parse(&channel.unit)
                        .is_some_and(|unit| role.quantities().contains(&unit.quantity))
            };
            Some(Missing {
                role: *role,
                without: if *role == Role::YawRate && has_heading {
                    "the change of the heading stands in for it"
                } else {
                    without(*role)
                },
                refused,
                candidates: recording
                    .channels
                    .iter()
                    .filter(fits)
                    .map(|c| c.name.clone())
                    .collect(),
            })
        });
        Self {
            source: recording.source.display().to_string(),
            channels: recording
                .channels
                .iter()
                .map(|channel| {
                    listed(
                        channel,
                        taken.iter().find(|m| std::ptr::eq(m.channel, channel)).copied(),
                    )
                })
                .collect(),
            missing: missing.collect(),
        }
    }

    /// Whether it is of a log that has positions, and nothing that could be a channel which a model of the car needs: of a kart
    /// with GPS alone.
    pub fn is_of_places_alone(&self) -> bool {
        let plays = |role| self.channels.iter().any(|c| c.role == Some(role));
        let placed = plays(Role::Latitude) && plays(Role::Longitude) || plays(Role::X) && plays(Role::Y);
        let lacks_all = |role: Role| {
            !role.required() || self.missing.iter().any(|m| m.role == role && m.refused.is_none())
        };
        placed && Role::ALL.into_iter().all(lacks_all)
    }

    /// The list as a table of text, and what is missing below it.
    pub fn table(&self) -> String {
        let rows: Vec<[String; 5]> = self
            .channels
            .iter()
            .map(|c| {
                let range = match c.range {
                    Some(ends) => range(ends),
                    None => "no numbers".to_owned(),
                };
                let why = match (c.role, c.unreadable) {
                    (Some(role), 0) => format!("{}, {}", role.key(), c.why),
                    (Some(role), n) => format!("{}, {}; {n} samples are no numbers", role.key(), c.why),
                    (None, 0) => c.why.to_owned(),
                    (None, n) => format!("{}; {n} samples are no numbers", c.why),
                };
                [c.name.clone(), c.unit.clone(), figure(c.rate_hz), range, why]
            })
            .collect();
        let head = ["channel", "unit", "Hz", "range", "taken for"].map(str::to_owned);
        let width = |column: usize| {
            let cells = std::iter::once(&head).chain(&rows);
            cells.map(|row| row[column].chars().count()).max().unwrap_or(0)
        };
        let widths = [0, 1, 2, 3, 4].map(width);
        let mut text = String::new();
        for row in std::iter::once(&head).chain(&rows) {
            let line: String = row
                .iter()
                .zip(widths)
                .map(|(cell, width)| format!("{cell:width$}  "))
                .collect();
            let _ = writeln!(text, "  {}", line.trim_end());
        }
        for missing in &self.missing {
            let _ = write!(text, "  no {}: {}", missing.role.key(), missing.without);
            if let Some(refused) = &missing.refused {
                let _ = write!(text, "; {refused}");
            }
            if !missing.candidates.is_empty() {
                let _ = write!(
                    text,
                    " (could be, by the unit: {})",
                    missing.candidates.join(", ")
                );
            }
            text.push('\n');
        }
        text
    }

    /// A channel map of these channels, to be edited: an entry for each role that a channel plays, and commented ones for
    /// those that none plays.
    pub fn map_text(&self) -> String {
        let mut text = format!(
            "# Channels of {}, as `lapswarm check` took them. Mend what is wrong.\n\n\
             # bridge_gaps_s = 0.2             # longest gap that a straight line bridges\n\n",
            quoted(&self.source)
        );
        // What positions make is made anew.
        let of_log = |c: &&ListedChannel| c.role.and_then(channel_name) != Some(c.name.as_str());
        let played = |role: Role| self.channels.iter().filter(of_log).find(|c| c.role == Some(role));
        for role in Role::ALL {
            if let Some(channel) = played(role) {
                let _ = writeln!(text, "[channels.{}]", role.key());
                // As the map makes it of others.
                let made = channel
                    .name
                    .strip_prefix(role.key())
                    .and_then(|rest| rest.strip_prefix(" = "));
                let _ = match made {
                    Some(expression) => writeln!(text, "expression = {}", quoted(expression)),
                    None => writeln!(text, "name = {}", quoted(&channel.name)),
                };
                if !role.quantities().is_empty() && Unit::parse(&channel.unit).is_some() {
                    let _ = writeln!(text, "unit = {}", quoted(&channel.unit));
                }
            } else if let Some(missing) = self.missing.iter().find(|m| m.role == role) {
                let _ = writeln!(text, "# {}", missing.without);
                let _ = writeln!(text, "# [channels.{}]", role.key());
                let mut candidates = missing.candidates.iter().map(|name| quoted(name));
                let name = candidates.next().unwrap_or_else(|| quoted(""));
                let others: String = candidates.map(|name| format!(" or {name}")).collect();
                let _ = writeln!(text, "# name = {name}{others}");
            }
            text.push('\n');
        }
        text.push_str(
            "[vehicle]\n# steering_ratio = 14.0           # for a log of the steering-wheel angle\n\
             # rolling_radius_m = 0.325        # for wheel speeds in km/h: what the logger took\n\
             # speed_axle = \"front\"            # the axle that is not driven\n",
        );
        text
    }
}

/// A name as TOML writes it.
fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

/// What becomes of a log without a channel for a role.
fn without(role: Role) -> &'static str {
    match role {
        Role::WheelSpeedFl | Role::WheelSpeedFr | Role::WheelSpeedRl | Role::WheelSpeedRr => {
            "the car's own motion stands in for it; slip along the car is not told"
        }
        Role::Steer => "needed: the steering angle drives the model",
        Role::YawRate => "needed: the model is compared with it",
        Role::Heading => "not needed",
        Role::Vx => "the speed of the undriven wheels stands in for it",
        Role::Ax => "the change of speed stands in for it",
        Role::Ay => "speed times yaw rate stands in for it",
        Role::Distance => "the speed is added up in its place",
        Role::Lap => "laps come from beacons, from the distance, or from positions",
        Role::LapComplete => "laps between two passages of the line are complete",
        Role::Throttle | Role::Brake => "not needed",
        Role::Drs => "the DRS counts as shut",
        Role::Latitude | Role::Longitude | Role::X | Role::Y => "laps can be found from it",
    }
}

fn listed(channel: &Channel, taken: Option<&Mapped<'_>>) -> ListedChannel {
    let values = channel.values.iter().copied().filter(|v| v.is_finite());
    let range = values.fold(None, |range: Option<[f64; 2]>, v| {
        let [least, greatest] = range.unwrap_or([v, v]);
        Some([least.min(v), greatest.max(v)])
    });
    let rate_hz = match &channel.clock {
        Clock::Rate { rate_hz, .. } => *rate_hz,
        Clock::Times(times) => match &times[..] {
            [first, .., last] if last > first => (times.len() - 1) as f64 / (last - first),
            _ => 0.0,
        },
    };
    ListedChannel {
        name: channel.name.clone(),
        unit: channel.unit.clone(),
        rate_hz,
        range,
        unreadable: channel.values.iter().filter(|v| !v.is_finite()).count(),
        role: taken.map(|m| m.role),
        why: match taken {
            Some(m) if m.is_of_positions() => "made of the positions",
            Some(m) if m.declared => "by the channel map",
            Some(_) => "by its name",
            None => "-",
        },
    }
}

/// Both ends of a range, with as many digits as it takes to tell them apart.
fn range([least, greatest]: [f64; 2]) -> String {
    let apart = digits_of(greatest - least, 2);
    let end = |value: f64| rounded(value, digits_of(value, 4).max(apart));
    format!("{} to {}", end(least), end(greatest))
}

/// Decimal places that show so many significant digits.
fn digits_of(value: f64, significant: i32) -> usize {
    if value == 0.0 {
        0
    } else {
        (significant - 1 - value.abs().log10().floor() as i32).clamp(0, 6) as usize
    }
}

/// Four significant digits, which is enough to see what a channel is.
fn figure(value: f64) -> String {
    rounded(value, digits_of(value, 4))
}

fn rounded(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOG: &[u8] = b"time (s),Speed (km/h),FL (rad/s),Gyro (deg/s),Air (bar)\n0,36,30,1,1\n0.1,72,31,-2,1\n0.2,54,32,3,x\n";

    fn list(map: &str) -> ChannelList {
        let recording = Recording::parse(LOG, "a.csv").unwrap();
        ChannelList::of(&recording, &ChannelMap::parse(map, "m.toml").unwrap())
    }

    #[test]
    fn a_channel_shows_what_it_holds_and_what_it_is_taken_for() {
        let list = list("[channels.yaw_rate]\nname = \"Gyro\"\n");
        let speed = &list.channels[0];
        assert_eq!((speed.role, speed.why), (Some(Role::Vx), "by its name"));
        assert_eq!((speed.range, speed.unit.as_str()), (Some([36.0, 72.0]), "km/h"));
        assert!((speed.rate_hz - 10.0).abs() < 1e-9);
        let gyro = &list.channels[2];
        assert_eq!((gyro.role, gyro.why), (Some(Role::YawRate), "by the channel map"));
        assert_eq!(list.channels[3].unreadable, 1);
        assert_eq!(list.channels[3].range, Some([1.0, 1.0]));
    }

    #[test]
    fn what_is_missing_says_what_could_be_it() {
        let list = list("");
        let wheel = list
            .missing
            .iter()
            .find(|m| m.role == Role::WheelSpeedFl)
            .unwrap();
        assert_eq!(wheel.candidates, ["FL", "Gyro"]);
        assert!(wheel.without.contains("stands in"));
        assert!(!list.missing.iter().any(|m| m.role == Role::Vx));
        let table = list.table();
        assert!(
            table.contains("no wheel_speed_fl: the car's own") && table.contains("36 to 72"),
            "{table}"
        );
    }

    /// What is written is read as a map that finds the same channels.
    #[test]
    fn the_map_that_is_written_is_read() {
        let first = list("");
        let text = first.map_text();
        let again = list(&text);
        let roles = |list: &ChannelList| list.channels.iter().map(|c| c.role).collect::<Vec<_>>();
        assert_eq!(roles(&first), roles(&again), "{text}");
        assert!(
            again
                .channels
                .iter()
                .all(|c| c.role.is_none() || c.why == "by the channel map")
        );
        assert!(
            text.contains("# [channels.yaw_rate]\n# name = \"FL\" or \"Gyro\"\n"),
            "{text}"
        );
    }

    #[test]
    fn the_ends_of_a_range_can_be_told_apart() {
        assert_eq!(range([51.998_12, 52.001_37]), "51.9981 to 52.0014");
        assert_eq!(range([36.0, 72.0]), "36 to 72");
        assert_eq!(range([1.0, 1.0]), "1 to 1");
    }

    #[test]
    fn figures_have_four_digits() {
        for (value, text) in [
            (0.0, "0"),
            (123_456.7, "123457"),
            (-12.3456, "-12.35"),
            (0.001_234_56, "0.001235"),
            (50.0, "50"),
        ] {
            assert_eq!(figure(value), text);
        }
    }
}
