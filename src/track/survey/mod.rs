//! Surveyed roads: a line of centre points with the distances to both edges, and where such lines come from.
//!
//! [`Survey::read`] takes, by content:
//! - the racetrack database's CSV, `x_m,y_m,w_tr_right_m,w_tr_left_m` (TU Munich; the header may be a comment);
//! - a centreline, `x_m,y_m`, with a `width_m` column or a width in [`SurveyOptions`];
//! - both edges, `left_x_m,left_y_m,right_x_m,right_y_m`: the edges may have different numbers of points, the cells of
//!   the shorter one being left empty, and run in the direction of driving;
//! - latitudes and longitudes (`latitude_deg,longitude_deg` or shorter names), with widths as above;
//! - GPX (`trk` or `rte`) and KML (`LineString`, `LinearRing` or `gx:Track`);
//! - a telemetry log with GPS, of which one lap becomes the line.
//!
//! Tables of lines may have a height, `z_m`, a banking, `bank_deg`, and a friction as a share of what the car's tyres have (1 where it is
//! dry): `friction`, or `friction_left` and `friction_right`, or these and `friction_25`, `friction_50` and `friction_75` at so many
//! percent of the width from the right edge. GPX and KML have heights where all their points do.
//!
//! Geographic coordinates are projected onto the plane that touches the WGS 84 ellipsoid at the middle of the line.

mod boundaries;
mod check;
mod csv_columns;
mod driven;
#[cfg(test)]
mod fuzz;
mod geographic;
#[cfg(test)]
mod tests;
mod xml;

use super::circuit::{Corner, Section};
use super::friction::FRICTION_PLACES;
use super::relief::Given;
use crate::config::{read_bytes, with_commas};
use crate::{Error, Place, Result};
use glam::DVec2;
use std::path::Path;

/// The most points that are read.
pub(super) const MOST_POINTS: usize = 1_000_000;
/// The largest file that is read (bytes).
const LARGEST_FILE: u64 = 1 << 30;
/// The widest distance of an edge from the line (m).
const WIDEST_M: f64 = 200.0;

/// Options for what a file does not say, or says ambiguously.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurveyOptions {
    /// Whether the end joins the start; `None` to decide by the gap between them.
    pub closed: Option<bool>,
    /// Width of the whole road (m), half on each side of the line, where the file has no widths.
    pub width_m: Option<f64>,
    /// The lap of a telemetry log; `None` for the first complete one.
    pub lap: Option<u32>,
    /// How many times the line may cross itself, as at the bridge of a figure of eight.
    pub bridges: usize,
    /// Whether height, banking and friction are left out.
    pub flat: bool,
}

/// A surveyed line with the distances to both edges of the road.
#[derive(Clone, Debug, PartialEq)]
pub struct Survey {
    /// Name for titles.
    pub name: String,
    /// The file, for error messages.
    pub source: String,
    /// Whether the end joins the start, which is not repeated.
    pub closed: bool,
    /// Points of the line (m), in the direction of driving.
    pub centre_m: Vec<DVec2>,
    /// Distance from each point to the left edge (m).
    pub left_m: Vec<f64>,
    /// Distance from each point to the right edge (m).
    pub right_m: Vec<f64>,
    /// The line of the file that each point stands on, from 1; empty where points are no lines of a file.
    pub lines: Vec<usize>,
    /// Named stretches, by station along the smoothed line.
    pub sections: Vec<Section>,
    /// Named corners, by station along the smoothed line.
    pub corners: Vec<Corner>,
    /// Stretches where the DRS may be open, by station along the smoothed line, as a [`super::Circuit`] has them.
    pub drs_zones_m: Vec<[f64; 2]>,
    /// How many times the line may cross itself.
    pub bridges: usize,
    /// Height of the line at each point (m); empty where it is not known.
    pub z_m: Vec<f64>,
    /// Banking at each point (degrees about the direction of driving, the left side up); empty where it is not known.
    pub bank_deg: Vec<f64>,
    /// Friction from the right edge to the left beside each point, as [`FrictionAcross::of`](super::FrictionAcross::of); empty where it
    /// is not known.
    pub friction: Vec<[f64; FRICTION_PLACES]>,
    /// Gap in height between end and start of a closed line, which is spread over its length already (m).
    pub height_gap_m: f64,
}

/// A line as read: points of a plane or of the globe, with the widths that the file gives.
#[derive(Default)]
struct Raw {
    points: Vec<DVec2>,
    lines: Vec<usize>,
    /// Left and right widths, as many as points, or none.
    widths: Option<(Vec<f64>, Vec<f64>)>,
    /// Heights (m) and banking (degrees), as many as points, or none.
    z_m: Vec<f64>,
    bank_deg: Vec<f64>,
    /// Friction from the right edge to the left, likewise.
    friction: Vec<[f64; FRICTION_PLACES]>,
    name: Option<String>,
}

impl Survey {
    /// Reads a survey; see the module's text for the formats.
    ///
    /// # Errors
    /// [`Error::Io`] when the file cannot be read; [`Error::Input`], naming the line or point, when it holds no road.
    pub fn read(path: impl AsRef<Path>, options: &SurveyOptions) -> Result<Self> {
        let path = path.as_ref();
        Self::parse(&read_bytes(path, LARGEST_FILE)?, path, options)
    }

    /// Reads a survey from memory; `path` is its name in error messages.
    ///
    /// # Errors
    /// As for [`Survey::read`].
    pub fn parse(bytes: &[u8], path: impl AsRef<Path>, options: &SurveyOptions) -> Result<Self> {
        let path = path.as_ref();
        check_options(path, options)?;
        if driven::is_log(bytes, path) {
            return assemble(driven::read(bytes, path, options)?, path, options);
        }
        let text = String::from_utf8_lossy(bytes);
        let text = text.trim_start_matches('\u{feff}');
        let raw = if text.trim_start().starts_with('<') {
            xml::read(text, path)?
        } else {
            match csv_columns::read(&with_commas(text), path)? {
                csv_columns::Content::Line(raw) => raw,
                csv_columns::Content::Edges { left, right } => {
                    return boundaries::survey(&left, &right, path, options);
                }
            }
        };
        assemble(raw, path, options)
    }

    /// Where a point stands, for error messages.
    pub(super) fn place(&self, point: usize) -> Place {
        place(&self.lines, point)
    }
}

fn place(lines: &[usize], point: usize) -> Place {
    match lines.get(point) {
        Some(&line) => Place::line(line),
        None => Place::point(point + 1),
    }
}

fn check_options(path: &Path, options: &SurveyOptions) -> Result<()> {
    match options.width_m {
        Some(width) if !(width > 0.0 && width <= 2.0 * WIDEST_M) => Err(Error::input(
            path,
            "width_m",
            width.to_string(),
            format!("more than 0 and at most {} m", 2.0 * WIDEST_M),
        )),
        _ => Ok(()),
    }
}

fn stem(path: &Path) -> String {
    path.file_stem()
        .map_or_else(|| "survey".to_owned(), |s| s.to_string_lossy().into_owned())
}

/// Closes the line or leaves it open, adds widths and checks the whole.
fn assemble(mut raw: Raw, path: &Path, options: &SurveyOptions) -> Result<Survey> {
    if options.flat {
        raw.z_m.clear();
        raw.bank_deg.clear();
        raw.friction.clear();
    }
    let closed = check::close(&mut raw.points, &raw.lines, path, options.closed)?;
    let n = raw.points.len();
    let (mut left_m, mut right_m) = match (raw.widths, options.width_m) {
        (Some(widths), _) => widths,
        (None, Some(width)) => (vec![0.5 * width; n], vec![0.5 * width; n]),
        (None, None) => {
            return Err(Error::input(
                path,
                "width of the road",
                "none in the file",
                "columns w_tr_right_m and w_tr_left_m, or a TOML file with `survey` (this file) and `width_m`",
            ));
        }
    };
    // The repeated first point of a closed line was dropped, so its widths are dropped too.
    left_m.truncate(n);
    right_m.truncate(n);
    raw.lines.truncate(n);
    raw.bank_deg.truncate(n);
    raw.friction.truncate(n);
    let mut heights = Given {
        z_m: raw.z_m,
        ..Given::default()
    };
    if closed {
        let mut station_m = vec![0.0];
        for i in 1..=n {
            station_m.push(station_m[i - 1] + raw.points[i % n].distance(raw.points[i - 1]));
        }
        heights.close(&path.display().to_string(), n, &station_m, station_m[n])?;
    }
    let survey = Survey {
        name: raw.name.unwrap_or_else(|| stem(path)),
        source: path.display().to_string(),
        closed,
        centre_m: raw.points,
        left_m,
        right_m,
        lines: raw.lines,
        sections: Vec::new(),
        corners: Vec::new(),
        drs_zones_m: Vec::new(),
        bridges: options.bridges,
        z_m: heights.z_m,
        bank_deg: raw.bank_deg,
        friction: raw.friction,
        height_gap_m: heights.gap_m,
    };
    survey.check()?;
    Ok(survey)
}
