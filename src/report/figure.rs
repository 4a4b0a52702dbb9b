//! What all figures have in common.

use super::HtmlReport;
use crate::Result;
use std::path::Path;

/// A figure, stated once: drawn to an SVG file and placed on a page from the same values.
pub trait Figure {
    /// Draws it to an SVG file, whole or not at all.
    ///
    /// # Errors
    /// [`crate::Error::Input`] when there is nothing to draw or lengths differ; [`crate::Error::Io`] when the file cannot
    /// be written.
    fn write_svg(&self, path: &Path) -> Result<()>;

    /// Places its charts on a page.
    ///
    /// # Errors
    /// [`crate::Error::Input`] when lengths differ.
    fn place(&self, page: &mut HtmlReport) -> Result<()>;
}
