//! Pages of what was measured: a figure for each, and every measurement as a table and as `rows.csv`.

use super::scaling::{self, Table as Rates};
use super::{optimisers, studies, swarm, tune, whole};
use lapswarm::Result;
use lapswarm::report::{BarPanel, Bars, Curves, HtmlReport, Panel, Scale, Table, significant};
use lapswarm::swarm::comparison::quartiles;
use lapswarm::swarm::problems::Half;
use std::path::Path;

/// Rows that share a label, in the order in which labels come.
fn by_label<T>(rows: &[T], label: impl Fn(&T) -> String) -> Vec<(String, Vec<&T>)> {
    let mut found: Vec<(String, Vec<&T>)> = Vec::new();
    for row in rows {
        let name = label(row);
        match found.iter_mut().find(|(n, _)| *n == name) {
            Some((_, members)) => members.push(row),
            None => found.push((name, vec![row])),
        }
    }
    found
}

/// A quantity over the population, both by equal ratios, a curve for each label.
fn over_population<T>(
    panel: Panel,
    families: &[(String, Vec<&T>)],
    population: impl Fn(&T) -> usize,
    value: impl Fn(&T) -> Option<f64>,
) -> Panel {
    let panel = panel.x("population", "candidates").scales(Scale::Log, Scale::Log);
    families.iter().fold(panel, |panel, (label, rows)| {
        let points = rows
            .iter()
            .map(|r| (population(r) as f64, value(r).unwrap_or(f64::NAN)));
        panel.points(label, points)
    })
}

/// A table on the page, and the same as `rows.csv`.
fn rows_of(page: &mut HtmlReport, folder: &Path, table: &Table<'_>) -> Result<()> {
    table.write_csv(folder.join("rows.csv"))?;
    page.table("Every measurement", "", table)
}

/// The rates of `bench` against the population, and what they come of.
pub fn rates(rows: &[scaling::Row]) -> Curves {
    let families = by_label(rows, |r| format!("{}, {}", r.problem, r.backend));
    let population = |r: &scaling::Row| r.population;
    let rate = Panel::new("Rate").y("evaluations per second", "1/s");
    let time = Panel::new("Time of a generation").y("time", "ms");
    let memory = Panel::new("Memory of the process at its greatest").y("memory", "MiB");
    let panels = [
        over_population(rate, &families, population, |r| Some(r.evaluations_per_s)),
        over_population(time, &families, population, |r| Some(r.generation_ms)),
        over_population(memory, &families, population, |r| r.peak_memory_mib),
    ];
    Curves::new(
        "Evaluations per second against population",
        panels.into_iter().filter(Panel::has_points),
    )
}

/// The page of `bench`; `other` is what another machine had.
pub fn of_scaling(folder: &Path, table_of: &Rates, other: Option<&Rates>) -> Result<HtmlReport> {
    let rows = &table_of.rows;
    let mut page = HtmlReport::new("bench", "Evaluations against population");
    for (problem, of) in by_label(rows, |r| r.problem.clone()) {
        let best = of
            .iter()
            .max_by(|a, b| a.evaluations_per_s.total_cmp(&b.evaluations_per_s));
        if let Some(best) = best {
            let rate = significant(best.evaluations_per_s, 3);
            page.sentence(format!(
                "{problem}: at most {rate} evaluations per second, on {} ({}) with a population of {}.",
                best.backend, best.adapter, best.population
            ));
            page.tile(&format!("{problem}, at most"), rate, "1/s");
        }
    }
    page.section(
        "Against population",
        "The candidates of a population are evaluated all at once. Devices need many of them to be busy.",
    );
    page.figure(folder.join("scaling.svg"), &rates(rows))?;
    let mut table = Table::rows(rows)
        .text("problem", |r| &*r.problem)
        .text("backend", |r| &*r.backend)
        .number("population", "", |r| r.population as f64)
        .number("evaluations", "1/s", |r| r.evaluations_per_s)
        .number("steps of cars", "1/s", |r| r.particle_steps_per_s)
        .number("generation", "ms", |r| r.generation_ms)
        .number("kernel", "ms", |r| r.kernel_ms)
        .number("arithmetic peak", "%", |r| Some(100.0 * r.arithmetic_peak_share?))
        .number("memory", "MiB", |r| r.peak_memory_mib)
        .text("device", |r| &*r.adapter);
    if let Some(other) = other {
        table = table.number("times the other", "", |r| {
            Some(r.evaluations_per_s / other.like(r)?.evaluations_per_s)
        });
    }
    rows_of(&mut page, folder, &table.table())?;
    page.provenance("time", format!("{:.1} s", table_of.elapsed_s));
    Ok(page)
}

/// The page of `bench optimisers`.
pub fn of_optimisers(folder: &Path, rows: &[optimisers::Row]) -> Result<HtmlReport> {
    let mut page = HtmlReport::new("bench", "Optimisers on problems whose answers are known");
    let problems = by_label(rows, |r| r.problem.to_owned());
    let seeds = rows.iter().map(|r| r.seeds).max().unwrap_or(0);
    page.sentence(format!(
        "{} optimisers on {} problems, {seeds} seeds each; figures are medians.",
        by_label(rows, |r| r.algorithm.to_owned()).len(),
        problems.len()
    ));
    page.sentence(
        "Settings are chosen on one half of each suite (chosen_on). The other half (published) says what they are worth.",
    );
    for half in [Half::ChosenOn, Half::Published] {
        let default: Vec<_> = rows
            .iter()
            .filter(|r| r.half == half && r.algorithm == "default" && r.best_peer.is_some())
            .collect();
        let short: Vec<_> = default
            .iter()
            .filter(|r| r.falls_short())
            .map(|r| r.problem)
            .collect();
        if !default.is_empty() {
            page.sentence(format!(
                "{}: the default falls short of the best other library on {} of {} problems: {}.",
                half.name(),
                short.len(),
                default.len(),
                if short.is_empty() {
                    "none".to_owned()
                } else {
                    short.join(", ")
                }
            ));
        }
    }
    let mut panels = Vec::new();
    for (problem, of) in &problems {
        let several = of.iter().all(|r| r.hypervolume_median.is_some());
        let value = |r: &optimisers::Row| r.hypervolume_median.or(r.error_median).unwrap_or(f64::NAN);
        let sign = if several { -1.0 } else { 1.0 };
        let mut ranked = of.clone();
        ranked.sort_by(|a, b| (sign * value(a)).total_cmp(&(sign * value(b))));
        let Some(best) = ranked.first() else { continue };
        let what = if several { "hypervolume" } else { "error" };
        page.sentence(format!(
            "{problem} ({}): {} is best, with {what} {}.",
            best.half.name(),
            best.algorithm,
            significant(value(best), 4)
        ));
        // How far the others stay behind: hypervolumes themselves are alike, errors many orders apart.
        if several {
            let names = ranked.iter().map(|r| r.algorithm);
            let behind = ranked.iter().map(|r| value(best) - value(r));
            panels.push(BarPanel::new(problem, "hypervolume below the best", names).bars("", behind));
        }
    }
    page.section(
        "Behind the best",
        "Hypervolume that the median of an optimiser lacks of the best one's.",
    );
    page.place(&Bars::new("Behind the best", panels))?;
    let table = Table::rows(rows)
        .text("suite", |r| r.suite)
        .text("half", |r| r.half.name())
        .text("problem", |r| r.problem)
        .text("algorithm", |r| r.algorithm)
        .number("seeds with something feasible", "", |r| r.feasible_seeds as f64)
        .number("hypervolume", "", |r| r.hypervolume_median)
        .number("its interquartile range", "", |r| r.hypervolume_iqr)
        .number("IGD+", "", |r| r.igd_plus_median)
        .number("error", "", |r| r.error_median)
        .number("the error's interquartile range", "", |r| r.error_iqr)
        .number("best peer", "", |r| r.best_peer)
        .text("which peer", |r| r.best_peer_name.unwrap_or(""))
        .number("p of being better", "", |r| r.better_than_peer_p);
    rows_of(&mut page, folder, &table.table())?;
    Ok(page)
}

/// The page of `bench swarm`.
pub fn of_swarm(folder: &Path, rows: &[swarm::Row]) -> Result<HtmlReport> {
    let mut page = HtmlReport::new("bench", "What a generation of the swarm costs");
    let families = by_label(rows, |r| format!("{}, {}", r.problem, r.backend));
    for (label, of) in &families {
        if let Some(largest) = of.iter().max_by_key(|r| r.population) {
            let time = significant(largest.generation_ms, 3);
            page.sentence(format!(
                "{label}: {time} ms for a generation of {} particles, evaluations aside.",
                largest.population
            ));
            page.tile(&format!("{label}, {} particles", largest.population), time, "ms");
        }
    }
    page.section("Against the particles", "");
    let population = |r: &swarm::Row| r.population;
    let [own, evaluations] =
        ["The swarm itself", "Evaluations"].map(|title| Panel::new(title).y("time of a generation", "ms"));
    page.place(&Curves::new(
        "Time of a generation",
        [
            over_population(own, &families, population, |r| Some(r.generation_ms)),
            over_population(evaluations, &families, population, |r| Some(r.evaluation_ms)),
        ],
    ))?;
    let table = Table::rows(rows)
        .text("problem", |r| r.problem)
        .text("backend", |r| r.backend)
        .number("particles", "", |r| r.population as f64)
        .number("generation", "ms", |r| r.generation_ms)
        .number("slowest generation", "ms", |r| r.slowest_generation_ms)
        .number("evaluations", "ms", |r| r.evaluation_ms)
        .number("memory of a particle", "bytes", |r| r.bytes_per_particle as f64)
        .number("hypervolume", "", |r| r.hypervolume)
        .text("device", |r| &*r.device);
    rows_of(&mut page, folder, &table.table())?;
    Ok(page)
}

/// The page of `bench whole`.
pub fn of_whole(folder: &Path, rows: &[whole::Row]) -> Result<HtmlReport> {
    let mut page = HtmlReport::new("bench", "Whole generations");
    let families = by_label(rows, |r| {
        format!("{}, {}, swarm on the {}", r.problem, r.backend, r.swarm)
    });
    for (label, of) in &families {
        if let Some(largest) = of.iter().max_by_key(|r| r.population) {
            page.sentence(format!(
                "{label}: {} % of a generation of {} particles is not kernels.",
                significant(100.0 * largest.outside_kernels_share, 2),
                largest.population
            ));
        }
    }
    page.section("Against the particles", "A generation asks, evaluates and tells.");
    let population = |r: &whole::Row| r.population;
    let time = Panel::new("Whole generation").y("time", "ms");
    let share = Panel::new("Outside the kernels").y("share of the generation", "%");
    page.figure(
        folder.join("whole.svg"),
        &Curves::new(
            "Whole generations",
            [
                over_population(time, &families, population, |r| Some(r.generation_ms)),
                over_population(share, &families, population, |r| {
                    Some(100.0 * r.outside_kernels_share)
                }),
            ],
        ),
    )?;
    let table = Table::rows(rows)
        .text("problem", |r| r.problem)
        .text("backend", |r| r.backend)
        .text("swarm", |r| r.swarm)
        .number("particles", "", |r| r.population as f64)
        .number("objectives", "", |r| r.objectives as f64)
        .number("generation", "ms", |r| r.generation_ms)
        .number("kernels", "ms", |r| r.kernel_ms)
        .number("outside kernels", "%", |r| 100.0 * r.outside_kernels_share)
        .text("device", |r| &*r.adapter);
    rows_of(&mut page, folder, &table.table())?;
    Ok(page)
}

/// The page of `bench tune`.
pub fn of_tune(folder: &Path, rows: &[tune::Row], best: String) -> Result<HtmlReport> {
    let mut page = HtmlReport::new("bench", "How kernels are best dispatched");
    page.sentence(best);
    let table = Table::rows(rows)
        .text("problem", |r| r.problem)
        .number("workgroup", "lanes", |r| f64::from(r.workgroup))
        .number("lanes of a dispatch", "", |r| r.lanes as f64)
        .number("particles", "", |r| r.population as f64)
        .number("kernels", "ms", |r| r.kernel_ms)
        .number("times usual", "", |r| r.times_usual)
        .text("bits", |r| if r.same_bits { "same" } else { "others" });
    rows_of(&mut page, folder, &table.table())?;
    Ok(page)
}

/// Hypervolume against time, a panel for each population and problem, all of a problem over the same range: what the lower
/// half of the runs end at is in it, how they began need not be.
pub fn qualities(rows: &[studies::Row]) -> Curves {
    let mut panels = by_label(rows, |r| format!("{}, population {}", r.problem, r.population));
    panels.sort_by_key(|(_, of)| of.first().map(|r| r.population));
    let panel = |(title, of): (String, Vec<&studies::Row>)| {
        let alike = rows
            .iter()
            .filter(|r| of.iter().any(|own| own.problem == r.problem));
        let ends: Vec<f64> = alike.map(|r| r.hypervolume_median).collect();
        let [low, ..] = quartiles(&ends);
        let most = ends.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let range = (most - low).max(1e-3);
        let panel = Panel::new(title)
            .x("time", "s")
            .y("hypervolume", "")
            .scales(Scale::Log, Scale::Linear)
            .shown((low - range).max(0.0), (most + 0.1 * range).min(1.0));
        of.iter().fold(panel, |panel, r| {
            panel.curve(&*r.algorithm, &r.history.seconds, &r.history.hypervolume)
        })
    };
    Curves::new(
        "Hypervolume against time at equal evaluations",
        panels.into_iter().map(panel),
    )
}

/// The page of `bench studies`.
pub fn of_studies(folder: &Path, rows: &[studies::Row]) -> Result<HtmlReport> {
    let mut page = HtmlReport::new("bench", "Optimisers on the studies' own problems");
    let seeds = rows.iter().map(|r| r.seeds).max().unwrap_or(0);
    page.sentence(format!(
        "Hypervolume against time at equal evaluations; medians of {seeds} seeds."
    ));
    for (problem, of) in by_label(rows, |r| r.problem.to_owned()) {
        let best = of
            .iter()
            .max_by(|a, b| a.hypervolume_median.total_cmp(&b.hypervolume_median));
        if let Some(best) = best {
            let volume = significant(best.hypervolume_median, 4);
            page.sentence(format!(
                "{problem}: {} with a population of {} is best, with {volume} in {} s.",
                best.algorithm,
                best.population,
                significant(best.seconds_median, 3)
            ));
            page.tile(&format!("{problem}, hypervolume"), volume, "");
        }
    }
    page.section("Against time", "The run of each that is nearest to the median.");
    page.figure(folder.join("quality.svg"), &qualities(rows))?;
    let table = Table::rows(rows)
        .text("problem", |r| r.problem)
        .text("algorithm", |r| &*r.algorithm)
        .number("population", "", |r| r.population as f64)
        .number("generations", "", |r| r.generations as f64)
        .number("hypervolume", "", |r| r.hypervolume_median)
        .number("its interquartile range", "", |r| r.hypervolume_iqr)
        .number("time", "s", |r| r.seconds_median)
        .number("of which evaluations", "s", |r| r.evaluation_s_median);
    rows_of(&mut page, folder, &table.table())?;
    Ok(page)
}
