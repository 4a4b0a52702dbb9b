//! A line that was looked for sector by sector: what each is long, and the links between them.

use crate::Result;
use crate::report::{HtmlReport, Table};
use crate::study::raceline::{RacelineSettings, ReportedLine, Setup};
use serde::{Deserialize, Serialize};

/// A sector of a line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SectorFigures {
    /// Its cross-sections, which follow those of the sector before.
    pub sections: usize,
    /// Length from its first cross-section to its last (m).
    pub length_m: f64,
    /// Length from its last cross-section to the first of the next sector (m).
    pub link_m: f64,
}

/// The sectors of a line; none where it was looked for at once.
pub(super) fn of(settings: &RacelineSettings, setup: &Setup, line: &ReportedLine) -> Vec<SectorFigures> {
    if settings.sectors == 1 {
        return Vec::new();
    }
    let points = setup.cross_sections.points(&line.alpha);
    let n = points.len();
    let step_m = |i: usize| match i + 1 {
        next if next < n => points[i].distance(points[next]),
        _ if setup.cross_sections.closed => points[i].distance(points[0]),
        _ => 0.0,
    };
    let sector = |number: usize| {
        let sector = setup.cross_sections.sector(number, settings.sectors);
        SectorFigures {
            sections: sector.len(),
            link_m: step_m(sector.end - 1),
            length_m: (sector.start..sector.end - 1).map(step_m).sum(),
        }
    };
    (0..settings.sectors).map(sector).collect()
}

/// Lengths of all sectors, and of all links between them (m); none where the line was looked for at once.
pub fn lengths_m(sectors: &[SectorFigures]) -> Option<[f64; 2]> {
    let sum = |of: fn(&SectorFigures) -> f64| sectors.iter().map(of).sum();
    (!sectors.is_empty()).then(|| [sum(|s| s.length_m), sum(|s| s.link_m)])
}

/// In words.
pub(super) fn words(sectors: &[SectorFigures]) -> Option<String> {
    let [within_m, links_m] = lengths_m(sectors)?;
    Some(format!(
        "In {} sectors, each from where the one before ends: {within_m:.2} m within them, {links_m:.2} m of links between them, {:.2} \
         m in all",
        sectors.len(),
        within_m + links_m
    ))
}

/// Places their table on a page.
///
/// # Errors
/// Those of a table.
pub(super) fn place(page: &mut HtmlReport, sectors: &[SectorFigures]) -> Result<()> {
    let Some(words) = words(sectors) else {
        return Ok(());
    };
    page.section("Sectors", &format!("{words}."));
    let numbered: Vec<(usize, &SectorFigures)> = (1..).zip(sectors).collect();
    let table = Table::rows(numbered)
        .number("sector", "", |(number, _)| *number as f64)
        .number("cross-sections", "", |(_, s)| s.sections as f64)
        .number("length", "m", |(_, s)| s.length_m)
        .number("link to the next", "m", |(_, s)| s.link_m)
        .table();
    page.table("Sector by sector", "", &table)
}
