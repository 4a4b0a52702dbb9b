//! What commands print. A reader that goes away ends no study, and an output that takes no more is told at the end.

use std::fmt::Arguments;
use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// The first failure of standard output.
static FAILED: Mutex<Option<io::Error>> = Mutex::new(None);

fn note(outcome: io::Result<()>) {
    if let Err(error) = outcome {
        FAILED
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .get_or_insert(error);
    }
}

/// Whether words go to standard error,
static ASIDE: AtomicBool = AtomicBool::new(false);
/// and whether there are none.
static SILENT: AtomicBool = AtomicBool::new(false);

/// From now on words and tables go to standard error: standard output is for the JSON object alone.
pub fn set_words_aside() {
    ASIDE.store(true, Ordering::Relaxed);
}

/// From now on words and tables go nowhere.
pub fn set_silent() {
    SILENT.store(true, Ordering::Relaxed);
}

/// Writes words or a table.
pub fn words(text: Arguments<'_>) {
    if SILENT.load(Ordering::Relaxed) {
        return;
    }
    if ASIDE.load(Ordering::Relaxed) {
        to_stderr(text);
    } else {
        to_stdout(text);
    }
}

/// Writes to standard output.
pub fn to_stdout(text: Arguments<'_>) {
    note(io::stdout().write_fmt(text));
}

/// Writes to standard error, and if that takes no more, to nobody.
pub fn to_stderr(text: Arguments<'_>) {
    let _ = io::stderr().write_fmt(text);
}

/// What became of standard output, once all is printed: a reader that has gone away has had all that it wanted.
///
/// # Errors
/// [`lapswarm::Error::Io`] if it took no more.
pub fn finish() -> lapswarm::Result<()> {
    note(io::stdout().flush());
    let failed = FAILED.lock().unwrap_or_else(PoisonError::into_inner).take();
    match failed {
        Some(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(lapswarm::Error::io("standard output", "write", error))
        }
        _ => Ok(()),
    }
}

/// Columns of a table that is printed as its rows come: head, width (below zero to the left), and the cell of a row.
pub type Columns<R> = [(&'static str, isize, fn(&R) -> String)];

/// A row of a table, or the heads of its columns.
pub fn line_of<R>(columns: &Columns<R>, row: Option<&R>) -> String {
    let cell = |(head, width, cell): &(&'static str, isize, fn(&R) -> String)| {
        let text = row.map_or((*head).to_owned(), cell);
        let wide = width.unsigned_abs();
        if *width < 0 {
            format!("{text:<wide$}")
        } else {
            format!("{text:>wide$}")
        }
    };
    columns.iter().map(cell).collect()
}

/// As `print!`, which panics where nobody reads; see [`words`].
macro_rules! out {
    ($($text:tt)*) => {
        $crate::cli::output::words(format_args!($($text)*))
    };
}

/// As `println!`, which panics where nobody reads; see [`words`].
macro_rules! outln {
    ($($text:tt)*) => {
        $crate::cli::output::words(format_args!("{}\n", format_args!($($text)*)))
    };
}

/// As `eprintln!`, which panics where nobody reads.
macro_rules! errln {
    ($($text:tt)*) => {
        $crate::cli::output::to_stderr(format_args!("{}\n", format_args!($($text)*)))
    };
}

pub(crate) use {errln, out, outln};
