//! Pictures (SVG), tables and interactive pages of what a study found.
//!
//! A [`Figure`] and a [`Table`] are stated once, of plain numbers. A figure is written as an SVG file and placed on a page by
//! the same value; a table is written as CSV or Parquet, printed, and placed on a page. Files are written whole or not at
//! all. Numbers that are not finite are gaps in a curve; a figure without anything to draw is refused.

mod axis;
mod bars;
mod canvas;
pub mod compare;
mod corners;
mod curves;
mod figure;
mod html;
mod lap;
mod parameters;
mod pareto;
#[cfg(feature = "parquet")]
mod parquet;
mod site_map;
mod style;
mod surface;
mod table;
mod track_map;

pub use crate::files::write_whole;
pub use bars::{BarPanel, Bars};
pub use corners::{CornerLap, Stretch, corner_table};
pub use curves::{Curves, Panel, Scale};
pub use figure::Figure;
pub use html::HtmlReport;
pub use lap::{LapLine, LapView};
pub use parameters::{ParameterRow, Parameters};
pub use pareto::Front;
pub use site_map::SiteMap;
pub use style::{significant, with_unit};
pub use surface::{Levels, Surface};
pub use table::{Rows, Table};
pub use track_map::{Road, TrackMap};

#[cfg(test)]
mod tests;
