//! Circuits and other roads: centrelines with curvature, widths and named sections, and the cross-sections across them.
//!
//! A [`Circuit`] is built from a table of curvature against station ([`CurvatureTable`]), read from a file
//! ([`Circuit::load`]) or taken from the ones that come with the crate ([`Circuit::bundled`]). Curvature, heading and
//! position of a circuit agree with one another to rounding, so a car that follows the curvature follows the positions.
//!
//! A [`Survey`] is a line of points with widths, from a file of any of the usual formats. It becomes a smooth
//! [`ReferenceLine`], and that a circuit or the [`CrossSections`] that a racing line crosses. A [`Shape`] is a circuit
//! with known answers. [`Track::load`] opens a circuit, a survey or a shape by name.

mod checker;
mod circuit;
mod clothoid;
mod cross_sections;
mod crossing;
mod cutting;
mod export;
mod friction;
mod friction_map;
mod from_curvature;
mod load;
mod load_survey;
mod reference;
mod relief;
mod road;
mod shapes;
mod source;
mod spline;
mod survey;

pub use circuit::{Circuit, Corner, Projection, Section};
pub use cross_sections::CrossSections;
pub use export::racetrack_csv;
pub use friction::{FRICTION_PLACES, FrictionAcross};
pub use from_curvature::{Closure, CurvatureRow, CurvatureTable};
pub use load::BUNDLED;
pub use reference::{ReferenceLine, Smoothing};
pub(crate) use relief::interpolated;
pub use relief::{Relief, ReliefChange, ReliefFacts, SectionRelief, Surface, SurfaceAcross};
pub use shapes::Shape;
pub use source::Track;
pub use spline::Deviation;
pub use survey::{Survey, SurveyOptions};

#[cfg(test)]
mod relief_tests;
#[cfg(test)]
mod road_tests;
#[cfg(test)]
mod tests;
