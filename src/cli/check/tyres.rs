//! Curves of tyres, beside each other.

use super::draw::{Chart, Line, Look};
use lapswarm::Result;
use lapswarm::files::names_of;
use lapswarm::report::HtmlReport;
use lapswarm::vehicle::tyre::{AxleTyre, PeakFriction, TyreFile};
use std::path::PathBuf;

/// A tyre by its name.
pub type Named = (String, AxleTyre);
/// Points of a line of a tyre under a load (N).
type Points = dyn Fn(&AxleTyre, f64) -> Vec<(f64, f64)>;
/// A direction of the friction.
type Direction = (&'static str, fn(&PeakFriction) -> f64);

/// The page and the charts of the tyres of one file or two.
pub fn drawn(files: &[PathBuf]) -> Result<(HtmlReport, Vec<Chart>)> {
    let read = files.iter().map(|path| TyreFile::read(path));
    let read = read.collect::<Result<Vec<TyreFile>>>()?;
    let names = names_of(files);
    let mut page = HtmlReport::new("check", &names.join(" and "));
    let mut least = f64::INFINITY;
    for (name, file) in names.iter().zip(&read) {
        let tyre = &file.coefficients;
        let nominal = tyre.fnomin * tyre.lfz0;
        least = least.min(nominal);
        if let Some(peak) = AxleTyre::of_file(file).peak_friction(nominal) {
            page.sentence(format!(
                "{name}: under its nominal load of {nominal:.0} N the friction peaks at {:.2} to the side, {:.2} driving and {:.2} \
                 braking.",
                peak.side, peak.driving, peak.braking
            ));
        }
    }
    page.sentence("The tyres stand upright, on the side on which they were measured.");
    let tyres: Vec<Named> = names
        .into_iter()
        .zip(read.iter().map(AxleTyre::of_file))
        .collect();
    Ok((page, charts(&tyres, 0.5 * least)))
}

/// To two digits.
fn rounded(x: f64) -> f64 {
    let unit = 10f64.powf(x.log10().floor() - 1.0);
    (x / unit).round() * unit
}

/// Even steps from `-most` to `most`, `each` to either side.
fn either_way(most: f64, each: i32) -> impl Iterator<Item = f64> {
    (-each..=each).map(move |i| most * f64::from(i) / f64::from(each))
}

/// Forces at four loads, of which the least is about `load_n` (N), the friction ellipse under the second of them, and the friction
/// over load. Linear tyres have forces alone.
pub fn charts(tyres: &[Named], load_n: f64) -> Vec<Chart> {
    let step = rounded(load_n);
    let of_loads = |points: &Points| {
        let panel = |(name, tyre): &Named| {
            let line = |k: u8| {
                let load = step * f64::from(k);
                let place = f64::from(k - 1) / 3.0;
                Line::new(format!("{load:.0} N"), Look::Family(place), points(tyre, load))
            };
            (name.clone(), (1..=4).map(line).collect())
        };
        tyres.iter().map(panel).collect()
    };
    let side = |tyre: &AxleTyre, load: f64| {
        let force = |angle: f64| (angle, tyre.forces(load, 0.0, angle.to_radians()).y);
        either_way(15.0, 60).map(force).collect()
    };
    let along = |tyre: &AxleTyre, load: f64| {
        let force = |slip: f64| (slip, tyre.forces(load, slip, 0.0).x);
        either_way(0.25, 100).map(force).collect()
    };
    let mut charts = vec![
        Chart {
            file: "side_force",
            title: "Side force",
            about: "Pure side slip at four loads. A tyre that slips to its left, at a positive angle, pushes to the right.".to_owned(),
            axes: [("slip angle", "deg"), ("side force", "N")],
            of: ["tyre", "load"],
            panels: of_loads(&side),
        },
        Chart {
            file: "longitudinal_force",
            title: "Longitudinal force",
            about: "Pure longitudinal slip at four loads: braking on the left, driving on the right.".to_owned(),
            axes: [("slip ratio", "-"), ("longitudinal force", "N")],
            of: ["tyre", "load"],
            panels: of_loads(&along),
        },
    ];
    charts.extend(ellipse(tyres, 2.0 * step));
    charts.extend(friction(tyres, step));
    charts
}

/// Forces of combined slip under a load (N); nothing for linear tyres.
fn ellipse(tyres: &[Named], load: f64) -> Option<Chart> {
    /// Slip angles of the family (deg).
    const ANGLES: [f64; 9] = [0.0, 2.0, -2.0, 4.0, -4.0, 8.0, -8.0, 12.0, -12.0];
    let limits = tyres.iter().map(|(_, tyre)| {
        let limit = tyre.friction_limit(load)?;
        Some(limit.into_iter().map(|[across, along]| (across, along)))
    });
    let limits = limits.collect::<Option<Vec<_>>>()?;
    let panel = |(name, tyre): &Named| {
        // Its own limit among those of all, so that they can be compared.
        let of_all = tyres.iter().zip(&limits).map(|((other, _), limit)| {
            let label = if tyres.len() == 1 {
                "limit".to_owned()
            } else {
                format!("limit of {other}")
            };
            Line::new(label, Look::Own, limit.clone())
        });
        let family = ANGLES.map(|angle| {
            let force = |slip: f64| {
                let force = tyre.forces(load, slip, angle.to_radians());
                (force.y, force.x)
            };
            let look = Look::Family(angle.abs() / 12.0);
            let line = Line::new(format!("{angle} deg"), look, either_way(0.4, 160).map(force));
            if angle < 0.0 { line.unlisted() } else { line }
        });
        (name.clone(), of_all.chain(family).collect())
    };
    Some(Chart {
        file: "friction_ellipse",
        title: "Friction ellipse",
        about: format!(
            "Combined slip under {load:.0} N: each line is a slip angle, to either side, from braking to driving. The limit is the greatest \
             force in each direction, of slip angles up to 30 degrees and slip ratios up to 0.4."
        ),
        axes: [("side force", "N"), ("longitudinal force", "N")],
        of: ["tyre", "line"],
        panels: tyres.iter().map(panel).collect(),
    })
}

/// Peak friction over loads up to four steps (N); nothing for linear tyres.
fn friction(tyres: &[Named], step: f64) -> Option<Chart> {
    const EACH: i32 = 10;
    let loads = (1..=4 * EACH).map(|i| step * f64::from(i) / f64::from(EACH));
    let directions: [Direction; 3] = [
        ("side", |peak| peak.side),
        ("driving", |peak| peak.driving),
        ("braking", |peak| peak.braking),
    ];
    let panel = |(name, tyre): &Named| {
        let peaks = loads.clone().map(|load| Some((load, tyre.peak_friction(load)?)));
        let peaks = peaks.collect::<Option<Vec<_>>>()?;
        let lines = directions.map(|(direction, of)| {
            let points = peaks.iter().map(|(load, peak)| (*load, of(peak)));
            Line::new(direction, Look::Own, points)
        });
        Some((name.clone(), lines.into()))
    };
    Some(Chart {
        file: "peak_friction",
        title: "Load sensitivity",
        about: "Greatest force over load in pure slip. Where it falls, a pair of tyres gives less the more load moves from one to the other."
            .to_owned(),
        axes: [("load", "N"), ("peak friction", "-")],
        of: ["tyre", "direction"],
        panels: tyres.iter().map(panel).collect::<Option<_>>()?,
    })
}
