//! Circuits, cross-sections and lines in the format of the racetrack database (TU Munich): `x_m,y_m,w_tr_right_m,w_tr_left_m`.

use super::circuit::Circuit;
use super::cross_sections::CrossSections;
use super::friction::FRICTION_NAMES;
use super::relief::SurfaceAcross;
use crate::files::write_new;
use crate::{Error, Result};
use glam::DVec2;
use std::fmt::Write as _;
use std::path::Path;

/// Points (m) with their distances to the right and the left edge (m) in the racetrack database's format, to the micrometre. On a
/// road that is not level and dry `relief` has the surface about each: height and banking follow in columns of their own, and where it
/// is not 1 everywhere the friction, at both edges or from edge to edge.
pub fn racetrack_csv(
    rows: impl Iterator<Item = (DVec2, f64, f64)>,
    relief: Option<&[SurfaceAcross]>,
) -> String {
    let mut text = "# x_m,y_m,w_tr_right_m,w_tr_left_m".to_owned();
    if relief.is_some() {
        text += ",z_m,bank_deg";
    }
    let frictions = || relief.iter().copied().flatten().map(|surface| surface.friction);
    let wet = frictions().any(|friction| !friction.is_dry());
    let steps = if frictions().all(|friction| friction.is_linear()) {
        FRICTION_NAMES.len() - 1
    } else {
        1
    };
    if wet {
        for name in FRICTION_NAMES.iter().step_by(steps) {
            text += ",";
            text += name;
        }
    }
    text += "\n";
    for (i, (point, right_m, left_m)) in rows.enumerate() {
        // Writing to a string cannot fail.
        let _ = write!(text, "{:.6},{:.6},{right_m:.6},{left_m:.6}", point.x, point.y);
        if let Some(surface) = relief.and_then(|relief| relief.get(i)) {
            let _ = write!(text, ",{:.6},{:.6}", surface.z_m, surface.bank_rad.to_degrees());
            let last = (FRICTION_NAMES.len() - 1) as f64;
            for k in (0..FRICTION_NAMES.len()).step_by(steps).filter(|_| wet) {
                let at_m = k as f64 / last * (left_m + right_m) - right_m;
                let _ = write!(text, ",{:.6}", surface.friction.at(at_m)[0]);
            }
        }
        text += "\n";
    }
    text
}

impl Circuit {
    /// The centreline's samples and widths in the racetrack database's format.
    pub fn to_racetrack_csv(&self) -> String {
        let widths = self.width_right_m.iter().zip(&self.width_left_m);
        let points = self.centreline_m.iter().zip(widths);
        let relief = self
            .relief
            .as_ref()
            .map(|relief| relief.surfaces().collect::<Vec<_>>());
        racetrack_csv(
            points.map(|(&point, (&right, &left))| (point, right, left)),
            relief.as_deref(),
        )
    }

    /// Writes [`Circuit::to_racetrack_csv`] to a new file.
    ///
    /// # Errors
    /// [`Error::Io`] when the file is there already or cannot be written.
    pub fn write_racetrack(&self, path: impl AsRef<Path>) -> Result<()> {
        write_new(path, self.to_racetrack_csv().as_bytes())
    }
}

impl CrossSections {
    /// The middles of the cross-sections and half their widths in the racetrack database's format.
    pub fn to_racetrack_csv(&self) -> String {
        self.line_to_racetrack_csv(&vec![0.5; self.len()])
    }

    /// A line in the racetrack database's format, with its distances to both edges along the cross-sections; `alpha` has a value
    /// for every cross-section.
    pub fn line_to_racetrack_csv(&self, alpha: &[f64]) -> String {
        let points = self.points(alpha);
        let ends = self.right_m.iter().zip(&self.left_m);
        let rows = points.iter().zip(ends);
        racetrack_csv(
            rows.map(|(&point, (&right, &left))| (point, point.distance(right), point.distance(left))),
            self.relief_across_of(&points).as_deref(),
        )
    }

    /// Writes [`CrossSections::to_racetrack_csv`] to a new file.
    ///
    /// # Errors
    /// [`Error::Io`] when the file is there already or cannot be written.
    pub fn write_racetrack(&self, path: impl AsRef<Path>) -> Result<()> {
        write_new(path, self.to_racetrack_csv().as_bytes())
    }

    /// Writes [`CrossSections::line_to_racetrack_csv`] to a new file.
    ///
    /// # Errors
    /// [`Error::Input`] when there are not as many values as cross-sections; [`Error::Io`] when the file is there already or
    /// cannot be written.
    pub fn write_racetrack_line(&self, alpha: &[f64], path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        if alpha.len() != self.len() {
            let found = format!("{} values", alpha.len());
            return Err(Error::input(
                path,
                "line",
                found,
                format!("{}, one per cross-section", self.len()),
            ));
        }
        write_new(path, self.line_to_racetrack_csv(alpha).as_bytes())
    }
}
