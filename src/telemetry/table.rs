//! The numeric part that both CSV formats share.

use std::path::Path;
use std::sync::Arc;

use super::recording::{Channel, Clock, Unreadable};
use super::text::{Row, shown};
use crate::{Error, Result};

/// Columns of numbers as they are read.
pub(super) struct Table<'a> {
    file: &'a Path,
    names: Vec<String>,
    units: Vec<String>,
    time_column: usize,
    columns: Vec<Vec<f64>>,
    unreadable: Vec<Option<Unreadable>>,
    lines: Vec<usize>,
}

impl<'a> Table<'a> {
    /// An empty table; `names` are unique, `units` as many, `time_column` one of them.
    pub fn new(file: &'a Path, names: Vec<String>, units: Vec<String>, time_column: usize) -> Self {
        let width = names.len();
        Self {
            file,
            names,
            units,
            time_column,
            columns: vec![Vec::new(); width],
            unreadable: vec![None; width],
            lines: Vec::new(),
        }
    }

    /// Adds a row. A cell that is no finite number is remembered, not refused, unless it is the time.
    pub fn push(&mut self, row: &Row<'_>) -> Result<()> {
        let (width, line) = (self.names.len(), row.line);
        // A trailing comma adds an empty cell and loses nothing.
        let surplus = row.cells.iter().skip(width).any(|cell| !cell.is_empty());
        if row.cells.len() < width || surplus {
            return Err(Error::input(
                self.file,
                format!("line {line}"),
                format!("{} cells", row.cells.len()),
                format!("{width} cells, one for each column"),
            ));
        }
        let sample = self.lines.len();
        for (index, cell) in row.cells.iter().take(width).enumerate() {
            let value = match cell.parse::<f64>() {
                Ok(value) if value.is_finite() => value,
                _ if index == self.time_column => {
                    return Err(Error::input(
                        self.file,
                        format!("line {line}, channel {}", self.names[index]),
                        shown(cell),
                        "a time in seconds",
                    ));
                }
                _ => {
                    if self.unreadable[index].is_none() {
                        let text = cell.to_string();
                        self.unreadable[index] = Some(Unreadable { sample, text });
                    }
                    f64::NAN
                }
            };
            self.columns[index].push(value);
        }
        self.lines.push(line);
        Ok(())
    }

    /// The channels, with time (multiplied by `time_factor` to seconds) as their common clock.
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
