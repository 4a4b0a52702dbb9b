//! The report of a sweep: what the medians say, figure by figure.

use super::SweepSettings;
use super::results::{Group, Spread, Summary};
use crate::error::Result;
use crate::report::{BarPanel, Bars, HtmlReport, significant};
use std::path::Path;

/// Settings that bars are drawn of: more are a wall, and stand in the table.
const DRAWN: usize = 40;
/// Least of the figures as a share of the greatest, above which they are alike.
const ALIKE: f64 = 0.7;
/// Figures of which more is better; of all others but counts less is.
const MORE_IS_BETTER: [&str; 3] = ["hypervolume", "hypervolume_share", "front_size"];
/// Figures that say what a run took, and not how good it is.
const COUNTS: [&str; 1] = ["evaluations"];
/// What studies are judged by, the first of these that is there.
const VERDICTS: [&str; 5] = [
    "total_parameter_error",
    "swarm_total_parameter_error",
    "best_cost",
    "best_lap_time_s",
    "hypervolume",
];

/// What a group differs in, in words.
fn name_of(group: &Group) -> String {
    let told: Vec<String> = group.settings.iter().map(|(k, v)| format!("{k} {v}")).collect();
    if told.is_empty() {
        "all runs".to_owned()
    } else {
        told.join(", ")
    }
}

/// The groups that have a figure, the best first.
fn ranked<'a>(summary: &'a Summary, figure: &str) -> Vec<(&'a Group, Spread)> {
    let mut all: Vec<(&Group, Spread)> = summary
        .groups
        .iter()
        .filter_map(|g| Some((g, *g.figures.get(figure)?)))
        .collect();
    all.sort_by(|a, b| a.1.median.total_cmp(&b.1.median));
    if MORE_IS_BETTER.contains(&figure) {
        all.reverse();
    }
    all
}

/// The figures of any group, what the study is judged by first, counts last. One that is another under a second name, as the
/// swarm's error is where nothing is polished, is left out.
fn figures(summary: &Summary) -> Vec<&str> {
    let mut names: Vec<&str> = summary
        .groups
        .iter()
        .flat_map(|g| g.figures.keys().map(String::as_str))
        .collect();
    names.sort_unstable();
    names.dedup();
    let place = |name: &str| {
        if COUNTS.contains(&name) {
            return VERDICTS.len() + 1;
        }
        VERDICTS.iter().position(|v| *v == name).unwrap_or(VERDICTS.len())
    };
    names.sort_by_key(|name| place(name));
    let same = |a: &str, b: &str| {
        summary
            .groups
            .iter()
            .all(|g| g.figures.get(a) == g.figures.get(b))
    };
    let mut told: Vec<&str> = Vec::new();
    for name in names {
        if !told.iter().any(|before| same(before, name)) {
            told.push(name);
        }
    }
    told
}

/// Values of a group's settings, without their names, which the section tells.
fn short_name(group: &Group) -> String {
    let values: Vec<&str> = group.settings.values().map(String::as_str).collect();
    if values.is_empty() {
        "all runs".to_owned()
    } else {
        values.join(" / ")
    }
}

/// The bars of a figure; nothing for one that is the same in all runs.
fn panel(summary: &Summary, figure: &str) -> Option<BarPanel> {
    let groups = ranked(summary, figure);
    let shown = &groups[..groups.len().min(DRAWN)];
    let ends = || {
        shown
            .iter()
            .flat_map(|(_, s)| [s.lower_quartile, s.upper_quartile])
    };
    let least = ends().fold(f64::INFINITY, f64::min);
    let most = ends().fold(f64::NEG_INFINITY, f64::max);
    if most <= least {
        return None;
    }
    // Bars begin at zero; where all are nearly as long, the part above the least is what matters.
    let (from, x_label) = if least > ALIKE * most {
        (least, format!("{figure} above {}", significant(least, 6)))
    } else {
        (0.0, figure.to_owned())
    };
    let medians = shown.iter().map(|(_, s)| s.median - from);
    let quartiles = shown
        .iter()
        .map(|(_, s)| [s.lower_quartile - from, s.upper_quartile - from]);
    let names = shown.iter().map(|(g, _)| short_name(g));
    Some(BarPanel::new(figure, x_label, names).with_intervals("", medians, quartiles))
}

pub(super) fn write(folder: &Path, summary: &Summary, settings: &SweepSettings) -> Result<()> {
    let study = settings.study.name();
    let (runs, groups) = (summary.rows.len(), summary.groups.len());
    let axes = settings.keys();
    let mut page = HtmlReport::new("sweep", &format!("{study} over {}", axes.join(", ")));
    let seeds = summary.groups.iter().map(|g| g.runs).max().unwrap_or(1);
    page.sentence(format!(
        "{runs} runs of {study} with {groups} settings, {} each.",
        if seeds == 1 {
            "one run".to_owned()
        } else {
            format!("{seeds} seeds")
        }
    ));
    page.tile("Runs", runs.to_string(), "");
    for figure in figures(summary)
        .into_iter()
        .filter(|f| !COUNTS.contains(f))
        .take(3)
    {
        let all = ranked(summary, figure);
        let (Some((best, spread)), Some((worst, last))) = (all.first(), all.last()) else {
            continue;
        };
        let best_words = if MORE_IS_BETTER.contains(&figure) {
            "greatest"
        } else {
            "least"
        };
        page.tile(
            &format!("{figure}, {best_words} median"),
            significant(spread.median, 4),
            "",
        );
        let quartiles = [spread.lower_quartile, spread.upper_quartile].map(|v| significant(v, 4));
        let mut sentence = format!(
            "The {best_words} median of {figure} is {} (half of the runs between {} and {}), with {}",
            significant(spread.median, 4),
            quartiles[0],
            quartiles[1],
            name_of(best)
        );
        if all.len() > 1 {
            sentence += &format!(
                "; at the other end is {} with {}",
                significant(last.median, 4),
                name_of(worst)
            );
        }
        page.sentence(sentence + ".");
    }
    let keys = summary
        .groups
        .first()
        .map(|g| g.settings.keys().cloned().collect::<Vec<_>>());
    let order = keys.unwrap_or_default().join(" / ");
    page.section(
        "Medians",
        &format!(
            "Over the seeds of each setting ({order}), with quartiles as whiskers. The best stands on top."
        ),
    );
    if groups > DRAWN {
        page.paragraph(&format!(
            "The best {DRAWN} of {groups} settings are drawn. The table has all."
        ));
    }
    let panels = figures(summary)
        .into_iter()
        .filter_map(|figure| panel(summary, figure));
    let bars = Bars::new(
        format!("Medians over the seeds, with quartiles, by {order}"),
        panels,
    );
    if !bars.is_empty() {
        page.figure(folder.join("medians.svg"), &bars)?;
    }
    let medians = summary.median_table(&[
        ("", |s| s.median),
        (", quartile below", |s| s.lower_quartile),
        (", quartile above", |s| s.upper_quartile),
    ]);
    page.table("Every setting", "", &medians)?;
    page.folded_table("Every run", "", &summary.row_table())?;
    page.provenance("study", study);
    page.provenance("runs", runs.to_string());
    page.settings("sweep.toml, which repeats this sweep", settings.text());
    page.write(folder.join("report.html"))
}
