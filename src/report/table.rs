//! Tables: CSV and Parquet files, aligned text for a terminal, tables of a page.

use std::borrow::Cow;
use std::path::Path;

use super::style::with_unit;
use crate::files::write_whole;
use crate::{Error, Result};

/// What a column holds.
#[derive(Debug, Clone)]
pub(super) enum Cells<'a> {
    /// Numbers, in the column's unit; what is not finite is left empty.
    Numbers(Cow<'a, [f64]>),
    /// Words.
    Texts(Vec<String>),
}

/// One column of a table.
#[derive(Debug, Clone)]
pub(super) struct Column<'a> {
    pub name: String,
    /// Empty for none.
    pub unit: String,
    pub cells: Cells<'a>,
}

/// A table, stated once for files, terminals and pages. Columns stand in the order in which they are added.
///
/// ```
/// use lapswarm::report::Table;
///
/// let laps = [("first", 114.29), ("second", 122.31)];
/// let table = Table::rows(laps).text("line", |l| l.0).number("lap time", "s", |l| l.1).table();
/// assert!(table.to_text().contains("lap time (s)"));
/// ```
#[derive(Debug, Clone, Default)]
pub struct Table<'a> {
    pub(super) columns: Vec<Column<'a>>,
}

/// A table of what rows hold, column by column.
#[derive(Debug, Clone)]
pub struct Rows<T> {
    rows: Vec<T>,
    table: Table<'static>,
}

impl<T> Rows<T> {
    /// Adds a column of words.
    #[must_use]
    pub fn text<S: Into<String>>(mut self, name: impl Into<String>, of: impl Fn(&T) -> S) -> Self {
        self.table = self.table.texts(name, self.rows.iter().map(of));
        self
    }

    /// Adds a column of numbers; a row without one has an empty cell.
    #[must_use]
    pub fn number<N: Into<Option<f64>>>(
        mut self,
        name: impl Into<String>,
        unit: impl Into<String>,
        of: impl Fn(&T) -> N,
    ) -> Self {
        let values = self.rows.iter().map(|row| of(row).into().unwrap_or(f64::NAN));
        self.table = self.table.numbers(name, unit, values.collect::<Vec<f64>>());
        self
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The table.
    pub fn table(self) -> Table<'static> {
        self.table
    }
}

impl<T: AsRef<[f64]>> Rows<T> {
    /// Adds a column for each number of a row, by these names and units.
    #[must_use]
    pub fn each<N: Into<String>, U: Into<String>>(self, named: impl IntoIterator<Item = (N, U)>) -> Self {
        let columns = named.into_iter().enumerate();
        columns.fold(self, |rows, (k, (name, unit))| {
            rows.number(name, unit, |row| row.as_ref()[k])
        })
    }
}

impl Column<'_> {
    pub(super) fn len(&self) -> usize {
        match &self.cells {
            Cells::Numbers(x) => x.len(),
            Cells::Texts(t) => t.len(),
        }
    }

    fn header(&self) -> String {
        with_unit(&self.name, &self.unit)
    }

    /// A cell with every digit of a number, so that it reads back as it was.
    fn exact(&self, row: usize) -> String {
        match &self.cells {
            Cells::Numbers(x) => x
                .get(row)
                .filter(|v| v.is_finite())
                .map_or_else(String::new, f64::to_string),
            Cells::Texts(t) => t.get(row).cloned().unwrap_or_default(),
        }
    }

    /// A cell for reading.
    fn short(&self, row: usize) -> String {
        match &self.cells {
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

/// Six significant digits without trailing zeros.
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

impl<'a> Table<'a> {
    /// A table without columns.
    pub fn new() -> Self {
        Self::default()
    }

    /// A table to be filled from rows.
    pub fn rows<T>(rows: impl IntoIterator<Item = T>) -> Rows<T> {
        Rows {
            rows: rows.into_iter().collect(),
            table: Table::new(),
        }
    }

    /// Adds a column of words.
    #[must_use]
    pub fn texts<S: Into<String>>(
        mut self,
        name: impl Into<String>,
        cells: impl IntoIterator<Item = S>,
    ) -> Self {
        self.columns.push(Column {
            name: name.into(),
            unit: String::new(),
            cells: Cells::Texts(cells.into_iter().map(Into::into).collect()),
        });
        self
    }

    /// Adds a column of numbers in a unit, which may be empty.
    #[must_use]
    pub fn numbers(
        mut self,
        name: impl Into<String>,
        unit: impl Into<String>,
        values: impl Into<Cow<'a, [f64]>>,
    ) -> Self {
        self.columns.push(Column {
            name: name.into(),
            unit: unit.into(),
            cells: Cells::Numbers(values.into()),
        });
        self
    }

    /// The first columns alone.
    #[must_use]
    pub fn first(mut self, columns: usize) -> Self {
        self.columns.truncate(columns);
        self
    }

    /// The table without the columns that are empty in every row.
    #[must_use]
    pub fn without_empty(mut self) -> Self {
        self.columns.retain(|column| match &column.cells {
            Cells::Numbers(x) => x.iter().any(|v| v.is_finite()),
            Cells::Texts(t) => t.iter().any(|t| !t.is_empty()),
        });
        self
    }

    /// Writes a CSV file, headed by names with units, whole or not at all. Numbers keep all their digits.
    ///
    /// # Errors
    /// [`Error::Input`] when there are no columns or they differ in length; [`Error::Io`] when the file
    /// cannot be written.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> Result<()> {
        let (path, columns) = (path.as_ref(), &self.columns);
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

    /// The table as text for a terminal: numbers to six digits aligned to the right, words to the left.
    /// Columns may differ in length.
    pub fn to_text(&self) -> String {
        let columns = &self.columns;
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
                    match &column.cells {
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
}
