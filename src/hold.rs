//! A point at which a test holds the program, so that what the test does next does not depend on the machine's speed.
//!
//! `LAPSWARM_HOLD=POINT:N:FILE` writes the name of every point that the program passes to FILE, one a line. At the N-th passing
//! of POINT (the first is 1) it adds `held` and waits until the program is asked to stop or is killed; other threads wait at
//! their next point. An N of 0 holds nothing. Without the variable nothing is written and nothing waits.

use std::fs::File;
use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Duration;

/// What the variable is called.
pub const VARIABLE: &str = "LAPSWARM_HOLD";

/// A point that programs pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Point {
    /// An observer is asked whether a study goes on.
    Step,
    /// A solver that may be stopped is about to take a step.
    Solver,
    /// A file's contents are on the disk under a temporary name.
    Written,
    /// That file has its own name.
    Placed,
    /// A study's state is saved.
    Saved,
}

impl Point {
    /// As the variable and the file have it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Step => "step",
            Self::Solver => "solver",
            Self::Written => "written",
            Self::Placed => "placed",
            Self::Saved => "saved",
        }
    }
}

struct Hold {
    point: String,
    number: u64,
    /// Where passings are written, and how many there were of the point.
    passings: Mutex<(File, u64)>,
}

static HOLD: OnceLock<Option<Hold>> = OnceLock::new();
static RELEASED: AtomicBool = AtomicBool::new(false);

fn from_environment() -> Option<Hold> {
    let given = std::env::var(VARIABLE).ok()?;
    let mut parts = given.splitn(3, ':');
    let (point, number, file) = (parts.next()?, parts.next()?, parts.next()?);
    let file = File::options().create(true).append(true).open(file).ok()?;
    Some(Hold {
        point: point.to_owned(),
        number: number.parse().ok()?,
        passings: Mutex::new((file, 0)),
    })
}

/// Passes a point.
pub fn pass(point: Point) {
    let Some(hold) = HOLD.get_or_init(from_environment) else {
        return;
    };
    let mut passings = hold.passings.lock().unwrap_or_else(PoisonError::into_inner);
    let (file, seen) = &mut *passings;
    // A file that cannot be written fails the test that reads it, and not the study.
    let _ = writeln!(file, "{}", point.name());
    if point.name() != hold.point {
        return;
    }
    *seen += 1;
    if *seen == hold.number {
        let _ = writeln!(file, "held");
        while !RELEASED.load(Ordering::Acquire) {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

/// Lets a program that is held go on: it was asked to stop.
pub fn release() {
    RELEASED.store(true, Ordering::Release);
}
