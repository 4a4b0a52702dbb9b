//! Reading a log file, whichever its format.

use std::borrow::Cow;
use std::path::Path;

use super::recording::{Format, Reading, Recording};
use super::{csv_headed, csv_native, motec_csv, motec_ld, text, vbox};
use crate::config::{LARGEST_LOG, read_bytes, with_commas};
use crate::{Error, Place, Result};

impl Recording {
    /// Reads a log file; content decides the format, and the extension where content does not.
    ///
    /// # Errors
    /// [`Error::Io`] when the file cannot be read; [`Error::Input`], naming the line or channel, when it holds
    /// something it must not.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        Self::read_some(path.as_ref(), &Reading::whole())
    }

    /// As [`Recording::read`], of the channels that are chosen; the others have no samples.
    pub(super) fn read_some(path: &Path, reading: &Reading<'_>) -> Result<Self> {
        if let Ok(told) = std::fs::metadata(path) {
            // The whole file is in memory while it is read.
            reading.fits(path, told.len(), told.len())?;
        }
        let bytes = read_bytes(path, LARGEST_LOG.min(reading.limit))?;
        let mut recording = Self::parse_some(Cow::Owned(bytes), path, reading)?;
        if recording.format == Format::MotecLd {
            recording.beacons_s = motec_ld::beacons_beside(path)?;
        }
        Ok(recording)
    }

    /// Reads a log from memory; `path` is its name in error messages, and its extension counts where the content
    /// does not decide the format. The `.ldx` file that may lie beside a `.ld` is not looked for.
    ///
    /// # Errors
    /// As for [`Recording::read`].
    pub fn parse(bytes: &[u8], path: impl AsRef<Path>) -> Result<Self> {
        Self::parse_some(Cow::Borrowed(bytes), path.as_ref(), &Reading::whole())
    }

    fn parse_some(bytes: Cow<'_, [u8]>, path: &Path, reading: &Reading<'_>) -> Result<Self> {
        let is_ld = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ld"));
        if is_ld || motec_ld::is_ld(&bytes) {
            return motec_ld::parse(bytes, path, reading);
        }
        let size = bytes.len() as u64;
        // Text that is not UTF-8 is converted, to at most twice its length.
        reading.fits(path, size, text::decoded_size(&bytes))?;
        let text = text::decode(&bytes);
        if vbox::is_vbo(&text, path) {
            return vbox::parse(&text, path, reading);
        }
        let text = with_commas(&text);
        if let Cow::Owned(table) = &text {
            reading.fits(path, size, text::decoded_size(&bytes) + table.len() as u64)?;
        }
        let mut rows = text::Rows::new(&text, path, true);
        let Some(first) = rows.next().transpose()? else {
            return Err(Error::input(path, Place::line(1), "no rows", "a log"));
        };
        if first.cells.iter().any(|c| c == csv_native::TIME) {
            csv_native::parse(&text, path, reading)
        } else if first.cell(0).eq_ignore_ascii_case("Format") {
            motec_csv::parse(&text, path, reading)
        } else {
            csv_headed::parse(&text, path, reading)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_decides_the_format() {
        let native = Recording::parse(b"# x\ntime_s,vx_mps\n0,1\n1,2\n", "a.txt").unwrap();
        assert_eq!(native.format, Format::Native);
        let motec = b"\"Format\",\"MoTeC CSV File\"\n\nTime,V\ns,km/h\n0,1\n1,2\n";
        assert_eq!(Recording::parse(motec, "a.csv").unwrap().format, Format::MotecCsv);
    }

    #[test]
    fn semicolons_and_decimal_commas_are_read() {
        let points = "Time (s),Speed (km/h),\"Yaw rate, filtered (deg/s)\"\n0.5,100.25,-1e-2\n1.5,101,0\n";
        let commas = "Time (s);Speed (km/h);Yaw rate, filtered (deg/s)\r\n0,5;100,25;-1e-2\r\n1,5;101;0\r\n";
        let read = |text: &str| Recording::parse(text.as_bytes(), "a.csv").unwrap();
        assert_eq!(read(commas), read(points));
        let refused = Recording::parse(b"time_s;v\n0,5;1\n0,5,5;2\n", "a.csv").unwrap_err();
        assert!(refused.to_string().contains("line 3"), "{refused}");
    }

    #[test]
    fn what_is_no_log_is_refused_with_what_was_found() {
        for (bytes, found) in [(&b""[..], "no rows"), (b"hello there", "hello there")] {
            let error = Recording::parse(bytes, "a.csv").unwrap_err().to_string();
            assert!(
                error.contains("a.csv: line 1") && error.contains(found),
                "{error}"
            );
        }
        let missing = Recording::read("no/such/file.csv").unwrap_err();
        assert!(matches!(missing, Error::Io { action: "read", .. }));
    }
}
