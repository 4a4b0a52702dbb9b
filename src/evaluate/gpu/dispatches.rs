//! How long the dispatches of this process have taken: drivers reset a device that is busy for seconds, and a desktop
//! stutters long before.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Whole microseconds, so that it fits an atomic.
static LONGEST_US: AtomicU64 = AtomicU64::new(0);

/// Notes how long a submission took, from its recording until the device was done.
pub(super) fn note(took: Duration) {
    let us = u64::try_from(took.as_micros()).unwrap_or(u64::MAX);
    LONGEST_US.fetch_max(us, Ordering::Relaxed);
}

/// The longest that a submission of this process has kept a device (ms), what the driver compiled at the first one and the
/// wait for other processes included; nothing before the first.
pub fn longest_dispatch_ms() -> Option<f64> {
    match LONGEST_US.load(Ordering::Relaxed) {
        0 => None,
        us => Some(us as f64 * 1e-3),
    }
}
