//! The progress bar on stderr; silent where stderr is no terminal.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use lapswarm::study::identify::{Report, Stage};
use std::time::Instant;

/// Shows a search as it goes.
pub struct SearchBar {
    bar: ProgressBar,
    stage: Option<Stage>,
    began: Instant,
    before: u64,
}

impl SearchBar {
    /// A bar, or a silent one.
    pub fn new(quiet: bool) -> Self {
        // Stderr's target is silent by itself where it is no terminal.
        let target = if quiet {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr()
        };
        let bar = ProgressBar::with_draw_target(Some(1), target);
        let style = ProgressStyle::with_template("{prefix:9} [{bar:32}] {pos}/{len}  {msg}  {eta} left");
        bar.set_style(
            style
                .unwrap_or_else(|_| ProgressStyle::default_bar())
                .progress_chars("=> "),
        );
        Self {
            bar,
            stage: None,
            began: Instant::now(),
            before: 0,
        }
    }

    /// Takes a report in.
    pub fn show(&mut self, report: &Report<'_>) {
        if self.stage != Some(report.stage) {
            self.stage = Some(report.stage);
            self.began = Instant::now();
            self.before = 0;
            self.bar.reset();
            self.bar.set_length(report.planned as u64);
            self.bar.set_prefix(match report.stage {
                Stage::Explore => "exploring",
                Stage::Gather => "gathering",
                Stage::Polish => "polishing",
            });
            if report.stage == Stage::Polish {
                self.bar.set_message("least squares on the exact Jacobian");
            }
        }
        if let Some(progress) = report.progress {
            let seconds = self.began.elapsed().as_secs_f64().max(1e-9);
            let best = progress
                .best
                .iter()
                .map(|b| format!("{b:.3e}"))
                .collect::<Vec<_>>()
                .join(" ");
            self.bar.set_position(progress.iteration as u64);
            let rate = progress.evaluations as f64 / seconds;
            self.bar.set_message(format!(
                "{rate:.0} evaluations/s, best {best}, {} failed",
                progress.failed
            ));
        }
    }

    /// Takes the bar away.
    pub fn finish(self) {
        self.bar.finish_and_clear();
    }
}

/// A bar that counts evaluations, or a silent one.
pub fn counting(quiet: bool) -> ProgressBar {
    let target = if quiet {
        ProgressDrawTarget::hidden()
    } else {
        ProgressDrawTarget::stderr()
    };
    let bar = ProgressBar::with_draw_target(Some(1), target);
    if let Ok(style) =
        ProgressStyle::with_template("[{bar:32}] {pos}/{len} evaluations, {per_sec}, {eta} left")
    {
        bar.set_style(style.progress_chars("=> "));
    }
    bar
}

/// A line that says what is being done, or a silent one.
pub fn saying(quiet: bool) -> ProgressBar {
    let target = if quiet {
        ProgressDrawTarget::hidden()
    } else {
        ProgressDrawTarget::stderr()
    };
    let bar = ProgressBar::with_draw_target(None, target);
    if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed_precise} {msg}") {
        bar.set_style(style);
    }
    bar
}
