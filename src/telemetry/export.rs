//! Laps as the tools of race engineers read them: MoTeC's `.ld` with its `.ldx` of beacons, and CSV as MoTeC i2 writes it.

use super::recording::{Channel, Recording};
use super::units::{G, Unit};
use crate::error::{Error, Result};
use motec_i2::{ChannelMetadata, Datatype, Header, LDWriter, Sample};
use std::fmt::Write as _;
use std::io::Cursor;
use std::path::Path;

/// A channel under the name and in the unit that MoTeC i2 uses.
#[derive(Clone, Debug, PartialEq)]
pub struct LapChannel {
    /// Its name, as in `Ground Speed`.
    pub name: String,
    /// Its unit, as in `km/h`.
    pub unit: String,
    /// Its samples.
    pub values: Vec<f64>,
}

/// A lap whose channels are sampled together at one rate.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledLap {
    /// Samples per second (Hz).
    pub rate_hz: u16,
    /// Time of the lap (s); the beacon stands there.
    pub time_s: f64,
    /// Its channels, at least one; all are equally long.
    pub channels: Vec<LapChannel>,
}

/// What a file says beside its channels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LapLabels {
    /// The car.
    pub vehicle: String,
    /// The circuit.
    pub venue: String,
    /// What the lap is, as in `line_fastest of runs/raceline-001`.
    pub comment: String,
}

/// Greatest sample rate (Hz): the fastest that loggers have.
const MOST_RATE_HZ: u16 = 1000;
/// Most samples of a channel: hours at the greatest rate.
const MOST_SAMPLES: f64 = 2e7;

/// Our columns, MoTeC's names and units for them, and the factor from SI.
const NAMES: [(&[&str], &str, &str, f64); 16] = [
    (&["distance", "station"], "Lap Distance", "m", 1.0),
    (&["vx", "v"], "Ground Speed", "km/h", 3.6),
    (&["ax"], "G Force Long", "G", 1.0 / G),
    (&["ay"], "G Force Lat", "G", 1.0 / G),
    (&["yaw_rate"], "Gyro Yaw Velocity", "deg/s", DEGREES),
    (&["steer", "steering"], "Steered Angle", "deg", DEGREES),
    (&["wheel_speed_fl"], "Wheel Speed FL", "rad/s", 1.0),
    (&["wheel_speed_fr"], "Wheel Speed FR", "rad/s", 1.0),
    (&["wheel_speed_rl"], "Wheel Speed RL", "rad/s", 1.0),
    (&["wheel_speed_rr"], "Wheel Speed RR", "rad/s", 1.0),
    (&["gear"], "Gear", "", 1.0),
    (&["x"], "Pos X", "m", 1.0),
    (&["y"], "Pos Y", "m", 1.0),
    (&["roll"], "Roll Angle", "deg", DEGREES),
    (&["sideslip"], "Sideslip Angle", "deg", DEGREES),
    (&["fuel"], "Fuel Used", "kg", 1.0),
];
const DEGREES: f64 = 180.0 / std::f64::consts::PI;
/// What stands after a column's name where a log is compared with a car.
const VERSIONS: [(&str, &str); 2] = [("_measured", " Measured"), ("_fitted", " Fitted")];

/// A channel's name and unit in MoTeC i2, and the factor from the unit that it is recorded in.
fn renamed(channel: &Channel) -> (String, String, f64) {
    let (name, unit) = (channel.name.as_str(), channel.unit.as_str());
    // Native logs have units in their names.
    let name = name
        .strip_suffix(unit)
        .and_then(|name| name.strip_suffix('_'))
        .unwrap_or(name);
    let version = VERSIONS
        .iter()
        .find_map(|(end, words)| Some((name.strip_suffix(end)?, *words)));
    let (base, words) = version.unwrap_or((name, ""));
    if let Some((_, motec, motec_unit, from_si)) = NAMES.iter().find(|(ours, ..)| ours.contains(&base)) {
        let to_si = Unit::parse(unit).map_or(1.0, |unit| unit.factor);
        return (
            format!("{motec}{words}"),
            (*motec_unit).to_owned(),
            to_si * from_si,
        );
    }
    let titled: Vec<String> = base
        .split(['_', ' '])
        .map(|word| {
            let mut letters = word.chars();
            letters
                .next()
                .into_iter()
                .flat_map(char::to_uppercase)
                .chain(letters)
                .collect()
        })
        .collect();
    let unit = if unit == "-" { "" } else { unit };
    (titled.join(" ") + words, unit.to_owned(), 1.0)
}

impl SampledLap {
    /// Samples a table that a study wrote (`line_fastest.csv`, `drive.csv`, `traces.csv`), or any log, at `rate_hz` (Hz), linearly
    /// between its samples; gears hold. Channels without a number are left out, and gaps are filled from their neighbours.
    ///
    /// # Errors
    /// Those of [`Recording::read`]; [`Error::Input`] naming file and line for times that do not rise, and naming the file for a
    /// rate out of 1 to 1000 Hz and for a table without a channel beside its times.
    pub fn read(path: &Path, rate_hz: u16) -> Result<Self> {
        if !(1..=MOST_RATE_HZ).contains(&rate_hz) {
            let expected = format!("1 to {MOST_RATE_HZ} Hz");
            return Err(Error::input(path, "rate", format!("{rate_hz} Hz"), expected));
        }
        let channels = Recording::read(path)?.channels;
        for channel in &channels {
            let back = (1..channel.values.len()).find(|&i| channel.time_s(i) <= channel.time_s(i - 1));
            if let Some(i) = back {
                let found = format!("{} s after {} s", channel.time_s(i), channel.time_s(i - 1));
                return Err(Error::input(path, channel.place(i), found, "times that rise"));
            }
        }
        let ends = |c: &Channel| (c.time_s(0), c.time_s(c.values.len().saturating_sub(1)));
        let begins = channels.iter().map(|c| ends(c).0).fold(f64::INFINITY, f64::min);
        let time_s = channels
            .iter()
            .map(|c| ends(c).1)
            .fold(f64::NEG_INFINITY, f64::max)
            - begins;
        let count = (time_s * f64::from(rate_hz) + 1e-9).floor() + 1.0;
        if count > MOST_SAMPLES {
            return Err(Error::input(path, "time", format!("{time_s} s"), "a lap"));
        }
        let sampled = |channel: &Channel| -> Option<LapChannel> {
            let samples = channel.values.iter().enumerate();
            let known: Vec<(f64, f64)> = samples
                .filter(|(_, x)| x.is_finite())
                .map(|(i, x)| (channel.time_s(i), *x))
                .collect();
            let (name, unit, factor) = renamed(channel);
            let holds = name == "Gear";
            let at = |k: usize| between(&known, begins + k as f64 / f64::from(rate_hz), holds) * factor;
            (!known.is_empty()).then(|| LapChannel {
                name,
                unit,
                values: (0..count as usize).map(at).collect(),
            })
        };
        let channels: Vec<LapChannel> = channels.iter().filter_map(sampled).collect();
        if channels.is_empty() {
            return Err(Error::input(
                path,
                "columns",
                "times alone",
                "a channel beside them",
            ));
        }
        Ok(Self {
            rate_hz,
            time_s,
            channels,
        })
    }

    /// As MoTeC i2 exports CSV.
    pub fn to_motec_csv(&self, labels: &LapLabels) -> String {
        let quoted = |text: &str| format!("\"{}\"", text.replace('"', "'").replace(['\r', '\n'], " "));
        let mut text = format!(
            "\"Format\",\"MoTeC CSV File\",,,\"Workbook\",\"\"\n\"Venue\",{},,,\"Worksheet\",\"\"\n\"Vehicle\",{},,,\"Vehicle Desc\",\"\"\n\
             \"Driver\",\"\",,,\"Engine ID\",\"\"\n\"Device\",\"lapswarm\"\n\"Comment\",{},,,\"Session\",\"\"\n\
             \"Log Date\",\"\",,,\"Origin Time\",\"0.000\",\"s\"\n\"Log Time\",\"\",,,\"Start Time\",\"0.000\",\"s\"\n\
             \"Sample Rate\",\"{:.3}\",\"Hz\",,\"End Time\",\"{:.3}\",\"s\"\n\"Duration\",\"{:.3}\",\"s\",,\"Start Distance\",\"0\",\"m\"\n\
             \"Range\",\"entire outing\",,,\"End Distance\",\"\",\"m\"\n\"Beacon Markers\",\"{:.3}\"\n\n\n",
            quoted(&labels.venue),
            quoted(&labels.vehicle),
            quoted(&labels.comment),
            f64::from(self.rate_hz),
            self.time_s,
            self.time_s,
            self.time_s
        );
        let row = |first: &str, cells: &mut dyn Iterator<Item = String>| {
            let cells: String = cells.map(|cell| format!(",{cell}")).collect();
            format!("\"{first}\"{cells}\n")
        };
        text += &row("Time", &mut self.channels.iter().map(|c| quoted(&c.name)));
        text += &row("s", &mut self.channels.iter().map(|c| quoted(&c.unit)));
        text += "\n\n";
        for k in 0..self.channels[0].values.len() {
            let _ = write!(text, "\"{:.3}\"", k as f64 / f64::from(self.rate_hz));
            for channel in &self.channels {
                let _ = write!(text, ",\"{:.6}\"", channel.values[k]);
            }
            text.push('\n');
        }
        text
    }

    /// As a MoTeC logger writes `.ld`, in single precision.
    ///
    /// # Errors
    /// [`Error::Study`] if the file cannot be put together.
    pub fn to_ld(&self, labels: &LapLabels) -> Result<Vec<u8>> {
        /// Where the first channel's entry stands.
        const ENTRY: u32 = 0x3448;
        let header = Header {
            channel_meta_ptr: ENTRY,
            // After the entries, of 124 bytes each.
            channel_data_ptr: ENTRY + 124 * self.channels.len() as u32,
            event_ptr: 0,
            device_serial: 1,
            device_type: "ADL".to_owned(),
            device_version: 420,
            num_channels: self.channels.len() as u32,
            date_string: "01/01/2000".to_owned(),
            time_string: "00:00:00".to_owned(),
            driver: String::new(),
            vehicleid: labels.vehicle.clone(),
            venue: labels.venue.clone(),
            session: String::new(),
            short_comment: labels.comment.clone(),
        };
        let mut bytes = Cursor::new(Vec::new());
        let mut writer = LDWriter::new(&mut bytes, header);
        for channel in &self.channels {
            let metadata = ChannelMetadata {
                prev_addr: 0,
                next_addr: 0,
                data_addr: 0,
                data_count: 0,
                datatype: Datatype::F32,
                sample_rate: self.rate_hz,
                offset: 0,
                mul: 1,
                scale: 1,
                dec_places: 0,
                name: channel.name.clone(),
                short_name: String::new(),
                unit: channel.unit.clone(),
            };
            let samples = channel.values.iter().map(|x| Sample::F32(*x as f32)).collect();
            writer = writer.with_channel(metadata, samples);
        }
        writer
            .write()
            .map_err(|e| Error::Study(format!("cannot write a .ld file: {e:?}")))?;
        Ok(bytes.into_inner())
    }

    /// The `.ldx` beside a `.ld`: its beacon.
    pub fn to_ldx(&self) -> String {
        format!(
            "<?xml version=\"1.0\"?>\n<LDXFile Locale=\"English_United Kingdom.1252\" DefaultLocale=\"C\" Version=\"1.6\">\n <Layers>\n  \
             <Layer>\n   <MarkerBlock>\n    <MarkerGroup Name=\"Beacons\" Index=\"3\">\n     \
             <Marker Version=\"100\" ClassName=\"BCN\" Name=\"Manual.1\" Flags=\"77\" Time=\"{:e}\"/>\n    </MarkerGroup>\n   \
             </MarkerBlock>\n  </Layer>\n </Layers>\n</LDXFile>\n",
            self.time_s * 1e6
        )
    }
}

/// The value at a time: linear between samples, or the last one where it `holds`; constant beyond the ends.
fn between(known: &[(f64, f64)], time: f64, holds: bool) -> f64 {
    let after = known.partition_point(|(t, _)| *t <= time);
    match (after.checked_sub(1).map(|i| known[i]), known.get(after)) {
        (Some((t0, x0)), Some((t1, x1))) if !holds => x0 + (x1 - x0) * (time - t0) / (t1 - t0),
        (Some((_, x)), _) => x,
        (None, Some((_, x))) => *x,
        (None, None) => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Clock, Recording};
    use super::*;

    const TABLE: &str = "station (m),v (m/s),ay (m/s^2),vx_fitted (m/s),soc (-),gear (-),time (s)\n\
                         0,10,1,,0.5,1,0\n5,20,3,4,0.4,2,0.5\n20,30,5,8,0.3,3,1\n";

    fn read(text: &str, rate_hz: u16) -> Result<SampledLap> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("line.csv");
        std::fs::write(&path, text).unwrap();
        SampledLap::read(&path, rate_hz)
    }

    #[test]
    fn what_is_written_is_read_back() {
        let lap = read(TABLE, 4).unwrap();
        let labels = LapLabels {
            vehicle: "GT \"car\"".to_owned(),
            venue: "Silverstone".to_owned(),
            comment: "a line".to_owned(),
        };
        let folder = tempfile::tempdir().unwrap();
        let csv = folder.path().join("lap.csv");
        std::fs::write(&csv, lap.to_motec_csv(&labels)).unwrap();
        let ld = folder.path().join("lap.ld");
        std::fs::write(&ld, lap.to_ld(&labels).unwrap()).unwrap();
        std::fs::write(ld.with_extension("ldx"), lap.to_ldx()).unwrap();
        for path in [csv, ld] {
            let recording = Recording::read(&path).unwrap();
            assert_eq!(recording.beacons_s, [1.0], "{path:?}");
            assert_eq!(recording.metadata.venue.as_deref(), Some("Silverstone"));
            for channel in &lap.channels {
                let found = recording.channels.iter().find(|c| c.name == channel.name);
                let found = found.unwrap_or_else(|| panic!("{} in {path:?}", channel.name));
                assert_eq!(found.unit, channel.unit);
                assert_eq!(found.values.len(), 5);
                // Six decimals in one file, single precision in the other.
                let close = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-6 * b.abs().max(1.0);
                assert!(found.values.iter().zip(&channel.values).all(close), "{found:?}");
                match &found.clock {
                    Clock::Rate { rate_hz, .. } => assert_eq!(*rate_hz, 4.0),
                    Clock::Times(times) => assert_eq!(times[..], [0.0, 0.25, 0.5, 0.75, 1.0]),
                }
            }
        }
    }

    #[test]
    fn columns_have_motecs_names_and_units_and_gaps_are_filled() {
        let lap = read(TABLE, 4).unwrap();
        let of = |name: &str| lap.channels.iter().find(|c| c.name == name).unwrap();
        assert_eq!(
            (of("Ground Speed").unit.as_str(), &of("Ground Speed").values[..]),
            ("km/h", &[36.0, 54.0, 72.0, 90.0, 108.0][..])
        );
        assert!((of("G Force Lat").values[0] - 1.0 / G).abs() < 1e-15);
        assert_eq!(
            of("Ground Speed Fitted").values,
            [4.0 * 3.6, 4.0 * 3.6, 4.0 * 3.6, 6.0 * 3.6, 8.0 * 3.6]
        );
        assert_eq!(of("Gear").values, [1.0, 1.0, 2.0, 2.0, 3.0]);
        // In whatever unit it is recorded.
        let other = read("time (s),vx (km/h),yaw_rate (deg/s)\n0,36,5\n1,36,5\n", 1).unwrap();
        assert!((other.channels[0].values[0] - 36.0).abs() < 1e-12, "{other:?}");
        assert!((other.channels[1].values[0] - 5.0).abs() < 1e-12, "{other:?}");
        assert_eq!((of("Soc").unit.as_str(), of("Lap Distance").values[1]), ("", 2.5));
    }

    #[test]
    fn tables_that_are_no_laps_are_refused_by_line() {
        for (text, rate_hz, expected) in [
            ("v (m/s),a (-)\n1,2\n", 10, "a column of times"),
            ("time (s),v (m/s)\n0,1\n2,1\n1,1\n", 10, "line 4"),
            ("time (s),v (m/s)\n0,1\nx,1\n", 10, "line 3"),
            ("time (s),v (m/s)\n", 10, "at least two"),
            ("time (s),v (m/s)\n0,word\n1,word\n", 10, "a channel"),
            ("time (s),v (m/s)\n0,1\n1,1\n", 0, "1 to 1000 Hz"),
            ("time (s),v (m/s)\n0,1\n1e300,1\n", 10, "a lap"),
        ] {
            let error = read(text, rate_hz).unwrap_err().to_string();
            assert!(error.contains(expected), "{text}: {error}");
        }
    }
}
