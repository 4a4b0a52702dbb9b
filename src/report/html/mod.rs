//! A study's report as one page: words first, then charts that can be hovered, zoomed and linked, tables that sort, and
//! at the end what it takes to repeat the run.
//!
//! The page opens from disk and loads nothing: its content security policy forbids it to. Charts are drawn by Apache
//! ECharts, which stands in the page with the data; words and tables read without any script. All text is escaped, in
//! HTML and in JSON alike: names of channels, cars and tracks come from files.

mod escape;
mod page;
pub(super) mod thin;

pub(super) use escape::{Numbers, raised};

use super::table::{Cells, Column, plain_digits};
use super::{CornerLap, Figure, Table, corner_table};
use crate::files::write_whole;
use crate::{Error, Result};
use escape::{html, json_in_script, prose};
use serde_json::Value;
use std::path::Path;

/// The page of a run, filled from the top.
///
/// ```
/// use lapswarm::report::{HtmlReport, Table};
///
/// let mut page = HtmlReport::new("raceline", "Silverstone with the GT car");
/// page.sentence("The fastest line takes 114.29 s.");
/// page.tile("Lap time", "114.29", "s");
/// page.table("Lines", "", &Table::new().numbers("lap time", "s", vec![114.29, 122.31]))?;
/// page.provenance("seed", "1");
/// let folder = std::env::temp_dir();
/// page.write(folder.join("lapswarm-doc-report.html"))?;
/// # Ok::<(), lapswarm::Error>(())
/// ```
#[derive(Default)]
pub struct HtmlReport {
    study: String,
    title: String,
    sentences: Vec<String>,
    tiles: Vec<[String; 3]>,
    warnings: Vec<String>,
    body: Vec<Block>,
    charts: Vec<Value>,
    sections: Vec<String>,
    provenance: Vec<[String; 2]>,
    settings: Vec<[String; 2]>,
}

/// A piece of the body as HTML, charts being places for the script to draw in.
struct Block {
    html: String,
    /// Whether two of them stand beside each other.
    half: bool,
}

impl HtmlReport {
    /// A page with nothing in it; `study` as on the command line.
    pub fn new(study: &str, title: &str) -> Self {
        Self {
            study: study.to_owned(),
            title: title.to_owned(),
            ..Self::default()
        }
    }

    /// A sentence of the summary.
    pub fn sentence(&mut self, text: impl Into<String>) {
        self.sentences.push(text.into());
    }

    /// A headline figure; `unit` may be empty.
    pub fn tile(&mut self, label: &str, value: impl Into<String>, unit: &str) {
        self.tiles.push([label.to_owned(), value.into(), unit.to_owned()]);
    }

    /// What a reader must know before believing the figures.
    pub fn warning(&mut self, text: impl Into<String>) {
        self.warnings.push(text.into());
    }

    /// Warnings, and that the run did not come to its end if it was `interrupted`.
    pub fn warnings(&mut self, warnings: &[String], interrupted: bool) {
        self.warnings.extend_from_slice(warnings);
        if interrupted {
            self.warning("The run was interrupted. These are the results that it had reached.");
        }
    }

    /// A heading, and what is to be seen under it; `text` may be empty.
    pub fn section(&mut self, title: &str, text: &str) {
        let number = self.sections.len();
        self.sections.push(title.to_owned());
        self.push(format!("<h2 id=\"section-{number}\">{}</h2>\n", html(title)));
        self.paragraph(text);
    }

    /// A paragraph between charts.
    pub fn paragraph(&mut self, text: &str) {
        if !text.is_empty() {
            self.push(format!("<p>{}</p>\n", prose(text)));
        }
    }

    /// Links to pages in folders within the page's own, as in `2_envelope` for `2_envelope/report.html`.
    pub fn reports_within(&mut self, folders: &[String]) {
        // Names that need no escape in an address: those that studies give.
        let plain = |f: &&String| f.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        let links: Vec<String> = folders
            .iter()
            .filter(plain)
            .map(|f| format!("<a href=\"{f}/report.html\">{}</a>", f.replace('_', " ")))
            .collect();
        self.push(format!("<p>{}</p>\n", links.join(" \u{b7} ")));
    }

    fn push(&mut self, html: String) {
        self.body.push(Block { html, half: false });
    }

    /// A table that sorts by any of its columns; `note` may be empty.
    ///
    /// # Errors
    /// [`Error::Input`] when the columns differ in length.
    pub fn table(&mut self, title: &str, note: &str, columns: &Table<'_>) -> Result<()> {
        let table = table(title, note, columns)?;
        self.push(table);
        Ok(())
    }

    /// The same, folded away until a reader asks for it.
    ///
    /// # Errors
    /// [`Error::Input`] when the columns differ in length.
    pub fn folded_table(&mut self, title: &str, note: &str, columns: &Table<'_>) -> Result<()> {
        let table = table(title, note, columns)?;
        self.push(format!(
            "<details><summary>{}</summary>{table}</details>\n",
            html(title)
        ));
        Ok(())
    }

    /// Laps by corner and by sector, the first of them against the others; nothing without a lap.
    ///
    /// # Errors
    /// As [`HtmlReport::table`].
    pub fn corners(&mut self, laps: &[CornerLap<'_>], sections: &[(String, f64, f64)]) -> Result<()> {
        let Some(first) = laps.first() else {
            return Ok(());
        };
        let note = "A corner is where the first lap holds more than a third of its lateral acceleration: entry and exit are its ends.";
        let corners = first.corners(sections);
        if !corners.is_empty() {
            self.table("By corner", note, &corner_table(laps, &corners))?;
        }
        self.table(
            "By sector",
            "Thirds of the lap.",
            &corner_table(laps, &first.sectors()),
        )
    }

    /// A figure as charts.
    ///
    /// # Errors
    /// [`Error::Input`] when it cannot be drawn.
    pub fn place(&mut self, figure: &impl Figure) -> Result<()> {
        figure.place(self)
    }

    /// A figure as charts, and the same as an SVG file.
    ///
    /// # Errors
    /// [`Error::Input`] when it cannot be drawn, [`Error::Io`] when the file cannot be written.
    pub fn figure(&mut self, svg: impl AsRef<Path>, figure: &impl Figure) -> Result<()> {
        figure.write_svg(svg.as_ref())?;
        figure.place(self)
    }

    /// A chart as the page's script reads it.
    pub(super) fn chart(&mut self, title: &str, note: &str, chart: Value) {
        let number = self.charts.len();
        let half = chart["kind"] == "curves" || chart["kind"] == "bars";
        let html = format!(
            "<figure><figcaption>{}</figcaption><div class=\"chart\" data-chart=\"{number}\"></div>{}</figure>\n",
            html(title),
            noted(note)
        );
        self.body.push(Block { html, half });
        self.charts.push(chart);
    }

    /// What the run was made with, as in `seed` and `1`; empty values are left out.
    pub fn provenance(&mut self, what: &str, value: impl Into<String>) {
        let value = value.into();
        if !value.is_empty() {
            self.provenance.push([what.to_owned(), value]);
        }
    }

    /// What the run was made with, several values at once.
    pub fn facts(&mut self, facts: &[(&str, &dyn std::fmt::Display)]) {
        for (what, value) in facts {
            self.provenance(what, value.to_string());
        }
    }

    /// A file that repeats the run, shown at the end.
    pub fn settings(&mut self, name: &str, contents: impl Into<String>) {
        self.settings.push([name.to_owned(), contents.into()]);
    }

    /// The page.
    ///
    /// # Errors
    /// [`Error::Io`] when the data cannot be written as JSON.
    pub fn to_html(&self) -> Result<String> {
        let json = serde_json::to_string(&self.charts)
            .map_err(|e| Error::io("report.html", "write", std::io::Error::other(e)))?;
        Ok(page::assemble(self, &json_in_script(&json)))
    }

    /// Writes the page, whole or not at all.
    ///
    /// # Errors
    /// [`Error::Io`] when the file cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        write_whole(path, self.to_html()?.as_bytes())
    }
}

/// An error of a figure that no page can hold.
pub(super) fn refused<T>(title: &str, found: &str, expected: &str) -> Result<T> {
    Err(Error::input(Path::new("report.html"), title, found, expected))
}

fn table(title: &str, note: &str, table: &Table<'_>) -> Result<String> {
    let columns = &table.columns;
    let rows = columns.first().map_or(0, Column::len);
    if columns.iter().any(|c| c.len() != rows) {
        return refused(title, "columns that differ", "columns of one length");
    }
    let class = |c: &Column<'_>| match &c.cells {
        Cells::Numbers(_) => " class=\"number\"",
        Cells::Texts(_) => "",
    };
    let mut text = format!(
        "<div class=\"table\"><table>\n<caption>{}</caption>\n<thead><tr>",
        html(title)
    );
    for c in columns {
        let unit = match c.unit.as_str() {
            "" => String::new(),
            unit => format!(" <span class=\"unit\">{}</span>", html(&raised(unit))),
        };
        text += &format!("<th scope=\"col\"{}>{}{unit}</th>", class(c), html(&c.name));
    }
    text += "</tr></thead>\n<tbody>\n";
    for row in 0..rows {
        text += "<tr>";
        for c in columns {
            match &c.cells {
                Cells::Numbers(x) if x[row].is_finite() => {
                    let shown = plain_digits(x[row]).replace('-', "\u{2212}");
                    text += &format!("<td class=\"number\" data-value=\"{}\">{shown}</td>", x[row]);
                }
                Cells::Numbers(_) => text += "<td class=\"number\">\u{2013}</td>",
                Cells::Texts(t) => text += &format!("<td>{}</td>", html(&t[row])),
            }
        }
        text += "</tr>\n";
    }
    text += &format!("</tbody></table></div>\n{}", noted(note));
    Ok(text)
}

fn noted(text: &str) -> String {
    if text.is_empty() {
        String::new()
    } else {
        format!("<p class=\"note\">{}</p>\n", prose(text))
    }
}

#[cfg(test)]
mod tests;
