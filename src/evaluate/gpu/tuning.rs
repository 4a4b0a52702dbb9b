//! What may suit one adapter better than another and changes no bit: `lapswarm bench tune` tries it, and the best is remembered in the
//! user's cache folder.

use super::{DeviceKind, DeviceSummary};
use crate::error::{Error, Result};
use crate::files::{cache_folder, stem, write_whole};
use std::path::PathBuf;

/// How kernels of lines and cars are dispatched on an adapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tuning {
    /// Lanes of a workgroup, where the device allows.
    pub workgroup: u32,
    /// The most lanes of a dispatch of replays; half as many laps or steady states on a card, a fourth on a software driver.
    pub lanes: usize,
}

impl Tuning {
    /// What stands to reason: a workgroup that is a multiple of every device's subgroup; lanes that fill a large card, or that a
    /// software driver takes on in reasonable time.
    pub fn usual(kind: DeviceKind) -> Self {
        Self {
            workgroup: 64,
            lanes: match kind {
                DeviceKind::Software => 1 << 14,
                _ => 1 << 18,
            },
        }
    }

    /// What there is to try on a kind of device, the usual first.
    pub fn all(kind: DeviceKind) -> Vec<Self> {
        let usual = Self::usual(kind);
        let mut all = vec![usual];
        for workgroup in [32, 64, 128, 256] {
            all.extend([1, 4].map(|times| Self {
                workgroup,
                lanes: times * usual.lanes,
            }));
        }
        let first = 1 + all[1..].iter().position(|other| *other == usual).unwrap_or(0);
        all.remove(first);
        all
    }

    /// What is remembered of an adapter, or else the usual. A file that says nothing of use is as good as none.
    pub fn of(adapter: &DeviceSummary) -> Self {
        let text = file_of(adapter, "tuning").and_then(|path| std::fs::read_to_string(path).ok());
        text.and_then(|text| Self::read(&text))
            .unwrap_or(Self::usual(adapter.kind))
    }

    fn read(text: &str) -> Option<Self> {
        let value = |key: &str| {
            text.lines()
                .filter_map(|line| line.split_once('='))
                .find(|(name, _)| name.trim() == key)
                .map(|(_, value)| value.trim())
        };
        let found = Self {
            workgroup: value("workgroup")?.parse().ok()?,
            lanes: value("lanes")?.parse().ok()?,
        };
        // Nothing else is tried, and other values may suit no kernel.
        let known = [DeviceKind::Software, DeviceKind::Other].map(Self::all).concat();
        known.contains(&found).then_some(found)
    }

    /// Remembers it for an adapter, as long as its driver stays the same; returns the file.
    ///
    /// # Errors
    /// [`Error::Io`] if the file cannot be written; [`Error::Study`] if the user has no cache folder.
    pub fn remember(self, adapter: &DeviceSummary) -> Result<PathBuf> {
        let path = file_of(adapter, "tuning")
            .ok_or_else(|| Error::Study("there is no folder for caches: HOME is not set".to_owned()))?;
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))?;
        }
        let text = format!(
            "# {adapter}, {} {}\nworkgroup = {}\nlanes = {}\n",
            adapter.driver, adapter.driver_info, self.workgroup, self.lanes
        );
        write_whole(&path, text.as_bytes())?;
        Ok(path)
    }
}

/// The file in the user's cache folder for what is kept of an adapter with its driver, if there is such a folder.
pub(super) fn file_of(adapter: &DeviceSummary, what: &str) -> Option<PathBuf> {
    let whole = format!(
        "{} {} {} {}",
        adapter.name, adapter.backend, adapter.driver, adapter.driver_info
    );
    let name = format!(
        "{what}-{}-{:08x}",
        stem(&adapter.name),
        crc32fast::hash(whole.as_bytes())
    );
    Some(cache_folder()?.join(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_tried_begins_with_the_usual_and_is_read_back() {
        for kind in [DeviceKind::Software, DeviceKind::Discrete] {
            let all = Tuning::all(kind);
            assert_eq!((all.len(), all[0]), (8, Tuning::usual(kind)));
            for tuning in all {
                let Tuning { workgroup, lanes } = tuning;
                let text = format!("# x\nworkgroup = {workgroup}\nlanes = {lanes}\n");
                assert_eq!(Tuning::read(&text), Some(tuning));
                assert_eq!(Tuning::read(&text[..text.len() / 2]), None);
            }
        }
        for damaged in ["", "workgroup = 64", "workgroup = 0\nlanes = 0\n"] {
            assert_eq!(Tuning::read(damaged), None, "{damaged}");
        }
    }
}
