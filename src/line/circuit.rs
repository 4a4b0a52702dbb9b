//! A line as a circuit of its own, to be driven along.

use super::{FineLine, RoadEdges};
use crate::error::{Error, Place, Result};
use crate::track::{Circuit, FrictionAcross, Relief, ReliefChange, SurfaceAcross};
use glam::DVec2;
use rayon::prelude::*;

/// How far beyond an edge the side of a car on a line may be that is to be driven (m).
const FURTHEST_M: f64 = 0.5;

impl FineLine {
    /// Where the lap has the DRS open: start and end (m) of each stretch.
    fn open_m(&self) -> Vec<[f64; 2]> {
        let open = self
            .lap
            .iter()
            .flat_map(|lap| &lap.drs_open)
            .enumerate()
            .filter(|(_, open)| **open);
        let mut stretches: Vec<[f64; 2]> = Vec::new();
        for (i, _) in open {
            let (start, end) = (self.station_m[i], self.station_m[i] + self.segment_m[i]);
            match stretches.last_mut() {
                Some(last) if last[1] == start => last[1] = end,
                _ => stretches.push([start, end]),
            }
        }
        stretches
    }

    /// A circuit whose centreline is this line between edges (m, right and left). Widths are from the line to the edges less
    /// half the car (m); `name` is what errors call the line.
    ///
    /// # Errors
    /// [`Error::Input`] if the line is open or leaves no room for the car.
    pub fn circuit(&self, name: &str, edges_m: &[Vec<DVec2>; 2], car_width_m: f64) -> Result<Circuit> {
        if !self.closed {
            return Err(Error::input(
                name,
                "line",
                "an open one",
                "a closed line: the lap driven is a flying one",
            ));
        }
        let n = self.points_m.len();
        let count = self.length_m.round().max(16.0) as usize;
        let spacing = self.length_m / count as f64;
        let mut heading = Vec::with_capacity(n + 1);
        for i in 0..n {
            let along = self.points_m[(i + 1) % n] - self.points_m[(i + n - 1) % n];
            let angle = along.y.atan2(along.x);
            let before = heading.last().copied().unwrap_or(angle);
            heading.push(
                before + (angle - before + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU)
                    - std::f64::consts::PI,
            );
        }
        let mut circuit = Circuit {
            name: name.to_owned(),
            closed: true,
            length_m: self.length_m,
            station_m: (0..count).map(|i| i as f64 * spacing).collect(),
            centreline_m: Vec::with_capacity(count),
            heading_rad: Vec::with_capacity(count),
            curvature_1pm: Vec::with_capacity(count),
            width_left_m: Vec::new(),
            width_right_m: Vec::new(),
            sections: Vec::new(),
            corners: Vec::new(),
            drs_zones_m: self.open_m(),
            relief: None,
        };
        let mut at = 0;
        let mut surfaces = Vec::new();
        for station in &circuit.station_m {
            while at + 1 < n && self.station_m[at + 1] <= *station {
                at += 1;
            }
            let next = (at + 1) % n;
            let share = ((station - self.station_m[at]) / self.segment_m[at]).clamp(0.0, 1.0);
            let mix = |a: f64, b: f64| a + share * (b - a);
            let turned = (heading[next] - heading[at] + std::f64::consts::PI)
                .rem_euclid(std::f64::consts::TAU)
                - std::f64::consts::PI;
            circuit
                .centreline_m
                .push(self.points_m[at].lerp(self.points_m[next], share));
            circuit.heading_rad.push(heading[at] + share * turned);
            circuit
                .curvature_1pm
                .push(mix(self.curvature_1pm[at], self.curvature_1pm[next]));
            if let Some(relief) = &self.relief {
                let (here, there) = (relief.surface[at], relief.surface[next]);
                surfaces.push([0, 1, 2, 3].map(|k| mix(here[k], there[k])));
            }
        }
        let edges = RoadEdges::new(&edges_m[0], &edges_m[1], true);
        let abreast = edges.abreast(&circuit.centreline_m);
        let room = |left: bool| -> Vec<f64> {
            let places = circuit.centreline_m.par_iter().zip(&abreast);
            places
                .map(|(p, abreast)| edges.inside(*p, *abreast, left) - 0.5 * car_width_m)
                .collect()
        };
        let (right, left) = (room(false), room(true));
        let least = right.iter().chain(&left).fold(f64::INFINITY, |a, b| a.min(*b));
        // Lines from elsewhere may pass an edge slightly. The drive says where the car does.
        if least < -FURTHEST_M {
            let at = right.iter().zip(&left).position(|(r, l)| r.min(*l) == least);
            let place = Place::station(at.map_or(0.0, |i| circuit.station_m[i]));
            let found = format!("a line that leaves the car's side {:.2} m beyond an edge", -least);
            let expected = "a line within the edges of this circuit";
            return Err(Error::input(name, place.named("line"), found, expected));
        }
        if self.relief.is_some() {
            let across = surfaces.into_iter().zip(left.iter().zip(&right));
            let across = across.map(
                |([z_m, bank_rad, friction, per_m], (left, right))| SurfaceAcross {
                    z_m,
                    bank_rad,
                    friction: FrictionAcross::linear([friction, per_m], [*left, *right]),
                },
            );
            circuit.relief = Some(Relief::of(across, ReliefChange::default()));
        }
        (circuit.width_right_m, circuit.width_left_m) = (right, left);
        Ok(circuit)
    }
}
