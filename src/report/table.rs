//! Tables: CSV files and aligned text for a terminal.

use std::path::Path;

use super::style::with_unit;
use crate::files::write_whole;
use crate::{Error, Result};

/// What a column holds.
#[derive(Debug, Clone, Copy)]
pub enum Cells<'a> {
    /// Numbers, in the column's unit; what is not finite is left empty.
    Numbers(&'a [f64]),
    /// Words.
    Texts(&'a [String]),
}

/// One column of a table.
#[derive(Debug, Clone, Copy)]
pub struct Column<'a> {
    /// The quantity.
    pub name: &'a str,
    /// Its unit; empty for none.
    pub unit: &'a str,
    /// Its values, from the first row.
    pub cells: Cells<'a>,
}

impl Column<'_> {
    pub(super) fn len(&self) -> usize {
        match self.cells {
            Cells::Numbers(x) => x.len(),
            Cells::Texts(t) => t.len(),
        }
    }

    fn header(&self) -> String {
        with_unit(self.name, self.unit)
    }

    /// A cell with every digit of a number, so that it reads back as it was.
    fn exact(&self, row: usize) -> String {
        match self.cells {
            Cells::Numbers(x) => x
                .get(row)
                .filter(|v| v.is_finite())
                .map_or_else(String::new, f64::to_string),
            Cells::Texts(t) => t.get(row).cloned().unwrap_or_default(),
        }
    }

    /// A cell for reading.
    fn short(&self, row: usize) -> String {
        match self.cells {
            Cells::Numbers(x) => match x.get(row) {
                None => String::new(),
                Some(v) if !v.is_finite() => "-".to_owned(),
                Some(v) => plain_digits(*v),
            },
            Cells::Texts(_) => printable(&self.exact(row)),
        }
    }
}

/// A line break or an escape sequence from a file must not reach the terminal.
fn printable(text: &str) -> String {
    let keep = |c: char| if c.is_control() { ' ' } else { c };
    text.chars().map(keep).collect()
}

/// Six significant digits without trailing noughts.
pub(super) fn plain_digits(v: f64) -> String {
    if v == 0.0 {
        return "0".to_owned();
    }
    let decade = v.abs().log10().floor();
    if !(-4.0..9.0).contains(&decade) {
        return format!("{v:.4e}");
    }
    let decimals = (5.0 - decade).max(0.0) as usize;
    let text = format!("{v:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// Writes columns to a CSV file, headed by names with units, whole or not at all. Numbers keep all
/// their digits.
///
/// # Errors
/// [`Error::Input`] when there are no columns or they differ in length; [`Error::Io`] when the file
/// cannot be written.
pub fn write_csv(path: impl AsRef<Path>, columns: &[Column<'_>]) -> Result<()> {
    let path = path.as_ref();
    let rows = columns.first().map_or(0, Column::len);
    if columns.is_empty() {
        return Err(Error::input(path, "columns", "none", "at least one"));
    }
    if let Some(odd) = columns.iter().find(|c| c.len() != rows) {
        return Err(Error::input(
            path,
            format!("column {}", odd.name),
            format!("{} rows", odd.len()),
            format!("{rows}, as in column {}", columns[0].name),
        ));
    }
    let failed = |e: csv::Error| Error::io(path, "write", std::io::Error::other(e));
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer
        .write_record(columns.iter().map(Column::header))
        .map_err(failed)?;
    for row in 0..rows {
        writer
            .write_record(columns.iter().map(|c| c.exact(row)))
            .map_err(failed)?;
    }
    let text = writer
        .into_inner()
        .map_err(|e| Error::io(path, "write", e.into_error()))?;
    write_whole(path, &text)
}

/// Columns as text for a terminal: numbers to six digits aligned to the right, words to the left.
/// Columns may differ in length.
pub fn text_table(columns: &[Column<'_>]) -> String {
    let rows = columns.iter().map(Column::len).max().unwrap_or(0);
    let cells: Vec<Vec<String>> = columns
        .iter()
        .map(|c| {
            let body = (0..rows).map(|row| c.short(row));
            std::iter::once(printable(&c.header())).chain(body).collect()
        })
        .collect();
    let widths: Vec<usize> = cells
        .iter()
        .map(|column| column.iter().map(|c| c.chars().count()).max().unwrap_or(0))
        .collect();
    let mut text = String::new();
    if columns.is_empty() {
        return text;
    }
    let mut push_line = |line: String| {
        text.push_str(line.trim_end());
        text.push('\n');
    };
    // The header is the row before the first.
    for row in 0..=rows {
        let line: Vec<String> = columns
            .iter()
            .zip(cells.iter().zip(&widths))
            .map(|(column, (cells, &width))| {
                let cell = &cells[row];
                match column.cells {
                    Cells::Numbers(_) => format!("{cell:>width$}"),
                    Cells::Texts(_) => format!("{cell:<width$}"),
                }
            })
            .collect();
        push_line(line.join("  "));
        if row == 0 {
            let rules: Vec<String> = widths.iter().map(|&w| "-".repeat(w)).collect();
            push_line(rules.join("  "));
        }
    }
    text
}
