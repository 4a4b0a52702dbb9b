//! Pages of what was measured.

use super::scaling::{self, Table};
use super::{optimisers, studies, swarm};
use lapswarm::Result;
use lapswarm::report::{
    BarPanel, BarSeries, Cells, Column, Curve, CurvePanel, HtmlReport, Scale, significant, write_csv,
};
use std::path::Path;

/// A column of words.
fn words<T>(rows: &[T], of: impl Fn(&T) -> &str) -> Vec<String> {
    rows.iter().map(|r| of(r).to_owned()).collect()
}

/// A column of numbers, gaps where there are none.
fn numbers<T>(rows: &[T], of: impl Fn(&T) -> Option<f64>) -> Vec<f64> {
    rows.iter().map(|r| of(r).unwrap_or(f64::NAN)).collect()
}

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
    page: &mut HtmlReport,
    (title, y_label): (&str, &str),
    families: &[(String, Vec<&T>)],
    population: impl Fn(&T) -> usize,
    value: impl Fn(&T) -> Option<f64>,
) -> Result<()> {
    let curves = families
        .iter()
        .map(|(label, rows)| Curve {
            label,
            x: rows.iter().map(|r| population(r) as f64).collect(),
            y: rows.iter().map(|r| value(r).unwrap_or(f64::NAN)).collect(),
            shade: None,
        })
        .collect();
    let panel = CurvePanel {
        title,
        x_label: "population (candidates)",
        y_label,
        curves,
    };
    page.curves(&panel, "", [Scale::Log, Scale::Log])
}

/// A table on the page, and the same as `rows.csv`.
fn table(page: &mut HtmlReport, folder: &Path, columns: &[(&str, &str, Cells<'_>)]) -> Result<()> {
    let columns: Vec<Column<'_>> = columns
        .iter()
        .map(|&(name, unit, cells)| Column { name, unit, cells })
        .collect();
    write_csv(folder.join("rows.csv"), &columns)?;
    page.table("Every measurement", "", &columns)
}

/// The page of `bench`; `other` is what another machine had.
pub fn of_scaling(folder: &Path, table_of: &Table, other: Option<&Table>) -> Result<HtmlReport> {
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
        "Candidates of a population are evaluated all at once; devices need many of them to be busy.",
    );
    let families = by_label(rows, |r| format!("{}, {}", r.problem, r.backend));
    let population = |r: &scaling::Row| r.population;
    let rate = ("Rate", "evaluations per second (1/s)");
    over_population(&mut page, rate, &families, population, |r| {
        Some(r.evaluations_per_s)
    })?;
    let time = ("Time of a generation", "time (ms)");
    over_population(&mut page, time, &families, population, |r| Some(r.generation_ms))?;
    if rows.iter().any(|r| r.peak_memory_mib.is_some()) {
        let memory = ("Memory of the process at its greatest", "memory (MiB)");
        over_population(&mut page, memory, &families, population, |r| r.peak_memory_mib)?;
    }
    let (problems, backends) = (words(rows, |r| &r.problem), words(rows, |r| &r.backend));
    let adapters = words(rows, |r| &r.adapter);
    let populations = numbers(rows, |r| Some(r.population as f64));
    let rates = numbers(rows, |r| Some(r.evaluations_per_s));
    let steps = numbers(rows, |r| r.particle_steps_per_s);
    let times = numbers(rows, |r| Some(r.generation_ms));
    let kernels = numbers(rows, |r| r.kernel_ms);
    let shares = numbers(rows, |r| r.arithmetic_peak_share.map(|s| 100.0 * s));
    let memory = numbers(rows, |r| r.peak_memory_mib);
    let ratios = numbers(rows, |r| {
        Some(r.evaluations_per_s / other?.like(r)?.evaluations_per_s)
    });
    let mut columns = vec![
        ("problem", "", Cells::Texts(&problems)),
        ("backend", "", Cells::Texts(&backends)),
        ("population", "", Cells::Numbers(&populations)),
        ("evaluations", "1/s", Cells::Numbers(&rates)),
        ("steps of cars", "1/s", Cells::Numbers(&steps)),
        ("generation", "ms", Cells::Numbers(&times)),
        ("kernel", "ms", Cells::Numbers(&kernels)),
        ("arithmetic peak", "%", Cells::Numbers(&shares)),
        ("memory", "MiB", Cells::Numbers(&memory)),
        ("device", "", Cells::Texts(&adapters)),
    ];
    if other.is_some() {
        columns.push(("times the other", "", Cells::Numbers(&ratios)));
    }
    table(&mut page, folder, &columns)?;
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
    let mut panels = Vec::new();
    for (problem, of) in &problems {
        let several = of.iter().all(|r| r.hypervolume_median.is_some());
        let value = |r: &optimisers::Row| r.hypervolume_median.or(r.error_median).unwrap_or(f64::NAN);
        let sign = if several { -1.0 } else { 1.0 };
        let mut ranked = of.clone();
        ranked.sort_by(|a, b| (sign * value(a)).total_cmp(&(sign * value(b))));
        if let Some(best) = ranked.first() {
            let what = if several { "hypervolume" } else { "error" };
            page.sentence(format!(
                "{problem}: {} is best, with {what} {}.",
                best.algorithm,
                significant(value(best), 4)
            ));
            // How far the others stay behind: hypervolumes themselves are alike, errors many orders apart.
            if several {
                let behind = ranked.iter().map(|r| value(best) - value(r)).collect();
                panels.push((problem, ranked.iter().map(|r| r.algorithm).collect(), behind));
            }
        }
    }
    page.section(
        "Behind the best",
        "Hypervolume that an optimiser's median lacks of the best one's.",
    );
    for (problem, names, values) in panels {
        let series = BarSeries {
            label: "",
            values,
            intervals: Vec::new(),
        };
        let panel = BarPanel {
            title: problem,
            x_label: "hypervolume below the best",
            names,
            series: vec![series],
        };
        page.bars(&panel, "")?;
    }
    let (problems, algorithms) = (words(rows, |r| r.problem), words(rows, |r| r.algorithm));
    let volumes = numbers(rows, |r| r.hypervolume_median);
    let volume_spreads = numbers(rows, |r| r.hypervolume_iqr);
    let distances = numbers(rows, |r| r.igd_plus_median);
    let errors = numbers(rows, |r| r.error_median);
    let error_spreads = numbers(rows, |r| r.error_iqr);
    let peers = numbers(rows, |r| r.best_peer);
    let chances = numbers(rows, |r| r.better_than_peer_p);
    let columns = [
        ("problem", "", Cells::Texts(&problems)),
        ("algorithm", "", Cells::Texts(&algorithms)),
        ("hypervolume", "", Cells::Numbers(&volumes)),
        ("its interquartile range", "", Cells::Numbers(&volume_spreads)),
        ("IGD+", "", Cells::Numbers(&distances)),
        ("error", "", Cells::Numbers(&errors)),
        (
            "the error's interquartile range",
            "",
            Cells::Numbers(&error_spreads),
        ),
        ("best peer", "", Cells::Numbers(&peers)),
        ("p of being better", "", Cells::Numbers(&chances)),
    ];
    table(&mut page, folder, &columns)?;
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
    let own = ("The swarm itself", "time of a generation (ms)");
    over_population(&mut page, own, &families, population, |r| Some(r.generation_ms))?;
    let others = ("Evaluations", "time of a generation (ms)");
    over_population(&mut page, others, &families, population, |r| {
        Some(r.evaluation_ms)
    })?;
    let (problems, backends) = (words(rows, |r| r.problem), words(rows, |r| r.backend));
    let devices = words(rows, |r| &r.device);
    let populations = numbers(rows, |r| Some(r.population as f64));
    let times = numbers(rows, |r| Some(r.generation_ms));
    let slowest = numbers(rows, |r| Some(r.slowest_generation_ms));
    let evaluations = numbers(rows, |r| Some(r.evaluation_ms));
    let bytes = numbers(rows, |r| Some(r.bytes_per_particle as f64));
    let volumes = numbers(rows, |r| Some(r.hypervolume));
    let columns = [
        ("problem", "", Cells::Texts(&problems)),
        ("backend", "", Cells::Texts(&backends)),
        ("particles", "", Cells::Numbers(&populations)),
        ("generation", "ms", Cells::Numbers(&times)),
        ("slowest generation", "ms", Cells::Numbers(&slowest)),
        ("evaluations", "ms", Cells::Numbers(&evaluations)),
        ("memory of a particle", "bytes", Cells::Numbers(&bytes)),
        ("hypervolume", "", Cells::Numbers(&volumes)),
        ("device", "", Cells::Texts(&devices)),
    ];
    table(&mut page, folder, &columns)?;
    Ok(page)
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
                "{problem}: {} with a population of {} comes furthest, to {volume} in {} s.",
                best.algorithm,
                best.population,
                significant(best.seconds_median, 3)
            ));
            page.tile(&format!("{problem}, hypervolume"), volume, "");
        }
    }
    page.section(
        "Against time",
        "The run of each that comes nearest to the median.",
    );
    for (title, of) in by_label(rows, |r| format!("{}, population {}", r.problem, r.population)) {
        let curves = of
            .iter()
            .map(|r| Curve {
                label: &r.algorithm,
                x: r.history.seconds.clone(),
                y: r.history.hypervolume.clone(),
                shade: None,
            })
            .collect();
        let panel = CurvePanel {
            title: &title,
            x_label: "time (s)",
            y_label: "hypervolume",
            curves,
        };
        page.curves(&panel, "", [Scale::Log, Scale::Linear])?;
    }
    let (problems, algorithms) = (words(rows, |r| r.problem), words(rows, |r| &r.algorithm));
    let populations = numbers(rows, |r| Some(r.population as f64));
    let generations = numbers(rows, |r| Some(r.generations as f64));
    let volumes = numbers(rows, |r| Some(r.hypervolume_median));
    let spreads = numbers(rows, |r| Some(r.hypervolume_iqr));
    let times = numbers(rows, |r| Some(r.seconds_median));
    let evaluating = numbers(rows, |r| Some(r.evaluation_s_median));
    let columns = [
        ("problem", "", Cells::Texts(&problems)),
        ("algorithm", "", Cells::Texts(&algorithms)),
        ("population", "", Cells::Numbers(&populations)),
        ("generations", "", Cells::Numbers(&generations)),
        ("hypervolume", "", Cells::Numbers(&volumes)),
        ("its interquartile range", "", Cells::Numbers(&spreads)),
        ("time", "s", Cells::Numbers(&times)),
        ("of which evaluations", "s", Cells::Numbers(&evaluating)),
    ];
    table(&mut page, folder, &columns)?;
    Ok(page)
}
