//! What reading a log takes at the most. A process has one peak: one test.
#![cfg(target_os = "linux")]

#[path = "common/ld.rs"]
mod ld;

use lapswarm::telemetry::{ChannelMap, Log, LogOptions};
use motec_i2::{Datatype, Sample};
use std::io::{Seek, Write};
use std::path::Path;

const MIB: u64 = 1 << 20;

/// The most memory that this process has had (bytes).
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("its status");
    let line = status
        .lines()
        .find(|l| l.starts_with("VmHWM:"))
        .expect("its peak");
    let kib = line.split_whitespace().nth(1).and_then(|n| n.parse::<u64>().ok());
    1024 * kib.expect("a number")
}

/// A lap's channels, and one that nothing is made of which fills `size` bytes. All samples are the same.
fn write(path: &Path, size: u64) {
    let names = [
        ("wheel speed fl", "rad/s"),
        ("wheel speed fr", "rad/s"),
        ("wheel speed rl", "rad/s"),
        ("wheel speed rr", "rad/s"),
        ("steer_rad", "rad"),
        ("vx_mps", "m/s"),
        ("ax_mps2", "m/s^2"),
        ("ay_mps2", "m/s^2"),
        ("yaw_rate_radps", "rad/s"),
    ];
    let made = |name: &str, unit: &str| {
        let metadata = ld::channel(name, unit, Datatype::I16, 100);
        (metadata, (0..1000).map(|_| Sample::I16(1)).collect())
    };
    let mut channels: Vec<_> = names.iter().map(|(name, unit)| made(name, unit)).collect();
    channels.push(made("spare", "V"));
    let last = ld::ENTRY + 124 * (channels.len() - 1);
    let mut bytes = ld::file(channels);
    // Its samples stand behind everything else.
    let (data, count) = (bytes.len() as u32, ((size - bytes.len() as u64) / 2) as u32);
    bytes[last + 8..last + 12].copy_from_slice(&data.to_le_bytes());
    bytes[last + 12..last + 16].copy_from_slice(&count.to_le_bytes());
    let mut file = std::fs::File::create(path).expect("a file");
    file.write_all(&bytes).expect("written");
    let block = vec![1; MIB as usize];
    while file.stream_position().expect("a place") < size {
        file.write_all(&block).expect("written");
    }
    file.set_len(size).expect("cut to size");
}

#[test]
fn reading_a_log_takes_its_size_and_what_is_read_of_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("large.ld");
    let size = 96 * MIB;
    write(&path, size);
    let read = |limit: u64| Log::read_within(&path, &ChannelMap::default(), &LogOptions::default(), limit);

    let before = peak();
    let refused = read(64 * MIB).expect_err("96 MiB do not fit into 64").to_string();
    for part in ["large.ld: file size", "96 MiB", "fits into 64 MiB"] {
        assert!(refused.contains(part), "{refused}");
    }
    // What a refusal itself takes is far less than a block of the file.
    assert!(peak() < before + MIB, "{} bytes to refuse it", peak() - before);

    let log = read(128 * MIB).expect("the file and a thousand samples of nine channels");
    assert_eq!(log.samples(), 1000);
    // Ten samples of eight bytes for each of nine channels and a log are a megabyte or so.
    assert!(
        peak() < before + size + 4 * MIB,
        "{} MiB",
        (peak() - before) / MIB
    );
}
