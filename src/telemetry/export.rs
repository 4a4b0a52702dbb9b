//! Laps as the tools of race engineers read them: MoTeC's `.ld` with its `.ldx` of beacons, and CSV as MoTeC i2 writes it.

use super::csv_native::COLUMNS;
use crate::config::read_bytes;
use crate::error::{Error, Place, Result};
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

/// Largest file that is read (bytes); a lap is far smaller.
const MOST_BYTES: u64 = 256 << 20;
/// Greatest sample rate (Hz): the fastest that loggers have.
const MOST_RATE_HZ: u16 = 1000;
/// Most samples of a channel: hours at the greatest rate.
const MOST_SAMPLES: f64 = 2e7;

/// Our columns, MoTeC's names and units for them, and the factor between.
const NAMES: [(&[&str], &str, &str, f64); 12] = [
    (&["distance", "station"], "Lap Distance", "m", 1.0),
    (&["vx", "v"], "Ground Speed", "km/h", 3.6),
    (&["ax"], "G Force Long", "G", 1.0 / 9.806_65),
    (&["ay"], "G Force Lat", "G", 1.0 / 9.806_65),
    (&["yaw_rate"], "Gyro Yaw Velocity", "deg/s", DEGREES),
    (&["steer", "steering"], "Steered Angle", "deg", DEGREES),
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

/// A column of one of our tables under MoTeC's name.
fn renamed(name: &str, unit: &str) -> (String, String, f64) {
    let version = VERSIONS
        .iter()
        .find_map(|(end, words)| Some((name.strip_suffix(end)?, *words)));
    let (base, words) = version.unwrap_or((name, ""));
    if let Some((_, motec, unit, factor)) = NAMES.iter().find(|(ours, ..)| ours.contains(&base)) {
        return (format!("{motec}{words}"), (*unit).to_owned(), *factor);
    }
    let titled: Vec<String> = base
        .split(['_', ' '])
        .map(|word| match word {
            "fl" | "fr" | "rl" | "rr" => word.to_uppercase(),
            _ => word
                .chars()
                .take(1)
                .flat_map(char::to_uppercase)
                .chain(word.chars().skip(1))
                .collect(),
        })
        .collect();
    let unit = if unit == "-" { "" } else { unit };
    (titled.join(" ") + words, unit.to_owned(), 1.0)
}

/// A column's name and unit, from a head such as `vx (m/s)` or `vx_mps`.
fn split_head(head: &str) -> (String, String) {
    let head = head.trim_start_matches('#').trim();
    if let Some((name, unit)) = head.split_once(" (") {
        return (name.to_owned(), unit.trim_end_matches(')').to_owned());
    }
    // As native logs have them; the longer endings come first.
    let endings = [
        ("_mps2", "m/s^2"),
        ("_mps", "m/s"),
        ("_radps", "rad/s"),
        ("_rad", "rad"),
        ("_m", "m"),
        ("_s", "s"),
    ];
    let known = endings
        .iter()
        .find_map(|(end, unit)| Some((head.strip_suffix(end)?, *unit)));
    known.map_or_else(
        || (head.to_owned(), String::new()),
        |(name, unit)| (name.to_owned(), unit.to_owned()),
    )
}

impl SampledLap {
    /// Samples a table that a study wrote (`line_fastest.csv`, `drive.csv`, `traces.csv`), or a native log, at `rate_hz` (Hz),
    /// linearly between its rows; gears hold. Columns without a number are left out, and gaps are filled from their neighbours.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be read; [`Error::Input`] naming file and line for a table without rising times or other
    /// columns, for rows of another width, and for a rate out of 1 to 1000 Hz.
    pub fn read(path: &Path, rate_hz: u16) -> Result<Self> {
        if !(1..=MOST_RATE_HZ).contains(&rate_hz) {
            let expected = format!("1 to {MOST_RATE_HZ} Hz");
            return Err(Error::input(path, "rate", format!("{rate_hz} Hz"), expected));
        }
        let bytes = read_bytes(path, MOST_BYTES)?;
        let text = String::from_utf8(bytes)
            .map_err(|_| Error::input(path, "file", "bytes that are no UTF-8", "text"))?;
        let native = text.lines().any(|line| line.starts_with(COLUMNS[0]));
        let mut reader = csv::ReaderBuilder::new()
            .comment(native.then_some(b'#'))
            .from_reader(text.as_bytes());
        let refuse = |e: csv::Error| {
            let line = e.position().map_or(1, csv::Position::line);
            Error::input(
                path,
                Place::line(line as usize),
                e.to_string(),
                "a table with a header",
            )
        };
        let heads: Vec<(String, String)> = reader.headers().map_err(refuse)?.iter().map(split_head).collect();
        let Some(clock) = heads.iter().position(|(name, _)| name == "time") else {
            let found: Vec<&str> = heads.iter().take(8).map(|(name, _)| name.as_str()).collect();
            let expected = "a column of times (s), as a line, a drive, a lap or a log has it";
            return Err(Error::input(path, Place::line(1), found.join(", "), expected));
        };
        let mut columns: Vec<Vec<f64>> = vec![Vec::new(); heads.len()];
        for record in reader.records() {
            let record = record.map_err(refuse)?;
            let line = record.position().map_or(1, csv::Position::line) as usize;
            let number = |cell: &str| {
                cell.trim()
                    .parse()
                    .ok()
                    .filter(|x: &f64| x.is_finite())
                    .unwrap_or(f64::NAN)
            };
            for (column, cell) in columns.iter_mut().zip(record.iter()) {
                column.push(number(cell));
            }
            let times = &columns[clock];
            let at = times.len() - 1;
            if !(times[at].is_finite() && (at == 0 || times[at] > times[at - 1])) {
                let found = record.get(clock).unwrap_or_default();
                return Err(Error::input(
                    path,
                    Place::line(line).named("time"),
                    found,
                    "times that rise",
                ));
            }
        }
        let times = columns[clock].clone();
        let (Some(&first), Some(&last)) = (times.first(), times.last()) else {
            return Err(Error::input(path, "rows", "none", "a lap"));
        };
        let time_s = last - first;
        let count = (time_s * f64::from(rate_hz) + 1e-9).floor() + 1.0;
        if count > MOST_SAMPLES {
            return Err(Error::input(path, "time", format!("{time_s} s"), "a lap"));
        }
        let named = heads
            .iter()
            .zip(&columns)
            .enumerate()
            .filter(|(i, _)| *i != clock);
        let channels: Vec<LapChannel> = named
            .filter_map(|(_, ((name, unit), values))| {
                let known: Vec<(f64, f64)> = times
                    .iter()
                    .copied()
                    .zip(values.iter().copied())
                    .filter(|(_, x)| x.is_finite())
                    .collect();
                let (motec, unit, factor) = renamed(name, unit);
                let at = |k: usize| {
                    between(&known, first + k as f64 / f64::from(rate_hz), name == "gear") * factor
                };
                (!known.is_empty()).then(|| LapChannel {
                    name: motec,
                    unit,
                    values: (0..count as usize).map(at).collect(),
                })
            })
            .collect();
        if channels.is_empty() {
            return Err(Error::input(
                path,
                Place::line(1),
                "a column of times alone",
                "a channel beside it",
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
        assert!((of("G Force Lat").values[0] - 1.0 / 9.806_65).abs() < 1e-15);
        assert_eq!(
            of("Ground Speed Fitted").values,
            [4.0 * 3.6, 4.0 * 3.6, 4.0 * 3.6, 6.0 * 3.6, 8.0 * 3.6]
        );
        assert_eq!(of("Gear").values, [1.0, 1.0, 2.0, 2.0, 3.0]);
        assert_eq!((of("Soc").unit.as_str(), of("Lap Distance").values[1]), ("", 2.5));
    }

    #[test]
    fn tables_that_are_no_laps_are_refused_by_line() {
        for (text, rate_hz, expected) in [
            ("v (m/s),a (-)\n1,2\n", 10, "a column of times"),
            ("time (s),v (m/s)\n0,1\n2,1\n1,1\n", 10, "line 4"),
            ("time (s),v (m/s)\n0,1\nx,1\n", 10, "line 3"),
            ("time (s),v (m/s)\n", 10, "a lap"),
            ("time (s),v (m/s)\n0,word\n1,word\n", 10, "a channel"),
            ("time (s),v (m/s)\n0,1\n1,1\n", 0, "1 to 1000 Hz"),
            ("time (s),v (m/s)\n0,1\n1e300,1\n", 10, "a lap"),
        ] {
            let error = read(text, rate_hz).unwrap_err().to_string();
            assert!(error.contains(expected), "{text}: {error}");
        }
    }
}
