//! Height and banking of roads in three dimensions.
//!
//! The plan view of a road is a matter of [`Circuit`](super::Circuit) and [`CrossSections`](super::CrossSections). Height and
//! banking are added to it: the height of the reference line, and the angle about the direction of driving by which the left
//! side of the road lies above the right. A level road without banking has no relief at all, so its laps are those of the plane.

use super::spline::Spline;
use crate::{Error, Place, Result};
use glam::DVec2;

/// Range of heights (m).
pub(super) const HEIGHTS_M: (f64, f64) = (-1000.0, 10_000.0);
/// Greatest banking, either way (degrees). Daytona's is 31, the steepest of Monza's old bowl about 39.
pub(super) const STEEPEST_BANK_DEG: f64 = 40.0;
/// Greatest gradient of a road.
const STEEPEST: f64 = 0.4;
/// A step of the survey from the end to the start that is steeper than this is a gap in height and no slope.
const STEEPEST_CLOSING: f64 = 0.25;
/// Greatest gap in height of a closed road, as a share of its length: a barometer drifts by this in a lap.
const LARGEST_GAP: f64 = 0.005;
/// Heights that differ by less are the same (m), and banking below this is none (rad).
const LEVEL_M: f64 = 1e-9;
const LEVEL_RAD: f64 = 1e-9;
/// Waves of the height that are longer than this are kept, whatever deviation is allowed (m): the shortest crests are longer.
const LONGEST_WAVE_M: f64 = 150.0;
/// The same of the banking (m).
const LONGEST_BANK_WAVE_M: f64 = 100.0;

/// What smoothing and closing changed of a road's height and banking.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReliefChange {
    /// Greatest change of the height by smoothing (m).
    pub height_m: f64,
    /// Its root mean square (m).
    pub height_rms_m: f64,
    /// Greatest change of the banking by smoothing (rad).
    pub bank_rad: f64,
    /// Gap in height between the end and the start of a closed road, which was spread over its length (m).
    pub gap_m: f64,
}

/// Height and banking at the samples of a [`Circuit`](super::Circuit).
#[derive(Clone, Debug, PartialEq)]
pub struct Relief {
    /// Height of the centreline (m).
    pub z_m: Vec<f64>,
    /// Angle about the direction of driving by which the left side lies above the right (rad).
    pub bank_rad: Vec<f64>,
    /// What was changed of what was given.
    pub change: ReliefChange,
}

/// What a road's height comes to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReliefFacts {
    /// The sum of all that the road rises (m).
    pub climb_m: f64,
    /// Greatest height less the least (m).
    pub range_m: f64,
    /// Greatest gradient, up or down, as a share of the distance on the map.
    pub gradient: f64,
    /// Where that is (m).
    pub gradient_at_m: f64,
    /// Greatest banking, either way (rad).
    pub bank_rad: f64,
    /// Where that is (m).
    pub bank_at_m: f64,
}

impl Relief {
    /// What it comes to at stations (m) of a road that is closed or not.
    pub fn facts(&self, station_m: &[f64], spacing_m: f64, closed: bool) -> ReliefFacts {
        let n = self.z_m.len();
        let steps = n - usize::from(!closed);
        let rise = |i: &usize| self.z_m[(i + 1) % n] - self.z_m[*i];
        let steepest = (0..steps).max_by(|i, j| rise(i).abs().total_cmp(&rise(j).abs()));
        let bank = |i: &usize| self.bank_rad[*i].abs();
        let banked = (0..n).max_by(|i, j| bank(i).total_cmp(&bank(j)));
        let (steepest, banked) = (steepest.unwrap_or(0), banked.unwrap_or(0));
        let ends = self
            .z_m
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), z| {
                (least.min(*z), most.max(*z))
            });
        ReliefFacts {
            climb_m: (0..steps).map(|i| rise(&i).max(0.0)).sum(),
            range_m: ends.1 - ends.0,
            gradient: rise(&steepest).abs() / spacing_m,
            gradient_at_m: station_m[steepest],
            bank_rad: bank(&banked),
            bank_at_m: station_m[banked],
        }
    }
}

/// Planes across a road: height and banking at each of its [`CrossSections`](super::CrossSections).
#[derive(Clone, Debug, PartialEq)]
pub struct SectionRelief {
    /// A point of each cross-section (m),
    pub foot_m: Vec<DVec2>,
    /// its height (m),
    pub z_m: Vec<f64>,
    /// and the angle about the direction of driving by which the cross-section rises to the left (rad).
    pub bank_rad: Vec<f64>,
}

impl SectionRelief {
    /// Some of the planes, in this order.
    pub(crate) fn some(&self, of: impl Iterator<Item = usize> + Clone) -> Self {
        Self {
            foot_m: of.clone().map(|i| self.foot_m[i]).collect(),
            z_m: of.clone().map(|i| self.z_m[i]).collect(),
            bank_rad: of.map(|i| self.bank_rad[i]).collect(),
        }
    }

    /// The height (m) of a point of cross-section `i`, whose leftward unit vector is `left`.
    pub fn height_m(&self, i: usize, left: DVec2, point: DVec2) -> f64 {
        self.z_m[i] + self.bank_rad[i].tan() * (point - self.foot_m[i]).dot(left)
    }
}

/// Heights and bankings as read, at the points of a line.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Given {
    /// Heights (m), or none.
    pub z_m: Vec<f64>,
    /// Banking (rad), or none.
    pub bank_rad: Vec<f64>,
    /// The gap in height that was spread (m).
    pub gap_m: f64,
}

impl Given {
    /// Whether there is nothing that a level road lacks.
    pub fn is_level(&self) -> bool {
        let first = self.z_m.first().copied().unwrap_or_default();
        self.z_m.iter().all(|z| (z - first).abs() <= LEVEL_M)
            && self.bank_rad.iter().all(|bank| bank.abs() <= LEVEL_RAD)
    }

    /// Closes the heights at these stations of a closed line of this length (m). The last row of a line that repeats its first
    /// point is the end of the lap and goes; `points` are those that are left. A gap is spread evenly over the length.
    ///
    /// # Errors
    /// [`Error::Input`] for a gap that no measuring error explains.
    pub fn close(&mut self, source: &str, points: usize, station_m: &[f64], length_m: f64) -> Result<()> {
        self.bank_rad.truncate(points);
        if self.z_m.len() < points || points < 2 {
            return Ok(());
        }
        let (first, last) = (self.z_m[0], self.z_m[points - 1]);
        let (end, reach_m) = match self.z_m.get(points) {
            Some(repeated) => (*repeated, length_m),
            None if (first - last).abs() > STEEPEST_CLOSING * (length_m - station_m[points - 1]) => {
                (last, station_m[points - 1])
            }
            None => (first, length_m),
        };
        self.z_m.truncate(points);
        let gap_m = end - first;
        if gap_m.abs() > LARGEST_GAP * length_m {
            return Err(Error::input(
                source,
                "height",
                format!("an end {gap_m:.1} m above the start of a closed road"),
                format!(
                    "heights that close to within {:.1} m, which is {}% of the length",
                    LARGEST_GAP * length_m,
                    100.0 * LARGEST_GAP
                ),
            ));
        }
        self.gap_m = gap_m;
        for (z, station) in self.z_m.iter_mut().zip(station_m) {
            *z -= gap_m * station / reach_m;
        }
        Ok(())
    }

    /// Smooth curves within these deviations of the figures (m, rad), over the knots of the line; nothing of a level road.
    pub fn smoothed(
        &self,
        knots: &[f64],
        closed: bool,
        [height_m, bank_rad]: [f64; 2],
    ) -> Option<SmoothRelief> {
        if self.is_level() {
            return None;
        }
        let points = knots.len() - usize::from(closed);
        let fit = |given: &[f64], greatest: f64, longest_wave_m: f64| {
            if given.is_empty() {
                return Spline::smoothing(knots, &vec![0.0; points], closed, 0.0);
            }
            if greatest > 0.0 {
                Spline::within(knots, given, closed, greatest, longest_wave_m)
            } else {
                Spline::smoothing(knots, given, closed, 0.0)
            }
        };
        let height = fit(&self.z_m, height_m, LONGEST_WAVE_M);
        let bank = fit(&self.bank_rad, bank_rad, LONGEST_BANK_WAVE_M);
        let mut change = ReliefChange {
            gap_m: self.gap_m,
            ..ReliefChange::default()
        };
        if !self.z_m.is_empty() {
            let deviation = height.deviation(&self.z_m);
            (change.height_m, change.height_rms_m) = (deviation.greatest_m, deviation.rms_m);
        }
        if !self.bank_rad.is_empty() {
            change.bank_rad = bank.deviation(&self.bank_rad).greatest_m;
        }
        Some(SmoothRelief { height, bank, change })
    }
}

/// Height (m) and banking (rad) along a line, as functions of its parameter.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SmoothRelief {
    height: Spline<f64>,
    bank: Spline<f64>,
    /// What was changed.
    pub change: ReliefChange,
}

impl SmoothRelief {
    /// Height (m) and banking (rad) on an interval of the line.
    pub fn on(&self, interval: usize, t: f64) -> [f64; 2] {
        [self.height.on(interval, t).value, self.bank.on(interval, t).value]
    }

    /// Height (m) and banking (rad) at a parameter.
    pub fn at(&self, t: f64) -> [f64; 2] {
        [self.height.at(t).value, self.bank.at(t).value]
    }

    /// Refuses a road that is too steep anywhere.
    ///
    /// # Errors
    /// [`Error::Input`] naming the station.
    pub fn check(&self, source: &str) -> Result<()> {
        let knots = &self.height.knots;
        let middles = knots.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
        for t in knots.iter().copied().chain(middles) {
            let gradient = self.height.at(t).first;
            if gradient.is_nan() || gradient.abs() > STEEPEST {
                let found = format!("a gradient of {:.0}%", 100.0 * gradient);
                let expected = format!("at most {:.0}% up or down", 100.0 * STEEPEST);
                return Err(Error::input(
                    source,
                    Place::station(t).named("height"),
                    found,
                    expected,
                ));
            }
        }
        Ok(())
    }
}

/// What is asked for where height and banking are not known.
pub(super) fn level_road(what: &str) -> String {
    format!(
        "a level road: {what} would leave height and banking out; a TOML file of the road with `flat = true` does so knowingly"
    )
}

/// The cubic through four figures at even steps, `t` of the way from the second to the third (E. Catmull, R. Rom, *A class of local
/// interpolating splines*, 1974).
pub(super) fn cubic([a, b, c, d]: [f64; 4], t: f64) -> f64 {
    let (second, third) = (2.0 * a - 5.0 * b + 4.0 * c - d, 3.0 * (b - c) + d - a);
    b + 0.5 * t * (c - a + t * (second + t * third))
}

/// A smooth curve through `data` at knots (ascending; a closed curve has one more, where it repeats its start), at some places.
pub(crate) fn interpolated(knots: &[f64], data: &[f64], closed: bool, at: &[f64]) -> Vec<f64> {
    let curve = Spline::smoothing(knots, data, closed, 0.0);
    at.iter().map(|t| curve.at(*t).value).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{Smoothing, Survey, SurveyOptions};
    use std::f64::consts::TAU;
    use std::fmt::Write as _;
    use std::path::Path;

    /// A circle of 100 m in the racetrack database's format, with these columns after: their header, and their cells by angle.
    fn circle(header: &str, cells: impl Fn(f64) -> String, repeat: Option<&str>) -> String {
        let mut text = format!("# x_m,y_m,w_tr_right_m,w_tr_left_m{header}\n");
        for i in 0..120 {
            let angle = TAU * f64::from(i) / 120.0;
            let (sin, cos) = angle.sin_cos();
            let _ = writeln!(text, "{},{},5,5{}", 100.0 * cos, 100.0 * sin, cells(angle));
        }
        if let Some(cells) = repeat {
            let _ = writeln!(text, "100,0,5,5{cells}");
        }
        text
    }

    fn survey(text: &str) -> crate::Result<Survey> {
        Survey::parse(
            text.as_bytes(),
            Path::new("circle.csv"),
            &SurveyOptions::default(),
        )
    }

    #[test]
    fn height_and_banking_come_through_to_the_cross_sections() {
        let height = |angle: f64| 5.0 * angle.sin();
        let text = circle(",z_m,bank_deg", |angle| format!(",{},-6", height(angle)), None);
        let reference = survey(&text).unwrap().smoothed(&Smoothing::default()).unwrap();
        let (circuit, _) = reference.circuit().unwrap();
        let facts = circuit.relief_facts().unwrap();
        assert!((facts.climb_m - 10.0).abs() < 0.2, "{facts:?}");
        assert!((facts.range_m - 10.0).abs() < 0.2 && (facts.gradient - 0.05).abs() < 2e-3);
        assert!((facts.bank_rad.to_degrees() - 6.0).abs() < 0.5);
        assert!(circuit.relief.as_ref().unwrap().change.height_m <= 0.5);
        let road = circuit.cross_sections(100).unwrap();
        // The inside of a left-hander lies on the left: with its right side up it is lower there.
        let right = road.relief_of(&road.right_m).unwrap();
        let left = road.relief_of(&road.left_m).unwrap();
        for i in 0..100 {
            let fall = right[i][0] - left[i][0];
            assert!(
                (fall - 10.0 * right[i][1].abs().tan()).abs() < 1e-9 && fall > 0.9,
                "{fall}"
            );
        }
        // Narrower for a car, and along a line: the planes stay where they are.
        let narrow = road.narrowed(2.0).unwrap();
        let middle = narrow.relief_of(&narrow.points(&[0.5; 100])).unwrap();
        let along = road.relief_along(&narrow.points(&[0.5; 100])).unwrap();
        for (own, found) in middle.iter().zip(&along) {
            assert!((own[0] - found[0]).abs() < 1e-6, "{own:?} {found:?}");
        }
        let stretch = road.stretch(90, 20).unwrap();
        assert_eq!(
            stretch.relief.as_ref().unwrap().z_m[15],
            road.relief.as_ref().unwrap().z_m[5]
        );
        assert!(road.level_only("this").is_err() && stretch.level_only("this").is_err());
    }

    #[test]
    fn a_level_road_has_no_relief() {
        let plain = survey(&circle("", |_| String::new(), None)).unwrap();
        let level = survey(&circle(",z_m,bank_deg", |_| ",12,0".to_owned(), None)).unwrap();
        let cut = |survey: &Survey| {
            let road = survey.smoothed(&Smoothing::default()).unwrap();
            (road.circuit().unwrap(), road.cross_sections(60).unwrap())
        };
        assert_eq!(cut(&plain), cut(&level));
        let flat = SurveyOptions {
            flat: true,
            ..SurveyOptions::default()
        };
        let text = circle(",z_m", |angle| format!(",{}", angle.sin()), None);
        let asked = Survey::parse(text.as_bytes(), Path::new("circle.csv"), &flat).unwrap();
        assert_eq!(cut(&plain), cut(&asked));
    }

    #[test]
    fn a_gap_in_height_is_spread_or_refused() {
        // It drifts by 2 m in the lap, where the repeated point says so, and where the first point alone does.
        let drift = |angle: f64| format!(",{}", 5.0 * angle.sin() + 2.0 * angle / TAU);
        for repeat in [Some(",2"), None] {
            let survey = survey(&circle(",z_m", drift, repeat)).unwrap();
            assert_eq!(survey.z_m.len(), 120);
            // The repeated point says what it is. Without it, a fall at a gradient of a third is a gap, as large as the step is high.
            let last = TAU * 119.0 / 120.0;
            let wanted = if repeat.is_some() {
                2.0
            } else {
                5.0 * last.sin() + 2.0 * last / TAU
            };
            assert!((survey.height_gap_m - wanted).abs() < 1e-9);
            let reference = survey.smoothed(&Smoothing::default()).unwrap();
            let (circuit, _) = reference.circuit().unwrap();
            assert_eq!(circuit.relief.unwrap().change.gap_m, survey.height_gap_m);
        }
        let broken = |angle: f64| format!(",{}", 40.0 * angle / TAU);
        let error = survey(&circle(",z_m", broken, Some(",40")))
            .unwrap_err()
            .to_string();
        assert!(error.contains("an end 40.0 m above the start"), "{error}");
        // A step of 3 m from the last point to the first is no slope, but a gap.
        let step = |angle: f64| format!(",{}", 3.0 * angle / TAU);
        let found = survey(&circle(",z_m", step, None)).unwrap();
        assert!((found.height_gap_m - 3.0 * 119.0 / 120.0).abs() < 1e-9);
    }

    #[test]
    fn what_no_road_can_be_is_refused_by_name() {
        for (text, wanted) in [
            (
                circle(",bank_deg", |_| ",50".to_owned(), None),
                "a number from -40 to 40",
            ),
            (circle(",z_m", |_| ",high".to_owned(), None), "column 5 (z_m)"),
        ] {
            let error = survey(&text).unwrap_err().to_string();
            assert!(error.contains(wanted), "{error}");
        }
        let steep = circle(",z_m", |angle| format!(",{}", 80.0 * angle.cos()), None);
        let error = survey(&steep)
            .unwrap()
            .smoothed(&Smoothing::default())
            .unwrap_err();
        assert!(error.to_string().contains("a gradient of"), "{error}");
        let edges = "left_x_m,left_y_m,right_x_m,right_y_m,z_m\n0,0,0,-8,1\n";
        assert!(
            survey(edges)
                .unwrap_err()
                .to_string()
                .contains("beside two edges")
        );
    }

    #[test]
    fn heights_of_gpx_and_kml_are_read_where_all_points_have_one() {
        let point = |i: i32, height: Option<f64>| {
            let (sin, cos) = (TAU * f64::from(i) / 100.0).sin_cos();
            let ele = height.map_or(String::new(), |z| format!("<ele>{z}</ele>"));
            let (latitude, longitude) = (50.0 + 1e-3 * sin, 7.0 + 1.5e-3 * cos);
            format!("<trkpt lat=\"{latitude}\" lon=\"{longitude}\">{ele}</trkpt>")
        };
        let wide = SurveyOptions {
            width_m: Some(10.0),
            ..SurveyOptions::default()
        };
        let gpx = |height: &dyn Fn(i32) -> Option<f64>| {
            let points: String = (0..100).map(|i| point(i, height(i))).collect();
            let text = format!("<gpx><trk><trkseg>{points}</trkseg></trk></gpx>");
            Survey::parse(text.as_bytes(), Path::new("a.gpx"), &wide).unwrap()
        };
        let all = gpx(&|i| Some(200.0 + f64::from(i % 3)));
        assert_eq!((all.z_m.len(), all.z_m[1]), (100, 201.0));
        assert!(gpx(&|i| (i != 40).then_some(200.0)).z_m.is_empty());
        let points: Vec<String> = (0..100)
            .map(|i| {
                let (sin, cos) = (TAU * f64::from(i) / 100.0).sin_cos();
                format!("{},{},{}", 7.0 + 1.5e-3 * cos, 50.0 + 1e-3 * sin, 300 + i % 2)
            })
            .collect();
        let kml = format!(
            "<kml><LineString><coordinates>{}</coordinates></LineString></kml>",
            points.join(" ")
        );
        let kml = Survey::parse(kml.as_bytes(), Path::new("a.kml"), &wide).unwrap();
        assert_eq!(kml.z_m[1], 301.0);
    }
}
