//! Tests that need what not every machine has: they show as ignored, with the reason, where it is missing.

use super::radv;
use lapswarm::evaluate::gpu::GpuContext;
use libtest_mimic::{Arguments, Completion, Failed, Trial};
use std::cell::RefCell;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::OnceLock;

/// Names the folder of data that belong to others and are not in the repository.
const OUTSIDE: &str = "LAPSWARM_OUTSIDE";

/// Names the file of SwiftShader for the Vulkan loader.
const SWIFTSHADER: &str = "LAPSWARM_SWIFTSHADER";

/// A test and what it needs.
pub struct Case {
    name: String,
    run: fn(),
    needs: Option<Box<dyn Fn() -> Result<(), String> + Send>>,
    /// A part that the test leaves out where something is missing.
    part: Option<(&'static str, Need)>,
    full: bool,
}

/// Whether something is there; the error is the reason why it is not.
type Need = fn() -> Result<(), String>;

impl Case {
    /// The test `name` of a module.
    pub fn new(module: &str, name: &str, run: fn()) -> Self {
        let (_, module) = module.split_once("::").unwrap_or_default();
        Self {
            name: format!("{module}::{name}"),
            run,
            needs: None,
            part: None,
            full: false,
        }
    }

    /// Runs everywhere.
    pub fn everywhere(self) -> Self {
        self
    }

    /// Needs a device.
    pub fn device(self) -> Self {
        self.needing(adapter)
    }

    /// Runs everywhere, and on a device too where there is one.
    pub fn also_device(mut self) -> Self {
        self.part = Some(("its part on a device", adapter));
        self
    }

    /// Runs everywhere, and opens its pages where there is a browser.
    pub fn also_browser(mut self) -> Self {
        self.part = Some(("its part in a browser", chromium));
        self
    }

    /// Belongs to the full tier: it takes long.
    pub fn full(mut self) -> Self {
        self.full = true;
        self
    }

    /// Needs whatever this asks for; an error is the reason why it is not there.
    pub fn needing(mut self, needs: impl Fn() -> Result<(), String> + Send + 'static) -> Self {
        self.needs = Some(Box::new(needs));
        self
    }

    /// Needs the compiler for AMD that the bars were measured with.
    pub fn radv(self) -> Self {
        self.needing(radv::with_bars)
    }

    /// Needs lavapipe, which the loader can be given twice.
    pub fn two_software_devices(self) -> Self {
        self.needing(|| radv::software_driver().map(drop))
    }

    /// Needs SwiftShader.
    pub fn swiftshader(self) -> Self {
        self.needing(|| swiftshader().map(drop))
    }

    /// Needs the survey of Silverstone.
    pub fn survey(self) -> Self {
        self.needing(|| survey().map(drop))
    }

    /// Needs a browser.
    pub fn browser(self) -> Self {
        self.needing(chromium)
    }

    fn trials(self) -> Vec<Trial> {
        let Self { name, run, needs, .. } = self;
        let mut trials = Vec::new();
        if let Some((part, need)) = self.part
            && let Err(reason) = need()
        {
            let part = format!("{name} ({part})");
            trials.push(Trial::ignorable_test(part, move || missing(&reason)));
        }
        trials.push(Trial::ignorable_test(name, move || {
            if let Some(reason) = needs.and_then(|needs| needs().err()) {
                return missing(&reason);
            }
            let _shown = ShownOnPanic;
            run();
            Ok(Completion::Completed)
        }));
        let kind = if self.full { "full tier" } else { "" };
        let full = |trial: Trial| trial.with_ignored_flag(self.full).with_kind(kind);
        trials.into_iter().map(full).collect()
    }
}

thread_local! {
    /// What the test on this thread has printed.
    static SAID: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Keeps a line until the test ends.
pub fn say(line: &str) {
    SAID.with_borrow_mut(|said| *said += &format!("{line}\n"));
}

/// Prints what was kept if the test failed.
struct ShownOnPanic;

impl Drop for ShownOnPanic {
    fn drop(&mut self) {
        let said = SAID.take();
        if std::thread::panicking() {
            eprint!("{said}");
        }
    }
}

/// Whether there is a device: asked once, before any test makes devices fail.
///
/// # Errors
/// Why there is none.
pub fn adapter() -> Result<(), String> {
    static FOUND: OnceLock<Result<(), String>> = OnceLock::new();
    let look = || {
        GpuContext::shared(None)
            .map(drop)
            .map_err(|e| format!("no GPU adapter: {e}"))
    };
    FOUND.get_or_init(look).clone()
}

/// Ignores a test, or fails it where the machine must have all that a device needs.
fn missing(reason: &str) -> Result<Completion, Failed> {
    let required = std::env::var("LAPSWARM_REQUIRE_GPU").is_ok_and(|x| x == "1");
    if required && reason.contains("adapter") {
        return Err(format!("LAPSWARM_REQUIRE_GPU=1, but {reason}").into());
    }
    Ok(Completion::ignored_with(reason))
}

/// A file of others' data.
///
/// # Errors
/// How to make it known.
pub fn outside(name: &str, source: &str) -> Result<PathBuf, String> {
    std::env::var_os(OUTSIDE)
        .map(|folder| PathBuf::from(folder).join(name))
        .filter(|path| path.is_file())
        .ok_or_else(|| format!("outside data: {OUTSIDE} names no folder with {name} of {source}"))
}

/// The surveyed Silverstone: the centreline and widths of the TUM race track database.
///
/// # Errors
/// As [`outside`].
pub fn survey() -> Result<PathBuf, String> {
    outside("Silverstone.csv", "the TUM race track database")
}

/// The file of SwiftShader, a driver on the processor that comes with Chromium, for the Vulkan loader.
///
/// # Errors
/// How to make it known.
pub fn swiftshader() -> Result<PathBuf, String> {
    let asked = std::env::var_os(SWIFTSHADER).map(PathBuf::from);
    let beside = [
        "/usr/lib/chromium",
        "/usr/lib/chromium-browser",
        "/opt/google/chrome",
    ];
    let files = beside.map(|folder| PathBuf::from(folder).join("vk_swiftshader_icd.json"));
    asked
        .into_iter()
        .chain(files)
        .find(|file| file.is_file())
        .ok_or_else(|| {
            format!("no SwiftShader here: it comes with Chromium, or {SWIFTSHADER} names its file")
        })
}

/// A browser that runs without a screen.
pub fn browser() -> Option<PathBuf> {
    let asked = std::env::var_os("LAPSWARM_BROWSER").map(PathBuf::from);
    let names = [
        "chromium",
        "chromium-browser",
        "google-chrome",
        "google-chrome-stable",
    ];
    let path = std::env::var_os("PATH").unwrap_or_default();
    let mut found = std::env::split_paths(&path).flat_map(|folder| names.map(|name| folder.join(name)));
    asked.or_else(|| found.find(|file| file.is_file()))
}

fn chromium() -> Result<(), String> {
    browser().map(drop).ok_or_else(|| "no Chromium here".to_owned())
}

/// Runs the tests of some modules, as the arguments have it.
pub fn main(modules: impl IntoIterator<Item = Vec<Case>>) -> ExitCode {
    let _ = adapter();
    let trials = modules.into_iter().flatten().flat_map(Case::trials).collect();
    libtest_mimic::run(&Arguments::from_args(), trials).exit_code()
}

/// As the standard one, but shown only if the test fails.
#[allow(unused_macros)] // Not every target has such tests.
macro_rules! println {
    ($($part:tt)+) => {
        $crate::common::harness::say(&format!($($part)+))
    };
}

/// The tests of a module: each with what it needs, methods of [`Case`].
#[allow(unused_macros)] // Not every target has such tests.
macro_rules! tests {
    ($($name:ident: $($need:ident)+,)+) => {
        pub fn tests() -> Vec<$crate::common::harness::Case> {
            vec![$($crate::common::harness::Case::new(module_path!(), stringify!($name), $name)$(.$need())+),+]
        }
    };
}
