//! The interface that circuits, smoothed surveys and generated shapes share, and what is made from it.

use super::circuit::{Circuit, Corner, Section};
use super::from_curvature::{Closure, CurvatureRow, CurvatureTable};
use super::relief::{Relief, ReliefChange, SurfaceAcross};
use crate::{Error, Place, Result};
use glam::DVec2;

/// Distance between the rows of curvature that a circuit is built from (m), before rounding to whole steps.
const ROW_M: f64 = 1.0;

/// The road at one station.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoadFrame {
    /// The reference line (m).
    pub position_m: DVec2,
    /// Its direction, a unit vector.
    pub tangent: DVec2,
    /// Its curvature (1/m), positive in left turns.
    pub curvature_1pm: f64,
    /// Distance to the left edge (m).
    pub left_m: f64,
    /// Distance to the right edge (m).
    pub right_m: f64,
    /// Its surface.
    pub surface: SurfaceAcross,
}

/// A road along a smooth reference line.
pub(super) trait Road {
    /// Name for titles.
    fn name(&self) -> &str;
    /// File or circuit for error messages.
    fn source(&self) -> &str;
    /// Whether the end joins the start.
    fn closed(&self) -> bool;
    /// Length of the reference line (m).
    fn length_m(&self) -> f64;
    /// The road at a station (m), which is wrapped, or held at the ends of an open road.
    fn frame(&self, station_m: f64) -> RoadFrame;
    /// Named stretches.
    fn sections(&self) -> &[Section];
    /// Named corners.
    fn corners(&self) -> &[Corner];
    /// Stretches where the DRS may be open, as a [`Circuit`] has them.
    fn drs_zones_m(&self) -> &[[f64; 2]];
    /// What was changed of height and banking; nothing on a level road, which has none.
    fn relief_change(&self) -> Option<ReliefChange>;
}

impl Road for Circuit {
    fn name(&self) -> &str {
        &self.name
    }

    fn source(&self) -> &str {
        &self.name
    }

    fn closed(&self) -> bool {
        self.closed
    }

    fn length_m(&self) -> f64 {
        self.length_m
    }

    fn frame(&self, station_m: f64) -> RoadFrame {
        let (left_m, right_m) = self.widths_at(station_m);
        RoadFrame {
            position_m: self.position_at(station_m),
            tangent: DVec2::from_angle(self.heading_at(station_m)),
            curvature_1pm: self.curvature_at(station_m),
            left_m,
            right_m,
            surface: self.relief_at(station_m).unwrap_or(SurfaceAcross::LEVEL_AND_DRY),
        }
    }

    fn relief_change(&self) -> Option<ReliefChange> {
        self.relief.as_ref().map(|relief| relief.change)
    }

    fn sections(&self) -> &[Section] {
        &self.sections
    }

    fn corners(&self) -> &[Corner] {
        &self.corners
    }

    fn drs_zones_m(&self) -> &[[f64; 2]] {
        &self.drs_zones_m
    }
}

/// Stations at even steps of about `step_m`, the length itself left out on a closed road.
pub(super) fn even_stations(road: &dyn Road, step_m: f64) -> Vec<f64> {
    let steps = (road.length_m() / step_m).round().max(8.0) as usize;
    let stations = steps + usize::from(!road.closed());
    (0..stations)
        .map(|i| road.length_m() * i as f64 / steps as f64)
        .collect()
}

/// A circuit along the road's reference line, where the road lies.
pub(super) fn circuit(road: &dyn Road) -> Result<(Circuit, Closure)> {
    let stations = even_stations(road, ROW_M);
    let step = road.length_m() / (stations.len() - usize::from(!road.closed())) as f64;
    let turn = |from: DVec2, to: DVec2| from.perp_dot(to).atan2(from.dot(to));
    let rows: Vec<CurvatureRow> = stations
        .iter()
        .map(|&station_m| {
            let frame = road.frame(station_m);
            // The row has the mean curvature about it, not the curvature at it, so that headings do not drift from row to row.
            let (mut from, mut to) = (station_m - 0.5 * step, station_m + 0.5 * step);
            if !road.closed() {
                (from, to) = (from.max(0.0), to.min(road.length_m()));
            }
            let turned = turn(road.frame(from).tangent, road.frame(to).tangent);
            CurvatureRow {
                station_m,
                curvature_1pm: turned / (to - from),
                // A spline through widths of zero may be slightly negative.
                width_left_m: frame.left_m.max(0.0),
                width_right_m: frame.right_m.max(0.0),
                corner: String::new(),
            }
        })
        .collect();
    if let Some(row) = rows.iter().find(|r| !(-1.0..=1.0).contains(&r.curvature_1pm)) {
        return Err(Error::input(
            road.source(),
            Place::station(row.station_m),
            format!("a bend of {:.2} m radius", 1.0 / row.curvature_1pm.abs()),
            "bends of at least 1 m radius",
        ));
    }
    let start = road.frame(0.0);
    let mut start_heading_rad = start.tangent.to_angle();
    if road.closed() {
        // The integral of mean curvatures is the mean of the headings half a step before and after.
        let around = [-0.5 * step, 0.5 * step].map(|s| turn(start.tangent, road.frame(s).tangent));
        start_heading_rad += 0.5 * (around[0] + around[1]);
    }
    let table = CurvatureTable {
        name: road.name().to_owned(),
        closed: road.closed(),
        length_m: road.length_m(),
        start_heading_rad,
        rows,
        sections: road.sections().to_vec(),
        drs_zones_m: road.drs_zones_m().to_vec(),
        relief: None,
    };
    let (mut circuit, closure) = table.build()?;
    for position in &mut circuit.centreline_m {
        *position += start.position_m;
    }
    circuit.corners = road.corners().to_vec();
    circuit.relief = road.relief_change().map(|change| {
        let surfaces = circuit
            .station_m
            .iter()
            .map(|station| road.frame(*station).surface);
        Relief::of(surfaces, change)
    });
    Ok((circuit, closure))
}

/// Fewest and most cross-sections.
const COUNTS: (usize, usize) = (8, 1_000_000);
/// The stations of so many cross-sections at equal steps, ascending from 0; an open road has its last at its end.
pub(super) fn spread(road: &dyn Road, count: usize) -> Result<Vec<f64>> {
    if !(COUNTS.0..=COUNTS.1).contains(&count) {
        return Err(Error::input(
            road.source(),
            "number of cross-sections",
            count.to_string(),
            format!("{} to {}", COUNTS.0, COUNTS.1),
        ));
    }
    let steps = (count - usize::from(!road.closed())) as f64;
    let length = road.length_m();
    Ok((0..count).map(|i| length * i as f64 / steps).collect())
}
