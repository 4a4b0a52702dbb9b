//! Makes the cross-sections of a road, turns those that cross one another and refuses a road that overlaps itself.
//!
//! Cross-sections stand along the normals of the reference line. Where a bend is tight and the road wide on its inside,
//! neighbouring normals cross before they reach the edge. Such cross-sections are turned, all of a neighbourhood at once, until
//! they no longer cross: the turning is spread over a longer stretch by diffusion, and each turned cross-section ends where it
//! meets the edge.
//!
//! The normals of a survey waver by some degrees where its points are off by some centimetres. Heights along them waver as well: 5 m from
//! the reference line on a slope of 5 %, 3 degrees are 13 mm, and such waves of 5 m take all load off a car at 37 m/s. So on a road with
//! height, cross-sections are turned to directions that change smoothly.

use super::circuit::Circuit;
use super::circuit::in_a_zone;
use super::cross_sections::CrossSections;
use super::crossing::{Stretch, crossings, stretches};
use super::relief::SectionRelief;
use super::road::{Road, RoadFrame, even_stations, spread};
use crate::scalar::bisected;
use crate::{Error, Place, Result};
use glam::{DMat3, DVec2, DVec3};

/// Greatest turn of a cross-section from the normal (rad).
const FURTHEST_TURN_RAD: f64 = 0.6;
/// Most rounds of turning; then the bend is refused.
const ROUNDS: usize = 300;
/// Step of the reference line against which the ends of turned cross-sections are found (m).
const FINE_M: f64 = 0.5;
/// Half of the stretch over which directions are made smooth on a road with height (m), and how many cross-sections it must have.
const SMOOTHED_M: f64 = 25.0;
const SMOOTHED: usize = 7;
/// Turn from the normal up to which a reference line is smooth as it is (rad).
const SMOOTH_RAD: f64 = 0.01;
/// Least gap between the ends of turned neighbours, as a share of the step between the cross-sections.
const LEAST_STEP: f64 = 0.02;

impl Circuit {
    /// Cross-sections across the circuit at `count` equally spaced stations, along the normals of the centreline; normals that
    /// cross are turned until they do not.
    ///
    /// # Errors
    /// [`Error::Input`] naming the station where the road overlaps itself or is wider than a bend allows.
    pub fn cross_sections(&self, count: usize) -> Result<CrossSections> {
        cross_sections(self, count)
    }
}

/// Cross-sections across a road, as [`Circuit::cross_sections_spaced`].
pub(super) fn cross_sections(road: &dyn Road, count: usize) -> Result<CrossSections> {
    let mut cutter = Cutter::new(road, spread(road, count)?)?;
    if cutter.has_height() {
        cutter.even_out();
    }
    cutter.mend()?;
    cutter.check_edges()?;
    let share = |(frame, &[right, left]): (&RoadFrame, &Stretch)| {
        let across: DVec2 = left - right;
        (frame.position_m - right).dot(across) / across.length_squared()
    };
    let reference = cutter.frames.iter().zip(&cutter.ends).map(share).collect();
    let zones = road.drs_zones_m();
    let end_m = road.length_m();
    let after = cutter.stations.iter().skip(1).chain([&end_m]);
    let middles = cutter
        .stations
        .iter()
        .zip(after)
        .map(|(from, to)| 0.5 * (from + to));
    let drs = middles
        .filter(|_| !zones.is_empty())
        .map(|middle| in_a_zone(zones, middle))
        .collect();
    let (right_m, left_m) = cutter.ends.iter().map(|&[right, left]| (right, left)).unzip();
    let frames = &cutter.frames;
    let relief = road.relief_change().map(|_| SectionRelief {
        foot_m: frames.iter().map(|frame| frame.position_m).collect(),
        z_m: frames.iter().map(|frame| frame.surface.z_m).collect(),
        bank_rad: frames.iter().map(|frame| frame.surface.bank_rad).collect(),
        friction: frames.iter().map(|frame| frame.surface.friction).collect(),
    });
    Ok(CrossSections {
        reference,
        name: road.name().to_owned(),
        closed: road.closed(),
        length_m: road.length_m(),
        station_m: cutter.stations,
        right_m,
        left_m,
        sections: road.sections().to_vec(),
        corners: road.corners().to_vec(),
        drs,
        relief,
    })
}

/// One sample of the reference line on the way along a turned cross-section.
struct Sample {
    position_m: DVec2,
    left_m: f64,
    right_m: f64,
}

struct Cutter<'a> {
    road: &'a dyn Road,
    stations: Vec<f64>,
    frames: Vec<RoadFrame>,
    /// Turn of each cross-section from the normal (rad), anticlockwise.
    turned: Vec<f64>,
    /// Right and left end of each cross-section (m).
    ends: Vec<Stretch>,
    /// Greatest distance between the stations of two cross-sections that turning can separate (m).
    near_m: f64,
    /// Pairs of stations where the reference line crosses itself, as on a bridge (m).
    bridges: Vec<(f64, f64)>,
    /// The reference line at fine steps; computed when the first cross-section is turned.
    fine: Vec<Sample>,
}

impl<'a> Cutter<'a> {
    fn new(road: &'a dyn Road, stations: Vec<f64>) -> Result<Self> {
        let frames: Vec<RoadFrame> = stations.iter().map(|&s| road.frame(s)).collect();
        let mut widest = 0.0f64;
        for (frame, station) in frames.iter().zip(&stations) {
            let width = frame.left_m + frame.right_m;
            if width.is_nan() || width <= 0.0 {
                return Err(Error::input(
                    road.source(),
                    Place::station(*station).named("width"),
                    format!("{width:.2} m"),
                    "a road wider than zero",
                ));
            }
            widest = widest.max(width);
        }
        let ends = frames.iter().map(along_normal).collect();
        let even = even_stations(road, 5.0);
        let line: Vec<DVec2> = even.iter().map(|&s| road.frame(s).position_m).collect();
        let Ok(bridges) = crossings(&stretches(&line, road.closed()), 1000) else {
            return Err(tangled(road));
        };
        let bridges = bridges.iter().map(|&(i, j)| (even[i], even[j])).collect();
        Ok(Self {
            road,
            turned: vec![0.0; stations.len()],
            stations,
            frames,
            ends,
            near_m: 3.0 * widest,
            bridges,
            fine: Vec::new(),
        })
    }

    /// Distance along the road between two stations (m).
    fn apart(&self, a: f64, b: f64) -> f64 {
        let along = (a - b).abs();
        if self.road.closed() {
            along.min(self.road.length_m() - along)
        } else {
            along
        }
    }

    /// Whether two stretches of road that meet do so at a bridge.
    fn bridged(&self, a: f64, b: f64) -> bool {
        let near = |x: f64, y: f64| self.apart(x, y) < self.near_m;
        self.bridges
            .iter()
            .any(|&(p, q)| (near(a, p) && near(b, q)) || (near(a, q) && near(b, p)))
    }

    fn overlap(&self, i: usize, j: usize) -> Error {
        let [a, b] = [i, j].map(|i| self.stations[i.min(self.stations.len() - 1)]);
        Error::input(
            self.road.source(),
            Place::station(a),
            format!("edges that cross those at station {b:.1} m: the road overlaps itself"),
            "widths that leave room between the two stretches",
        )
    }

    /// Cross-sections that cross, or whose ends run backwards, as pairs of indices near each other along the road.
    fn crossed(&self) -> Result<Vec<(usize, usize)>> {
        let n = self.ends.len();
        let all = crossings(&self.ends, 8 * n).map_err(|_| tangled(self.road))?;
        let mut near = Vec::new();
        for (i, j) in all {
            let (a, b) = (self.stations[i], self.stations[j]);
            if self.apart(a, b) <= self.near_m {
                near.push((i, j));
            } else if !self.bridged(a, b) {
                return Err(self.overlap(i, j));
            }
        }
        let pairs = n - usize::from(!self.road.closed());
        for i in 0..pairs {
            let j = (i + 1) % n;
            let (here, there) = (&self.frames[i], &self.frames[j]);
            let step = there.position_m - here.position_m;
            let forwards =
                |end: usize| (self.ends[j][end] - self.ends[i][end]).dot(here.tangent + there.tangent);
            let least = LEAST_STEP * step.dot(here.tangent + there.tangent).abs();
            if forwards(0) < least || forwards(1) < least {
                near.push((i, j));
            }
        }
        Ok(near)
    }

    /// Whether the reference line rises or falls anywhere.
    fn has_height(&self) -> bool {
        let heights = self.frames.iter().map(|frame| frame.surface.z_m);
        heights.clone().fold(f64::NEG_INFINITY, f64::max) > heights.fold(f64::INFINITY, f64::min)
    }

    /// Turns all cross-sections to smooth directions, if those of the reference line are not smooth.
    fn even_out(&mut self) {
        let turns = self.turns_to_smooth();
        if turns.iter().all(|turn| turn.abs() <= SMOOTH_RAD) {
            return;
        }
        for (i, turn) in turns.into_iter().enumerate() {
            self.turned[i] = turn.clamp(-FURTHEST_TURN_RAD, FURTHEST_TURN_RAD);
            match self.slanted(i) {
                Some(ends) => self.ends[i] = ends,
                None => self.turned[i] = 0.0,
            }
        }
    }

    /// The turn of each cross-section (rad) to the parabola that fits the directions of those about it best.
    fn turns_to_smooth(&self) -> Vec<f64> {
        let n = self.frames.len() as isize;
        let closed = self.road.closed();
        let at = |i: isize| i.rem_euclid(n) as usize;
        let turn = |i: isize| {
            let here = self.frames[at(i)].tangent;
            let (mut products, mut sums, mut count) = (DMat3::ZERO, DVec3::ZERO, 0);
            for way in [-1, 1] {
                // The last direction that was added, and what it differs from that of the cross-section.
                let (mut last, mut heading) = (here, 0.0);
                for k in 0..n / 2 {
                    let j = i + way * k;
                    if !closed && !(0..n).contains(&j) {
                        break;
                    }
                    let away = self.apart(self.stations[at(i)], self.stations[at(j)]) / SMOOTHED_M;
                    if away >= 1.0 {
                        break;
                    }
                    let tangent = self.frames[at(j)].tangent;
                    heading += last.angle_to(tangent);
                    last = tangent;
                    // The cross-section itself counts once.
                    if way == 1 && k == 0 {
                        continue;
                    }
                    let place = way as f64 * away;
                    let powers = DVec3::new(1.0, place, place * place);
                    let weight = (1.0 - away * away).powi(2);
                    products += DMat3::from_cols(powers, place * powers, place * place * powers) * weight;
                    sums += weight * heading * powers;
                    count += 1;
                }
            }
            if count < SMOOTHED {
                return 0.0;
            }
            let fitted = (products.inverse() * sums).x;
            if fitted.is_finite() { fitted } else { 0.0 }
        };
        (0..n).map(turn).collect()
    }

    fn mend(&mut self) -> Result<()> {
        let n = self.ends.len();
        for round in 0..=ROUNDS {
            let crossed = self.crossed()?;
            let Some(&(worst, _)) = crossed.first() else {
                return Ok(());
            };
            let spread = 1 + round / 3;
            let mut zone = vec![false; n];
            for &(i, j) in &crossed {
                // The shorter way along the road between the two, of which the last and the first are neighbours.
                let (i, j) = (i.min(j), i.max(j));
                let (from, to) = if j - i <= n / 2 { (i, j) } else { (j, i + n) };
                for k in from as isize - spread as isize..=(to + spread) as isize {
                    if self.road.closed() {
                        zone[k.rem_euclid(n as isize) as usize] = true;
                    } else if (1..n as isize - 1).contains(&k) {
                        zone[k as usize] = true;
                    }
                }
            }
            let direction = |i: usize| self.frames[i].tangent.rotate(DVec2::from_angle(self.turned[i]));
            let mut next = self.turned.clone();
            for i in (0..n).filter(|&i| zone[i]) {
                let mean = direction((i + n - 1) % n) + direction((i + 1) % n) + 2.0 * direction(i);
                next[i] = self.frames[i].tangent.angle_to(mean);
                let turnable = next[i].abs() <= FURTHEST_TURN_RAD && round < ROUNDS;
                if !turnable {
                    return Err(self.too_tight(worst));
                }
            }
            self.turned = next;
            for i in (0..n).filter(|&i| zone[i]) {
                self.ends[i] = self.slanted(i).ok_or_else(|| self.too_tight(i))?;
            }
        }
        Ok(())
    }

    fn too_tight(&self, section: usize) -> Error {
        let frame = &self.frames[section];
        let inside = if frame.curvature_1pm > 0.0 {
            frame.left_m
        } else {
            frame.right_m
        };
        Error::input(
            self.road.source(),
            Place::station(self.stations[section]),
            format!(
                "cross-sections that cross: {inside:.1} m of road inside a bend of {:.1} m radius",
                1.0 / frame.curvature_1pm.abs().max(1e-9)
            ),
            "less road inside the bend than its radius, or fewer cross-sections",
        )
    }

    /// The ends of a turned cross-section, where it meets the edges.
    fn slanted(&mut self, section: usize) -> Option<Stretch> {
        if self.fine.is_empty() {
            let samples = even_stations(self.road, FINE_M).into_iter();
            self.fine = samples
                .map(|s| {
                    let frame = self.road.frame(s);
                    Sample {
                        position_m: frame.position_m,
                        left_m: frame.left_m,
                        right_m: frame.right_m,
                    }
                })
                .collect();
        }
        let frame = &self.frames[section];
        let left = frame
            .tangent
            .rotate(DVec2::from_angle(self.turned[section]))
            .perp();
        let reach = |way: f64, width: f64| {
            // Distance of a point on the cross-section from the edge beside it.
            let short = |along: f64| {
                let (away, sample) =
                    self.nearest(frame.position_m + way * along * left, self.stations[section]);
                let width = if way > 0.0 { sample.left_m } else { sample.right_m };
                width - away
            };
            let step = (width / 16.0).max(0.05);
            let (mut low, mut high) = (0.0, step);
            while short(high) > 0.0 {
                (low, high) = (high, high + step);
                if high > 3.0 * width + 1.0 {
                    return None;
                }
            }
            let [low, _] = bisected([low, high], 1e-12 * step, |along| short(along) > 0.0);
            Some(frame.position_m + way * low * left)
        };
        Some([reach(-1.0, frame.right_m)?, reach(1.0, frame.left_m)?])
    }

    /// Distance (m) of a point from the reference line near a station, and the sample nearest to it.
    fn nearest(&self, point: DVec2, station: f64) -> (f64, &Sample) {
        let n = self.fine.len() as isize;
        let step = self.road.length_m() / n as f64;
        let middle = (station / step).round() as isize;
        let reach = ((self.near_m / step).ceil() as isize).min(n / 2);
        let index = |k: isize| {
            if self.road.closed() {
                k.rem_euclid(n) as usize
            } else {
                k.clamp(0, n - 1) as usize
            }
        };
        let distance = |k: isize| self.fine[index(k)].position_m.distance_squared(point);
        let best = (middle - reach..=middle + reach)
            .min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
            .unwrap_or(middle);
        let sample = &self.fine[index(best)];
        // Distance from the chord through the neighbours, which is finer than that from the sample.
        let (before, after) = (
            self.fine[index(best - 1)].position_m,
            self.fine[index(best + 1)].position_m,
        );
        let along = (after - before).normalize_or_zero();
        let away = (point - sample.position_m).perp_dot(along).abs();
        (away.max(0.0), sample)
    }

    /// Refuses edges that cross, on one side or between the sides.
    fn check_edges(&self) -> Result<()> {
        let (right, left): (Vec<DVec2>, Vec<DVec2>) = self.ends.iter().map(|&[r, l]| (r, l)).unzip();
        let mut edges = stretches(&right, self.road.closed());
        let per_side = edges.len();
        edges.extend(stretches(&left, self.road.closed()));
        let all = crossings(&edges, 8 * self.ends.len()).map_err(|_| tangled(self.road))?;
        for (i, j) in all {
            let (i, j) = (i % per_side, j % per_side);
            if !self.bridged(self.stations[i], self.stations[j]) {
                return Err(self.overlap(i, j));
            }
        }
        Ok(())
    }
}

/// A cross-section along the normal.
fn along_normal(frame: &RoadFrame) -> Stretch {
    let left = frame.tangent.perp();
    [
        frame.position_m - frame.right_m * left,
        frame.position_m + frame.left_m * left,
    ]
}

fn tangled(road: &dyn Road) -> Error {
    Error::input(
        road.source(),
        "whole line",
        "stretches so tangled that crossings cannot be looked for",
        "the line of a road",
    )
}
