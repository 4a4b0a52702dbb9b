//! Pictures (SVG), tables and interactive pages of what a study found.
//!
//! Every function here takes plain numbers and writes one file, whole or not at all. Numbers that
//! are not finite are gaps in a curve; a figure without anything to draw is refused.

mod axis;
mod bars;
mod canvas;
mod convergence;
mod curves;
mod html;
mod parallel;
mod parameters;
mod pareto;
mod parquet;
mod quality;
mod scaling;
mod site_map;
mod style;
mod surface;
mod table;
mod traces;
mod track_map;

pub use self::parquet::write_parquet;
pub use crate::files::write_whole;
pub use bars::{BarPanel, BarSeries, plot_bars};
pub use convergence::{ConvergenceRun, plot_convergence};
pub use curves::{Curve, CurvePanel, plot_curves};
pub use html::{Front, HtmlReport, LapLine, LapMap, LapPanel, LapTrace, LapView, Scale};
pub use parallel::plot_parallel;
pub use parameters::{ParameterRow, plot_parameters};
pub use pareto::{Objective, plot_pareto};
pub use quality::{QualityPanel, QualityRun, plot_quality};
pub use scaling::{ScalingSeries, plot_scaling};
pub use site_map::{SiteMap, plot_site_map};
pub use style::significant;
pub use surface::{Levels, SurfaceFigure, plot_surface};
pub use table::{Cells, Column, text_table, write_csv};
pub use traces::{ShadedSection, TraceFigure, TracePanel, plot_traces};
pub use track_map::{TrackMap, plot_track_map};

#[cfg(test)]
mod tests;
