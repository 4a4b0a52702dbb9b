//! A study's report as one page: words first, then charts that can be hovered, zoomed and linked, tables that sort, and
//! at the end what it takes to repeat the run.
//!
//! The page opens from disk and loads nothing: its content security policy forbids it to. Charts are drawn by Apache
//! ECharts, which stands in the page with the data; words and tables read without any script. All text is escaped, in
//! HTML and in JSON alike: names of channels, cars and tracks come from files.

mod charts;
mod escape;
mod lap;
mod page;
mod thin;

pub use charts::{Front, Scale};
pub use lap::{LapLine, LapMap, LapPanel, LapTrace, LapView};

use super::table::{Cells, Column, plain_digits};
use super::{BarPanel, CurvePanel, ParameterRow, SurfaceFigure};
use crate::files::write_whole;
use crate::{Error, Result};
use charts::Chart;
use escape::{html, json_in_script, raised};
use std::path::Path;

/// The page of a run, filled from the top.
///
/// ```
/// use lapswarm::report::{Cells, Column, HtmlReport};
///
/// let mut page = HtmlReport::new("raceline", "Silverstone with the GT car");
/// page.sentence("The fastest line takes 114.29 s.");
/// page.tile("Lap time", "114.29", "s");
/// let times_s = [114.29, 122.31];
/// let column = Column { name: "lap time", unit: "s", cells: Cells::Numbers(&times_s) };
/// page.table("Lines", "", &[column])?;
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
    charts: Vec<Chart>,
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
            self.push(format!("<p>{}</p>\n", html(text)));
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
    pub fn table(&mut self, title: &str, note: &str, columns: &[Column<'_>]) -> Result<()> {
        let table = table(title, note, columns)?;
        self.push(table);
        Ok(())
    }

    /// The same, folded away until a reader asks for it.
    ///
    /// # Errors
    /// [`Error::Input`] when the columns differ in length.
    pub fn folded_table(&mut self, title: &str, note: &str, columns: &[Column<'_>]) -> Result<()> {
        let table = table(title, note, columns)?;
        self.push(format!(
            "<details><summary>{}</summary>{table}</details>\n",
            html(title)
        ));
        Ok(())
    }

    /// Traces of lines over a lap, linked with a map.
    ///
    /// # Errors
    /// [`Error::Input`] when a trace has another number of values than its line has places, or a panel that is not there.
    pub fn lap(&mut self, view: &LapView<'_>) -> Result<()> {
        let (data, thinned) = view.data()?;
        let mut note = view.note.to_owned();
        if let Some((kept, of)) = thinned {
            let stated = format!("Drawn are {kept} of up to {of} samples, chosen so that peaks stay.");
            note = [note, stated].join(" ").trim().to_owned();
        }
        self.chart(view.title, &note, Chart::Lap(data));
        Ok(())
    }

    /// Curves over a common quantity.
    ///
    /// # Errors
    /// [`Error::Input`] when a curve has another number of `y` than of `x`.
    pub fn curves(&mut self, panel: &CurvePanel<'_>, note: &str, scales: [Scale; 2]) -> Result<()> {
        let chart = Chart::curves(panel, scales)?;
        self.chart(panel.title, note, chart);
        Ok(())
    }

    /// Candidates by their objectives.
    ///
    /// # Errors
    /// [`Error::Input`] with fewer than two objectives, points with another number of values, or marks on no point.
    pub fn front(&mut self, front: &Front<'_>) -> Result<()> {
        let chart = Chart::front(front)?;
        self.chart(front.title, front.note, chart);
        Ok(())
    }

    /// Parameters within their bounds, with standard errors and the truth where known.
    pub fn parameters(&mut self, title: &str, note: &str, rows: &[ParameterRow<'_>]) {
        self.chart(title, note, Chart::parameters(rows));
    }

    /// A cost over two parameters, from above and in space. Colours go with the root of the cost above its least, which
    /// spreads a basin's bottom.
    ///
    /// # Errors
    /// [`Error::Input`] when there is not one value per pair, or none that is finite.
    pub fn surface(&mut self, figure: &SurfaceFigure<'_>, note: &str) -> Result<()> {
        let (chart, thinned) = Chart::surface(figure)?;
        let mut note = note.to_owned();
        if let Some((kept, of)) = thinned {
            note += &format!(" Drawn are {kept} of up to {of} values along a side.");
        }
        self.chart(figure.title, note.trim(), chart);
        Ok(())
    }

    /// Horizontal bars, with intervals where they are known.
    ///
    /// # Errors
    /// [`Error::Input`] when there is not one value per name.
    pub fn bars(&mut self, panel: &BarPanel<'_>, note: &str) -> Result<()> {
        let chart = Chart::bars(panel)?;
        self.chart(panel.title, note, chart);
        Ok(())
    }

    fn chart(&mut self, title: &str, note: &str, chart: Chart) {
        let number = self.charts.len();
        let half = matches!(chart, Chart::Curves { .. } | Chart::Bars { .. });
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

fn table(title: &str, note: &str, columns: &[Column<'_>]) -> Result<String> {
    let rows = columns.first().map_or(0, Column::len);
    if columns.iter().any(|c| c.len() != rows) {
        let expected = "columns of one length";
        return Err(Error::input(
            Path::new("report.html"),
            title,
            "columns that differ",
            expected,
        ));
    }
    let class = |c: &Column<'_>| match c.cells {
        Cells::Numbers(_) => " class=\"number\"",
        Cells::Texts(_) => "",
    };
    let mut text = format!(
        "<div class=\"table\"><table>\n<caption>{}</caption>\n<thead><tr>",
        html(title)
    );
    for c in columns {
        let unit = match c.unit {
            "" => String::new(),
            unit => format!(" <span class=\"unit\">{}</span>", html(&raised(unit))),
        };
        text += &format!("<th scope=\"col\"{}>{}{unit}</th>", class(c), html(c.name));
    }
    text += "</tr></thead>\n<tbody>\n";
    for row in 0..rows {
        text += "<tr>";
        for c in columns {
            match c.cells {
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
        format!("<p class=\"note\">{}</p>\n", html(text))
    }
}

#[cfg(test)]
mod tests;
