//! How many steps of trajectories a dispatch takes.

use super::DeviceKind;

/// Steps of all lanes of the first dispatch: tens of milliseconds on a software driver.
const FIRST: usize = 1 << 16;
/// How much longer than the last one a dispatch may be.
const GROWTH: f64 = 4.0;
/// Rounds of all loops of a kernel together, from which on llvmpipe leaves every loop after one round without a word: its own
/// limit, 65535, less what the other loops of a dispatch take.
pub(crate) const LOOP_ROUNDS: usize = 65_000;

/// How work is cut. Results do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepBatching {
    /// The most lanes of one batch.
    pub lanes: usize,
    /// How long a dispatch should take, ms: well under the watchdogs' two seconds, well over its overhead.
    pub dispatch_ms: f64,
    /// The most steps of a dispatch; `None` leaves it to the time.
    pub steps: Option<usize>,
}

impl StepBatching {
    /// What suits a kind of device: a step of all lanes takes milliseconds on a software driver, and fills a large card.
    pub fn for_kind(kind: DeviceKind) -> Self {
        Self {
            lanes: match kind {
                DeviceKind::Software => 1 << 12,
                _ => 1 << 17,
            },
            dispatch_ms: kind.dispatch_ms(),
            steps: None,
        }
    }
}

/// What the last dispatch taught of the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pacing {
    rounds_per_step: usize,
    /// Steps of the last dispatch, its lanes, and how long it took, ms.
    last: Option<(usize, usize, f64)>,
}

impl Pacing {
    /// For a kernel whose loops take so many rounds in a step.
    pub fn new(rounds_per_step: usize) -> Self {
        Self {
            rounds_per_step,
            last: None,
        }
    }

    /// Steps of the next dispatch of `lanes` lanes.
    pub fn steps(&self, lanes: usize, batching: &StepBatching) -> usize {
        let by_time = match self.last {
            // A device that was not full takes no longer for more lanes, so that a rise is taken in full and a fall not at all.
            Some((steps, before, ms)) => {
                let more = (lanes as f64 / before as f64).max(1.0);
                let growth = (batching.dispatch_ms / (ms * more)).min(GROWTH);
                (steps as f64 * growth) as usize
            }
            None => FIRST / lanes,
        };
        by_time
            .min(batching.steps.unwrap_or(usize::MAX))
            .min(LOOP_ROUNDS / self.rounds_per_step)
            .max(1)
    }

    /// Notes how long a dispatch took, ms. The first one of all may have compiled; the next one corrects what it taught.
    pub fn took(&mut self, steps: usize, lanes: usize, ms: f64) {
        self.last = Some((steps, lanes, ms));
    }
}

/// How many lanes a dispatch takes, where each lane does all of its work in one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LanePacing {
    first: usize,
    /// Lanes of the last dispatch, and how long it took, ms.
    last: Option<(usize, f64)>,
}

impl LanePacing {
    /// With so many lanes in the first dispatch.
    pub fn new(first: usize) -> Self {
        Self { first, last: None }
    }

    /// Lanes of the next dispatch, which should take so long.
    pub fn lanes(&self, dispatch_ms: f64) -> usize {
        match self.last {
            // A device that was not full takes no longer for more: it is approached in steps.
            Some((lanes, ms)) => (lanes as f64 * (dispatch_ms / ms).min(GROWTH)) as usize,
            None => self.first,
        }
    }

    /// Notes how long a dispatch took, ms. The first one of all may have compiled; the next one corrects what it taught.
    pub fn took(&mut self, lanes: usize, ms: f64) {
        self.last = Some((lanes, ms));
    }
}
