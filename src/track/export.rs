//! Circuits, cross-sections and lines in the format of the racetrack database (TU Munich): `x_m,y_m,w_tr_right_m,w_tr_left_m`.

use super::circuit::Circuit;
use super::cross_sections::CrossSections;
use super::relief::{Surface, beside};
use crate::files::write_new;
use crate::{Error, Result};
use glam::DVec2;
use std::fmt::Write as _;
use std::path::Path;

/// Points (m) with their distances to the right and the left edge (m) in the racetrack database's format, to the micrometre. On a
/// road that is not level and dry `relief` has the surface of each: height and banking follow in columns of their own, and the friction
/// at both edges where it is not 1 everywhere.
pub fn racetrack_csv(rows: impl Iterator<Item = (DVec2, f64, f64)>, relief: Option<&[Surface]>) -> String {
    let mut text = "# x_m,y_m,w_tr_right_m,w_tr_left_m".to_owned();
    if relief.is_some() {
        text += ",z_m,bank_deg";
    }
    let wet = relief
        .iter()
        .any(|surfaces| surfaces.iter().any(|s| [s[2], s[3]] != [1.0, 0.0]));
    if wet {
        text += ",friction_left,friction_right";
    }
    text += "\n";
    for (i, (point, right_m, left_m)) in rows.enumerate() {
        // Writing to a string cannot fail.
        let _ = write!(text, "{:.6},{:.6},{right_m:.6},{left_m:.6}", point.x, point.y);
        if let Some(surface) = relief.and_then(|relief| relief.get(i)) {
            let [z_m, bank_rad, ..] = surface;
            let _ = write!(text, ",{z_m:.6},{:.6}", bank_rad.to_degrees());
            if wet {
                let [at_left, at_right] = [left_m, -right_m].map(|at| beside(*surface, at)[2]);
                let _ = write!(text, ",{at_left:.6},{at_right:.6}");
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
            self.relief_of(&points).as_deref(),
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
