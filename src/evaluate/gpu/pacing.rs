//! How work is cut into dispatches, and how long these take.

use super::DeviceKind;

/// Steps of all lanes of the first dispatch: tens of milliseconds on a software driver.
const FIRST: usize = 1 << 16;
/// How much longer than the last one a dispatch may be.
const GROWTH: f64 = 4.0;
/// The most rounds of all loops of a kernel together on llvmpipe. Beyond its own limit, 65535, it ends every loop after one round
/// without an error; the difference is for other loops of a dispatch.
pub(crate) const LOOP_ROUNDS: usize = 65_000;

/// The most rounds of all loops of a kernel together on a kind of device: no dispatch of a graphics processor comes near its.
pub(crate) fn most_rounds(kind: DeviceKind) -> usize {
    if kind.is_real() { 1 << 24 } else { LOOP_ROUNDS }
}

/// The most rounds that llvmpipe counts for a loop of `count` rounds: one more to detect the end, and another one that was
/// observed in nested loops (a replay's sample of `s` steps takes `3 + 6 s` in all).
pub(crate) const fn rounds_of(count: usize) -> usize {
    count + 2
}

/// How work is cut. Results do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Batching {
    /// The most lanes: of one batch, or of one dispatch where lanes do all of their work in one.
    pub lanes: usize,
    /// The most bytes of any buffer that grows with the lanes.
    pub bytes: u64,
    /// How long a dispatch should take, ms: well under the watchdogs' two seconds, well over its overhead.
    pub dispatch_ms: f64,
    /// The most steps of a dispatch, for kernels that take candidates on step by step; `None` leaves it to the time. Samples
    /// of a replay are rounded up to whole blocks.
    pub steps: Option<usize>,
}

impl Batching {
    /// So many lanes and bytes, dispatches as long as suits a kind of device.
    pub(crate) fn new(kind: DeviceKind, lanes: usize, bytes: u64) -> Self {
        Self {
            lanes,
            bytes,
            dispatch_ms: kind.dispatch_ms(),
            steps: None,
        }
    }
}

/// Chooses the steps of the next dispatch from the time of the last one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pacing {
    /// The most steps of a dispatch.
    most: usize,
    /// Steps of the last dispatch, its lanes, and how long it took, ms.
    last: Option<(usize, usize, f64)>,
}

impl Pacing {
    /// For a kernel whose loops take so many rounds in a step, and may take so many in a dispatch.
    pub fn new(rounds_per_step: usize, most_rounds: usize) -> Self {
        Self {
            most: most_rounds / rounds_per_step,
            last: None,
        }
    }

    /// Steps of the next dispatch of `lanes` lanes.
    pub fn steps(&self, lanes: usize, batching: &Batching) -> usize {
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
            .min(self.most)
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
    /// Lanes of the last dispatch that taught anything, and how long it took, ms.
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
        // Fewer that took no longer teach nothing: a device that was not full does not do as many in the time.
        let teaches = |(before, took): (usize, f64)| {
            lanes >= before || ms > took || lanes as f64 / ms >= before as f64 / took
        };
        if self.last.is_none_or(teaches) {
            self.last = Some((lanes, ms));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TARGET_MS: f64 = 40.0;
    /// Watchdogs and desktops are patient for longer.
    const LONGEST_MS: f64 = 100.0;

    /// A model of a device that takes time and does nothing else: so many lanes at once in so long, up to twice as slow while other
    /// work runs, plus the time of a submission.
    struct ModelDevice {
        at_once: usize,
        lane_step_ms: f64,
        submission_ms: f64,
        draws: u32,
    }

    impl ModelDevice {
        fn next(&mut self, below: u32) -> u32 {
            self.draws = self.draws.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (self.draws >> 16) % below
        }

        /// Half the speed or the whole of it.
        fn took(&mut self, lanes: usize, steps: usize) -> f64 {
            let slower = f64::from(1 + self.next(2));
            let rounds = lanes.div_ceil(self.at_once) as f64;
            self.submission_ms + slower * rounds * steps as f64 * self.lane_step_ms
        }
    }

    /// From a processor that takes 64 lanes in turns to a card that takes all at once.
    fn devices() -> [ModelDevice; 4] {
        [
            (1, 2e-4, 0.2),
            (64, 2e-2, 0.05),
            (1 << 14, 1.5, 1.0),
            (1 << 20, 1e-5, 0.01),
        ]
        .map(|(at_once, lane_step_ms, submission_ms)| ModelDevice {
            at_once,
            lane_step_ms,
            submission_ms,
            draws: 7,
        })
    }

    #[test]
    fn no_dispatch_of_steps_but_the_first_is_long_on_a_device_whose_speed_changes() {
        let batching = Batching {
            lanes: usize::MAX,
            bytes: u64::MAX,
            dispatch_ms: TARGET_MS,
            steps: None,
        };
        for mut device in devices() {
            for rounds_per_step in [1, 5, 37] {
                let mut pacing = Pacing::new(rounds_per_step, LOOP_ROUNDS);
                let (mut lanes, mut total_ms, mut longest_steps) = (4096, 0.0, 0);
                for dispatch in 0..2000 {
                    // Batches of other sizes, and the last steps of one.
                    if device.next(5) == 0 {
                        lanes = 64 << device.next(7);
                    }
                    let most = if device.next(9) == 0 { 3 } else { usize::MAX };
                    let steps = pacing.steps(lanes, &batching).min(most);
                    assert!(steps >= 1 && steps * rounds_per_step <= LOOP_ROUNDS, "{steps}");
                    let ms = device.took(lanes, steps);
                    pacing.took(steps, lanes, ms);
                    if dispatch > 0 {
                        assert!(ms <= LONGEST_MS, "{ms} ms of {steps} steps of {lanes} lanes");
                        total_ms += ms;
                        longest_steps = longest_steps.max(steps);
                    }
                }
                // Nor is it cut to pieces.
                let filled = longest_steps * rounds_per_step > LOOP_ROUNDS - rounds_per_step;
                assert!(
                    filled || total_ms / 2000.0 > TARGET_MS / 4.0,
                    "{total_ms} ms in all"
                );
            }
        }
    }

    #[test]
    fn a_first_dispatch_that_takes_seconds_to_compile_and_one_that_takes_no_time_teach_no_harm() {
        let batching = Batching {
            lanes: usize::MAX,
            bytes: u64::MAX,
            dispatch_ms: TARGET_MS,
            steps: None,
        };
        let mut pacing = Pacing::new(5, LOOP_ROUNDS);
        pacing.took(100, 64, 9000.0);
        assert_eq!(pacing.steps(64, &batching), 1);
        pacing.took(1, 64, 1e-3);
        assert_eq!(pacing.steps(64, &batching), GROWTH as usize);
        // More steps than wanted, or fewer.
        let few = Batching {
            steps: Some(3),
            ..batching
        };
        assert_eq!(pacing.steps(64, &few), 3);
        pacing.took(usize::MAX / 8, 64, 1e-3);
        assert_eq!(pacing.steps(64, &batching), LOOP_ROUNDS / 5);
    }

    #[test]
    fn a_few_lanes_after_many_do_not_cut_the_next_dispatch() {
        let mut pacing = LanePacing::new(64);
        pacing.took(100_000, 2.0);
        pacing.took(400, 0.7);
        assert_eq!(pacing.lanes(TARGET_MS), 400_000);
        // Unless the device has become slower, or the many had to wait for a compiler.
        pacing.took(400, 3.0);
        assert_eq!(pacing.lanes(TARGET_MS), 1_600);
        pacing.took(1_600, 9_000.0);
        pacing.took(64, 0.5);
        assert_eq!(pacing.lanes(TARGET_MS), 256);
    }

    #[test]
    fn no_dispatch_of_lanes_but_the_first_is_long_on_a_device_whose_speed_changes() {
        for mut device in devices() {
            // A workgroup is the least there is: those take no more than a fraction of a dispatch.
            let (group, steps) = (64, if device.at_once == 1 << 14 { 5 } else { 300 });
            let mut pacing = LanePacing::new(group);
            for dispatch in 0..2000 {
                let most = if device.next(9) == 0 { group } else { 1 << 22 };
                let lanes = (pacing.lanes(TARGET_MS) / group).max(1).min(most / group) * group;
                let ms = device.took(lanes, steps);
                pacing.took(lanes, ms);
                if dispatch > 0 {
                    assert!(ms <= LONGEST_MS, "{ms} ms of {lanes} lanes");
                }
            }
        }
    }
}
