//! The staircase that sweeps over two further objectives keep: points of which none dominates another.

use std::collections::BTreeMap;

/// Non-dominated points of a plane, in order of the first coordinate.
#[derive(Default)]
pub(in crate::swarm) struct Staircase {
    /// The second coordinate by the first, which is kept as a word of the same order.
    steps: BTreeMap<u64, f64>,
}

/// A word that is ordered as the number is.
fn word(x: f64) -> u64 {
    // Zero has two signs and one place.
    let bits = (x + 0.0).to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

fn number(word: u64) -> f64 {
    f64::from_bits(if word >> 63 == 1 { word & !(1 << 63) } else { !word })
}

impl Staircase {
    /// Whether a point of the staircase is at least as good as `(x, y)` in both coordinates.
    pub fn covers(&self, x: f64, y: f64) -> bool {
        self.steps
            .range(..=word(x))
            .next_back()
            .is_some_and(|(_, &v)| v <= y)
    }

    /// Takes in a point that the staircase does not cover, and drops those that it covers. Returns the area
    /// under the corner `(right, top)` that it adds. Both coordinates are below the corner's.
    pub fn insert(&mut self, (x, y): (f64, f64), (right, top): (f64, f64)) -> f64 {
        let mut ceiling = self
            .steps
            .range(..word(x))
            .next_back()
            .map_or(top, |(_, &v)| v.min(top));
        let mut from = x;
        let mut area = 0.0;
        while let Some((&key, &v)) = self.steps.range(word(x)..).next() {
            let at = number(key).min(right);
            area += (at - from) * (ceiling - y);
            from = at;
            if v < y {
                self.steps.insert(word(x), y);
                return area;
            }
            ceiling = v.min(top);
            self.steps.remove(&key);
        }
        self.steps.insert(word(x), y);
        area + (right - from) * (ceiling - y)
    }
}
