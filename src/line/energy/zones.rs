//! Where on a lap the motor is of use: the zones of a deployment, and where the lap begins.

/// Gaps shorter than this do not end a stretch (m).
pub const GAP_M: f64 = 8.0;

/// Stretches of less are none (J).
const LEAST_J: f64 = 5e3;

/// Sections where stretches begin that the motor is of use on, by what it gives in each segment (J) of a lap on which nothing
/// holds it back, and by the segments' lengths (m). Where tyres or corners take all that the engine gives, it adds nothing.
pub fn zone_starts(given_j: &[f64], length_m: &[f64]) -> Vec<usize> {
    let n = given_j.len();
    let mut on: Vec<bool> = given_j.iter().map(|j| *j > 0.0).collect();
    let runs = |on: &[bool]| -> Vec<(usize, usize)> {
        let Some(first) = (0..n).find(|&i| on[i] != on[(i + n - 1) % n]) else {
            return Vec::new();
        };
        let mut runs = Vec::new();
        let mut k = 0;
        while k < n {
            let start = (first + k) % n;
            let count = (0..n - k)
                .take_while(|j| on[(start + j) % n] == on[start])
                .count();
            runs.push((start, count));
            k += count;
        }
        runs
    };
    let sum = |values: &[f64], (start, count): (usize, usize)| {
        (0..count).map(|j| values[(start + j) % n]).sum::<f64>()
    };
    for run in runs(&on) {
        if !on[run.0] && sum(length_m, run) < GAP_M {
            (0..run.1).for_each(|j| on[(run.0 + j) % n] = true);
        }
    }
    let worth_it = |run: &(usize, usize)| on[run.0] && sum(given_j, *run) > LEAST_J;
    let mut starts: Vec<usize> = runs(&on).iter().filter(|r| worth_it(r)).map(|r| r.0).collect();
    starts.sort_unstable();
    if starts.is_empty() { vec![0] } else { starts }
}

/// Bends from this share of the lap on are late.
const LATE: f64 = 0.6;

/// The sharpest bend late in a lap of these curvatures (1/m).
pub fn late_bend(curvature_1pm: &[f64]) -> usize {
    let n = curvature_1pm.len();
    ((LATE * n as f64) as usize..n)
        .max_by(|&i, &j| curvature_1pm[i].abs().total_cmp(&curvature_1pm[j].abs()))
        .unwrap_or(0)
}
