//! The report of a sweep: what the medians say, figure by figure, and what the searches reached by what they cost.

use super::results::{Group, NamedPart, Row, Spread, Summary};
use super::ways::{Ways, times};
use super::words::{is_detail, words};
use super::{KeptRow, SweepSettings};
use crate::error::Result;
use crate::report::{BarPanel, Bars, HtmlReport, significant, with_unit};
use crate::swarm::comparison::quartiles;
use std::path::Path;

/// Settings that strips are drawn of: more are a wall, and stand in the table.
const DRAWN: usize = 40;
/// Settings whose searches are drawn beside one another: as many as there are colours.
const COMPARED: usize = 7;
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
        .filter(|name| !is_detail(name))
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

/// All runs of every setting and their quartiles; nothing for a figure that is the same in all runs, or that is told of none.
fn panel(summary: &Summary, figure: &str) -> Option<BarPanel> {
    let groups = ranked(summary, figure);
    let shown = &groups[..groups.len().min(DRAWN)];
    let singles = |group: &Group| -> Vec<f64> {
        let own = summary.rows.iter().filter(|row| is_of(row, group));
        own.filter_map(|row| row.figures.get(figure).copied().flatten())
            .collect()
    };
    let singles: Vec<Vec<f64>> = shown.iter().map(|(group, _)| singles(group)).collect();
    let all = || singles.iter().flatten().copied();
    if all().fold(f64::NEG_INFINITY, f64::max) <= all().fold(f64::INFINITY, f64::min) {
        return None;
    }
    let quartiles: Vec<[f64; 3]> = shown
        .iter()
        .map(|(_, s)| [s.lower_quartile, s.median, s.upper_quartile])
        .collect();
    let names = shown.iter().map(|(g, _)| short_name(g));
    let (name, unit) = words(figure);
    Some(BarPanel::new(&*name, with_unit(&name, unit), names).strips(singles, &quartiles))
}

/// Whether a run is one of a group: its settings, the seed aside, are the group's.
fn is_of(row: &Row, group: &Group) -> bool {
    let rest = row.settings.iter().filter(|(key, _)| *key != "seed");
    rest.eq(group.settings.iter())
}

/// The searches of the runs beside one another: what they had reached by what it cost, and where they came to.
fn searches(page: &mut HtmlReport, folder: &Path, summary: &Summary, kept: &[KeptRow]) -> Result<()> {
    let mut all: Vec<&[String]> = Vec::new();
    for kept in kept {
        let objectives = &*kept.searched.objectives;
        if !kept.searched.reached.is_empty() && !all.contains(&objectives) {
            all.push(objectives);
        }
    }
    for (number, objectives) in all.iter().enumerate() {
        let own = |group: &Group| -> Vec<&KeptRow> {
            let own = kept.iter().filter(|kept| is_of(&kept.row, group));
            own.filter(|kept| kept.searched.objectives == *objectives)
                .collect()
        };
        let fronts = objectives.len() > 1;
        let last = |kept: &&KeptRow| kept.searched.reached.last().and_then(|reached| reached.best);
        let mut ways: Vec<(f64, Ways<'_>)> = summary
            .groups
            .iter()
            .map(|group| {
                let runs = own(group);
                let reached: Vec<f64> = runs.iter().filter_map(last).collect();
                let name = short_name(group);
                (quartiles(&reached)[1], Ways { name, runs })
            })
            .filter(|(_, ways)| !ways.runs.is_empty())
            .collect();
        ways.sort_by(|(a, _), (b, _)| if fronts { b.total_cmp(a) } else { a.total_cmp(b) });
        let settings = ways.len();
        let ways: Vec<Ways<'_>> = ways.into_iter().take(COMPARED).map(|(_, ways)| ways).collect();
        let most = if settings > COMPARED {
            format!(" The best {COMPARED} of {settings} settings are drawn.")
        } else {
            String::new()
        };
        let (label, what) = if fronts {
            let what = "The hypervolume of the swarm's front, as a share of that of the front that all swarms end with";
            ("hypervolume, share of all swarms'".to_owned(), what)
        } else {
            let only = objectives.first().cloned().unwrap_or_default();
            (only, "The best that the swarm had found")
        };
        let figure = super::ways::figure(&ways, &label);
        // Pictures of the first objectives have plain names, those of others have a number.
        let named = |stem: &str| match number {
            0 => folder.join(format!("{stem}.svg")),
            _ => folder.join(format!("{stem}_{}.svg", number + 1)),
        };
        if !figure.is_empty() {
            page.section(
                "What was reached by what it cost",
                &format!("{what}: the median over the seeds, and a band between the quartiles.{most}"),
            );
            page.figure(named("convergence"), &figure)?;
        }
        let over = super::ways::fronts(&ways, objectives);
        if !over.is_empty() {
            page.section(
                "Fronts over one another",
                &format!("The members of all seeds.{most}"),
            );
            page.figure(named("fronts"), &over)?;
        }
    }
    Ok(())
}

pub(super) fn write(
    folder: &Path,
    summary: &Summary,
    settings: &SweepSettings,
    kept: &[KeptRow],
) -> Result<()> {
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
        let (name, unit) = words(figure);
        let value = |figure: f64| format!("{} {unit}", significant(figure, 4)).trim_end().to_owned();
        page.tile(
            &format!("{name}, {best_words} median"),
            significant(spread.median, 4),
            unit,
        );
        let mut sentence = format!(
            "The {best_words} median of the {name} is {} (half of the runs between {} and {}), with {}",
            value(spread.median),
            value(spread.lower_quartile),
            value(spread.upper_quartile),
            name_of(best)
        );
        if all.len() > 1 {
            sentence += &format!(
                "; at the other end is {} with {}",
                value(last.median),
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
    searches(&mut page, folder, summary, kept)?;
    page.section(
        "Runs of every setting",
        &format!(
            "A dot is a run. The median over the seeds of each setting ({order}) is marked, with quartiles as whiskers. The best \
             stands on top."
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
    let strips = Bars::new(format!("Every run, medians and quartiles, by {order}"), panels);
    if !strips.is_empty() {
        page.figure(folder.join("medians.svg"), &strips)?;
    }
    let parts: [NamedPart; 3] = [
        ("", |s| s.median),
        (", quartile below", |s| s.lower_quartile),
        (", quartile above", |s| s.upper_quartile),
    ];
    let medians = summary.median_table(&parts, |name| !is_detail(name), words);
    page.table("Every setting", "", &medians)?;
    let has_details = summary
        .groups
        .iter()
        .any(|g| g.figures.keys().any(|name| is_detail(name)));
    if has_details {
        let details = summary.median_table(&parts[..1], is_detail, words);
        page.folded_table("Parameters and errors of every setting, medians", "", &details)?;
    }
    page.folded_table("Every run", "", &summary.row_table(words))?;
    page.folded_table("What every run took", "", &times(kept).table())?;
    page.provenance("study", study);
    page.provenance("runs", runs.to_string());
    page.settings("sweep.toml, which repeats this sweep", settings.text());
    page.write(folder.join("report.html"))
}
