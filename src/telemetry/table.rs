//! The numeric part that both CSV formats share.

use std::path::Path;
use std::sync::Arc;

use super::recording::{Channel, Clock, Format, Metadata, Reading, Recording, Unreadable};
use super::text::{Row, shown};
use crate::{Error, Place, Result};

/// Columns of numbers as they are read.
pub(super) struct Table<'a> {
    file: &'a Path,
    names: Vec<String>,
    units: Vec<String>,
    time_column: usize,
    /// Columns that are not read keep no samples.
    wanted: Vec<bool>,
    columns: Vec<Vec<f64>>,
    unreadable: Vec<Option<Unreadable>>,
    lines: Vec<usize>,
}

impl<'a> Table<'a> {
    /// An empty table with room for the rows of `text`; `names` are unique, `units` as many, `time_column` one of them.
    ///
    /// # Errors
    /// [`Error::Input`] if the rows do not fit into what memory is allowed.
    pub fn new(
        file: &'a Path,
        text: &str,
        (names, units): (Vec<String>, Vec<String>),
        time_column: usize,
        (format, reading): (Format, &Reading<'_>),
    ) -> Result<Self> {
        let width = names.len();
        let wanted = wanted(file, (&names, &units), time_column, (format, reading))?;
        let rows = text.bytes().filter(|&b| b == b'\n').count() + 1;
        // Beside the text: the columns, the lines of the rows, and times and lines once more, as they are shared in the end.
        let kept = wanted.iter().filter(|w| **w).count() as u64 + 3;
        let needed = (rows as u64).saturating_mul(8 * kept);
        let size = text.len() as u64;
        reading.fits(file, size, needed.saturating_add(size))?;
        let room = |wanted: &bool| Vec::with_capacity(if *wanted { rows } else { 0 });
        Ok(Self {
            file,
            names,
            units,
            time_column,
            columns: wanted.iter().map(room).collect(),
            wanted,
            unreadable: vec![None; width],
            lines: Vec::with_capacity(rows),
        })
    }

    /// Adds a row. A cell that is not a finite number is recorded and not refused, unless it is the time.
    ///
    /// # Errors
    /// [`Error::Input`] for a row of another width, and for a time that is not a number or does not rise.
    pub fn push(&mut self, row: &Row<'_>) -> Result<()> {
        let (width, line) = (self.names.len(), row.line);
        // A trailing comma adds an empty cell and loses nothing.
        let surplus = row.cells.iter().skip(width).any(|cell| !cell.is_empty());
        if row.cells.len() < width || surplus {
            return Err(Error::input(
                self.file,
                Place::line(line),
                format!("{} cells", row.cells.len()),
                format!("{width} cells, one for each column"),
            ));
        }
        let sample = self.lines.len();
        for (index, cell) in row.cells.iter().take(width).enumerate() {
            if !self.wanted[index] {
                continue;
            }
            let value = match cell.parse::<f64>() {
                Ok(value) if value.is_finite() => value,
                _ if index == self.time_column => {
                    return Err(Error::input(
                        self.file,
                        Place::line(line).channel(&self.names[index]),
                        shown(cell),
                        "a time in seconds",
                    ));
                }
                _ => {
                    let text = cell.to_string();
                    Unreadable::keep(&mut self.unreadable[index], Unreadable { sample, text });
                    f64::NAN
                }
            };
            self.columns[index].push(value);
        }
        self.lines.push(line);
        Ok(())
    }

    /// The channels, with time (multiplied by `time_factor` to seconds) as their common clock.
    ///
    /// # Errors
    /// [`Error::Input`] for fewer than two rows.
    pub fn finish(mut self, time_factor: f64) -> Result<Vec<Channel>> {
        if self.lines.len() < 2 {
            return Err(Error::input(
                self.file,
                "data rows",
                format!("{} of them", self.lines.len()),
                "at least two",
            ));
        }
        let times: Arc<[f64]> = self.columns[self.time_column]
            .iter()
            .map(|t| t * time_factor)
            .collect();
        let lines: Arc<[usize]> = self.lines.into();
        let mut channels = Vec::with_capacity(self.names.len());
        for (index, name) in self.names.into_iter().enumerate() {
            if index == self.time_column {
                continue;
            }
            channels.push(Channel {
                name,
                unit: std::mem::take(&mut self.units[index]),
                clock: Clock::Times(Arc::clone(&times)),
                values: std::mem::take(&mut self.columns[index]),
                unreadable: self.unreadable[index].take(),
                lines: Some(Arc::clone(&lines)),
            });
        }
        Ok(channels)
    }
}

/// Which columns are read: those that are chosen by their names and units, and the time.
fn wanted(
    file: &Path,
    (names, units): (&[String], &[String]),
    time_column: usize,
    (format, reading): (Format, &Reading<'_>),
) -> Result<Vec<bool>> {
    let channels = names.iter().zip(units).enumerate();
    let head = Recording {
        source: file.to_owned(),
        format,
        channels: channels
            .filter(|(index, _)| *index != time_column)
            .map(|(_, (name, unit))| Channel {
                name: name.clone(),
                unit: unit.clone(),
                clock: Clock::Times(Arc::default()),
                values: Vec::new(),
                unreadable: None,
                lines: None,
            })
            .collect(),
        beacons_s: Vec::new(),
        metadata: Metadata::default(),
    };
    let mut wanted = (reading.choose)(&head)?;
    wanted.insert(time_column, true);
    Ok(wanted)
}
