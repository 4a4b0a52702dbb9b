//! How long dispatches take: drivers reset a device that is busy for seconds, and a desktop stutters long before.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::Duration;

/// Those that watch at present.
static WATCHES: Mutex<Vec<Weak<AtomicU64>>> = Mutex::new(Vec::new());

/// Watches every dispatch of every evaluator and thread from its creation on. Each study has one. The watch of a study that runs
/// other studies covers theirs too.
#[derive(Clone, Debug)]
pub struct DispatchWatch {
    /// Whole microseconds, so that they fit an atomic.
    longest_us: Arc<AtomicU64>,
}

impl DispatchWatch {
    /// Begins to watch.
    pub fn begin() -> Self {
        let longest_us = Arc::new(AtomicU64::new(0));
        WATCHES
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(Arc::downgrade(&longest_us));
        Self { longest_us }
    }

    /// The longest time that a submission has kept a device since the beginning (ms). It includes compilation by the driver at the
    /// first submission and waiting for other processes. `None` before the first submission.
    pub fn longest_ms(&self) -> Option<f64> {
        match self.longest_us.load(Ordering::Relaxed) {
            0 => None,
            us => Some(us as f64 * 1e-3),
        }
    }
}

/// Notes how long a submission took, from its recording until the device was done.
pub(super) fn note(took: Duration) {
    let us = u64::try_from(took.as_micros()).unwrap_or(u64::MAX).max(1);
    let mut watches = WATCHES.lock().unwrap_or_else(PoisonError::into_inner);
    watches.retain(|watch| {
        let watch = watch.upgrade();
        if let Some(longest_us) = &watch {
            longest_us.fetch_max(us, Ordering::Relaxed);
        }
        watch.is_some()
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times far above any of a test that uses a device at the same time.
    #[test]
    fn a_watch_sees_what_comes_after_its_beginning_and_nothing_before() {
        let hours = |h: u64| Duration::from_secs(3600 * h);
        let whole = DispatchWatch::begin();
        note(hours(2));
        let part = DispatchWatch::begin();
        note(hours(1));
        assert_eq!(whole.longest_ms(), Some(2.0 * 3.6e6));
        assert_eq!(part.longest_ms(), Some(3.6e6));
        let later = DispatchWatch::begin();
        assert!(later.longest_ms().is_none_or(|ms| ms < 3.6e6));
    }
}
