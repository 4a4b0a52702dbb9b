//! Reproductions: tables beside the published figures, broken off and resumed.

use lapswarm::Error;
use lapswarm::study::framework::Progress;
use lapswarm::study::reproduce::{
    EvaluatedOn, PAGE, ReproduceRequest, ReproduceSettings, Summary, begin, reproduce,
};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

fn run(
    settings: &ReproduceSettings,
    folder: &Path,
    observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Summary, Error> {
    let request = ReproduceRequest {
        save_every: Duration::ZERO,
        time_limit: None,
        memory_limit_mib: 4096,
        stop: Arc::default(),
        observe,
        draw: &|drawing, folder| {
            std::fs::create_dir_all(folder).expect("a folder");
            std::fs::write(folder.join(PAGE), drawing.title.as_bytes()).expect("a page");
            Ok(())
        },
    };
    reproduce(settings, folder, request)
}

fn begun(folder: &Path) -> ReproduceSettings {
    let settings = ReproduceSettings::new(&[3, 2], true, EvaluatedOn::default()).expect("chapters");
    std::fs::create_dir_all(folder).expect("a folder");
    begin(&settings, folder).expect("it begins");
    settings
}

#[test]
#[ignore = "full tier: two chapters twice"]
fn a_reproduction_that_is_broken_off_goes_on_with_what_is_left() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let (whole, broken) = (root.path().join("whole"), root.path().join("broken"));
    let settings = begun(&whole);
    let expected = run(&settings, &whole, &mut |_| ControlFlow::Continue(())).expect("it ends");
    assert!(expected.tables.len() >= 2);
    let last = expected.tables.last().expect("a table").name.clone();

    begun(&broken);
    let error = run(&settings, &broken, &mut |progress| {
        if progress.stage.starts_with(&last) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    });
    assert!(
        matches!(&error, Err(Error::Interrupted(at)) if *at == broken),
        "{error:?}"
    );
    assert!(!broken.join("summary.json").exists());
    let mut again = Vec::new();
    let resumed = run(&settings, &broken, &mut |progress| {
        again.push(progress.stage.clone());
        ControlFlow::Continue(())
    });
    let resumed = resumed.expect("it ends");
    assert!(again.iter().all(|stage| stage.starts_with(&last)), "{again:?}");
    for (resumed, expected) in resumed.tables.iter().zip(&expected.tables) {
        assert_eq!(resumed.rows, expected.rows);
        assert!(resumed.elapsed_s > 0.0);
    }
    for name in ["published.csv", "report.html", "summary.json"] {
        assert!(broken.join(name).is_file(), "{name}");
    }
    // Drawings come last, once, and the page shows the way to theirs.
    let tyres = broken.join("2_5_tyres").join(PAGE);
    assert!(tyres.is_file());
    let page = std::fs::read_to_string(broken.join(PAGE)).expect("the page");
    assert!(page.contains("2_5_tyres/report.html"));
    std::fs::write(&tyres, "kept").expect("a page");
    run(&settings, &broken, &mut |_| ControlFlow::Continue(())).expect("it ends");
    assert_eq!(std::fs::read_to_string(&tyres).expect("the page"), "kept");
    let other = ReproduceSettings::new(&[3], true, EvaluatedOn::default()).expect("a chapter");
    let refused = run(&other, &broken, &mut |_| ControlFlow::Continue(())).expect_err("another");
    assert_eq!(refused.exit_code(), 2);
}
