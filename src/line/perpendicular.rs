//! Cross-sections square to a line, instead of the road's own.
//!
//! The direction of a road's cross-sections comes from its survey. A line that lies far from the reference line inherits their
//! jitter. Where the line bends unlike the reference line, a few control points cannot describe it. Along cross-sections square
//! to a line that is nearly right, a smooth `alpha` gives a smooth line in the plane.

use super::fine::FineLine;
use crate::error::{Error, Result};
use crate::track::{CrossSections, SectionRelief};
use glam::DVec2;

/// Distance between the points that curves are followed by (m). Between two of them a curve is taken for an arc.
const STEP_M: f64 = 0.25;
/// Greatest distance along the road between a cross-section and the piece of edge that it meets (m).
const REACH_M: f64 = 60.0;
/// Usable road that is left where edges meet (m).
const LEAST_M: f64 = 0.1;

/// Where a curve crosses one cross-section.
struct Crossing {
    /// Distance along the curve (m).
    station_m: f64,
    /// Share of the cross-section from the right; beyond zero and one off the road.
    alpha: f64,
}

/// Where the straight line from `from` along `step` meets the stretch from `start` to `end`, in shares of both.
fn meeting(from: DVec2, step: DVec2, start: DVec2, end: DVec2) -> Option<[f64; 2]> {
    let along = end - start;
    let cross = step.perp_dot(along);
    let apart = start - from;
    let shares = [apart.perp_dot(along) / cross, apart.perp_dot(step) / cross];
    shares.iter().all(|s| s.is_finite()).then_some(shares)
}

/// How far a curve is to the right of its chord at a share of a segment (m).
fn sag_m(curve: &FineLine, segment: usize, share: f64) -> f64 {
    let bends = [segment, (segment + 1) % curve.points_m.len()].map(|i| curve.curvature_1pm[i]);
    0.25 * (bends[0] + bends[1]) * curve.segment_m[segment].powi(2) * share * (1.0 - share)
}

fn unseen(road: &CrossSections, what: &str, station_m: f64) -> Error {
    Error::Study(format!("{}: {what} at {station_m:.0} m", road.name))
}

/// A closed curve through `points_m`, in steps of [`STEP_M`].
fn followed(road: &CrossSections, points_m: &[DVec2]) -> Result<FineLine> {
    if !road.closed {
        return Err(unseen(
            road,
            "only a closed road has cross-sections square to a line",
            0.0,
        ));
    }
    FineLine::new(points_m, true, STEP_M, None, 0.0)
}

/// Where `curve` crosses each cross-section, one after the other.
fn crossings(road: &CrossSections, curve: &FineLine) -> Result<Vec<Crossing>> {
    let (n, k) = (road.len(), curve.points_m.len());
    let at = |section: usize, segment: usize| -> Option<Crossing> {
        let (right, across) = (
            road.right_m[section],
            road.left_m[section] - road.right_m[section],
        );
        let ends = [curve.points_m[segment % k], curve.points_m[(segment + 1) % k]];
        let [chord_alpha, share] = meeting(right, across, ends[0], ends[1])?;
        let square = (ends[1] - ends[0]).perp().normalize();
        let alpha = chord_alpha - sag_m(curve, segment % k, share) / square.dot(across);
        // Slightly more than the segment, so that no crossing is missed between two segments.
        let crosses = (-1e-9..=1.0 + 1e-9).contains(&share) && (-0.5..=1.5).contains(&alpha);
        crosses.then(|| Crossing {
            station_m: curve.station_m[segment % k] + share * curve.segment_m[segment % k],
            alpha,
        })
    };
    let off = |c: &Crossing| (c.alpha - 0.5).abs();
    let first = (0..k)
        .filter_map(|segment| Some((segment, at(0, segment)?)))
        .min_by(|a, b| off(&a.1).total_cmp(&off(&b.1)));
    let (mut segment, crossing) = first.ok_or_else(|| unseen(road, "no line", road.station_m[0]))?;
    let mut found = vec![crossing];
    let spacing = road.spacing_m();
    for section in 1..n {
        let most = ((2.0 * spacing[section - 1] + REACH_M) / STEP_M) as usize;
        let next = (segment..segment + most).find_map(|s| Some((s, at(section, s)?)));
        let (place, crossing) = next.ok_or_else(|| unseen(road, "no line", road.station_m[section]))?;
        segment = place;
        found.push(crossing);
    }
    Ok(found)
}

/// `alpha` of the closed line through `points_m` at every cross-section of `road`; beyond zero and one off the road.
///
/// # Errors
/// [`Error::Study`] if the road is open, or the line does not cross its cross-sections one after the other.
pub fn shares_across(road: &CrossSections, points_m: &[DVec2]) -> Result<Vec<f64>> {
    let found = crossings(road, &followed(road, points_m)?)?;
    Ok(found.into_iter().map(|c| c.alpha).collect())
}

/// How cross-sections are spread along a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spread {
    /// So many at equal steps.
    Even(usize),
    /// At steps of so many metres in bends, and up to so many on straights.
    Steps {
        /// The step in bends (m).
        bends_m: f64,
        /// The greatest step on straights (m).
        straights_m: f64,
    },
}

/// Radius (m) of bends below which steps are the least.
const TIGHT_M: f64 = 150.0;
/// Distance (m) over which steps change from those of straights to those of bends.
const APPROACH_M: f64 = 40.0;

impl Spread {
    /// The stations (m) of the cross-sections along a closed curve, ascending from zero.
    fn stations(self, curve: &FineLine) -> Vec<f64> {
        let (bends_m, straights_m) = match self {
            Self::Even(count) => {
                let spacing_m = curve.length_m / count as f64;
                return (0..count).map(|i| spacing_m * i as f64).collect();
            }
            Self::Steps { bends_m, straights_m } => (bends_m, straights_m),
        };
        // Cross-sections per metre, without kinks: a spline over the cross-sections' numbers is to be smooth in the plane.
        let reach = (APPROACH_M / STEP_M) as usize;
        let bends: Vec<f64> = curve.curvature_1pm.iter().map(|k| k.abs()).collect();
        let wanted = twice_averaged(&bends, reach).into_iter();
        let wanted: Vec<f64> = wanted
            .map(|k| (k * TIGHT_M).clamp(bends_m / straights_m, 1.0) / bends_m)
            .collect();
        let density = twice_averaged(&wanted, reach);
        let mut sums = vec![0.0];
        for (i, step_m) in curve.segment_m.iter().enumerate() {
            let mean = 0.5 * (density[i] + density[(i + 1) % density.len()]);
            sums.push(sums[i] + mean * step_m);
        }
        let total = sums[sums.len() - 1];
        let count = total.ceil() as usize;
        let station = |i: usize| {
            let wanted = total * i as f64 / count as f64;
            let segment = sums
                .partition_point(|sum| *sum <= wanted)
                .clamp(1, sums.len() - 1)
                - 1;
            let share = (wanted - sums[segment]) / (sums[segment + 1] - sums[segment]);
            curve.station_m[segment] + share * curve.segment_m[segment]
        };
        (0..count).map(station).collect()
    }
}

/// Means over `reach` neighbours in all, taken twice, of values along a closed curve.
fn twice_averaged(values: &[f64], reach: usize) -> Vec<f64> {
    let n = values.len();
    let half = (reach / 2).min((n - 1) / 2);
    let averaged = |values: &[f64]| -> Vec<f64> {
        let mut sum: f64 = (0..=2 * half).map(|j| values[(n + j - half) % n]).sum();
        (0..n)
            .map(|i| {
                let mean = sum / (2 * half + 1) as f64;
                sum += values[(i + half + 1) % n] - values[(i + n - half) % n];
                mean
            })
            .collect()
    };
    averaged(&averaged(values))
}

/// Cross-sections square to the closed line through `points_m`, spread along it, between the edges of `road`; the line is their
/// reference, and may lie off the road. At the cross-sections a line within these is within `road`; between two of them an edge
/// bulges in by no more than the square of their spacing over eight times its radius.
///
/// # Errors
/// As [`shares_across`]; [`Error::Study`] where an edge does not lie abreast of the line.
pub fn cross_sections_about(
    road: &CrossSections,
    points_m: &[DVec2],
    spread: Spread,
) -> Result<CrossSections> {
    let curve = followed(road, points_m)?;
    let stations = spread.stations(&curve);
    let count = stations.len();
    let (n, k) = (road.len(), curve.points_m.len());
    let mut by_station: Vec<(f64, usize)> = crossings(road, &curve)?
        .into_iter()
        .enumerate()
        .map(|(section, c)| (c.station_m, section))
        .collect();
    by_station.sort_by(|a, b| a.0.total_cmp(&b.0));
    let reach = (REACH_M * n as f64 / road.length_m).ceil() as usize + 2;
    let reach = reach.min(n / 2);
    // The direction to the left at a point of the curve.
    let left_at = |point: usize| {
        let along = curve.points_m[(point + 3) % k] - curve.points_m[(point + k - 3) % k];
        along.perp().normalize()
    };

    let mut places = Vec::with_capacity(count);
    let mut limits = Vec::with_capacity(count);
    for &station_m in &stations {
        let segment = curve.station_m.partition_point(|s| *s <= station_m).max(1) - 1;
        let share = (station_m - curve.station_m[segment]) / curve.segment_m[segment];
        let left = left_at(segment).lerp(left_at(segment + 1), share).normalize();
        let chord = curve.points_m[segment].lerp(curve.points_m[(segment + 1) % k], share);
        let place = chord - sag_m(&curve, segment, share) * left;
        let near = by_station.partition_point(|(s, _)| *s <= station_m).max(1) - 1;
        let near = by_station[near].1;
        // In a hairpin an edge is met several times. The nearest place belongs to the line.
        let edge = |ends: &[DVec2]| {
            (0..2 * reach)
                .map(|j| (near + n + j - reach) % n)
                .filter_map(|j| meeting(place, left, ends[j], ends[(j + 1) % n]))
                .filter(|[_, share]| (-1e-9..=1.0 + 1e-9).contains(share))
                .map(|[distance, _]| distance)
                .min_by(|a, b| a.abs().total_cmp(&b.abs()))
        };
        let (Some(right), Some(left_end)) = (edge(&road.right_m), edge(&road.left_m)) else {
            return Err(unseen(road, "no edge abreast of the line", station_m));
        };
        places.push((place, left));
        limits.push([right, left_end]);
    }

    // Between two cross-sections a corner of an edge may stand further in than at either: both are shortened to it.
    for (station_m, section) in by_station {
        for (side, end) in [road.right_m[section], road.left_m[section]]
            .into_iter()
            .enumerate()
        {
            let about = curve.station_m.partition_point(|s| *s <= station_m) + k;
            let steps = ((REACH_M / STEP_M) as usize).min(k / 2);
            let nearest = (about - steps..about + steps)
                .map(|p| p % k)
                .min_by(|a, b| {
                    let distance = |p: &usize| curve.points_m[*p].distance_squared(end);
                    distance(a).total_cmp(&distance(b))
                })
                .unwrap_or(0);
            let inward = (end - curve.points_m[nearest]).dot(left_at(nearest));
            let after = stations.partition_point(|s| *s <= curve.station_m[nearest]);
            for i in [after - 1, after % count] {
                let limit = &mut limits[i][side];
                *limit = if side == 0 {
                    limit.max(inward)
                } else {
                    limit.min(inward)
                };
            }
        }
    }

    let mut cross_sections = CrossSections {
        length_m: curve.length_m,
        station_m: stations,
        right_m: Vec::with_capacity(count),
        left_m: Vec::with_capacity(count),
        reference: Vec::with_capacity(count),
        ..road.clone()
    };
    for ((place, left), [right, left_end]) in places.into_iter().zip(limits) {
        let (middle, half) = (
            0.5 * (right + left_end),
            (0.5 * (left_end - right)).max(0.5 * LEAST_M),
        );
        cross_sections.right_m.push(place + (middle - half) * left);
        cross_sections.left_m.push(place + (middle + half) * left);
        cross_sections.reference.push((half - middle) / (2.0 * half));
    }
    let points = cross_sections.points(&cross_sections.reference);
    cross_sections.drs = road.drs_along(&points);
    cross_sections.relief = road.relief_across(&points).map(|across| SectionRelief {
        z_m: across.iter().map(|surface| surface.z_m).collect(),
        bank_rad: across.iter().map(|surface| surface.bank_rad).collect(),
        friction: across.iter().map(|surface| surface.friction).collect(),
        foot_m: points,
    });
    Ok(cross_sections)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::{Shape, Track};

    /// Square to a line in a ring, cross-sections lie along the radii, and reach from edge to edge.
    #[test]
    fn cross_sections_about_a_circle_are_its_radii() {
        let ring = Shape::parse("circle:90:110").unwrap().unwrap();
        let road = ring.cross_sections(400).unwrap();
        let points = road.points(&vec![0.3; 400]);
        let cross_sections = cross_sections_about(&road, &points, Spread::Even(300)).unwrap();
        for i in 0..300 {
            let radii = [cross_sections.right_m[i], cross_sections.left_m[i]].map(DVec2::length);
            // Polygons of 400 corners: a sagitta is 3.4 mm.
            let edges = [radii[0].min(radii[1]), radii[0].max(radii[1])];
            assert!(
                (edges[0] - 90.0).abs() < 5e-3 && (edges[1] - 110.0).abs() < 5e-3,
                "{radii:?}"
            );
            assert!(
                (cross_sections.reference[i] - 0.3).abs() < 1e-3,
                "{}",
                cross_sections.reference[i]
            );
            let along = (cross_sections.left_m[i] - cross_sections.right_m[i]).normalize();
            assert!(along.perp_dot(cross_sections.right_m[i].normalize()).abs() < 1e-3);
        }
        let back = shares_across(&road, &cross_sections.points(&cross_sections.reference)).unwrap();
        assert!(back.iter().all(|a| (a - 0.3).abs() < 1e-4));
    }

    /// On a circuit with hairpins every line within the new cross-sections is within the old ones, but for what it bulges between
    /// two.
    /// Two straights of 400 m and half circles of 60 m: least steps in bends, three times as long ones on straights, and none that is
    /// much longer than the one before.
    #[test]
    fn steps_are_closer_in_bends() {
        let stadium = Shape::parse("stadium:400:60:12").unwrap().unwrap();
        let road = stadium.cross_sections(600).unwrap();
        let spread = Spread::Steps {
            bends_m: 2.0,
            straights_m: 6.0,
        };
        let points = road.points(&road.reference);
        let cross_sections = cross_sections_about(&road, &points, spread).unwrap();
        let steps = cross_sections.spacing_m();
        let least = steps.iter().copied().fold(f64::INFINITY, f64::min);
        let most = steps.iter().copied().fold(0.0, f64::max);
        assert!((1.95..2.0 + 1e-9).contains(&least), "{least}");
        assert!((5.8..6.0 + 1e-9).contains(&most), "{most}");
        let next = steps.iter().skip(1).chain(&steps[..1]);
        let growth = steps.iter().zip(next).map(|(step, next)| next / step);
        assert!(
            growth.clone().all(|g| (0.75..1.35).contains(&g)),
            "{:?}",
            growth.collect::<Vec<_>>()
        );
        let length_m: f64 = steps.iter().sum();
        assert!((length_m / road.length_m - 1.0).abs() < 1e-3, "{length_m}");
    }

    #[test]
    fn lines_within_are_on_the_road() {
        let track = Track::load("silverstone_gp").unwrap();
        let road = track.cross_sections(720, false).unwrap();
        let cross_sections =
            cross_sections_about(&road, &road.points(&road.reference), Spread::Even(1440)).unwrap();
        for alpha in [0.0, 0.5, 1.0] {
            let shares = shares_across(&road, &cross_sections.points(&vec![alpha; 1440])).unwrap();
            let worst = shares.iter().fold(0.0f64, |w, a| w.max((a - 0.5).abs() - 0.5));
            // 1 % of 15 m: half of a cross-section's spacing squared over eight times the tightest radius of an edge, 10 m.
            assert!(worst < 0.01, "{alpha}: {worst}");
        }
    }

    #[test]
    fn an_open_road_is_refused() {
        let track = Track::load("silverstone_gp").unwrap();
        let mut road = track.cross_sections(120, false).unwrap();
        let points = road.points(&road.reference);
        road.closed = false;
        let error = cross_sections_about(&road, &points, Spread::Even(100))
            .unwrap_err()
            .to_string();
        assert!(error.contains("closed"), "{error}");
    }
}
