//! Problems of racing lines: the cross-sections they cross, the variables that give them, and the objectives.

use crate::error::{Error, Result};
use crate::evaluate::Problem;
use crate::evaluate::objectives::{listed, objectives};
use crate::line::kernel::{Shape, Wanted};
use crate::line::{EnvelopeTable, LinePlan, Parametrisation, PointMass, geometry};
use crate::track::CrossSections;
use glam::DVec2;

objectives! {
    /// What of a line can be minimised.
    LineObjective {
        /// Its length, m.
        Length: "length", "m", "length";
        /// The sum of its segments' squared lengths, m^2.
        LengthSquared: "length_squared", "m^2", "squared length";
        /// The root of the sum of its squared second differences over the spacing of the cross-sections, 1/m.
        Gamma: "gamma", "1/m", "second difference";
        /// The integral of its curvature squared over the length, 1/m.
        Kappa2: "kappa2", "1/m", "squared curvature";
        /// The time of the quasi-steady-state lap on it, s.
        LapTime: "lap_time", "s", "lap time";
    }
}

impl LineObjective {
    /// What the line is called on which the objective is least.
    pub fn line_name(self) -> &'static str {
        [
            "shortest",
            "least squared length",
            "least second difference",
            "minimum-curvature",
            "fastest",
        ][self as usize]
    }
}

/// Figures of one line, one for each [`LineObjective`] and in their order: of Gamma the square.
pub(super) type Measures = [f64; MEASURES];
/// How many those are.
pub(super) const MEASURES: usize = LineObjective::ALL.len();

impl<R: Copy> From<(Shape<R>, R)> for MeasuresOf<R> {
    fn from((shape, time): (Shape<R>, R)) -> Self {
        Self([
            shape.length,
            shape.length_squared,
            shape.second_differences,
            shape.integral,
            time,
        ])
    }
}

/// [`Measures`] in any scalar.
pub(super) struct MeasuresOf<R>(pub [R; MEASURES]);

/// Most rounds in which lines are brought inside.
const INSIDE_SWEEPS: usize = 30;
/// How far inside they are put, as a share of the width: 10 micrometres, above rounding.
const INSIDE: f64 = 1e-6;

/// Finding lines across sections.
#[derive(Clone, Debug)]
pub struct LineProblem {
    /// Variables and objectives.
    pub problem: Problem,
    cross_sections: CrossSections,
    parametrisation: Parametrisation,
    pub(super) objectives: Vec<LineObjective>,
    plan: LinePlan<f64>,
    car: Option<PointMass>,
    envelope: Option<EnvelopeTable<f64>>,
}

impl LineProblem {
    /// The problem of finding lines across `cross_sections`, which the middle of the car may use from end to end (see
    /// [`CrossSections::narrowed`]). `car` drives the laps; `entry_mps` is its greatest speed at the start of an open circuit
    /// (m/s).
    ///
    /// # Errors
    /// [`Error::Input`] if there are fewer than three sections, if objectives are missing or come twice, if a lap time is
    /// asked for without a car, or if the parametrisation or the car is out of range.
    pub fn new(
        cross_sections: CrossSections,
        parametrisation: Parametrisation,
        objectives: &[LineObjective],
        car: Option<PointMass>,
        entry_mps: f64,
    ) -> Result<Self> {
        let wrong = |place: &str, found: String, expected: &str| {
            Err(Error::input(&cross_sections.name, place, found, expected))
        };
        let n = cross_sections.len();
        if n < 3 || cross_sections.right_m.len() != n || cross_sections.left_m.len() != n {
            return wrong("sections", n.to_string(), "at least three, each with both ends");
        }
        let finite = |points: &[DVec2]| points.iter().all(|p| p.is_finite());
        if !(finite(&cross_sections.right_m) && finite(&cross_sections.left_m)) {
            return wrong(
                "sections",
                "a position that is not finite".to_owned(),
                "finite positions",
            );
        }
        if !(0.0..=1000.0).contains(&entry_mps) {
            return wrong("entry speed", format!("{entry_mps} m/s"), "0 to 1000 m/s");
        }
        let twice = (1..objectives.len()).find(|&i| objectives[..i].contains(&objectives[i]));
        if let Some(i) = twice {
            return wrong(
                "objectives",
                format!("{} twice", objectives[i].name()),
                "each once",
            );
        }
        if objectives.is_empty() {
            return wrong("objectives", "none".to_owned(), "at least one");
        }
        if car.is_none() && objectives.contains(&LineObjective::LapTime) {
            return wrong(
                "objectives",
                "lap_time without a car".to_owned(),
                "a car's envelope",
            );
        }
        let mut plan = LinePlan::of_cross_sections(
            &cross_sections.right_m,
            &cross_sections.left_m,
            cross_sections.closed,
        )
        .spaced(&cross_sections.spacing_m())
        .with_drs(&cross_sections.drs)
        .with_relief(&cross_sections);
        parametrisation.apply(&cross_sections, &mut plan)?;
        plan.entry = entry_mps * entry_mps;
        let middle = geometry(&cross_sections.points(&vec![0.5; n]), cross_sections.closed);
        let sharpness = |i: &usize| middle.curvature_1pm[*i].abs();
        plan.start = (0..n)
            .max_by(|i, j| sharpness(i).total_cmp(&sharpness(j)))
            .unwrap_or(0);
        if !plan.relief.is_empty() && car.as_ref().is_some_and(|car| !car.relief) {
            let found = "a car with limits for level roads".to_owned();
            return wrong("car", found, "limits under loads, for a road in three dimensions");
        }
        let envelope = car.as_ref().map(PointMass::table).transpose()?;
        Ok(Self {
            problem: Problem {
                variables: parametrisation.variables(&cross_sections),
                objectives: listed(objectives),
            },
            cross_sections,
            parametrisation,
            objectives: objectives.to_vec(),
            plan,
            car,
            envelope,
        })
    }

    /// The sections.
    pub fn cross_sections(&self) -> &CrossSections {
        &self.cross_sections
    }

    /// How variables give a line.
    pub fn parametrisation(&self) -> &Parametrisation {
        &self.parametrisation
    }

    /// The objectives.
    pub fn objectives(&self) -> &[LineObjective] {
        &self.objectives
    }

    /// The car that laps are timed with.
    pub fn car(&self) -> Option<&PointMass> {
        self.car.as_ref()
    }

    /// The car's limits, a table made from its g-g-v envelope.
    pub fn envelope(&self) -> Option<&EnvelopeTable<f64>> {
        self.envelope.as_ref()
    }

    /// What the kernels read of the sections.
    pub fn plan(&self) -> &LinePlan<f64> {
        &self.plan
    }

    /// Number of variables.
    pub fn dimensions(&self) -> usize {
        self.problem.variables.len()
    }

    /// `alpha` at every section, of a candidate.
    pub fn alpha(&self, candidate: &[f64]) -> Vec<f64> {
        self.plan
            .rows
            .iter()
            .map(|row| crate::line::kernel::alpha(row, self.plan.terms, candidate))
            .collect()
    }

    /// The points of a candidate's line (m), one per section.
    pub fn points(&self, candidate: &[f64]) -> Vec<DVec2> {
        self.cross_sections.points(&self.alpha(candidate))
    }

    /// The candidate whose line comes closest to `alpha` at every section.
    ///
    /// # Errors
    /// As [`Parametrisation::fit`].
    pub fn candidate(&self, alpha: &[f64]) -> Result<Vec<f64>> {
        Ok(self.candidates(&[alpha])?.swap_remove(0))
    }

    /// As [`LineProblem::candidate`], for several lines.
    ///
    /// # Errors
    /// As [`Parametrisation::fit`].
    pub fn candidates(&self, lines: &[&[f64]]) -> Result<Vec<Vec<f64>>> {
        let fitted = self.parametrisation.fit_all(&self.cross_sections, lines)?;
        let variables = |coefficients: &Vec<f64>| self.parametrisation.variables_of(coefficients);
        Ok(fitted.iter().map(variables).collect())
    }

    /// Moves the variables of `candidate` so that its line lies on the road at every cross-section; returns the sum of the squared
    /// moves. Kernels would hold such a line at the edge with a kink.
    ///
    /// Sections off the road are put back on it one after the other, each by the least move of its variables, until none
    /// is left (S. Kaczmarz, *Angenäherte Auflösung von Systemen linearer Gleichungen*, 1937; for inequalities S. Agmon,
    /// *The relaxation method for linear inequalities*, Canadian J. Math. 6, 1954).
    pub fn bring_inside(&self, candidate: &mut [f64]) -> f64 {
        let (rows, terms) = (&self.plan.rows, self.plan.terms);
        let before = candidate.to_vec();
        // A row that was mended moves others that share its variables.
        let reach = 3 * rows.len().div_ceil(candidate.len().max(1));
        let mut due: Vec<usize> = (0..rows.len()).collect();
        let mut mended = Vec::new();
        for round in 0..INSIDE_SWEEPS {
            mended.clear();
            for &i in &due {
                let row = &rows[i];
                let parts = || row.weights[..terms].iter().zip(&row.sources[..terms]);
                let sum = row.constant + parts().map(|(w, s)| w * candidate[*s as usize]).sum::<f64>();
                let over = if sum > 1.0 {
                    sum - 1.0 + INSIDE
                } else if sum < 0.0 {
                    sum - INSIDE
                } else {
                    continue;
                };
                let squares: f64 = parts().map(|(w, _)| w * w).sum();
                if squares > 0.0 {
                    parts().for_each(|(w, s)| candidate[*s as usize] -= over * w / squares);
                    mended.push(i);
                }
            }
            if mended.is_empty() {
                break;
            }
            due.clear();
            mended.sort_unstable();
            let mut next = 0;
            for &i in &mended {
                let end = (i + reach + 1).min(rows.len());
                due.extend(i.saturating_sub(reach).max(next)..end);
                next = next.max(end);
            }
            // The first rows of a closed line follow the last, and share variables with them.
            if self.plan.closed {
                let (first, last) = (due[0], next);
                if last == rows.len() {
                    due.extend(0..reach.min(first));
                }
                if first == 0 {
                    due.extend(rows.len().saturating_sub(reach).max(last)..rows.len());
                }
            }
            // To and fro, so that no end of a stretch is always the last to be heard.
            if round % 2 == 0 {
                due.reverse();
            }
        }
        let moved = candidate.iter().zip(&before);
        moved.map(|(after, before)| (after - before).powi(2)).sum()
    }

    /// What the kernels must compute.
    pub(super) fn wanted(&self) -> Wanted {
        Wanted {
            integral: self.objectives.contains(&LineObjective::Kappa2),
            lap: self.objectives.contains(&LineObjective::LapTime),
        }
    }
}
