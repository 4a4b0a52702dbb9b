//! Bytes to text to rows of cells, with the line number of each row kept for error messages.

use std::borrow::Cow;
use std::path::Path;

use super::recording::MOST_CHANNELS;
use crate::config::cells;
use crate::{Error, Place, Result};

/// A quoted cell may span lines (a comment in a header); one that spans more lines was never closed.
const MAX_LINES_PER_ROW: usize = 64;

/// Text from bytes that are UTF-8, or else Latin-1, which loggers write for the degree sign. A byte-order mark is
/// dropped.
pub(super) fn decode(bytes: &[u8]) -> Cow<'_, str> {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => {
            let mut text = String::with_capacity(latin_1_size(bytes));
            text.extend(bytes.iter().map(|&b| char::from(b)));
            Cow::Owned(text)
        }
    }
}

/// Bytes of Latin-1 in UTF-8.
fn latin_1_size(bytes: &[u8]) -> usize {
    bytes.len() + bytes.iter().filter(|b| !b.is_ascii()).count()
}

/// Memory of bytes and their text together (bytes).
pub(super) fn decoded_size(bytes: &[u8]) -> u64 {
    let text = match std::str::from_utf8(bytes) {
        Ok(_) => 0,
        Err(_) => latin_1_size(bytes),
    };
    bytes.len() as u64 + text as u64
}

/// A string as an error message may show it: short, and on one line.
pub(super) fn shown(text: &str) -> String {
    const LONGEST: usize = 60;
    let mut out: String = text.chars().take(LONGEST).flat_map(char::escape_debug).collect();
    if text.chars().count() > LONGEST {
        out.push_str("...");
    }
    format!("\"{out}\"")
}

/// One row of a comma-separated file.
pub(super) struct Row<'a> {
    /// The line it starts on, from 1.
    pub line: usize,
    /// Its cells, unquoted and trimmed.
    pub cells: Vec<Cow<'a, str>>,
}

impl Row<'_> {
    /// The cell at `index`, empty where the row is shorter.
    pub fn cell(&self, index: usize) -> &str {
        self.cells.get(index).map_or("", |cell| cell.as_ref())
    }
}

/// The rows of a comma-separated text that are not blank.
pub(super) struct Rows<'a> {
    file: &'a Path,
    rest: &'a str,
    line: usize,
    comments: bool,
}

impl<'a> Rows<'a> {
    /// Rows of `text`; with `comments`, lines that start with `#` are left out.
    pub fn new(text: &'a str, file: &'a Path, comments: bool) -> Self {
        Self {
            file,
            rest: text,
            line: 0,
            comments,
        }
    }

    fn record(&mut self) -> Result<(usize, &'a str)> {
        let first = self.line + 1;
        let mut end = 0;
        let mut open = false;
        loop {
            let tail = &self.rest[end..];
            let length = tail.find('\n').map_or(tail.len(), |at| at + 1);
            open ^= tail[..length].bytes().filter(|&b| b == b'"').count() % 2 == 1;
            end += length;
            self.line += 1;
            if !open {
                break;
            }
            if end == self.rest.len() || self.line - first >= MAX_LINES_PER_ROW {
                return Err(Error::input(
                    self.file,
                    Place::line(first),
                    "a quotation mark that is never closed",
                    "quotation marks in pairs",
                ));
            }
        }
        let (record, rest) = self.rest.split_at(end);
        self.rest = rest;
        Ok((first, record.trim_end_matches(['\r', '\n'])))
    }
}

impl<'a> Iterator for Rows<'a> {
    type Item = Result<Row<'a>>;

    fn next(&mut self) -> Option<Self::Item> {
        while !self.rest.is_empty() {
            if self.comments && self.rest.starts_with('#') {
                let end = self.rest.find('\n').map_or(self.rest.len(), |at| at + 1);
                self.rest = &self.rest[end..];
                self.line += 1;
                continue;
            }
            match self.record() {
                Ok((_, record)) if record.trim().is_empty() => {}
                Ok((line, record)) => {
                    let commas = record.bytes().filter(|&b| b == b',').count();
                    if commas >= MOST_CHANNELS {
                        self.rest = "";
                        return Some(Err(Error::input(
                            self.file,
                            Place::line(line),
                            format!("{commas} commas"),
                            format!("a row of at most {MOST_CHANNELS} cells"),
                        )));
                    }
                    let cells = cells(record);
                    return Some(Ok(Row { line, cells }));
                }
                Err(error) => {
                    self.rest = "";
                    return Some(Err(error));
                }
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows_of(text: &str) -> Vec<(usize, Vec<String>)> {
        Rows::new(text, Path::new("t.csv"), true)
            .map(|row| {
                let row = row.unwrap();
                (row.line, row.cells.iter().map(|c| c.to_string()).collect())
            })
            .collect()
    }

    #[test]
    fn rows_keep_their_line_numbers_past_blanks_comments_and_carriage_returns() {
        let rows = rows_of("# note\r\na,b\r\n\r\n\"1\",\"x, \"\"y\"\"\"\r\n\"two\nlines\",3\n4,5");
        assert_eq!(rows[0], (2, vec!["a".into(), "b".into()]));
        assert_eq!(rows[1], (4, vec!["1".into(), "x, \"y\"".into()]));
        assert_eq!(rows[2], (5, vec!["two\nlines".into(), "3".into()]));
        assert_eq!(rows[3], (7, vec!["4".into(), "5".into()]));
    }

    #[test]
    fn an_unclosed_quote_names_its_line() {
        let error = Rows::new("a\n\"b\nc", Path::new("t.csv"), false)
            .find_map(Result::err)
            .unwrap();
        assert!(error.to_string().contains("t.csv: line 2"), "{error}");
    }

    #[test]
    fn a_row_of_more_cells_than_any_log_has_is_refused() {
        let row = ",".repeat(MOST_CHANNELS);
        let refused = |text: &str| Rows::new(text, Path::new("t.csv"), false).find_map(Result::err);
        let said = refused(&format!("a\n{row}\n")).unwrap().to_string();
        assert!(said.contains("t.csv: line 2: found 65536 commas"), "{said}");
        assert!(refused(&row[1..]).is_none());
    }

    #[test]
    fn latin_1_is_read_where_utf_8_fails() {
        assert_eq!(decode(b"\xB0/s"), "°/s");
        assert_eq!(decode("\u{feff}°".as_bytes()), "°");
    }
}
