//! The progress bar on stderr; silent where stderr is no terminal.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use lapswarm::study::framework::Progress;

/// Shows a study as it goes.
pub struct Bar {
    bar: ProgressBar,
    stage: Option<String>,
}

impl Bar {
    /// A bar, or a silent one.
    pub fn new(quiet: bool) -> Self {
        // Stderr's target is silent by itself where it is no terminal.
        let target = if quiet {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr()
        };
        Self {
            bar: ProgressBar::with_draw_target(None, target),
            stage: None,
        }
    }

    /// Shows what a study tells.
    pub fn show(&mut self, progress: &Progress) {
        if self.stage.as_ref() != Some(&progress.stage) {
            self.bar.reset();
            let template = match progress.planned {
                Some(planned) => {
                    self.bar.set_length(planned);
                    "{prefix:12} [{bar:32}] {pos}/{len}  {per_sec}  {msg}  {eta} left"
                }
                None => {
                    self.bar.unset_length();
                    "{spinner} {elapsed_precise} {prefix:24} {msg}"
                }
            };
            if let Ok(style) = ProgressStyle::with_template(template) {
                self.bar.set_style(style.progress_chars("=> "));
            }
            self.bar.set_prefix(progress.stage.clone());
            self.stage = Some(progress.stage.clone());
        }
        self.bar.set_position(progress.done);
        self.bar.set_message(progress.reached.clone());
        self.bar.tick();
    }

    /// Takes the bar away.
    pub fn finish(self) {
        self.bar.finish_and_clear();
    }
}
