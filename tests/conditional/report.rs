//! Reports as a reader meets them: runs laid side by side by the program, pages opened in a real browser.

use crate::common::harness::browser;
use glam::DVec2;
use lapswarm::report::{
    BarPanel, Bars, Curves, Front, HtmlReport, LapLine, LapView, Levels, Panel, ParameterRow, Parameters,
    Road, Scale, Surface, Table, with_unit,
};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

tests! {
    pages_work_in_a_browser: browser,
    runs_are_laid_side_by_side: everywhere,
    what_is_measured_has_a_page: also_browser,
    parity_has_a_page: full also_browser,
    folders_that_are_no_runs_are_refused_by_name: everywhere,
}

/// As a channel, a car and a track may be called in a file.
const HOSTILE: &str = "<script>window.alerted=true</script><img src=x onerror=\"window.alerted=true\">";

fn lapswarm(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lapswarm"));
    command.args(arguments).output().unwrap()
}

fn raceline(folder: &Path, seed: &str) {
    let out = folder.to_str().unwrap();
    let small = [
        "--track",
        "stadium:400:120:14",
        "--sections",
        "60",
        "--population",
        "20",
        "--iterations",
        "5",
        "--backend",
        "simd",
    ];
    let mut arguments = vec![
        "raceline",
        "--out",
        out,
        "--quiet",
        "--seed",
        seed,
        "--objectives",
        "length,gamma,lap_time",
    ];
    arguments.extend(small);
    let run = lapswarm(&arguments);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
}

fn envelope(folder: &Path, step: &str) {
    let run = lapswarm(&[
        "envelope",
        "--out",
        folder.to_str().unwrap(),
        "--quiet",
        "--step-mps",
        step,
    ]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
}

/// A page with every kind of chart on it, a long lap, and a hostile name wherever a name can stand.
fn everything(path: &Path) {
    let mut page = HtmlReport::new("identify", HOSTILE);
    page.sentence(HOSTILE);
    page.tile(HOSTILE, HOSTILE, HOSTILE);
    page.warning(HOSTILE);
    page.section(HOSTILE, HOSTILE);
    let n = 14_000;
    let x: Vec<f64> = (0..n).map(|i| 0.4 * f64::from(i)).collect();
    let angle = |s: f64| s * std::f64::consts::TAU / 5600.0;
    let wave = |k: f64| -> Vec<f64> { x.iter().map(|s| 40.0 + k * (3.0 * angle(*s)).sin()).collect() };
    let ring =
        |radius: f64| -> Vec<DVec2> { x.iter().map(|s| radius * DVec2::from_angle(angle(*s))).collect() };
    let (low, high) = (wave(8.0), wave(12.0));
    let (inner, outer) = (ring(880.0), ring(900.0));
    let line = |k: f64, banded: bool| {
        let line = LapLine::new(HOSTILE, &x[..]).trace(0, wave(k));
        let line = if banded { line.band(&low, &high) } else { line };
        line.trace(1, wave(0.1 * k)).at(ring(890.0 + 0.1 * k))
    };
    let view = LapView::new(HOSTILE)
        .note(HOSTILE)
        .panel(HOSTILE, "m/s^2")
        .low_panel(HOSTILE, "m/s^2")
        .lines([line(10.0, true), line(20.0, false)])
        .sections([(HOSTILE.to_owned(), 500.0, 1500.0)])
        .road(Road {
            names: vec![(HOSTILE.to_owned(), inner[0])],
            left_edge_m: inner,
            right_edge_m: outer,
            closed: true,
        });
    page.place(&view).unwrap();
    let steps: Vec<f64> = (0..50).map(f64::from).collect();
    let panel = Panel::new(HOSTILE)
        .x(HOSTILE, "")
        .y(HOSTILE, "m/s^2")
        .scales(Scale::Linear, Scale::Log);
    let panel = (0..3).fold(panel, |panel, k| {
        let y: Vec<f64> = steps.iter().map(|i| i * f64::from(k) + 1.0).collect();
        match k {
            2 => panel.shaded(0.5, HOSTILE, &steps, &y),
            _ => panel.curve(HOSTILE, &steps, &y),
        }
    });
    page.place(&Curves::new(HOSTILE, [panel])).unwrap();
    let row = |fitted, truth| ParameterRow {
        name: HOSTILE.to_owned(),
        unit: "N".to_owned(),
        lower: 0.0,
        upper: 2.0,
        swarm: 0.7,
        fitted,
        standard_error: Some(0.1),
        truth,
        identifiable: truth.is_some(),
    };
    page.place(&Parameters {
        title: HOSTILE.to_owned(),
        note: HOSTILE.to_owned(),
        rows: vec![row(1.0, Some(1.1)), row(0.4, None)],
    })
    .unwrap();
    let points: Vec<Vec<f64>> = (0..40)
        .map(f64::from)
        .map(|i| vec![i, 40.0 - i, (i - 20.0).powi(2)])
        .collect();
    let front = Front::new(HOSTILE, &points).mark(7, HOSTILE);
    page.place(&(0..3).fold(front, |front, _| front.objective(HOSTILE, "s")))
        .unwrap();
    let steps: Vec<f64> = (0..30).map(f64::from).collect();
    let bowl = |x: &f64, y: &f64| (x - 9.0).powi(2) + (y - 20.0).powi(2) + 1.0;
    let z: Vec<f64> = steps
        .iter()
        .flat_map(|y| steps.iter().map(move |x| bowl(x, y)))
        .collect();
    let surface = Surface {
        title: HOSTILE.to_owned(),
        x_label: HOSTILE.to_owned(),
        y_label: HOSTILE.to_owned(),
        z_label: HOSTILE.to_owned(),
        x: steps.clone(),
        y: steps,
        z,
        levels: Levels::Basin,
        marks: vec![(HOSTILE.to_owned(), [9.0, 20.0])],
    };
    page.place(&surface).unwrap();
    let bars = ["alone", HOSTILE].into_iter().fold(
        BarPanel::new(HOSTILE, with_unit(HOSTILE, "m/s^2"), [HOSTILE, "plain"]),
        |panel, label| panel.with_intervals(label, [0.3, 0.6], [[0.2, 0.4], [0.5, 0.65]]),
    );
    page.place(&Bars::new(HOSTILE, [bars])).unwrap();
    let table =
        Table::new()
            .texts(HOSTILE, ["b", HOSTILE, "a"])
            .numbers("n", "m/s^2", vec![2.0, f64::NAN, 1.0]);
    page.table(HOSTILE, HOSTILE, &table).unwrap();
    page.provenance(HOSTILE, HOSTILE);
    page.settings(HOSTILE, HOSTILE);
    page.write(path).unwrap();
}

/// Opens a page, uses it by `tests/browser/checks.js`, and gives back what came of it.
fn used(browser: &Path, page: &Path) -> serde_json::Value {
    let html = std::fs::read_to_string(page).unwrap();
    assert!(html.len() < 6_000_000, "{} bytes", html.len());
    let (head, body) = html.split_once("<meta name=\"viewport\"").unwrap();
    let (body, end) = body.rsplit_once("</body>").unwrap();
    let under_test = page.with_file_name("under_test.html");
    let (early, checks) = (
        include_str!("../browser/early.js"),
        include_str!("../browser/checks.js"),
    );
    let text = format!(
        "{head}<script>{early}</script><meta name=\"viewport\"{body}<script>{checks}</script></body>{end}"
    );
    std::fs::write(&under_test, text).unwrap();
    let profile = tempfile::tempdir().unwrap();
    let dom = page.with_file_name("dom.html");
    let mut child = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--no-first-run",
            "--dump-dom",
        ])
        .args([
            "--window-size=1440,1000",
            "--virtual-time-budget=8000",
            "--host-resolver-rules=MAP * ~NOTFOUND",
        ])
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg(format!("file://{}", under_test.display()))
        .stdout(std::fs::File::create(&dom).unwrap())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let began = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if began.elapsed() > Duration::from_secs(300) {
            child.kill().unwrap();
            panic!("the browser did not come back");
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    let dom = std::fs::read_to_string(dom).unwrap();
    let (_, findings) = dom.split_once("<pre id=\"findings\">").expect("the checks ended");
    let findings = findings.split_once("</pre>").unwrap().0;
    let plain = findings
        .replace("&lt;", "<")
        .replace("&gt;", ">")
        .replace("&amp;", "&");
    serde_json::from_str(&plain).unwrap()
}

/// What holds for every page: no fault, nothing blank, nothing run that came from a name.
fn sound(findings: &serde_json::Value, charts: u64) {
    assert_eq!(findings["faults"], serde_json::json!([]), "{findings}");
    assert_eq!(findings["charts"], charts, "{findings}");
    assert_eq!(findings["blank"], 0, "{findings}");
    assert_eq!(findings["alerted"], false, "{findings}");
    // Data, library, our own, and the two of the test.
    assert_eq!(findings["scripts"], 5, "{findings}");
    assert_eq!(findings["sorts"], true, "{findings}");
}

/// Moving along the traces moves the dot and changes the read-out, and the map leads back to the traces.
fn linked(findings: &serde_json::Value) {
    let dots: Vec<Option<&str>> = findings["dot_from_traces"]
        .as_array()
        .unwrap()
        .iter()
        .map(|d| d.as_str())
        .collect();
    assert_eq!(dots.len(), 3);
    assert_eq!(dots[0], None, "{findings}");
    assert!(
        dots[1].is_some() && dots[2].is_some() && dots[1] != dots[2],
        "{findings}"
    );
    assert_eq!(findings["readouts_differ"], true, "{findings}");
    let told = findings["map_to_traces"].as_array().unwrap();
    assert_ne!(told[0], told[1], "{findings}");
    assert_eq!(findings["map_follows_zoom"], true, "{findings}");
}

fn pages_work_in_a_browser() {
    let browser = browser().expect("the harness has looked");
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("everything.html");
    everything(&page);
    let findings = used(&browser, &page);
    sound(&findings, 6);
    linked(&findings);
    // 2 and 1 m/s^2, with a gap.
    assert_eq!(
        findings["in_g"],
        serde_json::json!(["0.2039", "\u{2013}", "0.102"]),
        "{findings}"
    );
    assert_eq!(findings["lap_units"], serde_json::json!(["g"]), "{findings}");
    // The curves' and the bars'. The greatest bar is 0.6 m/s^2.
    assert_eq!(findings["axes_in_g"], 2, "{findings}");
    let bar_g = findings["greatest_bar"].as_f64().unwrap();
    assert!((bar_g - 0.6 / 9.80665).abs() < 1e-4, "{findings}");
    assert!(
        findings["switch"]
            .as_str()
            .is_some_and(|s| s.ends_with("change to SI")),
        "{findings}"
    );

    let [first, second] = ["a", "b"].map(|name| folder.path().join(name));
    raceline(&first, "1");
    raceline(&second, "2");
    let findings = used(&browser, &first.join("report.html"));
    // Lines, front, three swarms, three surfaces.
    sound(&findings, 8);
    linked(&findings);

    let page = folder.path().join("both.html");
    let [first, second] = [first, second].map(|f| f.display().to_string());
    let run = lapswarm(&["report", &first, &second, "--out", page.to_str().unwrap()]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let html = std::fs::read_to_string(&page).unwrap();
    let (_, data) = html.split_once("id=\"charts\">").unwrap();
    let data: serde_json::Value = serde_json::from_str(data.split_once("</script>").unwrap().0).unwrap();
    // The road of the first run lies under the lines, and the first run loses no time on itself.
    assert_eq!(data[0]["map"]["left"][0].as_array().unwrap().len(), 60);
    let lost = data[0]["lines"][0]["traces"].as_array().unwrap().last().unwrap();
    assert!(lost["values"].as_array().unwrap().iter().all(|v| v == 0));
    let findings = used(&browser, &page);
    // Laps and four limits.
    sound(&findings, 5);
    linked(&findings);
}

fn runs_are_laid_side_by_side() {
    let folder = tempfile::tempdir().unwrap();
    let [coarse, fine] = ["coarse", "fine"].map(|name| folder.path().join(name));
    envelope(&coarse, "10");
    envelope(&fine, "5");
    let out = folder.path().join("both.html");
    let [a, b, page] = [&coarse, &fine, &out].map(|p| p.to_str().unwrap());
    let run = lapswarm(&["report", a, b, "--out", page, "--json"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let said = String::from_utf8(run.stdout).unwrap();
    let json: serde_json::Value = serde_json::from_str(said.lines().last().unwrap()).unwrap();
    assert_eq!(json["file"], page);
    let html = std::fs::read_to_string(&out).unwrap();
    for expected in [
        "2 runs of envelope, by top speed: coarse",
        "top_speed_mps",
        "Braking grip",
        "second against first",
    ] {
        assert!(html.contains(expected), "{expected}");
    }
    // The same again would overwrite it.
    let again = lapswarm(&["report", a, b, "--out", page]);
    assert_eq!(again.status.code(), Some(2));
}

/// Sweeps, measurements and simulated laps have pages: what they say in words, and their charts in a browser.
fn what_is_measured_has_a_page() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = folder.path().join("sweep.toml");
    let text = "study = \"identify\"\n[base]\npolish = false\n[base.swarm]\nalgorithm = \"thesis\"\niterations = 2\n\
                [base.free]\nrBy1 = [5.0, 25.0]\n[grid]\n\"swarm.population\" = [8, 16]\nseed = [1, 2]\n";
    std::fs::write(&sweep, text).unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let sweep = sweep.display().to_string();
    let small = [
        "--populations",
        "16,64",
        "--backend",
        "simd",
        "--problems",
        "line",
    ];
    // Words of the page, its charts, and a file beside it.
    let runs: [(&str, Vec<&str>, &str, u64, &str); 6] = [
        (
            "sweep",
            vec!["sweep", &sweep],
            "4 runs of identify with 2 settings, 2 seeds each.",
            13,
            "medians.svg",
        ),
        (
            "bench",
            [&["bench"], small.as_slice()].concat(),
            "line: at most",
            3,
            "scaling.svg",
        ),
        (
            "swarm",
            vec![
                "bench",
                "swarm",
                "--populations",
                "100,200",
                "--problems",
                "zdt1",
                "--generations",
                "2",
                "--repeats",
                "1",
                "--backend",
                "simd",
            ],
            "for a generation of 200 particles",
            2,
            "rows.csv",
        ),
        (
            "optimisers",
            vec![
                "bench",
                "optimisers",
                "--seeds",
                "1",
                "--problems",
                "zdt1",
                "--algorithms",
                "default,nsga2",
            ],
            "zdt1 (chosen_on): default is best",
            1,
            "rows.csv",
        ),
        (
            "studies",
            vec![
                "bench",
                "studies",
                "--problems",
                "raceline",
                "--algorithms",
                "default,nsga2",
                "--populations",
                "20",
                "--evaluations",
                "100",
                "--seeds",
                "1",
                "--sections",
                "90",
                "--backend",
                "simd",
            ],
            "raceline:",
            1,
            "quality.svg",
        ),
        (
            "simulate",
            vec!["simulate", "--track", "stadium:300:80:12"],
            "1 run of simulate, by logged lap",
            1,
            "lap.csv",
        ),
    ];
    for (name, arguments, words, charts, beside) in runs {
        has_a_page(&folder.path().join(name), &arguments, words, charts, beside);
    }
    // The rates are those of the JSON: two rows of the line.
    let rows = std::fs::read_to_string(folder.path().join("bench/rows.csv")).unwrap();
    let summary = std::fs::read_to_string(folder.path().join("bench/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let rate = summary["rows"][1]["evaluations_per_s"].as_f64().unwrap();
    assert!(
        rows.lines().nth(2).unwrap().contains(&format!(",{rate},")),
        "{rows}"
    );

    let out = path("lap.html");
    let run = lapswarm(&["report", &path("simulate"), "--out", &out]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let html = std::fs::read_to_string(&out).unwrap();
    let (_, data) = html.split_once("id=\"charts\">").unwrap();
    let data: serde_json::Value = serde_json::from_str(data.split_once("</script>").unwrap().0).unwrap();
    // Speed, both accelerations, yaw rate and steering; alone, no time lost on another.
    let lines = data[0]["lines"][0]["traces"].as_array().unwrap();
    assert_eq!(lines.len(), 5);

    // The log itself, beside the run that it is of.
    let (log, out) = (path("simulate/lap.csv"), path("measured.html"));
    let run = lapswarm(&["report", &log, &path("simulate"), "--out", &out]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let html = std::fs::read_to_string(&out).unwrap();
    assert!(
        html.contains("lap.csv: logged") && html.contains("simulate: logged"),
        "{out}"
    );
}

fn parity_has_a_page() {
    let folder = tempfile::tempdir().unwrap();
    let words = "comparisons agree with the reference";
    let parity = ["parity", "--backend", "simd"];
    has_a_page(&folder.path().join("parity"), &parity, words, 1, "kernels.csv");
}

/// What these arguments measure is in the folder `out`: a page with these words and so many charts, and a file beside it.
fn has_a_page(out: &Path, arguments: &[&str], words: &str, charts: u64, beside: &str) {
    let arguments = [arguments, &["--out", out.to_str().unwrap()]].concat();
    let run = lapswarm(&arguments);
    assert!(
        run.status.success(),
        "{arguments:?}: {}",
        String::from_utf8_lossy(&run.stderr)
    );
    let page = out.join("report.html");
    let html = std::fs::read_to_string(&page).unwrap();
    assert!(html.contains(words), "{arguments:?} does not say: {words}");
    assert!(out.join(beside).is_file(), "{arguments:?}: {beside}");
    if let Some(browser) = browser() {
        sound(&used(&browser, &page), charts);
    }
    // Nothing is overwritten.
    assert_eq!(lapswarm(&arguments).status.code(), Some(2), "{arguments:?} again");
}

fn folders_that_are_no_runs_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("none.html");
    let refused = |run: &Path, named: &str| {
        let output = lapswarm(&["report", run.to_str().unwrap(), "--out", out.to_str().unwrap()]);
        let said = String::from_utf8_lossy(&output.stderr).replace(['\n', '│', ' '], "");
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(&named.replace(' ', "")), "{named}: {said}");
        assert!(!out.exists());
    };
    refused(&folder.path().join("nowhere"), "manifest.json: file: found none");
    let odd = folder.path().join("odd");
    std::fs::create_dir(&odd).unwrap();
    refused(&odd, "manifest.json: file: found none");
    let write = |name: &str, text: &[u8]| std::fs::write(odd.join(name), text).unwrap();
    write("manifest.json", b"{\"program\": \"another\"}");
    refused(&odd, "manifest.json: program: found another");
    write("manifest.json", b"{\"program\": ");
    refused(&odd, "manifest.json: line 1");
    write("manifest.json", b"[1, 2]");
    refused(&odd, "manifest.json: file: found another value");
    write("manifest.json", b"\xff\xfe");
    refused(&odd, "manifest.json: file: found bytes that are no UTF-8");
    write(
        "manifest.json",
        b"{\"program\": \"lapswarm\", \"study\": \"raceline\"}",
    );
    refused(&odd, "summary.json: file: found none");
    write("summary.json", b"{}");
    write("traces.csv", b"a,b\n1,2\n1,2,3\n");
    refused(&odd, "traces.csv: line 3");
    // A file is taken for a log.
    refused(&odd.join("summary.json"), "summary.json: line 1: found \"{}\"");
}
