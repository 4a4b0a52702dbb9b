//! Injected faults, so that tests can see how a run handles devices that fail.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What happens to a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The device is lost, as when a driver resets or a card is removed.
    Lost,
    /// The device and its adapter are lost: until the drill ends, no device opens.
    Gone,
    /// It has no memory left.
    OutOfMemory,
    /// The device rejects an operation.
    Validation,
    /// The device does not finish within the time limit.
    Hung,
}

impl Fault {
    /// Every fault.
    pub const ALL: [Self; 5] = [
        Self::Lost,
        Self::Gone,
        Self::OutOfMemory,
        Self::Validation,
        Self::Hung,
    ];
}

/// What a drill counts, and where its fault strikes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Submissions of work.
    Submission,
    /// Allocations of buffers.
    Allocation,
}

struct Drill {
    fault: Fault,
    place: Place,
    from: u64,
    count: u64,
    seen: u64,
    /// Whether an adapter has gone.
    gone: bool,
}

static ARMED: AtomicBool = AtomicBool::new(false);
static DRILL: Mutex<Option<Drill>> = Mutex::new(None);

fn drill() -> MutexGuard<'static, Option<Drill>> {
    DRILL.lock().unwrap_or_else(PoisonError::into_inner)
}

/// From now on the process's submissions to devices are counted, and those from number `from` on (the first is 0) fail,
/// `count` of them, on any device. A drill replaces the previous one.
pub fn inject(fault: Fault, from: u64, count: u64) {
    inject_at(Place::Submission, fault, from, count);
}

/// As [`inject`], at the places named.
pub fn inject_at(place: Place, fault: Fault, from: u64, count: u64) {
    *drill() = Some(Drill {
        fault,
        place,
        from,
        count,
        seen: 0,
        gone: false,
    });
    ARMED.store(true, Ordering::Release);
}

/// Ends the drill; returns what it counted since it began.
pub fn end() -> u64 {
    ARMED.store(false, Ordering::Release);
    drill().take().map_or(0, |d| d.seen)
}

/// Counts a submission or an allocation; the fault that it meets, if any.
pub(super) fn next(place: Place) -> Option<Fault> {
    if !ARMED.load(Ordering::Acquire) {
        return None;
    }
    let mut drill = drill();
    let drill = drill.as_mut().filter(|d| d.place == place)?;
    let number = drill.seen;
    drill.seen += 1;
    let struck = number >= drill.from && number - drill.from < drill.count;
    drill.gone |= struck && drill.fault == Fault::Gone;
    struck.then_some(drill.fault)
}

/// Whether the adapter has gone.
pub(super) fn adapter_is_gone() -> bool {
    ARMED.load(Ordering::Acquire) && drill().as_ref().is_some_and(|d| d.gone)
}
