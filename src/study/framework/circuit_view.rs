//! Roads under the traces and lines of a report.

use crate::report::Road;
use crate::track::Circuit;

/// Names, starts and ends (m) of a circuit's stretches.
pub(crate) fn sections(circuit: &Circuit) -> impl Iterator<Item = (String, f64, f64)> {
    circuit
        .sections
        .iter()
        .map(|s| (s.name.clone(), s.start_m, s.end_m))
}

/// A circuit with the names of its stretches.
pub(crate) fn circuit_road(circuit: &Circuit) -> Road {
    let middle = |s: &crate::track::Section| circuit.position_at(0.5 * (s.start_m + s.end_m));
    let names = circuit.sections.iter().map(|s| (s.name.clone(), middle(s)));
    Road {
        left_edge_m: circuit.left_edge(),
        right_edge_m: circuit.right_edge(),
        closed: circuit.closed,
        names: names.collect(),
    }
}
