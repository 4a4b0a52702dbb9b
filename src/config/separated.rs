//! Tables in text: cells between commas, semicolons or tabs, numbers with a decimal point or comma.

use super::line_of;
use crate::error::{Error, Place, Result};
use std::borrow::Cow;

/// The rows of a table as wide as its header, each with its line.
pub(crate) struct Rows {
    pub header: (usize, csv::StringRecord),
    pub records: Vec<(usize, csv::StringRecord)>,
}

impl Rows {
    /// Reads a text; lines that begin with `#` are comments. `file` is what errors call it.
    ///
    /// # Errors
    /// [`Error::Input`] naming the line of a row that is no row of the header's width.
    pub fn of(file: &str, text: &str) -> Result<Self> {
        let text = with_commas(text.trim_start_matches('\u{feff}'));
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
            line_of(&text, start) + skipped
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
        let mut records = Vec::new();
        let header = (line_at(header.position()), header);
        for record in reader.records() {
            let record = record.map_err(unreadable)?;
            records.push((line_at(record.position()), record));
        }
        Ok(Self { header, records })
    }
}

/// Rows at the start of a text that say what separates its cells.
const ROWS_ASKED: usize = 64;

/// A table with commas between its cells and points in its numbers, for readers that know no others. Semicolons and tabs between cells
/// become commas, and a number such as `12,5` between them `12.5`. Lines keep their numbers.
pub(crate) fn with_commas(text: &str) -> Cow<'_, str> {
    let separator = separator(text);
    if separator == ',' {
        return Cow::Borrowed(text);
    }
    let mut table = String::with_capacity(text.len() + text.len() / 8);
    // A quoted cell may go on in the next line.
    let mut quoted = false;
    for line in text.split_inclusive('\n') {
        let body = line.trim_end_matches(['\r', '\n']);
        let comment = !quoted && body.starts_with('#');
        // What goes on from the line before stays as it is, and a comment must still begin like one.
        let mut as_it_is = quoted || comment;
        let mut start = 0;
        for (at, c) in body.char_indices() {
            quoted ^= c == '"';
            if c == separator && !quoted {
                push_cell(&mut table, &body[start..at], as_it_is);
                table.push(',');
                (start, as_it_is) = (at + 1, comment);
            }
        }
        push_cell(&mut table, &body[start..], as_it_is || quoted);
        table.push_str(&line[body.len()..]);
        // A mark in a comment is no quotation.
        quoted &= !comment;
    }
    Cow::Owned(table)
}

/// What separates the cells: a semicolon or a tab if most of the first rows have it, and the first of these, or a comment before it, has
/// fewer commas.
fn separator(text: &str) -> char {
    let count = |line: &str, sought: char| {
        let mut quoted = false;
        let outside = |c: &char| {
            quoted ^= *c == '"';
            !quoted && *c == sought
        };
        line.chars().filter(outside).count()
    };
    let separates = |separator: &char| {
        let (mut rows, mut with, mut heads) = (0, 0, false);
        for line in text.lines().filter(|line| !line.trim().is_empty()) {
            let found = count(line, *separator);
            heads |= with == 0 && found > count(line, ',');
            if line.starts_with('#') {
                continue;
            }
            rows += 1;
            with += usize::from(found > 0);
            if rows == ROWS_ASKED {
                break;
            }
        }
        heads && 2 * with > rows
    };
    [';', '\t'].into_iter().find(separates).unwrap_or(',')
}

/// Writes a cell, `as_it_is` or with a decimal point.
fn push_cell(table: &mut String, cell: &str, as_it_is: bool) {
    let bare = cell.trim();
    if as_it_is || bare.starts_with('"') && bare.len() > 1 || !cell.contains(',') {
        table.push_str(cell);
    } else if is_number(bare) {
        table.push_str(&bare.replace(',', "."));
    } else {
        table.push('"');
        table.push_str(&bare.replace('"', "\"\""));
        table.push('"');
    }
}

/// Whether a cell is a number with a decimal comma.
fn is_number(cell: &str) -> bool {
    let digits = cell.trim_start_matches(['+', '-']);
    digits.starts_with(|c: char| c.is_ascii_digit() || c == ',')
        && digits.matches(',').count() == 1
        && !digits.contains('.')
        && digits.replace(',', ".").parse::<f64>().is_ok()
}

/// The cells of a line between commas, without the quotation marks and spaces round them.
pub(crate) fn cells(line: &str) -> Vec<Cow<'_, str>> {
    let mut cells = Vec::new();
    let mut start = 0;
    let mut quoted = false;
    for (at, byte) in line.bytes().enumerate() {
        match byte {
            b'"' => quoted = !quoted,
            b',' if !quoted => {
                cells.push(unquoted(&line[start..at]));
                start = at + 1;
            }
            _ => {}
        }
    }
    cells.push(unquoted(&line[start..]));
    cells
}

fn unquoted(cell: &str) -> Cow<'_, str> {
    let cell = cell.trim();
    match cell.strip_prefix('"').and_then(|c| c.strip_suffix('"')) {
        Some(inner) if inner.contains("\"\"") => Cow::Owned(inner.replace("\"\"", "\"").trim().to_owned()),
        Some(inner) => Cow::Borrowed(inner.trim()),
        None => Cow::Borrowed(cell),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn semicolons_tabs_and_decimal_commas_become_commas_and_points() {
        for (text, expected) in [
            ("a;b\r\n1,5;-2,25\r\n3;4e-1\n", "a,b\r\n1.5,-2.25\r\n3,4e-1\n"),
            ("a\tb\n1,5E-3\t,5\n", "a,b\n1.5E-3,.5\n"),
            // A title, a comment with a mark, words and dates with commas, and a quoted cell over two lines.
            (
                "Monza, wet\n# 13\" rims, dry\nt;x\n1,5;one, two\n2,0;\"a;\nb\"\n3;1,234,5\n",
                "\"Monza, wet\"\n# 13\" rims, dry\nt,x\n1.5,\"one, two\"\n2.0,\"a;\nb\"\n3,\"1,234,5\"\n",
            ),
            ("a; b\n1.5; 2\n", "a, b\n1.5, 2\n"),
            // More comments than rows, one of them the header.
            (
                "# by x; of y, z\n# wet, cold\n# a; b\n0,5; 1,5\n",
                "# by x, of y, z\n# wet, cold\n# a, b\n0.5,1.5\n",
            ),
        ] {
            assert_eq!(with_commas(text), expected);
        }
    }

    #[test]
    fn a_table_with_commas_stays_as_it_is() {
        for text in [
            "a,b\n1,2\n",
            "\"Comment\",\"one; two\"\n\"x\",\"y\"\n1,2\n",
            "a, b; c\n1,2\n3,4\n",
            "a,\tb,\tc\n1,\t2,\t3\n",
            "a\n1\n",
            "",
        ] {
            assert!(matches!(with_commas(text), Cow::Borrowed(_)), "{text}");
        }
    }

    #[test]
    fn cells_lose_their_quotation_marks() {
        assert_eq!(cells(" a, \"b, \"\"c\"\"\" ,\"d\""), ["a", "b, \"c\"", "d"]);
    }
}
