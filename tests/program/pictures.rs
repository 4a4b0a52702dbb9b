//! `check --draw`: what it writes of cars and tyres, and what it refuses.

use super::cli::{lapswarm, text};
use lapswarm::vehicle::Car;
use std::path::Path;

/// A folder with the bundled car and its tyre, and a second tyre with less side friction.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let made = lapswarm(folder.path(), &["init", "car"]);
    assert!(made.status.success(), "{}", text(&made.stderr));
    let less = Car::BUNDLED_TYRE.replace("= 1.55", "= 1.35");
    assert_ne!(less, Car::BUNDLED_TYRE);
    std::fs::write(folder.path().join("hard.tir"), less).expect("written");
    folder
}

/// The rows of a table, and its heads.
fn rows(path: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let mut reader = csv::Reader::from_path(path).expect("a table");
    let cells = |record: &csv::StringRecord| record.iter().map(str::to_owned).collect::<Vec<String>>();
    let heads = cells(reader.headers().expect("heads"));
    let rows = reader.records().map(|row| cells(&row.expect("a row")));
    (heads, rows.collect())
}

fn number(cell: &str) -> f64 {
    cell.parse().expect("a number")
}

fn names(folder: &Path) -> Vec<String> {
    let entries = folder.read_dir().expect("a folder").flatten();
    let mut names: Vec<String> = entries
        .map(|e| e.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// A picture and a table of each figure.
fn files_of(figures: &[&str]) -> Vec<String> {
    let both = figures
        .iter()
        .flat_map(|name| ["csv", "svg"].map(|end| format!("{name}.{end}")));
    let mut all: Vec<String> = both.chain(["report.html".to_owned()]).collect();
    all.sort();
    all
}

const OF_TYRES: [&str; 4] = [
    "side_force",
    "longitudinal_force",
    "friction_ellipse",
    "peak_friction",
];

#[test]
fn two_tyres_stand_beside_each_other() {
    let folder = folder();
    let checked = lapswarm(
        folder.path(),
        &["check", "gt_slick.tir", "hard.tir", "--draw", "a/b"],
    );
    assert!(checked.status.success(), "{}", text(&checked.stderr));
    assert!(text(&checked.stdout).contains("report.html"));
    let drawn = folder.path().join("a/b");
    assert_eq!(names(&drawn), files_of(&OF_TYRES));
    let (heads, forces) = rows(&drawn.join("side_force.csv"));
    assert_eq!(heads, ["tyre", "load", "slip angle (deg)", "side force (N)"]);
    // Two tyres, four loads, 121 angles. The greatest force is the friction times the load: 1.55 at 4 kN as its file has it.
    assert_eq!(forces.len(), 2 * 4 * 121);
    let most = |tyre: &str| {
        let of = forces.iter().filter(|row| row[0] == tyre && row[1] == "4000 N");
        of.map(|row| number(&row[3]).abs()).fold(0.0, f64::max)
    };
    assert!(
        (most("gt_slick") / 6200.0 - 1.0).abs() < 0.01,
        "{}",
        most("gt_slick")
    );
    assert!((most("hard") / 5400.0 - 1.0).abs() < 0.01, "{}", most("hard"));
    let picture = std::fs::read_to_string(drawn.join("friction_ellipse.svg")).expect("a picture");
    for label in ["gt_slick", "hard", "side force (N)", "longitudinal force (N)"] {
        assert!(picture.contains(label), "{label}");
    }
    let page = std::fs::read_to_string(drawn.join("report.html")).expect("a page");
    assert!(page.contains("Load sensitivity") && page.contains("1.35 to the side"));
}

#[test]
fn a_car_has_gears_forces_brakes_tyres_and_limits() {
    let folder = folder();
    let draw = || lapswarm(folder.path(), &["check", "car.toml", "--draw", "drawn"]);
    let checked = draw();
    assert!(checked.status.success(), "{}", text(&checked.stderr));
    let drawn = folder.path().join("drawn");
    let of_car = [
        "gears",
        "tractive_force",
        "standing_start",
        "brake_balance",
        "envelope",
    ];
    assert_eq!(names(&drawn), files_of(&[&of_car[..], &OF_TYRES[..]].concat()));

    // Sixth gear turns 4.1328 times: 8500 rpm on wheels of 0.325 m are 69.998 m/s.
    let (heads, gears) = rows(&drawn.join("gears.csv"));
    assert_eq!(heads[2..], ["speed (m/s)", "engine speed (rpm)"]);
    let sixth = gears.iter().rfind(|row| row[1] == "gear 6").expect("sixth gear");
    assert!((number(&sixth[2]) - 69.998).abs() < 1e-3, "{sixth:?}");
    assert_eq!(gears.iter().filter(|row| row[1] == "shift points").count(), 5);

    // 382 N m at 8500 rpm push with 382 x 4.1328 x 0.95 / 0.325 N in top gear.
    let (_, forces) = rows(&drawn.join("tractive_force.csv"));
    let sixth = forces.iter().rfind(|row| row[1] == "gear 6").expect("sixth gear");
    assert!((number(&sixth[3]) / 4614.7 - 1.0).abs() < 1e-4, "{sixth:?}");

    // From rest to 69.6 m/s the engine's 342 kW do 0.95 of their work at the wheels, which is more than the 1245 kg's energy; on the
    // brakes the car is back at rest in less than half of the time.
    let (heads, start) = rows(&drawn.join("standing_start.csv"));
    assert_eq!(heads[2..], ["time (s)", "speed (m/s)"]);
    let by_engine: Vec<[f64; 2]> = start
        .iter()
        .filter(|row| row[1] == "engine")
        .map(|row| [number(&row[2]), number(&row[3])])
        .collect();
    let top = by_engine
        .iter()
        .max_by(|a, b| a[1].total_cmp(&b[1]))
        .expect("a top speed");
    let end = by_engine[by_engine.len() - 1];
    assert!((top[1] - 0.995 * 69.998).abs() < 0.01, "{top:?}");
    assert!(
        top[0] > 0.5 * 1245.0 * top[1].powi(2) / (342e3 * 0.95) && top[0] < 60.0,
        "{top:?}"
    );
    assert!(end[1] == 0.0 && end[0] < 1.5 * top[0], "{end:?}");
    assert_eq!(start.iter().filter(|row| row[1] == "shift points").count(), 5);

    // The front carries 1.17 / 2.6 = 45 % of a car that rolls without air. Its tyres are the rear's but for their camber.
    let (heads, shares) = rows(&drawn.join("brake_balance.csv"));
    assert_eq!(heads[3], "front share of the braking force (%)");
    assert_eq!(shares[0][..2], ["0 km/h", "load"]);
    assert_eq!(number(&shares[0][2]), 0.0);
    assert!((number(&shares[0][3]) - 45.0).abs() < 1e-9);
    let peaks = shares
        .iter()
        .find(|row| row[1] == "tyres' peaks")
        .expect("the tyres'");
    assert!((number(&peaks[3]) - 45.0).abs() < 0.5, "{peaks:?}");

    // The envelope's table is one that studies read, and a second drawing takes the place of the first.
    let read = lapswarm(folder.path(), &["check", "drawn/envelope.csv"]);
    assert!(
        text(&read.stdout).contains("a g-g-v envelope"),
        "{}",
        text(&read.stderr)
    );
    assert!(draw().status.success());
}

#[test]
fn what_cannot_be_drawn_is_refused_and_leaves_nothing() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let lap = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/laps/gt_silverstone.csv");
    std::fs::copy(lap, at("lap.csv")).expect("a log");
    std::fs::write(at("none.tir"), "not a tyre\n").expect("written");
    let before = names(folder.path());
    let three = ["check", "gt_slick.tir", "hard.tir", "hard.tir", "--draw", "out"];
    for (arguments, told) in [
        (
            &["check", "lap.csv", "--draw", "out"][..],
            "found a log, expected one car",
        ),
        (&["check", "car.toml", "lap.csv", "--draw", "out"], "a car, a log"),
        (&three, "one or two tyres"),
        (
            &["check", "gt_slick.tir", "none.tir", "--draw", "out"],
            "none.tir",
        ),
        (&["check", "gone.tir", "--draw", "out"], "gone.tir"),
        (
            &["check", "gt_slick.tir", "--draw", "none.tir"],
            "expected a folder",
        ),
        (
            &["check", "gt_slick.tir", "--draw", "none.tir/within"],
            "none.tir",
        ),
    ] {
        let refused = lapswarm(folder.path(), arguments);
        assert_eq!(refused.status.code(), Some(2), "{arguments:?}");
        let words = text(&refused.stderr);
        assert!(words.contains(told), "{arguments:?}: {words}");
        assert_eq!(names(folder.path()), before, "{arguments:?}");
    }
}

/// A car of linear tyres without an engine has curves of its tyres and brakes by its load alone.
#[test]
fn a_car_without_an_engine_and_peaks_has_what_is_left() {
    let folder = folder();
    let path = folder.path().join("car.toml");
    let whole = std::fs::read_to_string(&path).expect("a car");
    let (body, _) = whole.split_once("[powertrain]").expect("an engine");
    let axle = "nominal_load_n = 4000\nslip_stiffness_n = 80000\ncornering_stiffness_n_per_rad = 60000\n";
    let tyres = format!("[tyres.front]\n{axle}[tyres.rear]\n{axle}");
    let plain = body.replace("[tyres]\nboth = \"gt_slick.tir\"", &tyres);
    assert_ne!(plain, body);
    std::fs::write(&path, plain).expect("written");
    let checked = lapswarm(folder.path(), &["check", "car.toml", "--draw", "drawn"]);
    assert!(checked.status.success(), "{}", text(&checked.stderr));
    let drawn = folder.path().join("drawn");
    assert_eq!(
        names(&drawn),
        files_of(&["brake_balance", "side_force", "longitudinal_force"])
    );
    // 60 kN/rad at 4 kN: 15 degrees are 0.261799 rad, at 1500 N 5890.5 N to the right.
    let (_, forces) = rows(&drawn.join("side_force.csv"));
    let last = forces
        .iter()
        .rfind(|row| row[1] == "1500 N")
        .expect("the least load");
    assert_eq!((last[0].as_str(), number(&last[2])), ("both axles", 15.0));
    assert!((number(&last[3]) + 5890.486).abs() < 1e-2, "{last:?}");
}
