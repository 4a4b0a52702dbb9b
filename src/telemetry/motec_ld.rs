//! MoTeC's binary `.ld`, read through the `motec-i2` crate.
//!
//! That crate trusts the file. It follows a looping channel list for ever, panics on half-precision samples and on offsets, and
//! rejects a whole file for one degree sign in Latin-1. This module therefore walks and checks the channel list first, and
//! corrects what the crate cannot read. Samples are read here, because the crate needs four times the memory that they take in
//! the file.

use std::borrow::Cow;
use std::collections::HashSet;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use motec_i2::{ChannelMetadata, Header, I2Error, LDReader};

use super::recording::{Channel, Clock, Format, MOST_CHANNELS, Metadata, Reading, Recording, Unreadable};
use super::text::{decode, shown};
use crate::config::{LARGEST_TEXT, read_bytes};
use crate::{Error, Place, Result};

/// First four bytes of a `.ld`, little-endian.
const MARKER: u32 = 64;
/// Length of the fixed part of the header, bytes.
const HEADER_SIZE: usize = 1762;
/// Length of one entry of the channel list, bytes.
const ENTRY_SIZE: usize = 124;
/// Text fields of the header: offset and size, bytes.
const HEADER_STRINGS: [(usize, usize); 8] = [
    (74, 8),
    (94, 16),
    (126, 16),
    (158, 64),
    (222, 64),
    (350, 64),
    (1508, 64),
    (1572, 64),
];
/// Text fields of a channel's entry.
const ENTRY_STRINGS: [(usize, usize); 3] = [(32, 32), (64, 8), (72, 12)];

/// How the samples of a channel are stored.
#[derive(Clone, Copy, PartialEq)]
enum Storage {
    I16,
    I32,
    F32,
    /// Half-precision floats. The crate is given them as integers of the same size.
    Half,
    Unknown {
        kind: u16,
        size: u16,
    },
}

/// The samples of a channel in the file; `range` lies in it.
struct Stored {
    storage: Storage,
    range: std::ops::Range<usize>,
    count: usize,
}

/// Whether the bytes start like a `.ld`.
pub(super) fn is_ld(bytes: &[u8]) -> bool {
    u32_at(bytes, 0) == Some(MARKER)
}

/// Reads a `.ld` from memory; `path` is its name in error messages.
pub(super) fn parse(bytes: Cow<'_, [u8]>, path: &Path, reading: &Reading<'_>) -> Result<Recording> {
    if !is_ld(&bytes) || bytes.len() < HEADER_SIZE {
        return Err(Error::input(
            path,
            "header",
            match u32_at(&bytes, 0) {
                Some(MARKER) => format!("{} bytes", bytes.len()),
                Some(marker) => format!("marker {marker}"),
                None => format!("{} bytes", bytes.len()),
            },
            format!("a MoTeC .ld: marker {MARKER} and at least {HEADER_SIZE} bytes"),
        ));
    }
    let size = bytes.len() as u64;
    // Borrowed bytes are copied.
    let copies = if matches!(bytes, Cow::Borrowed(_)) { 2 } else { 1 };
    let mut bytes = bytes.into_owned();
    for (at, size) in HEADER_STRINGS {
        to_utf8(&mut bytes[at..at + size]);
    }
    let stored = check_channels(&mut bytes, path)?;
    // A panic in the crate must not end the program.
    let read = catch_unwind(AssertUnwindSafe(|| read_head(&bytes)))
        .map_err(|_| broken(path, "a layout that the .ld reader cannot follow"))?;
    let (header, metas) = read.map_err(|e| broken(path, &e.to_string()))?;
    if metas.len() != stored.len() {
        return Err(broken(path, "a channel list that changes when read twice"));
    }
    let mut names = HashSet::new();
    let heads = metas
        .iter()
        .zip(&stored)
        .map(|(meta, stored)| head(meta, stored, &mut names));
    let mut recording = Recording {
        source: path.to_owned(),
        format: Format::MotecLd,
        channels: heads.collect(),
        beacons_s: Vec::new(),
        metadata: metadata(header),
    };
    let wanted = (reading.choose)(&recording)?;
    let samples = stored.iter().zip(&wanted).filter(|(_, wanted)| **wanted);
    let samples: u64 = samples.map(|(stored, _)| stored.count as u64).sum();
    reading.fits(
        path,
        size,
        samples.saturating_mul(8).saturating_add(copies * size),
    )?;
    let channels = recording.channels.iter_mut().zip(&metas).zip(&stored);
    for (((channel, meta), stored), _) in channels.zip(wanted).filter(|(_, wanted)| *wanted) {
        fill(channel, meta, stored.storage, &bytes[stored.range.clone()]);
    }
    Ok(recording)
}

/// The header and the list of the channels.
fn read_head(bytes: &[u8]) -> Result<(Header, Vec<ChannelMetadata>), I2Error> {
    let mut cursor = Cursor::new(bytes);
    let mut reader = LDReader::new(&mut cursor);
    Ok((reader.read_header()?, reader.read_channels()?))
}

/// Walks the channel list, checks every address and size, and makes the list one that the crate can read.
fn check_channels(bytes: &mut [u8], path: &Path) -> Result<Vec<Stored>> {
    let mut storage = Vec::new();
    let mut seen = HashSet::new();
    let mut total = 0_u64;
    let mut next = u32_at(bytes, 8).unwrap_or(0);
    while next != 0 {
        let at = next as usize;
        let index = storage.len();
        let place = format!("channel list, entry {index}");
        let length = bytes.len();
        let Some(entry) = at.checked_add(ENTRY_SIZE).and_then(|end| bytes.get_mut(at..end)) else {
            return Err(Error::input(
                path,
                place,
                format!("address {at}"),
                format!("an address inside the file of {length} bytes"),
            ));
        };
        if !seen.insert(next) {
            return Err(Error::input(
                path,
                place,
                format!("address {at} again"),
                "a list without loops",
            ));
        }
        if index >= MOST_CHANNELS {
            return Err(Error::input(
                path,
                place,
                "more channels",
                format!("at most {MOST_CHANNELS}"),
            ));
        }
        for (start, size) in ENTRY_STRINGS {
            to_utf8(&mut entry[start..start + size]);
        }
        let name = decode(entry[32..64].split(|&b| b == 0).next().unwrap_or(&[])).into_owned();
        let (kind, size) = (u16_at(entry, 18), u16_at(entry, 20));
        let kept = match (kind, size) {
            (0 | 3 | 5, 2) => Storage::I16,
            (0 | 3 | 5, 4) => Storage::I32,
            (7, 4) => Storage::F32,
            (7, 2) => Storage::Half,
            _ => Storage::Unknown { kind, size },
        };
        let (data, count) = (u32_at(entry, 8), u32_at(entry, 12));
        next = u32_at(entry, 4).unwrap_or(0);
        match kept {
            Storage::I16 | Storage::I32 | Storage::F32 => {}
            Storage::Half => entry[18..20].copy_from_slice(&3_u16.to_le_bytes()),
            Storage::Unknown { .. } => {
                entry[12..16].fill(0);
                entry[18..20].copy_from_slice(&3_u16.to_le_bytes());
                entry[20..22].copy_from_slice(&2_u16.to_le_bytes());
            }
        }
        let mut found = Stored {
            storage: kept,
            range: 0..0,
            count: 0,
        };
        if let (Some(data), Some(count), false) = (data, count, matches!(kept, Storage::Unknown { .. })) {
            let stored = u64::from(count) * u64::from(size);
            total += stored;
            // The data of all channels together cannot be longer than the file.
            if u64::from(data) + stored > length as u64 || total > length as u64 {
                return Err(Error::input(
                    path,
                    Place::default().channel(shown(&name)),
                    format!("{count} samples of {size} bytes at address {data}"),
                    format!("samples inside the file of {length} bytes (is it cut short?)"),
                ));
            }
            found.range = data as usize..data as usize + stored as usize;
            found.count = count as usize;
        }
        storage.push(found);
    }
    if storage.is_empty() {
        return Err(Error::input(path, "channel list", "no channels", "at least one"));
    }
    Ok(storage)
}

/// A channel without its samples.
fn head(meta: &ChannelMetadata, stored: &Stored, names: &mut HashSet<String>) -> Channel {
    let unreadable = match stored.storage {
        Storage::Unknown { kind, size } => Some(Unreadable {
            sample: 0,
            text: format!("samples of type {kind}, {size} bytes each"),
        }),
        _ => None,
    };
    let base = meta.name.trim();
    let mut name = base.to_owned();
    let mut copy = 2;
    while !names.insert(name.clone()) {
        name = format!("{base} ({copy})");
        copy += 1;
    }
    Channel {
        name,
        unit: meta.unit.trim().to_owned(),
        clock: Clock::Rate {
            start_s: 0.0,
            rate_hz: f64::from(meta.sample_rate),
        },
        values: Vec::new(),
        unreadable,
        lines: None,
    }
}

/// Reads a channel's samples.
fn fill(channel: &mut Channel, meta: &ChannelMetadata, storage: Storage, bytes: &[u8]) {
    // The crate gives these as unsigned; a logger that reverses a sensor writes a negative multiplier.
    let [offset, multiplier, scale] = [meta.offset, meta.mul, meta.scale].map(|raw| f64::from(raw as i16));
    let power = 10_f64.powi(-i32::from(meta.dec_places));
    let unreadable = &mut channel.unreadable;
    let value = |(index, raw): (usize, f64)| {
        let value = (raw / scale * power + offset) * multiplier;
        if value.is_finite() {
            return value;
        }
        unreadable.get_or_insert_with(|| Unreadable {
            sample: index,
            text: value.to_string(),
        });
        f64::NAN
    };
    let words = bytes.as_chunks::<2>().0.iter();
    let doubles = bytes.as_chunks::<4>().0.iter();
    channel.values = match storage {
        Storage::I16 => words
            .map(|b| f64::from(i16::from_le_bytes(*b)))
            .enumerate()
            .map(value)
            .collect(),
        Storage::Half => words
            .map(|b| half(u16::from_le_bytes(*b)))
            .enumerate()
            .map(value)
            .collect(),
        Storage::I32 => doubles
            .map(|b| f64::from(i32::from_le_bytes(*b)))
            .enumerate()
            .map(value)
            .collect(),
        Storage::F32 => doubles
            .map(|b| f64::from(f32::from_le_bytes(*b)))
            .enumerate()
            .map(value)
            .collect(),
        Storage::Unknown { .. } => Vec::new(),
    };
}

fn half(bits: u16) -> f64 {
    let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
    let fraction = f64::from(bits & 0x03ff) / 1024.0;
    sign * match (bits >> 10) & 0x1f {
        0 => fraction * 2_f64.powi(-14),
        0x1f if fraction == 0.0 => f64::INFINITY,
        0x1f => f64::NAN,
        exponent => (1.0 + fraction) * 2_f64.powi(i32::from(exponent) - 15),
    }
}

fn metadata(header: Header) -> Metadata {
    let text = |s: String| Some(s.trim().to_owned()).filter(|s| !s.is_empty());
    Metadata {
        venue: text(header.venue),
        vehicle: text(header.vehicleid),
        driver: text(header.driver),
        device: text(header.device_type),
        session: text(header.session),
        comment: text(header.short_comment),
        log_date: text(header.date_string),
        log_time: text(header.time_string),
        range: None,
    }
}

fn broken(path: &Path, found: &str) -> Error {
    Error::input(path, "the file", found, "a well-formed MoTeC .ld")
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    let word = bytes.get(at..at.checked_add(4)?)?;
    Some(u32::from_le_bytes(word.try_into().ok()?))
}

fn u16_at(entry: &[u8], at: usize) -> u16 {
    u16::from(entry[at]) | u16::from(entry[at + 1]) << 8
}

/// Rewrites a zero-padded Latin-1 field as UTF-8 in place, as far as it fits.
fn to_utf8(field: &mut [u8]) {
    let end = field.iter().position(|&b| b == 0).unwrap_or(field.len());
    if std::str::from_utf8(&field[..end]).is_ok() {
        return;
    }
    let text: String = field[..end].iter().map(|&b| char::from(b)).collect();
    field.fill(0);
    let mut at = 0;
    let mut buffer = [0; 4];
    for c in text.chars() {
        let encoded = c.encode_utf8(&mut buffer).as_bytes();
        let Some(room) = field.get_mut(at..at + encoded.len()) else {
            break;
        };
        room.copy_from_slice(encoded);
        at += encoded.len();
    }
}

/// Beacon times (s) from the `.ldx` that i2 keeps beside a `.ld`; none where there is no such file.
pub(super) fn beacons_beside(path: &Path) -> Result<Vec<f64>> {
    let candidates: [PathBuf; 2] = ["ldx", "LDX"].map(|e| path.with_extension(e));
    for ldx in candidates {
        match read_bytes(&ldx, LARGEST_TEXT) {
            Ok(bytes) => return beacons(&decode(&bytes), &ldx),
            Err(Error::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {}
            Err(e) => return Err(e),
        }
    }
    Ok(Vec::new())
}

/// The times of `<Marker ... ClassName="BCN" ... Time="..."/>`, which are in microseconds.
fn beacons(xml: &str, path: &Path) -> Result<Vec<f64>> {
    let mut found = Vec::new();
    for (line, text) in xml.lines().enumerate() {
        for tag in text.split('<').filter(|t| t.starts_with("Marker ")) {
            if attribute(tag, "ClassName") != Some("BCN") {
                continue;
            }
            let time = attribute(tag, "Time").unwrap_or("");
            match time.trim().parse::<f64>() {
                Ok(micros) if micros.is_finite() => found.push(micros * 1e-6),
                _ => {
                    return Err(Error::input(
                        path,
                        Place::line(line + 1).named("Marker"),
                        shown(time),
                        "a Time in microseconds",
                    ));
                }
            }
        }
    }
    found.sort_by(f64::total_cmp);
    Ok(found)
}

fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    let (_, rest) = tag.split_once(&format!(" {name}=\""))?;
    rest.split_once('"').map(|(value, _)| value)
}

#[cfg(test)]
#[path = "../../tests/common/ld.rs"]
mod sample_file;

#[cfg(test)]
mod tests {
    use super::sample_file::ENTRY;
    use super::*;
    use motec_i2::{Datatype, Sample};
    use proptest::prelude::*;

    fn small() -> Vec<u8> {
        let channel = |name, datatype, rate| sample_file::channel(name, "deg", datatype, rate);
        let tenths = ChannelMetadata {
            dec_places: 1,
            ..channel("Steer", Datatype::I16, 20)
        };
        let integers = vec![Sample::I16(10), Sample::I16(-25), Sample::I16(7)];
        let floats = vec![Sample::F32(0.5), Sample::F32(-0.25)];
        sample_file::file(vec![
            (tenths, integers),
            (channel("Yaw", Datatype::F32, 50), floats),
        ])
    }

    #[test]
    fn channels_keep_their_own_rates() {
        let r = Recording::parse(&small(), "a.ld").unwrap();
        assert_eq!(r.metadata.venue.as_deref(), Some("Test"));
        let expected = [1.0, -2.5, 0.7];
        for (value, expected) in r.channels[0].values.iter().zip(expected) {
            assert!((value - expected).abs() < 1e-12);
        }
        assert_eq!(r.channels[1].values, [0.5, -0.25]);
        assert_eq!(r.channels[1].time_s(1), 0.02);
        assert_eq!(r.channels[0].unit, "deg");
    }

    #[test]
    fn what_the_crate_cannot_take_is_read_all_the_same() {
        let mut bytes = small();
        bytes[ENTRY + 72..ENTRY + 76].copy_from_slice(b"\xB0/s\0");
        bytes[ENTRY + 18] = 7;
        bytes[ENTRY + 24] = 3;
        let data = u32_at(&bytes, ENTRY + 8).unwrap() as usize;
        bytes[data..data + 2].copy_from_slice(&0x3E00_u16.to_le_bytes());
        let r = Recording::parse(&bytes, "a.ld").unwrap();
        assert_eq!(r.channels[0].unit, "°/s");
        assert!((r.channels[0].values[0] - 3.15).abs() < 1e-12);
        bytes[ENTRY + 18] = 99;
        let r = Recording::parse(&bytes, "a.ld").unwrap();
        assert!(r.channels[0].values.is_empty() && r.channels[0].unreadable.is_some());
    }

    #[test]
    fn half_precision() {
        for (bits, value) in [(0x3C00, 1.0), (0xC000, -2.0), (0x0001, 2_f64.powi(-24))] {
            assert_eq!(half(bits), value);
        }
        assert!(half(0x7C00).is_infinite() && half(0x7C01).is_nan());
    }

    #[test]
    fn corrupt_files_are_refused_with_the_place() {
        let patched = |at: usize, value: u32| {
            let mut bytes = small();
            bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
            Recording::parse(&bytes, "a.ld").unwrap_err().to_string()
        };
        for (error, part) in [
            (patched(0, 63), "header: found marker 63"),
            (patched(8, 0), "no channels"),
            (patched(8, u32::MAX), "entry 0: found address 4294967295"),
            (
                patched(ENTRY + 4, ENTRY as u32),
                "entry 1: found address 13384 again",
            ),
            (
                patched(ENTRY + 12, 1 << 30),
                "channel \"Steer\": found 1073741824 samples",
            ),
        ] {
            assert!(error.contains(part), "{error}");
        }
        let error = Recording::parse(&small()[..900], "a.ld").unwrap_err();
        assert!(error.to_string().contains("900 bytes"), "{error}");
    }

    #[test]
    fn beacons_of_an_ldx() {
        let xml = "<MarkerGroup Name=\"Beacons\">\n <Marker Version=\"100\" ClassName=\"BCN\" Name=\"1\" Time=\"2.5e+06\"/>\n\
            <Marker ClassName=\"BCN\" Time=\"1500000\"/><Marker ClassName=\"X\" Time=\"1\"/>";
        assert_eq!(beacons(xml, Path::new("a.ldx")).unwrap(), [1.5, 2.5]);
        let error = beacons("<Marker ClassName=\"BCN\"/>", Path::new("a.ldx")).unwrap_err();
        assert!(error.to_string().contains("a.ldx: line 1, Marker"));
    }

    proptest! {
        #[test]
        fn never_panics_on_mutated_files(
            patches in prop::collection::vec((0..400_usize, any::<u8>()), 1..8),
            cut in 0..14_000_usize,
        ) {
            let mut bytes = small();
            for (at, value) in patches {
                // The channel list and the data behind it are where a wrong byte does harm.
                let at = if at < 64 { at } else { ENTRY + at - 64 };
                if let Some(byte) = bytes.get_mut(at) {
                    *byte = value;
                }
            }
            let _ = Recording::parse(&bytes, "a.ld");
            bytes.truncate(cut);
            let _ = Recording::parse(&bytes, "a.ld");
        }

        #[test]
        fn never_panics_on_arbitrary_bytes(tail in prop::collection::vec(any::<u8>(), 0..3000)) {
            let mut bytes = MARKER.to_le_bytes().to_vec();
            bytes.extend(tail);
            let _ = Recording::parse(&bytes, "a.ld");
        }
    }
}
