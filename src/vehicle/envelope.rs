//! The g-g-v envelope of a car: the greatest accelerations at each speed, within which a point mass laps.
//!
//! The acceleration by the tyres stays inside a friction ellipse. Its half axes are the greatest lateral and longitudinal
//! acceleration, which depend on speed. The engine limits driving too. Drag is not a force of the tyres, so it stays outside the
//! ellipse. (D. L. Brayshaw and M. F. Harrison, *A quasi steady state approach to race car lap simulation*, Proc. IMechE D 219,
//! 2005, for the g-g-speed surface.)

use crate::config::read_text;
use crate::error::{Error, Place, Result};
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;
use std::path::Path;

/// The g-g-v envelope at one speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EnvelopeRow {
    /// Speed (m/s).
    pub v_mps: f64,
    /// Greatest lateral acceleration (m/s^2).
    pub ay_mps2: f64,
    /// Greatest longitudinal acceleration by the tyres' grip, driving or braking (m/s^2).
    pub ax_grip_mps2: f64,
    /// Greatest acceleration that the engine can give, before drag (m/s^2).
    pub ax_drive_mps2: f64,
    /// Deceleration by drag and rolling resistance (m/s^2).
    pub drag_mps2: f64,
}

impl EnvelopeRow {
    fn to_array(self) -> [f64; 5] {
        [
            self.v_mps,
            self.ay_mps2,
            self.ax_grip_mps2,
            self.ax_drive_mps2,
            self.drag_mps2,
        ]
    }

    fn from_array([v_mps, ay_mps2, ax_grip_mps2, ax_drive_mps2, drag_mps2]: [f64; 5]) -> Self {
        Self {
            v_mps,
            ay_mps2,
            ax_grip_mps2,
            ax_drive_mps2,
            drag_mps2,
        }
    }
}

/// A g-g-v envelope: greatest accelerations over speed.
///
/// Between rows the figures are linear in speed; below the first row they are those of the first row. There is no drive at or
/// above the last speed, which is therefore the top speed of the car.
#[derive(Clone, Debug, PartialEq)]
pub struct Envelope {
    name: String,
    rows: Vec<EnvelopeRow>,
}

/// The columns of an envelope's table, in the order that [`Envelope::to_csv`] writes them.
pub const ENVELOPE_COLUMNS: [&str; 5] = ["v_mps", "ay_mps2", "ax_grip_mps2", "ax_drive_mps2", "drag_mps2"];

/// Range of each column: the least value, whether that value itself is allowed, and the greatest.
const RANGES: [(f64, bool, f64); 5] = [
    (0.0, true, 200.0),
    (0.0, false, 200.0),
    (0.0, false, 200.0),
    // At constant power, acceleration grows without bounds towards standstill.
    (0.0, true, 1e5),
    (0.0, true, 200.0),
];

impl Envelope {
    /// An envelope of these rows; `name` is what errors and titles call it.
    ///
    /// # Errors
    /// [`Error::Input`] if there are fewer than two rows, if speeds do not rise, or if a figure is out of range.
    pub fn new(name: impl Into<String>, rows: Vec<EnvelopeRow>) -> Result<Self> {
        let name = name.into();
        for (index, row) in rows.iter().enumerate() {
            check_row(&name, Place::row(index + 1), row, rows[..index].last())?;
        }
        check_count(&name, rows.len())?;
        Ok(Self { name, rows })
    }

    /// Reads an envelope from a CSV file with the columns [`ENVELOPE_COLUMNS`] in any order; lines that begin with
    /// `#` are comments.
    ///
    /// # Errors
    /// [`Error::Io`] if the file cannot be read, [`Error::Input`] with line and field if it holds no envelope.
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let text = read_text(path)?;
        Self::from_csv(&path.display().to_string(), &text)
    }

    /// As [`Envelope::load`], from a text; `file` is what errors call it.
    ///
    /// # Errors
    /// As [`Envelope::load`].
    pub fn from_csv(file: &str, text: &str) -> Result<Self> {
        let text = text.trim_start_matches('\u{feff}');
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        // The reader counts lines from before the comments and empty lines that it skips.
        let line_at = |position: Option<&csv::Position>| {
            let start = position.map_or(0, |p| p.byte() as usize).min(text.len());
            let skipped = text.as_bytes()[start..]
                .split(|&b| b == b'\n')
                .take_while(|line| line.trim_ascii().is_empty() || line.starts_with(b"#"))
                .count();
            1 + text.bytes().take(start).filter(|&b| b == b'\n').count() + skipped
        };
        let unreadable = |error: csv::Error| {
            let found = match error.kind() {
                csv::ErrorKind::UnequalLengths {
                    expected_len, len, ..
                } => format!("{len} fields where the header has {expected_len}"),
                _ => error.to_string(),
            };
            let place = Place::line(line_at(error.position()));
            Error::input(file, place, found, "a row like the header")
        };
        let header = reader.headers().map_err(unreadable)?.clone();
        let header_line = line_at(header.position());
        let mut column = [0; 5];
        for (place, name) in column.iter_mut().zip(ENVELOPE_COLUMNS) {
            let mut found = header.iter().enumerate().filter(|(_, h)| *h == name);
            *place = match (found.next(), found.next()) {
                (Some((i, _)), None) => i,
                (first, _) => {
                    return Err(Error::input(
                        file,
                        Place::line(header_line).column(name),
                        if first.is_some() {
                            "it twice".to_owned()
                        } else {
                            format!("only `{}`", header.iter().collect::<Vec<_>>().join(","))
                        },
                        format!("each of {} once", ENVELOPE_COLUMNS.join(", ")),
                    ));
                }
            };
        }
        let mut rows: Vec<EnvelopeRow> = Vec::new();
        for record in reader.records() {
            let record = record.map_err(unreadable)?;
            let line = line_at(record.position());
            let mut figures = [0.0; 5];
            for ((figure, place), name) in figures.iter_mut().zip(column).zip(ENVELOPE_COLUMNS) {
                let field = record.get(place).unwrap_or_default();
                *figure = field.parse().map_err(|_| {
                    Error::input(
                        file,
                        Place::line(line).field(name),
                        format!("`{field}`"),
                        "a number",
                    )
                })?;
            }
            let row = EnvelopeRow::from_array(figures);
            check_row(file, Place::line(line), &row, rows.last())?;
            rows.push(row);
        }
        check_count(file, rows.len())?;
        Ok(Self {
            name: file.to_owned(),
            rows,
        })
    }

    /// The table as [`Envelope::load`] reads it.
    pub fn to_csv(&self) -> String {
        let mut text = ENVELOPE_COLUMNS.join(",") + "\n";
        for row in &self.rows {
            let [v, ay, grip, drive, drag] = row.to_array();
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{v},{ay},{grip},{drive},{drag}");
        }
        text
    }

    /// What errors and titles call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The rows, by rising speed.
    pub fn rows(&self) -> &[EnvelopeRow] {
        &self.rows
    }

    /// The greatest speed (m/s).
    pub fn top_speed_mps(&self) -> f64 {
        self.rows[self.rows.len() - 1].v_mps
    }

    /// The envelope at a speed (m/s). At the top speed and above there is no drive.
    pub fn at(&self, v_mps: f64) -> EnvelopeRow {
        let after = self
            .rows
            .partition_point(|r| r.v_mps <= v_mps)
            .clamp(1, self.rows.len() - 1);
        let (low, high) = (self.rows[after - 1].to_array(), self.rows[after].to_array());
        let share = ((v_mps - low[0]) / (high[0] - low[0])).clamp(0.0, 1.0);
        let mut figures: [f64; 5] = std::array::from_fn(|i| low[i] + share * (high[i] - low[i]));
        figures[0] = v_mps;
        if v_mps >= self.top_speed_mps() {
            figures[3] = 0.0;
        }
        EnvelopeRow::from_array(figures)
    }
}

fn check_count(file: &str, rows: usize) -> Result<()> {
    if rows < 2 {
        return Err(Error::input(
            file,
            "rows",
            rows.to_string(),
            "at least two speeds with their limits",
        ));
    }
    Ok(())
}

fn check_row(file: &str, place: Place, row: &EnvelopeRow, before: Option<&EnvelopeRow>) -> Result<()> {
    for ((x, name), (least, allowed, most)) in row.to_array().into_iter().zip(ENVELOPE_COLUMNS).zip(RANGES) {
        if !(x > least && x <= most || allowed && x == least) {
            return Err(Error::input(
                file,
                place.field(name),
                x.to_string(),
                if allowed {
                    format!("{least} to {most}")
                } else {
                    format!("more than {least}, at most {most}")
                },
            ));
        }
    }
    let rises = before.is_none_or(|b| row.v_mps > b.v_mps);
    if !rises {
        return Err(Error::input(
            file,
            place.field(ENVELOPE_COLUMNS[0]),
            row.v_mps.to_string(),
            "a speed beyond that of the row before",
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# a car\ndrag_mps2,v_mps,ay_mps2,ax_grip_mps2,ax_drive_mps2\n0.5,20,15,14,9\n\n# more\n4,70,18,18,4\n";

    #[test]
    fn a_table_is_read_looked_up_and_written() {
        let envelope = Envelope::from_csv("own.csv", TEXT).unwrap();
        let half = envelope.at(45.0);
        assert_eq!(half.to_array(), [45.0, 16.5, 16.0, 6.5, 2.25]);
        assert_eq!(envelope.at(5.0).to_array(), [5.0, 15.0, 14.0, 9.0, 0.5]);
        assert_eq!(envelope.at(70.0).to_array(), [70.0, 18.0, 18.0, 0.0, 4.0]);
        assert_eq!(envelope.at(90.0).ax_drive_mps2, 0.0);
        assert_eq!(
            Envelope::from_csv("own.csv", &envelope.to_csv()).unwrap(),
            envelope
        );
    }

    #[test]
    fn mistakes_are_named_by_line_and_field() {
        for (text, wanted) in [
            (
                TEXT.replace("70,18", "70,fast"),
                "own.csv: line 6, field ay_mps2: found `fast`",
            ),
            (
                TEXT.replace("70,18", "70,0"),
                "line 6, field ay_mps2: found 0, expected more than 0",
            ),
            (TEXT.replace("70,18", "70,NaN"), "field ay_mps2: found NaN"),
            (
                TEXT.replace("4,70", "4,20"),
                "line 6, field v_mps: found 20, expected a speed beyond",
            ),
            (
                TEXT.replace("4,70", "-4,70"),
                "field drag_mps2: found -4, expected 0 to",
            ),
            (
                TEXT.replace("drag_mps2", "drag"),
                "line 2, column drag_mps2: found only",
            ),
            (
                TEXT.replace("drag_mps2", "v_mps"),
                "line 2, column v_mps: found it twice",
            ),
            (TEXT.replace("4,70,18,18,4", "4,70"), "line 6: found 2 fields"),
            (TEXT.replace("4,70,18,18,4", ""), "rows: found 1"),
            (String::new(), "column v_mps"),
        ] {
            let error = Envelope::from_csv("own.csv", &text).unwrap_err();
            assert!(error.to_string().contains(wanted), "{error} should say {wanted}");
        }
    }
}
