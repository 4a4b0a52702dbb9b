//! A line that was looked for sector by sector: what each is long, and the links between them.

use crate::Result;
use crate::line::geometry;
use crate::report::{HtmlReport, Table};
use crate::study::raceline::{RacelineSettings, ReportedLine, Setup};
use glam::DVec2;
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
    /// Gamma between its first cross-section and its last (1/m), by true spacing.
    pub gamma_1pm: f64,
    /// What the right edge of the usable road has instead (`alpha` 0).
    pub right: SectorShape,
    /// What the middle of the road has (`alpha` 0.5).
    pub middle: SectorShape,
    /// What the left edge has (`alpha` 1).
    pub left: SectorShape,
}

/// The shape of a line within a sector.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SectorShape {
    /// Length from the first cross-section to the last (m).
    pub length_m: f64,
    /// Gamma between them (1/m), by true spacing.
    pub gamma_1pm: f64,
}

/// The sectors of a line; none where it was looked for at once.
pub(super) fn of(settings: &RacelineSettings, setup: &Setup, line: &ReportedLine) -> Vec<SectorFigures> {
    if settings.sectors == 1 {
        return Vec::new();
    }
    let road = &setup.cross_sections;
    let points = road.points(&line.alpha);
    let [right, middle, left] = [0.0, 0.5, 1.0].map(|alpha| road.points(&vec![alpha; road.len()]));
    let sector = |number: usize| {
        let sector = road.sector(number, settings.sectors);
        let shape = |points: &[DVec2]| {
            let shape = geometry(&points[sector.clone()], false);
            SectorShape {
                length_m: shape.length_m,
                gamma_1pm: shape.gamma_1pm,
            }
        };
        let own = shape(&points);
        let next = points.get(sector.end).or(points.first().filter(|_| road.closed));
        SectorFigures {
            sections: sector.len(),
            length_m: own.length_m,
            link_m: next.map_or(0.0, |next| points[sector.end - 1].distance(*next)),
            gamma_1pm: own.gamma_1pm,
            right: shape(&right),
            middle: shape(&middle),
            left: shape(&left),
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
        .number("Gamma", "1/m", |(_, s)| s.gamma_1pm)
        .number("length at the right edge", "m", |(_, s)| s.right.length_m)
        .number("length in the middle", "m", |(_, s)| s.middle.length_m)
        .number("length at the left edge", "m", |(_, s)| s.left.length_m)
        .number("Gamma at the right edge", "1/m", |(_, s)| s.right.gamma_1pm)
        .number("Gamma in the middle", "1/m", |(_, s)| s.middle.gamma_1pm)
        .number("Gamma at the left edge", "1/m", |(_, s)| s.left.gamma_1pm)
        .table();
    page.table("Sector by sector", "", &table)
}
