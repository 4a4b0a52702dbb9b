//! Tracks by name or file.

use super::circuit::Circuit;
use super::cross_sections::CrossSections;
use super::load::CircuitSource;
use super::reference::Smoothing;
use super::shapes::Shape;
use super::survey::Survey;
use crate::Result;
use std::path::Path;

/// A track of any kind.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Track {
    /// Built from curvature: bundled, or a TOML file with a curvature table.
    Circuit(Circuit),
    /// Surveyed: a survey file, or a TOML file that names one and its smoothing.
    Survey(Survey, Smoothing),
    /// A simple shape.
    Shape(Shape),
}

impl Track {
    /// The track of this name: a bundled circuit, a shape such as `circle:590:600` (see [`Shape::parse`]), or a file:
    /// TOML (see [`Circuit::load`]) or a survey (see [`Survey::read`]).
    ///
    /// # Errors
    /// [`crate::Error::Io`] when a file cannot be read; [`crate::Error::Input`] when it holds no track or the name is
    /// not known.
    pub fn load(name_or_path: &str) -> Result<Self> {
        if let Some(shape) = Shape::parse(name_or_path) {
            return shape.map(Self::Shape);
        }
        let path = Path::new(name_or_path);
        if path.extension().is_some() || path.is_dir() {
            Self::read(name_or_path)
        } else {
            Circuit::bundled(name_or_path).map(Self::Circuit)
        }
    }

    /// The track of a file.
    ///
    /// # Errors
    /// As [`Track::load`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        Ok(match CircuitSource::read(path.as_ref())? {
            CircuitSource::Curvature(circuit, _) => Self::Circuit(circuit),
            CircuitSource::Survey(survey, smoothing) => Self::Survey(survey, smoothing),
        })
    }

    /// Name for titles.
    pub fn name(&self) -> String {
        match self {
            Self::Circuit(circuit) => circuit.name.clone(),
            Self::Survey(survey, _) => survey.name.clone(),
            Self::Shape(shape) => shape.name(),
        }
    }

    /// The circuit, surveys being smoothed.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the place where no road can be.
    pub fn circuit(&self) -> Result<Circuit> {
        match self {
            Self::Circuit(circuit) => Ok(circuit.clone()),
            Self::Survey(survey, smoothing) => Ok(survey.smoothed(smoothing)?.circuit()?.0),
            Self::Shape(shape) => shape.circuit(),
        }
    }

    /// Cross-sections across the track. A survey is smoothed first, unless `as_surveyed`.
    ///
    /// # Errors
    /// As [`Track::circuit`], and for a spacing out of range.
    pub fn cross_sections(&self, count: usize, as_surveyed: bool) -> Result<CrossSections> {
        match self {
            Self::Circuit(circuit) => circuit.cross_sections(count),
            Self::Survey(survey, _) if as_surveyed => survey.as_surveyed()?.cross_sections(count),
            Self::Survey(survey, smoothing) => survey.smoothed(smoothing)?.cross_sections(count),
            Self::Shape(shape) => shape.cross_sections(count),
        }
    }
}
