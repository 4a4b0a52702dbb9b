//! What a surface study leaves behind.

use super::{Outcome, SurfaceSettings};
use crate::error::Result;
use crate::evaluate::{FailureCounts, failures_in_words};
use crate::report::{Cells, Column, HtmlReport, Levels, SurfaceFigure, plot_surface, significant, write_csv};
use crate::study::identify::Setup;
use crate::study::run_folder::{Manifest, write_json, write_study};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// The least of a cost over the grid.
#[derive(Clone, Debug, Serialize)]
pub struct Least {
    /// The cost, in its unit.
    pub cost: f64,
    /// Where it is, in the parameters' units.
    pub at: [f64; 2],
}

/// The figures of the study; `--json` prints this.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// `surface`.
    pub study: &'static str,
    /// Seed of all random numbers: none are drawn.
    pub seed: u64,
    /// `cpu`, `simd` or `gpu`.
    pub backend: &'static str,
    /// Instruction set, or name of the adapter.
    pub adapter: String,
    /// What went wrong with devices and was got over; the study's figures hold all the same.
    pub device_faults: Vec<String>,
    /// Time taken (s).
    pub elapsed_s: f64,
    /// Candidates evaluated.
    pub evaluations: usize,
    /// Candidates per second.
    pub evaluations_per_s: f64,
    /// The horizontal and the vertical parameter.
    pub parameters: [String; 2],
    /// Their values in the base car.
    pub base: [f64; 2],
    /// The least of each cost; nothing where no car drove.
    pub least: BTreeMap<String, Option<Least>>,
    /// Candidates that did not drive.
    pub failed: usize,
    /// The same by reason.
    pub failures: FailureCounts,
    /// Whether the study was broken off.
    pub interrupted: bool,
}

/// Puts the figures together.
pub fn summarise(settings: &SurfaceSettings, setup: &Setup, outcome: &Outcome) -> Summary {
    let n = outcome.axes[0].len();
    let least_of = |costs: &Vec<f64>| {
        let finite = (0..costs.len()).filter(|i| costs[*i].is_finite());
        finite
            .min_by(|a, b| costs[*a].total_cmp(&costs[*b]))
            .map(|i| Least {
                cost: costs[i],
                at: [outcome.axes[0][i % n], outcome.axes[1][i / n]],
            })
    };
    let objectives = &setup.replay.problem.objectives;
    Summary {
        study: "surface",
        seed: settings.replay.seed,
        backend: outcome.backend.backend,
        adapter: outcome.backend.device.clone(),
        device_faults: outcome.device_faults.clone(),
        elapsed_s: outcome.elapsed_s,
        evaluations: outcome.evaluations,
        evaluations_per_s: outcome.evaluations as f64 / outcome.elapsed_s.max(1e-9),
        parameters: settings.parameters.clone(),
        base: outcome.base,
        least: objectives
            .iter()
            .zip(&outcome.costs)
            .map(|(o, costs)| (o.name.clone(), least_of(costs)))
            .collect(),
        failed: outcome.costs[0].iter().filter(|c| !c.is_finite()).count(),
        failures: outcome.failures.clone(),
        interrupted: outcome.interrupted,
    }
}

impl Summary {
    /// The figures in words.
    pub fn to_text(&self) -> String {
        let [x, y] = &self.parameters;
        let mut text = format!(
            "{x} and {y} (the car's own: {} and {})\n",
            self.base[0], self.base[1]
        );
        for (name, least) in &self.least {
            if let Some(least) = least {
                text += &format!(
                    "  least {name:<10} {:.6e} at {:.6} and {:.6}\n",
                    least.cost, least.at[0], least.at[1]
                );
            }
        }
        let faults: String = self
            .device_faults
            .iter()
            .map(|f| format!("Note: {f}\n"))
            .collect();
        text + &format!(
            "{} evaluations in {:.1} s, {:.0}/s, {} did not drive, {} {}\n{faults}",
            self.evaluations, self.elapsed_s, self.evaluations_per_s, self.failed, self.backend, self.adapter
        )
    }
}

/// Writes `summary.json`, `manifest.json`, `study.toml`, `surface.csv` a picture `surface_<cost>.svg` of each cost, and `report.html`.
///
/// # Errors
/// [`crate::Error::Io`] if a file cannot be written.
pub fn write_results(
    folder: &Path,
    settings: &SurfaceSettings,
    setup: &Setup,
    outcome: &Outcome,
    summary: &Summary,
) -> Result<()> {
    write_json(&folder.join("summary.json"), summary)?;
    let manifest = Manifest {
        log: Some(&setup.log.source),
        interrupted: outcome.interrupted,
        device_faults: &outcome.device_faults,
        longest_dispatch_ms: outcome.longest_dispatch_ms,
        ..Manifest::new(
            "surface",
            settings.replay.seed,
            &outcome.backend,
            &setup.replay.free.car.name,
        )
    };
    let problem = &setup.replay.problem;
    let toml = settings.to_toml();
    write_study(folder, &toml)?;
    if outcome.interrupted {
        return Ok(());
    }

    let n = outcome.axes[0].len();
    let grid: [Vec<f64>; 2] = [
        (0..n * n).map(|i| outcome.axes[0][i % n]).collect(),
        (0..n * n).map(|i| outcome.axes[1][i / n]).collect(),
    ];
    let mut columns: Vec<Column<'_>> = (0..2)
        .map(|k| Column {
            name: &problem.variables[k].name,
            unit: &problem.variables[k].unit,
            cells: Cells::Numbers(&grid[k]),
        })
        .collect();
    columns.extend(
        problem
            .objectives
            .iter()
            .zip(&outcome.costs)
            .map(|(o, costs)| Column {
                name: &o.name,
                unit: &o.unit,
                cells: Cells::Numbers(costs),
            }),
    );
    write_csv(folder.join("surface.csv"), &columns)?;

    let label = |name: &str, unit: &str| format!("{name} ({unit})");
    let axis_label = |k: usize| label(&problem.variables[k].name, &problem.variables[k].unit);
    let (x_label, y_label) = (axis_label(0), axis_label(1));
    let mut page = begun_page(setup, summary);
    for (objective, costs) in problem.objectives.iter().zip(&outcome.costs) {
        let mut marks = vec![("car", outcome.base)];
        if let Some(Some(least)) = summary.least.get(&objective.name) {
            marks.push(("least", least.at));
        }
        let name = &objective.name;
        let told = told_of(name);
        let figure = SurfaceFigure {
            title: &format!(
                "Cost of {told} over {} and {}",
                summary.parameters[0], summary.parameters[1]
            ),
            x_label: &x_label,
            y_label: &y_label,
            z_label: &label(&format!("cost of {told}"), &objective.unit),
            x: &outcome.axes[0],
            y: &outcome.axes[1],
            z: costs,
            levels: Levels::Basin,
            marks,
        };
        plot_surface(folder.join(format!("surface_{name}.svg")), &figure)?;
        page.surface(&figure, "")?;
    }
    page.provenance("log", &setup.log.source);
    page.provenance("car", &setup.replay.free.car.name);
    page.provenance("backend", summary.backend);
    page.provenance("adapter", &summary.adapter);
    page.provenance("driver", &outcome.backend.driver);
    page.provenance("candidates evaluated", summary.evaluations.to_string());
    page.provenance("time", format!("{:.1} s", summary.elapsed_s));
    page.settings("study.toml, which repeats this run", toml);
    page.write(folder.join("report.html"))?;
    // Last: it says that the run is whole.
    write_json(&folder.join("manifest.json"), &manifest)
}

/// What a cost is of.
fn told_of(objective: &str) -> &str {
    if objective == "all" {
        "all channels"
    } else {
        objective
    }
}

/// The interactive report, up to its surfaces.
fn begun_page(setup: &Setup, summary: &Summary) -> HtmlReport {
    let [x, y] = &summary.parameters;
    let car = &setup.replay.free.car.name;
    let mut page = HtmlReport::new("surface", &format!("{x} and {y} of the {car}"));
    page.sentence(format!(
        "{} cars over a grid of {x} and {y} were driven through the log in {:.1} s; the {car} itself has {} and {}.",
        summary.evaluations,
        summary.elapsed_s,
        significant(summary.base[0], 5),
        significant(summary.base[1], 5)
    ));
    for (name, least) in &summary.least {
        if let Some(least) = least {
            let [at_x, at_y] = least.at.map(|v| significant(v, 5));
            page.sentence(format!(
                "The cost of {} is least, {}, where {x} is {at_x} and {y} is {at_y}.",
                told_of(name),
                significant(least.cost, 4)
            ));
        }
    }
    if summary.failed > 0 {
        page.warning(format!(
            "{} of {} cars did not drive ({}); they are left out.",
            summary.failed,
            summary.evaluations,
            failures_in_words(&summary.failures)
        ));
    }
    page.section(
        "Costs",
        "From above with lines of equal steps of colour, and in space, to be turned by dragging. Colours go with the root \
         of the cost above its least, which spreads a basin's bottom.",
    );
    page
}
