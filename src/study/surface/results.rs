//! What a surface study leaves behind.

use crate::config::settings::Settings;
use crate::error::Result;
use crate::evaluate::failures_in_words;
use crate::report::{HtmlReport, Levels, Surface, Table, significant, with_unit};
use crate::study::framework::{RunRecord, Solved};
use crate::study::identify::Setup;
use crate::study::replayed::of_cost;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The least of a cost over the grid.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Least {
    /// The cost, in its unit.
    pub cost: f64,
    /// Where it is, in the parameters' units.
    pub at: [f64; 2],
}

/// The figures of the study; `--json` prints this.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Summary {
    /// `surface`.
    pub study: String,
    /// Seed of all random numbers: none are drawn.
    pub seed: u64,
    /// How the study ran.
    #[serde(flatten)]
    pub record: RunRecord,
    /// The horizontal and the vertical parameter.
    pub parameters: [String; 2],
    /// Their values in the base car.
    pub base: [f64; 2],
    /// The least of each cost; nothing where no car drove.
    pub least: BTreeMap<String, Option<Least>>,
    /// Candidates that did not drive.
    pub failed: usize,
}

/// Puts the figures together.
pub(super) fn summarise(solved: &Solved<'_, super::Surface>) -> Summary {
    let (settings, outcome) = (solved.settings, solved.outcome);
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
    let objectives = &solved.prepared.replay.problem.objectives;
    Summary {
        study: "surface".to_owned(),
        seed: settings.replay.seed,
        record: outcome.record.clone(),
        parameters: settings.parameters.clone(),
        base: outcome.base,
        least: objectives
            .iter()
            .zip(&outcome.costs)
            .map(|(o, costs)| (o.name.clone(), least_of(costs)))
            .collect(),
        failed: outcome.costs[0].iter().filter(|c| !c.is_finite()).count(),
    }
}

impl Summary {
    /// The figures in words.
    pub fn to_text(&self) -> String {
        let [x, y] = &self.parameters;
        let record = &self.record;
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
        text + &format!(
            "{} evaluations in {:.1} s, {:.0}/s, {} did not drive, {}\n{}",
            record.evaluations,
            record.elapsed_s,
            record.evaluations_per_s,
            self.failed,
            record.device(),
            record.notes()
        )
    }
}

/// Writes `surface.csv`, a figure `surface_<cost>.svg` of each cost, and `report.html`.
///
/// # Errors
/// [`crate::Error::Io`] if a file cannot be written.
pub(super) fn report(folder: &Path, solved: &Solved<'_, super::Surface>, summary: &Summary) -> Result<()> {
    let (setup, outcome) = (solved.prepared, solved.outcome);
    if outcome.record.interrupted {
        return Ok(());
    }
    let problem = &setup.replay.problem;
    let n = outcome.axes[0].len();
    let [x, y] = &problem.variables[..2] else {
        return Ok(());
    };
    let mut table = Table::rows(0..n * n)
        .number(&*x.name, &*x.unit, |i| outcome.axes[0][i % n])
        .number(&*y.name, &*y.unit, |i| outcome.axes[1][i / n]);
    for (o, costs) in problem.objectives.iter().zip(&outcome.costs) {
        table = table.number(&*o.name, &*o.unit, |i| costs[*i]);
    }
    table.table().write_csv(folder.join("surface.csv"))?;

    let mut page = begun_page(setup, summary);
    for (objective, costs) in problem.objectives.iter().zip(&outcome.costs) {
        let mut marks = vec![("car".to_owned(), outcome.base)];
        if let Some(Some(least)) = summary.least.get(&objective.name) {
            marks.push(("least".to_owned(), least.at));
        }
        let told = of_cost(&objective.name);
        let figure = Surface {
            title: format!("Cost of {told} over {} and {}", x.name, y.name),
            x_label: with_unit(&x.name, &x.unit),
            y_label: with_unit(&y.name, &y.unit),
            z_label: with_unit(&format!("cost of {told}"), &objective.unit),
            x: outcome.axes[0].clone(),
            y: outcome.axes[1].clone(),
            z: costs.clone(),
            levels: Levels::Basin,
            marks,
        };
        page.figure(folder.join(format!("surface_{}.svg", objective.name)), &figure)?;
    }
    page.facts(&[("log", &setup.log.source), ("car", &setup.replay.free.car.name)]);
    summary.record.provenance(&mut page, "candidates evaluated");
    page.settings("study.toml, which repeats this run", solved.settings.to_toml());
    page.write(folder.join("report.html"))
}

/// The interactive report, up to its surfaces.
fn begun_page(setup: &Setup, summary: &Summary) -> HtmlReport {
    let [x, y] = &summary.parameters;
    let car = &setup.replay.free.car.name;
    let mut page = HtmlReport::new("surface", &format!("{x} and {y} of the {car}"));
    page.sentence(format!(
        "{} cars over a grid of {x} and {y} were driven through the log in {:.1} s; the {car} itself has {} and {}.",
        summary.record.evaluations,
        summary.record.elapsed_s,
        significant(summary.base[0], 5),
        significant(summary.base[1], 5)
    ));
    for (name, least) in &summary.least {
        if let Some(least) = least {
            let [at_x, at_y] = least.at.map(|v| significant(v, 5));
            page.sentence(format!(
                "The cost of {} is least, {}, where {x} is {at_x} and {y} is {at_y}.",
                of_cost(name),
                significant(least.cost, 4)
            ));
        }
    }
    if summary.failed > 0 {
        page.warning(format!(
            "{} of {} cars did not drive ({}); they are left out.",
            summary.failed,
            summary.record.evaluations,
            failures_in_words(&summary.record.failures)
        ));
    }
    page.section(
        "Costs",
        "From above with lines of equal steps of colour, and in space, to be turned by dragging. Colours go with the root \
         of the cost above its least, which spreads a basin's bottom.",
    );
    page
}
