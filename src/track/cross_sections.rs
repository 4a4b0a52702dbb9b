//! Cross-sections of a circuit at stations: the straight segments that a racing line crosses.

use super::circuit::{Corner, Section};
use super::crossing::bridges;
use super::friction::FrictionAcross;
use super::relief::{SectionRelief, Surface, SurfaceAcross, cubic};
use crate::{Error, Place, Result};
use glam::DVec2;
use std::ops::Range;

/// Cross-sections across a circuit, each from its right edge to its left one.
///
/// A line crosses cross-section `i` at `right_m[i] + alpha_i (left_m[i] - right_m[i])`, with `alpha` from 0 (the driver's
/// right) to 1 (left). On a closed circuit the last cross-section is followed by the first, which is not repeated.
#[derive(Clone, Debug, PartialEq)]
pub struct CrossSections {
    /// Name for titles and messages.
    pub name: String,
    /// Whether the end joins the start.
    pub closed: bool,
    /// Length of the reference line (m), the closing stretch of a closed circuit included.
    pub length_m: f64,
    /// Station of each cross-section along the reference line (m), ascending from 0.
    pub station_m: Vec<f64>,
    /// Right end of each cross-section (m).
    pub right_m: Vec<DVec2>,
    /// Left end of each cross-section (m).
    pub left_m: Vec<DVec2>,
    /// Where the smooth reference line crosses each cross-section, as a share of its width from the right.
    pub reference: Vec<f64>,
    /// Named stretches, by station.
    pub sections: Vec<Section>,
    /// Named corners, by station.
    pub corners: Vec<Corner>,
    /// Whether the DRS may be open from each cross-section to the next. Empty where it may be open nowhere.
    pub drs: Vec<bool>,
    /// Height, banking and friction of each cross-section; none of a level and dry road.
    pub relief: Option<SectionRelief>,
}

impl CrossSections {
    /// Where the road crosses itself on bridges: both stations (m) of each.
    pub fn bridges(&self) -> Vec<[f64; 2]> {
        bridges(&self.points(&vec![0.5; self.len()]), &self.station_m, self.closed)
    }

    /// Number of cross-sections.
    pub fn len(&self) -> usize {
        self.station_m.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.station_m.is_empty()
    }

    /// Distance along the reference line from each cross-section to the next (m), the closing stretch of a closed circuit
    /// included.
    pub fn spacing_m(&self) -> Vec<f64> {
        let after = self.station_m.iter().copied().skip(1);
        let ends = after.chain(self.closed.then_some(self.length_m));
        self.station_m
            .iter()
            .zip(ends)
            .map(|(from, to)| to - from)
            .collect()
    }

    /// The same cross-sections with a reference line that leaves out what is shorter than `wavelength_m`, such as the noise of a
    /// survey, held on the road: see [`CrossSections::smoothed`].
    pub fn with_smooth_reference(&self, wavelength_m: f64) -> Self {
        let smooth = self.smoothed(&self.reference, wavelength_m);
        Self {
            reference: smooth.into_iter().map(|a| a.clamp(0.0, 1.0)).collect(),
            ..self.clone()
        }
    }

    /// A line (`alpha` at every cross-section) without what is shorter than `wavelength_m`: the line that minimises a weighted
    /// sum of its distance from the given line and its bending; with this weight, a wave of that length keeps half its height (E.
    /// T. Whittaker, *On a new method of graduation*, Proc. Edinburgh Math. Soc. 41, 1923). It may leave the road, where a line
    /// held at its edge would have a kink.
    pub fn smoothed(&self, alpha: &[f64], wavelength_m: f64) -> Vec<f64> {
        let n = self.len();
        if n < 5 {
            return alpha.to_vec();
        }
        let line = self.points(alpha);
        let ends = self.right_m.iter().zip(&self.left_m);
        let across: Vec<DVec2> = ends
            .map(|(right, left)| (*left - *right).normalize_or_zero())
            .collect();
        let mean_m = self.length_m / if self.closed { n } else { n - 1 } as f64;
        let weight = (wavelength_m / (std::f64::consts::TAU * mean_m)).powi(4);
        // Second differences over the mean spacing, in units of the spacing, and their transpose.
        let inner = if self.closed { 0..n } else { 1..n - 1 };
        let bend = |points: &[DVec2]| -> Vec<DVec2> {
            let mut bend = vec![DVec2::ZERO; n];
            for i in inner.clone() {
                bend[i] = points[(i + 1) % n] - 2.0 * points[i] + points[(i + n - 1) % n];
            }
            bend
        };
        let spread = |bend: &[DVec2]| -> Vec<f64> {
            let mut force = vec![DVec2::ZERO; n];
            for i in inner.clone() {
                force[(i + 1) % n] += bend[i];
                force[i] -= 2.0 * bend[i];
                force[(i + n - 1) % n] += bend[i];
            }
            force
                .iter()
                .zip(&across)
                .map(|(f, a)| weight * f.dot(*a))
                .collect()
        };
        let moved =
            |offset: &[f64]| -> Vec<DVec2> { offset.iter().zip(&across).map(|(o, a)| *o * *a).collect() };
        let apply = |offset: &[f64]| -> Vec<f64> {
            let bent = spread(&bend(&moved(offset)));
            offset.iter().zip(bent).map(|(o, b)| o + b).collect()
        };
        let right: Vec<f64> = spread(&bend(&line)).iter().map(|b| -b).collect();
        let offset = conjugate_gradients(apply, &right);
        let widths = (0..n).map(|i| self.right_m[i].distance(self.left_m[i]));
        let moved = alpha.iter().zip(offset).zip(widths);
        moved.map(|((a, offset), width)| a + offset / width).collect()
    }

    /// The same cross-sections shortened at both ends by half the width of a car (m), so that its middle may use all of them.
    ///
    /// # Errors
    /// [`Error::Input`] naming the station of the first cross-section that is not wider than the car.
    pub fn narrowed(&self, car_width_m: f64) -> Result<Self> {
        let mut narrowed = self.clone();
        let ends = narrowed.right_m.iter_mut().zip(&mut narrowed.left_m);
        let cross_sections = ends.zip(&mut narrowed.reference).zip(&self.station_m);
        for (((right, left), reference), station) in cross_sections {
            let width = right.distance(*left);
            // NaN does not fit.
            let fits = width > car_width_m && car_width_m >= 0.0;
            if !fits {
                return Err(Error::input(
                    &self.name,
                    Place::station(*station).named("width"),
                    format!("{width:.2} m"),
                    format!("more than the car's {car_width_m:.2} m"),
                ));
            }
            let inward = (*left - *right) * (0.5 * car_width_m / width);
            *right += inward;
            *left -= inward;
            let usable = width - car_width_m;
            *reference = ((*reference * width - 0.5 * car_width_m) / usable).clamp(0.0, 1.0);
        }
        Ok(narrowed)
    }

    /// The `count` cross-sections from `first` on as an open stretch, across the start line of a closed circuit if necessary.
    /// Stations start from zero; named sections and corners stay with the whole.
    ///
    /// # Errors
    /// [`Error::Input`] if the stretch has fewer than two cross-sections, or more than there are.
    pub fn stretch(&self, first: usize, count: usize) -> Result<Self> {
        let n = self.len();
        let most = if self.closed { n } else { n.saturating_sub(first) };
        if first >= n || count < 2 || count > most {
            return Err(Error::input(
                &self.name,
                "stretch of cross-sections",
                format!("{count} from {first} on"),
                format!("2 to {most} of {n}"),
            ));
        }
        let cross_sections = (first..first + count).map(|i| i % n);
        let from = self.station_m[first];
        let station_m: Vec<f64> = (first..first + count)
            .map(|i| self.station_m[i % n] - from + if i < n { 0.0 } else { self.length_m })
            .collect();
        Ok(Self {
            name: self.name.clone(),
            closed: false,
            length_m: station_m[count - 1],
            station_m,
            right_m: cross_sections.clone().map(|i| self.right_m[i]).collect(),
            left_m: cross_sections.clone().map(|i| self.left_m[i]).collect(),
            reference: cross_sections.clone().map(|i| self.reference[i]).collect(),
            relief: self
                .relief
                .as_ref()
                .map(|relief| relief.some(cross_sections.clone())),
            drs: cross_sections.filter_map(|i| self.drs.get(i).copied()).collect(),
            sections: Vec::new(),
            corners: Vec::new(),
        })
    }

    /// Where the section of this name, or of one of its names, begins (m), and its length (m). `3/12` is the third of twelve
    /// sectors of equally many cross-sections; the links from one sector to the next belong to neither.
    ///
    /// # Errors
    /// [`Error::Input`] listing the names when there is none of this one, or if there is no such sector.
    pub fn section_named(&self, name: &str) -> Result<(f64, f64)> {
        if let Some((number, of)) = numbered(name) {
            let n = self.len();
            if !(1..=of).contains(&number) || of > n / 2 {
                let expected = format!("1/{of} to {of}/{of}, with at most {} sectors", n / 2);
                return Err(Error::input(&self.name, "section", name, expected));
            }
            let sector = self.sector(number - 1, of);
            let spacing_m = self.length_m / n as f64;
            return Ok((
                self.station_m[sector.start],
                (sector.len() - 1) as f64 * spacing_m,
            ));
        }
        let called = |all: &str| all == name || all.split('/').any(|one| one.trim() == name);
        let Some(section) = self.sections.iter().find(|s| called(&s.name)) else {
            let known: Vec<&str> = self.sections.iter().map(|s| s.name.as_str()).collect();
            let expected = if known.is_empty() {
                "none: the circuit names no sections".to_owned()
            } else {
                format!("one of {}", known.join(", "))
            };
            return Err(Error::input(&self.name, "section", name, expected));
        };
        Ok((section.start_m, section.length_m()))
    }

    /// The cross-sections of a sector, counted from 0, of so many with equally many of them.
    pub fn sector(&self, number: usize, of: usize) -> Range<usize> {
        number * self.len() / of..(number + 1) * self.len() / of
    }

    /// The first cross-section at or after a station (m).
    pub fn first_from(&self, from_m: f64) -> usize {
        let from_m = if self.closed {
            from_m.rem_euclid(self.length_m)
        } else {
            from_m
        };
        let first = self.station_m.partition_point(|s| *s < from_m);
        if self.closed {
            first % self.len()
        } else {
            first.min(self.len() - 2)
        }
    }

    /// The cross-sections from a station (m) on over a length (m), and some `more`, as an open road.
    ///
    /// # Errors
    /// As [`CrossSections::stretch`].
    pub fn stretch_from(&self, from_m: f64, length_m: f64, more: usize) -> Result<Self> {
        let first = self.first_from(from_m);
        let spacing_m = self.length_m / self.len() as f64;
        let most = if self.closed {
            self.len()
        } else {
            self.len() - first
        };
        let count = (length_m / spacing_m).round() as usize + 1 + more;
        self.stretch(first, count.clamp(2, most))
    }

    /// Whether the DRS may be open from each point (m) of a line along the road to the next; empty where it may be open nowhere.
    pub fn drs_along(&self, points_m: &[DVec2]) -> Vec<bool> {
        if self.drs.is_empty() {
            return Vec::new();
        }
        let nearest = self.nearest_along(points_m);
        nearest.into_iter().map(|i| self.drs[i]).collect()
    }

    /// The cross-section nearest to each point (m) of a line along the road.
    fn nearest_along(&self, points_m: &[DVec2]) -> Vec<usize> {
        /// Cross-sections on each side among which the next point's own is looked for: those of another part of the road, beside it
        /// or on a bridge, are further away.
        const NEARBY: usize = 30;
        let n = self.len();
        let distance = |point: DVec2, i: usize| {
            let across = self.left_m[i] - self.right_m[i];
            let share = (point - self.right_m[i]).dot(across) / across.length_squared();
            point.distance_squared(self.right_m[i] + share.clamp(0.0, 1.0) * across)
        };
        let nearest = |point: DVec2, among: &mut dyn Iterator<Item = usize>| {
            among
                .min_by(|i, j| distance(point, *i).total_cmp(&distance(point, *j)))
                .unwrap_or(0)
        };
        let mut before: Option<usize> = None;
        let at = |point: &DVec2| {
            let here = match before {
                None => nearest(*point, &mut (0..n)),
                Some(before) => {
                    let around = (n + before).saturating_sub(NEARBY)..=n + before + NEARBY;
                    nearest(*point, &mut around.map(|i| i % n))
                }
            };
            before = Some(here);
            here
        };
        points_m.iter().map(at).collect()
    }

    /// The surface at each point (m) of a line along the road, of a road that is not level and dry: height and banking by the cubic
    /// through the four cross-sections about it, friction linear between two.
    pub fn relief_along(&self, points_m: &[DVec2]) -> Option<Vec<Surface>> {
        let across = self.relief_across(points_m)?;
        Some(across.iter().map(|across| across.at(0.0)).collect())
    }

    /// As [`CrossSections::relief_along`], and what lies to the left and right of each point.
    pub(crate) fn relief_across(&self, points_m: &[DVec2]) -> Option<Vec<SurfaceAcross>> {
        let relief = self.relief.as_ref()?;
        let n = self.len() as isize;
        let index = |i: isize| {
            if self.closed {
                i.rem_euclid(n) as usize
            } else {
                i.clamp(0, n - 1) as usize
            }
        };
        let left = |i: usize| (self.left_m[i] - self.right_m[i]).normalize_or_zero();
        // How far a point is ahead of a cross-section.
        let ahead = |point: DVec2, i: usize| -left(i).perp().dot(point - self.right_m[i]);
        let at = |(point, nearest): (&DVec2, usize)| {
            let behind = ahead(*point, nearest) < 0.0;
            let from = nearest as isize - isize::from(behind);
            let four = [-1, 0, 1, 2].map(|k| index(from + k));
            let (past, short) = (ahead(*point, four[1]), -ahead(*point, four[2]));
            let whole = past + short;
            let t = if whole > 0.0 {
                (past / whole).clamp(0.0, 1.0)
            } else {
                0.0
            };
            let foot = DVec2::new(
                cubic(four.map(|i| relief.foot_m[i].x), t),
                cubic(four.map(|i| relief.foot_m[i].y), t),
            );
            let across = left(four[1]).lerp(left(four[2]), t).normalize_or_zero();
            let plane = SurfaceAcross {
                z_m: cubic(four.map(|i| relief.z_m[i]), t),
                bank_rad: cubic(four.map(|i| relief.bank_rad[i]), t),
                friction: FrictionAcross::mixed(&relief.friction[four[1]], &relief.friction[four[2]], t),
            };
            plane.seen_from((*point - foot).dot(across))
        };
        let nearest = self.nearest_along(points_m);
        Some(points_m.iter().zip(nearest).map(at).collect())
    }

    /// The surface at a line's points (m), one per cross-section, of a road that is not level and dry.
    pub fn relief_of(&self, points_m: &[DVec2]) -> Option<Vec<Surface>> {
        let across = self.relief_across_of(points_m)?;
        Some(across.iter().map(|across| across.at(0.0)).collect())
    }

    /// As [`CrossSections::relief_of`], and what lies to the left and right of each point.
    pub(crate) fn relief_across_of(&self, points_m: &[DVec2]) -> Option<Vec<SurfaceAcross>> {
        let relief = self.relief.as_ref()?;
        let at = |(i, point): (usize, &DVec2)| {
            let left = (self.left_m[i] - self.right_m[i]).normalize_or_zero();
            relief.plane(i).seen_from((*point - relief.foot_m[i]).dot(left))
        };
        Some(points_m.iter().enumerate().map(at).collect())
    }

    /// The points of a line (m), one per cross-section, from its `alpha` at every cross-section.
    pub fn points(&self, alpha: &[f64]) -> Vec<DVec2> {
        self.right_m
            .iter()
            .zip(&self.left_m)
            .zip(alpha)
            .map(|((right, left), alpha)| *right + *alpha * (*left - *right))
            .collect()
    }
}

/// The numbers of `3/12`.
fn numbered(name: &str) -> Option<(usize, usize)> {
    let (number, of) = name.split_once('/')?;
    Some((number.trim().parse().ok()?, of.trim().parse().ok()?))
}

/// The solution of a symmetric positive definite system, by the method of conjugate gradients (Hestenes, Stiefel, *Methods
/// of conjugate gradients for solving linear systems*, J. Res. NBS 49, 1952).
fn conjugate_gradients(apply: impl Fn(&[f64]) -> Vec<f64>, right: &[f64]) -> Vec<f64> {
    /// A millionth of the first residual is a hundredth of a millimetre of a reference line.
    const SETTLED: f64 = 1e-6;
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let mut solution = vec![0.0; right.len()];
    let mut residual = right.to_vec();
    let mut direction = residual.clone();
    let first = dot(&residual, &residual);
    let mut square = first;
    for _ in 0..20_000 {
        if square <= SETTLED * SETTLED * first {
            break;
        }
        let image = apply(&direction);
        let step = square / dot(&direction, &image);
        for i in 0..right.len() {
            solution[i] += step * direction[i];
            residual[i] -= step * image[i];
        }
        let next = dot(&residual, &residual);
        let share = next / square;
        square = next;
        for (d, r) in direction.iter_mut().zip(&residual) {
            *d = r + share * *d;
        }
    }
    solution
}

#[cfg(test)]
mod tests {
    use super::*;

    fn straight() -> CrossSections {
        CrossSections {
            name: "straight".to_owned(),
            closed: false,
            length_m: 10.0,
            station_m: vec![0.0, 10.0],
            right_m: vec![DVec2::new(0.0, -4.0), DVec2::new(10.0, -4.0)],
            left_m: vec![DVec2::new(0.0, 6.0), DVec2::new(10.0, 6.0)],
            reference: vec![0.4, 0.4],
            sections: Vec::new(),
            corners: Vec::new(),
            drs: Vec::new(),
            relief: None,
        }
    }

    #[test]
    fn a_line_crosses_between_the_drawn_in_edges() {
        let cross_sections = straight().narrowed(2.0).unwrap();
        let points = cross_sections.points(&[0.0, 1.0]);
        assert_eq!(points, [DVec2::new(0.0, -3.0), DVec2::new(10.0, 5.0)]);
        // The reference line stays where it is, 4 m from the right edge: 3 of the 8 m that are left.
        assert!((cross_sections.reference[0] - 0.375).abs() < 1e-15);
    }

    #[test]
    fn a_stretch_goes_round_the_end_of_a_closed_circuit() {
        let mut cross_sections = straight();
        cross_sections.closed = true;
        cross_sections.length_m = 25.0;
        let stretch = cross_sections.stretch(1, 2).unwrap();
        assert!(!stretch.closed);
        assert_eq!(stretch.station_m, [0.0, 15.0]);
        assert_eq!(
            stretch.left_m,
            [cross_sections.left_m[1], cross_sections.left_m[0]]
        );
        assert!(cross_sections.stretch(0, 3).is_err() && cross_sections.stretch(2, 2).is_err());
        assert!(straight().stretch(1, 2).is_err());
    }

    #[test]
    fn numbered_sectors_share_the_cross_sections_out_and_leave_the_links_between_them() {
        let n = 12;
        let at = |i: usize, y: f64| DVec2::new(i as f64, y);
        let ring = CrossSections {
            closed: true,
            length_m: 24.0,
            station_m: (0..n).map(|i| 2.0 * i as f64).collect(),
            right_m: (0..n).map(|i| at(i, -4.0)).collect(),
            left_m: (0..n).map(|i| at(i, 6.0)).collect(),
            reference: vec![0.4; n],
            ..straight()
        };
        let mut shared = Vec::new();
        for number in 1..=3 {
            let (from_m, length_m) = ring.section_named(&format!("{number}/3")).unwrap();
            assert_eq!(length_m, 6.0, "three links of the four cross-sections");
            shared.extend(ring.stretch_from(from_m, length_m, 0).unwrap().right_m);
        }
        assert_eq!(shared, ring.right_m);
        for wrong in ["0/3", "4/3", "1/7", "3/0"] {
            let refused = ring.section_named(wrong).expect_err(wrong).to_string();
            assert!(refused.contains(wrong), "{refused}");
        }
    }

    #[test]
    fn a_smooth_reference_keeps_long_waves_and_leaves_short_ones_out() {
        // A straight road, closed only in that the last cross-section is followed by the first: waves alone bend its reference.
        let n = 600;
        let wavy = |length_m: f64| {
            let wave = |i: usize| 0.1 * (std::f64::consts::TAU * i as f64 / length_m).sin();
            CrossSections {
                length_m: (n - 1) as f64,
                station_m: (0..n).map(|i| i as f64).collect(),
                right_m: (0..n).map(|i| DVec2::new(i as f64, -5.0)).collect(),
                left_m: (0..n).map(|i| DVec2::new(i as f64, 5.0)).collect(),
                reference: (0..n).map(|i| 0.5 + wave(i)).collect(),
                ..straight()
            }
        };
        for (length_m, kept) in [
            (15.0, 1.0 / 257.0),
            (60.0, 0.5),
            (240.0, 1.0 / (1.0 + 1.0 / 256.0)),
        ] {
            let smooth = wavy(length_m).with_smooth_reference(60.0);
            // In the middle, away from the ends; a discrete second difference falls short of the true one by k^2 h^2/12,
            // which is 1.5 % at 15 m.
            let height = smooth.reference[200..400]
                .iter()
                .fold(0.0f64, |a, r| a.max(r - 0.5))
                / 0.1;
            assert!(
                (height / kept - 1.0).abs() < 0.04,
                "{length_m}: {height} and {kept}"
            );
        }
    }

    #[test]
    fn a_car_wider_than_the_road_is_refused_by_place() {
        let error = straight().narrowed(10.0).unwrap_err().to_string();
        assert!(error.contains("station 0.0 m"), "{error}");
    }
}
