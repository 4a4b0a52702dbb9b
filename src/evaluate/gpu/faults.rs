//! Faults on purpose, so that tests see what a run makes of devices that fail.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// What happens to a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// It goes, as when a driver resets or a card is pulled.
    Lost,
    /// It has no memory left.
    OutOfMemory,
    /// It is asked for what it does not do.
    Validation,
}

struct Drill {
    fault: Fault,
    from: u64,
    count: u64,
    seen: u64,
}

static ARMED: AtomicBool = AtomicBool::new(false);
static DRILL: Mutex<Option<Drill>> = Mutex::new(None);

/// From now on the process's submissions to devices are counted, and those from number `from` on (the first is 0) fail,
/// `count` of them, whatever device they go to. A drill takes the place of the one before.
pub fn inject(fault: Fault, from: u64, count: u64) {
    *DRILL.lock().unwrap_or_else(PoisonError::into_inner) = Some(Drill {
        fault,
        from,
        count,
        seen: 0,
    });
    ARMED.store(true, Ordering::Release);
}

/// Ends the drill; returns the submissions since it began.
pub fn end() -> u64 {
    ARMED.store(false, Ordering::Release);
    let drill = DRILL.lock().unwrap_or_else(PoisonError::into_inner).take();
    drill.map_or(0, |d| d.seen)
}

/// Counts a submission; the fault that it meets, if any.
pub(super) fn next() -> Option<Fault> {
    if !ARMED.load(Ordering::Acquire) {
        return None;
    }
    let mut drill = DRILL.lock().unwrap_or_else(PoisonError::into_inner);
    let drill = drill.as_mut()?;
    let number = drill.seen;
    drill.seen += 1;
    (number >= drill.from && number - drill.from < drill.count).then_some(drill.fault)
}
