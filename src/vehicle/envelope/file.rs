//! Envelopes in CSV files.

use super::{
    BendTraction, ENVELOPE_COLUMNS, Envelope, EnvelopeRow, LOST_COLUMN, OPEN_COLUMN, TRACTION_COLUMN,
    check_count, check_losses, check_row, check_shares, check_traction, in_list,
};
use crate::config::{Rows, read_text};
use crate::error::{Error, Place, Result};
use std::fmt::Write as _;
use std::path::Path;

impl Envelope {
    /// Reads an envelope from a CSV file with the columns [`ENVELOPE_COLUMNS`] in any order; lines that begin with
    /// `#` are comments. Columns whose names begin with [`OPEN_COLUMN`] hold the figures with the DRS open.
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
        let Rows { header, records } = Rows::of(file, text)?;
        let table = TableText {
            file,
            header: (header.0, &header.1),
            records: &records,
        };
        let shut = table.envelope("")?;
        if header.1.iter().any(|name| name.starts_with(OPEN_COLUMN)) {
            return shut.with_open(table.envelope(OPEN_COLUMN)?);
        }
        Ok(shut)
    }

    /// The table as [`Envelope::load`] reads it.
    pub fn to_csv(&self) -> String {
        let states = [("", Some(self)), (OPEN_COLUMN, self.open())];
        let states: Vec<_> = states
            .into_iter()
            .filter_map(|(prefix, state)| Some((prefix, state?)))
            .collect();
        let mut text = ENVELOPE_COLUMNS[0].to_owned();
        // Writing to a string cannot fail.
        for (prefix, state) in &states {
            for name in &ENVELOPE_COLUMNS[1..] {
                let _ = write!(text, ",{prefix}{name}");
            }
            if let Some(in_bends) = &state.in_bends {
                for column in [TRACTION_COLUMN, LOST_COLUMN] {
                    for share in &in_bends.shares {
                        let _ = write!(text, ",{prefix}{column}{share}");
                    }
                }
            }
        }
        text += "\n";
        for (index, row) in self.rows.iter().enumerate() {
            let _ = write!(text, "{}", row.v_mps);
            for (_, state) in &states {
                for figure in &state.rows[index].to_array()[1..] {
                    let _ = write!(text, ",{figure}");
                }
                if let Some(in_bends) = &state.in_bends {
                    for figure in in_bends.rows[index].iter().chain(&in_bends.lost[index]) {
                        let _ = write!(text, ",{figure}");
                    }
                }
            }
            text += "\n";
        }
        text
    }
}

/// The rows of a table, each with its line, and its header.
struct TableText<'a> {
    file: &'a str,
    header: (usize, &'a csv::StringRecord),
    records: &'a [(usize, csv::StringRecord)],
}

impl TableText<'_> {
    /// The envelope in the columns whose names begin with `prefix`; all have the speed in common.
    fn envelope(&self, prefix: &str) -> Result<Envelope> {
        let Self {
            file,
            header: (header_line, header),
            records,
        } = *self;
        let named = |name: &str| {
            if name == ENVELOPE_COLUMNS[0] {
                name.to_owned()
            } else {
                format!("{prefix}{name}")
            }
        };
        let names = ENVELOPE_COLUMNS.map(named);
        let mut column = [0; 5];
        for (place, name) in column.iter_mut().zip(&names) {
            let mut found = header.iter().enumerate().filter(|(_, h)| h == name);
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
                        format!("each of {} once", names.join(", ")),
                    ));
                }
            };
        }
        let columns = |column| columns_at_shares(file, header, header_line, prefix, column);
        let (places, shares) = columns(TRACTION_COLUMN)?;
        let (lost_places, lost_shares) = columns(LOST_COLUMN)?;
        if !lost_shares.is_empty() && lost_shares != shares {
            let place = Place::line(header_line).column(format!("{prefix}{LOST_COLUMN}*"));
            let expected = format!("the shares of {prefix}{TRACTION_COLUMN}*, or none");
            return Err(Error::input(file, place, in_list(&lost_shares), expected));
        }
        let mut rows: Vec<EnvelopeRow> = Vec::new();
        let (mut tractions, mut lost) = (Vec::new(), Vec::new());
        for (line, record) in records {
            let number = |place: usize| -> Result<f64> {
                let field = record.get(place).unwrap_or_default();
                let name = header.get(place).unwrap_or_default();
                let refused = |_| {
                    let place = Place::line(*line).field(name);
                    Error::input(file, place, format!("`{field}`"), "a number")
                };
                field.parse().map_err(refused)
            };
            let mut figures = [0.0; 5];
            for (figure, place) in figures.iter_mut().zip(column) {
                *figure = number(place)?;
            }
            let row = EnvelopeRow::from_array(figures);
            check_row(file, Place::line(*line), &row, rows.last())?;
            rows.push(row);
            let numbers =
                |places: &[usize]| -> Result<Vec<f64>> { places.iter().map(|p| number(*p)).collect() };
            if !shares.is_empty() {
                let figures = numbers(&places)?;
                check_traction(file, Place::line(*line), &shares, &figures)?;
                tractions.push(figures);
            }
            if !lost_shares.is_empty() {
                let figures = numbers(&lost_places)?;
                check_losses(file, Place::line(*line), &shares, &figures)?;
                lost.push(figures);
            }
        }
        check_count(file, rows.len())?;
        let in_bends = if shares.is_empty() {
            None
        } else if lost.is_empty() {
            Some(BendTraction::without_losses(shares, tractions))
        } else {
            Some(BendTraction {
                shares,
                rows: tractions,
                lost,
            })
        };
        Ok(Envelope {
            name: file.to_owned(),
            rows,
            in_bends,
            open: None,
            loads: Vec::new(),
        })
    }
}

/// The columns whose names end with a share of the lateral limit, by rising share: their places, and the shares.
fn columns_at_shares(
    file: &str,
    header: &csv::StringRecord,
    header_line: usize,
    prefix: &str,
    column: &str,
) -> Result<(Vec<usize>, Vec<f64>)> {
    let mut columns = Vec::new();
    for (place, name) in header.iter().enumerate() {
        let Some(share) = name
            .strip_prefix(prefix)
            .and_then(|name| name.strip_prefix(column))
        else {
            continue;
        };
        let share: f64 = share.parse().map_err(|_| {
            let expected = "a share of the lateral limit at its end, 0 to 1";
            Error::input(
                file,
                Place::line(header_line).column(name),
                format!("`{share}`"),
                expected,
            )
        })?;
        columns.push((place, share));
    }
    columns.sort_by(|a, b| a.1.total_cmp(&b.1));
    let (places, shares): (Vec<_>, Vec<_>) = columns.into_iter().unzip();
    if !shares.is_empty() {
        let place = Place::line(header_line).column(format!("{column}*"));
        check_shares(file, place, &shares)?;
    }
    Ok((places, shares))
}
