//! A circuit under the traces of a report.

use crate::report::{LapMap, ShadedSection};
use crate::track::Circuit;
use glam::DVec2;

/// Its named stretches.
pub(crate) fn sections(circuit: &Circuit) -> Vec<ShadedSection<'_>> {
    let shaded = circuit.sections.iter().map(|s| ShadedSection {
        name: &s.name,
        start: s.start_m,
        end: s.end_m,
    });
    shaded.collect()
}

/// Its left and right edge (m).
pub(crate) fn edges(circuit: &Circuit) -> [Vec<DVec2>; 2] {
    [circuit.left_edge(), circuit.right_edge()]
}

/// Its map over these edges.
pub(crate) fn map<'a>(circuit: &'a Circuit, [left, right]: &'a [Vec<DVec2>; 2]) -> LapMap<'a> {
    let middle = |s: &crate::track::Section| circuit.position_at(0.5 * (s.start_m + s.end_m));
    LapMap {
        left_edge_m: left,
        right_edge_m: right,
        closed: circuit.closed,
        names: circuit
            .sections
            .iter()
            .map(|s| (s.name.as_str(), middle(s)))
            .collect(),
    }
}
