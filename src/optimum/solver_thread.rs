//! Solvers on threads of their own, so that whoever watches can break them off.

use crate::error::Result;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::ScopedJoinHandle;
use std::time::Duration;

/// Between questions: no longer than an impatient user notices.
const LONGEST_PAUSE: Duration = Duration::from_millis(50);

/// What a solver on another thread comes to. `going_on` is asked meanwhile, and once it breaks off, the flag is raised, which
/// ends the solver: what it comes to then is no optimum.
///
/// # Errors
/// Those of the solver and of `going_on`.
pub fn interruptible<T>(
    solver: ScopedJoinHandle<'_, Result<T>>,
    stop: &AtomicBool,
    mut going_on: impl FnMut() -> Result<ControlFlow<()>>,
) -> Result<T> {
    let mut pause = Duration::from_millis(1);
    let mut asked = Ok(ControlFlow::Continue(()));
    while !solver.is_finished() {
        std::thread::sleep(pause);
        pause = (2 * pause).min(LONGEST_PAUSE);
        if matches!(asked, Ok(ControlFlow::Continue(()))) {
            asked = going_on();
            if !matches!(asked, Ok(ControlFlow::Continue(()))) {
                stop.store(true, Ordering::Relaxed);
            }
        }
    }
    let solved = match solver.join() {
        Ok(solved) => solved,
        Err(panic) => std::panic::resume_unwind(panic),
    };
    asked.and(solved)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;

    /// Works until it is told not to.
    fn patient(stop: &AtomicBool) -> Result<&'static str> {
        while !stop.load(Ordering::Relaxed) {
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok("stopped")
    }

    #[test]
    fn who_breaks_off_ends_the_solver() {
        let stop = AtomicBool::new(false);
        let mut questions = 0;
        let found = std::thread::scope(|scope| {
            interruptible(scope.spawn(|| patient(&stop)), &stop, || {
                questions += 1;
                Ok(if questions == 3 {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                })
            })
        });
        assert_eq!(found.expect("no error"), "stopped");
        assert_eq!(questions, 3);
    }

    #[test]
    fn an_error_ends_the_solver() {
        let stop = AtomicBool::new(false);
        let found = std::thread::scope(|scope| {
            interruptible(scope.spawn(|| patient(&stop)), &stop, || {
                Err(Error::Study("no more".to_owned()))
            })
        });
        assert!(found.is_err_and(|e| e.to_string().contains("no more")));
    }
}
