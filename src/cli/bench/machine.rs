//! What the machine can do at best, and what memory it has given.

use lapswarm::evaluate::simd::{InstructionSet, LaneWork, dispatch};
use lapswarm::scalar::lanes::Lanes;
use std::time::Instant;

/// Chains that run side by side, enough to hide the latency of a product and a sum on any processor of today.
const CHAINS: usize = 12;
/// Links of each chain in one measurement.
const LINKS: usize = 400_000;

struct Chains;

impl LaneWork for Chains {
    type Output = (f32, u64);

    #[inline(always)]
    fn run<L: Lanes>(self) -> (f32, u64) {
        let factor = L::lit(std::hint::black_box(0.999_999));
        let more = L::lit(std::hint::black_box(1e-6));
        let mut chains: [L; CHAINS] = std::array::from_fn(|i| L::lit(i as f64));
        for _ in 0..LINKS {
            for x in &mut chains {
                *x = *x * factor + more;
            }
        }
        let mut sum = L::lit(0.0);
        for x in chains {
            sum = sum + x;
        }
        let mut out = [0.0; 64];
        sum.write(&mut out);
        (out[0], (2 * CHAINS * LINKS * L::LANES) as u64)
    }
}

/// Products and sums per second that one core does in the lanes of `set` without fusing them, as the kernels are
/// written: the best of several measurements of independent chains held in registers.
pub fn peak_operations_per_s(set: InstructionSet) -> f64 {
    (0..5)
        .map(|_| {
            let began = Instant::now();
            let (result, operations) = dispatch(set, Chains);
            std::hint::black_box(result);
            operations as f64 / began.elapsed().as_secs_f64()
        })
        .fold(0.0, f64::max)
}

/// Forgets the greatest memory that the process has had so far, where the system can (Linux).
pub fn forget_peak_memory() {
    // Elsewhere, or where it is not allowed, the peak is simply that of the whole process so far.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// The greatest memory of the process since then (bytes), where the system tells.
pub fn peak_memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}
