//! Bisection.

/// The place in a range up to which `holds` is true and beyond which it is false, enclosed between two numbers: no more than `within`
/// apart, or neighbours where numbers lie farther apart than that.
pub fn bisected(range: [f64; 2], within: f64, mut holds: impl FnMut(f64) -> bool) -> [f64; 2] {
    let sure = |at: f64| Ok::<_, std::convert::Infallible>(holds(at));
    match try_bisected(range, within, sure) {
        Ok(found) => found,
    }
}

/// As [`bisected`], where finding out may fail.
///
/// # Errors
/// Those of `holds`.
pub fn try_bisected<E>(
    [mut low, mut high]: [f64; 2],
    within: f64,
    mut holds: impl FnMut(f64) -> Result<bool, E>,
) -> Result<[f64; 2], E> {
    while high - low > within {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        *(if holds(middle)? { &mut low } else { &mut high }) = middle;
    }
    Ok([low, high])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_root_is_enclosed_to_the_last_bit() {
        let [low, high] = bisected([0.0, 2.0], 0.0, |x| x * x < 2.0);
        assert!(low * low < 2.0 && high * high >= 2.0);
        assert_eq!(low.next_up(), high);
        let [low, high] = bisected([0.0, 2.0], 1e-3, |x| x * x < 2.0);
        assert!((5e-4..=1e-3).contains(&(high - low)) && low < 2f64.sqrt() && high >= 2f64.sqrt());
        assert_eq!(try_bisected([0.0, 1.0], 0.1, |_| Err(7)), Err(7));
    }
}
