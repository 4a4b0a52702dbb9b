//! Channels that are worked out from others, by an expression in the channel map.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use exmex::{Express, FlatEx};

use super::recording::{Channel, Recording, Unreadable};
use super::resample::linear;
use super::text::shown;
use crate::{Error, Place, Result};

/// Longest expression (characters).
const LONGEST: usize = 1000;

/// An expression of channels, as in `9.80665 * G_Lat`.
#[derive(Clone, Debug)]
pub struct Expression {
    text: String,
    parsed: FlatEx<f64>,
    /// Where it stands.
    file: PathBuf,
    place: Place,
}

impl PartialEq for Expression {
    fn eq(&self, other: &Self) -> bool {
        self.text == other.text
    }
}

impl Expression {
    /// Reads an expression that stands at a place of a channel map.
    ///
    /// # Errors
    /// [`Error::Input`] naming the place for what is no expression, and for one of no channel.
    pub fn parse(text: &str, file: &Path, place: Place) -> Result<Self> {
        let refuse = |why: &str| {
            let expected = "an expression of channels, as in 9.80665 * G_Lat or -{Lat Acc}";
            Err(Error::input(
                file,
                place.clone(),
                format!("{}: {why}", shown(text)),
                expected,
            ))
        };
        if text.chars().count() > LONGEST {
            return refuse("it is too long");
        }
        match exmex::parse::<f64>(text) {
            Ok(parsed) if parsed.var_names().is_empty() => refuse("it has no channel in it"),
            Ok(parsed) => Ok(Self {
                text: text.to_owned(),
                parsed,
                file: file.to_owned(),
                place,
            }),
            Err(error) => refuse(&error.to_string()),
        }
    }

    /// What it was read from.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The places of its channels in a recording. A name is that of the log, or the same letters and digits.
    ///
    /// # Errors
    /// [`Error::Input`] naming the expression and what is no channel of the log.
    pub(super) fn channels(&self, recording: &Recording) -> Result<Vec<usize>> {
        let place = |name: &String| {
            let there = |same: &dyn Fn(&str) -> bool| recording.channels.iter().position(|c| same(&c.name));
            let found = there(&|other| other == name)
                .or_else(|| there(&|other| other.eq_ignore_ascii_case(name)))
                .or_else(|| there(&|other| plain(other) == plain(name)));
            found.ok_or_else(|| {
                let found = format!(
                    "{}, in which {} is no channel of {}; it has {}",
                    shown(&self.text),
                    shown(name),
                    recording.source.display(),
                    super::channel_map::listed(recording)
                );
                let expected = "names of channels, in braces where they have spaces";
                Error::input(&self.file, self.place.clone(), found, expected)
            })
        };
        self.parsed.var_names().iter().map(place).collect()
    }

    /// The channel that it makes, on the clock of the fastest of its channels.
    ///
    /// # Errors
    /// As [`Expression::channels`].
    pub(super) fn channel(&self, recording: &Recording, name: String, unit: &str) -> Result<Channel> {
        let places = self.channels(recording)?;
        let channels: Vec<&Channel> = places.iter().map(|i| &recording.channels[*i]).collect();
        let none = || Error::input(&self.file, self.place.clone(), "no channel", "one at least");
        let fastest = channels.iter().max_by_key(|c| c.values.len()).ok_or_else(none)?;
        let columns: Vec<Cow<'_, [f64]>> = channels
            .iter()
            .map(|channel| {
                if channel.clock == fastest.clock && channel.values.len() == fastest.values.len() {
                    Cow::Borrowed(&channel.values[..])
                } else {
                    let times = |c: &Channel| (0..c.values.len()).map(|i| c.time_s(i)).collect::<Vec<f64>>();
                    let own = times(channel);
                    times(fastest)
                        .iter()
                        .map(|t| linear(&own, &channel.values, *t))
                        .collect()
                }
            })
            .collect();
        let mut values = Vec::with_capacity(fastest.values.len());
        let mut unreadable = None;
        let read = |c: &&Channel| c.unreadable.as_ref().is_none_or(Unreadable::is_missing);
        let only_missing = channels.iter().all(read);
        for sample in 0..fastest.values.len() {
            let of: Vec<f64> = columns.iter().map(|column| column[sample]).collect();
            let value = self.parsed.eval(&of).unwrap_or(f64::NAN);
            if !value.is_finite() {
                let text = if only_missing && of.iter().any(|v| v.is_nan()) {
                    String::new()
                } else {
                    format!("{value} of {}", self.text)
                };
                Unreadable::keep(&mut unreadable, Unreadable { sample, text });
            }
            values.push(if value.is_finite() { value } else { f64::NAN });
        }
        Ok(Channel {
            name,
            unit: unit.to_owned(),
            clock: fastest.clock.clone(),
            values,
            unreadable,
            lines: fastest.lines.as_ref().map(Arc::clone),
        })
    }
}

/// A name without anything but letters and digits, in lower case.
fn plain(name: &str) -> String {
    let kept = name.chars().filter(|c| c.is_alphanumeric());
    kept.flat_map(char::to_lowercase).collect()
}

#[cfg(test)]
mod tests {
    use crate::telemetry::{ChannelList, ChannelMap, Recording, Role};

    const LOG: &[u8] = b"time (s),G Lat (G),G Long (G),Pot (V)\n0,0.5,-1,2.5\n0.1,1,0,x\n0.2,-2,1,1.5\n";

    fn computed(map: &str) -> crate::Result<Recording> {
        let recording = Recording::parse(LOG, "a.csv")?;
        Ok(ChannelMap::parse(map, "m.toml")?
            .computed(&recording)?
            .into_owned())
    }

    #[test]
    fn channels_are_worked_out_by_the_map() {
        let map = "[channels.ay]\nexpression = \"9.80665 * G_Lat + 0 * abs({G Long})\"\nunit = \"m/s^2\"\n";
        let recording = computed(map).unwrap();
        let made = recording.channels.last().unwrap();
        assert_eq!(made.values, [0.5 * 9.80665, 9.80665, -2.0 * 9.80665]);
        assert_eq!((made.unit.as_str(), made.time_s(2)), ("m/s^2", 0.2));
        let map = ChannelMap::parse(map, "m.toml").unwrap();
        let list = ChannelList::of(&recording, &map);
        let listed = list.channels.last().unwrap();
        assert_eq!((listed.role, listed.why), (Some(Role::Ay), "by the channel map"));
        // What is written of it is read again.
        let again = ChannelMap::parse(&list.map_text(), "m.toml").unwrap();
        assert_eq!(
            again.channels[&Role::Ay].expression,
            map.channels[&Role::Ay].expression
        );
        // A sample that is no number is told of where it is used.
        let steer =
            computed("[channels.steer]\nexpression = \"0.1 * (Pot - 2.5)\"\nunit = \"rad\"\n").unwrap();
        let made = steer.channels.last().unwrap();
        assert_eq!(made.unreadable.as_ref().map(|bad| bad.sample), Some(1));
    }

    #[test]
    fn what_is_wrong_is_told_with_file_key_and_expression() {
        let refused = |map: &str, parts: &[&str]| {
            let said = computed(map).unwrap_err().to_string();
            for part in parts.iter().chain(&["m.toml: line ", "channels.ay."]) {
                assert!(said.contains(part), "{map}: {said}");
            }
        };
        let map = |text: &str| format!("[channels.ay]\nexpression = \"{text}\"\nunit = \"m/s^2\"\n");
        refused(
            &map("9.8 * Lat"),
            &["9.8 * Lat", "\"Lat\" is no channel of a.csv", "G Lat, G Long"],
        );
        refused(&map("9.8 * (G_Lat"), &["9.8 * (G_Lat", "parenthes"]);
        refused(&map("9.8"), &["no channel in it"]);
        refused(&map(&"(".repeat(2000)), &["too long"]);
        refused("[channels.ay]\nexpression = \"G_Lat\"\n", &["no unit", "beside"]);
        let both = "[channels.ay]\nname = \"G Lat\"\nexpression = \"G_Lat\"\nunit = \"G\"\n";
        refused(both, &["a name beside"]);
    }
}
