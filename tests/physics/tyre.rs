//! The tyres: the Magic Formula against MFeval, an independent implementation of it, and against its own limits;
//! the linear tyre against hand-worked figures.

use crate::support::{
    FORCE_TOLERANCE, MOMENT_TOLERANCE, SET_B, assert_agreement, forces_at, set_b, tyre_from,
    worst_differences,
};
use lapswarm::scalar::Real;
use lapswarm::vehicle::tyre::{IllFormed, Tyre, TyreForces, TyreInput};
use lapswarm::vehicle::{LinearTyre, TyreCoefficients};

/// Load (N), slip ratio, slip angle (rad), camber (rad) -> Fx (N), Fy (N), Mz (Nm): points of set B by MFeval, to
/// seven places.
#[rustfmt::skip]
const POINTS: [[f64; 7]; 14] = [
    [500.0, 0.03, 0.05, 0.03, 204.8735673, -393.9377774, 2.1913586],
    [500.0, -0.9, -0.35, -0.08, -429.8203351, 174.9429512, 4.5996657],
    [2000.0, 0.0, 0.1, 0.0, 20.1531581, -2130.4372789, 2.5328992],
    [2000.0, 0.03, -0.05, -0.03, 930.3423516, 1727.9399469, -14.0453185],
    [2898.48925945007, -0.002552254615570788, 0.15541222757233136, -0.06683778223436976, -32.9882576, -3145.4146848, 2.1445277],
    [4000.0, 0.0, 0.0, 0.0, 98.7448825, -42.720124, -8.3036631],
    [4000.0, 0.03, 0.1, 0.03, 1301.1529092, -3920.802192, 33.6461063],
    [4000.0, -0.03, -0.18, 0.08, -786.0359886, 4343.6943433, -39.8015591],
    [4850.0, 0.08, 0.0, 0.0, 5220.0596469, 98.6058511, 52.1782778],
    [4850.0, 0.0, -0.35, 0.08, 8.8012698, 5214.3507486, 19.890066],
    [4850.0, -0.9, 0.02, 0.0, -4174.6896461, -108.3940736, -49.7901864],
    [8000.0, 0.0, 0.05, 0.08, 229.666476, -5346.7424107, 147.3821747],
    [8000.0, 0.4, 0.18, -0.08, 6375.7154235, -3605.4831391, -47.3234993],
    [8000.0, -0.03, -0.35, 0.03, -62.5116114, 7479.5169439, 39.2543432],
];

#[test]
fn agrees_with_mfeval_at_chosen_points() {
    assert_agreement(worst_differences(&set_b(), POINTS.into_iter()));
}

/// Whether a mistake in one coefficient would be seen, so that agreement says something about each of them.
#[test]
fn every_coefficient_of_set_b_that_is_not_zero_shows_at_the_chosen_points() {
    let table = TyreCoefficients::<f64>::PARAMETERS;
    let flat = set_b().to_flat();
    for (index, info) in table.iter().enumerate() {
        // The formula as it stands has no other effect of a zero than of its absence.
        if flat[index] == 0.0 {
            continue;
        }
        let mut wrong = flat.clone();
        wrong[index] *= 1.01;
        let worst = worst_differences(&TyreCoefficients::from_flat(&wrong), POINTS.into_iter());
        assert!(
            worst[0] > FORCE_TOLERANCE || worst[1] > FORCE_TOLERANCE || worst[2] > MOMENT_TOLERANCE,
            "{} off by one per cent goes unnoticed: {worst:?}",
            info.name
        );
    }
}

/// A file that tells on which side the tyre was measured has its mirror image on the other: what drives left with one wheel drives
/// right with the other. On the side of the measurement it is the tyre of a file that tells nothing.
#[test]
fn a_tyre_is_mirrored_on_the_side_on_which_it_was_not_measured() {
    let camber = -0.05;
    let forces = |words: &str, side: f64, slip_tangent: f64| {
        let tyre = tyre_from(&format!("{SET_B} {words}")).prepare(camber);
        tyre.forces(TyreInput {
            load: 4200.0,
            slip_ratio: 0.03,
            slip_tangent,
            side,
        })
    };
    for (words, measured_on) in [("TYRESIDE='LEFT'", 1.0), ("TYRESIDE='right'", -1.0)] {
        for slip_tangent in [-0.1, 0.0, 0.04] {
            let here = forces(words, measured_on, slip_tangent);
            assert_eq!(here, forces("", measured_on, slip_tangent), "{words}");
            let there = forces(words, -measured_on, -slip_tangent);
            let mirrored = [there.x, -there.y, -there.aligning_moment];
            for (found, wanted) in mirrored.iter().zip([here.x, here.y, here.aligning_moment]) {
                assert!(
                    (found - wanted).abs() < 1e-9 * wanted.abs().max(1.0),
                    "{words}: {found} {wanted}"
                );
            }
            let unmirrored = forces("", -measured_on, -slip_tangent);
            assert!(
                (unmirrored.y - there.y).abs() > 10.0,
                "{words}: the tyre is not even"
            );
        }
    }
    assert_eq!(forces("TYRESIDE='SYMMETRIC'", -1.0, 0.04), forces("", -1.0, 0.04));
}

/// `E > 1` turns a curve back on itself, so it acts as one, in every curve that has an `E`.
#[test]
fn curvature_above_one_acts_as_one() {
    let clean = "PEX2=0 PEX3=0 PEX4=0 PEY2=0 PEY3=0 PEY4=0 REX2=0 REY2=0 QEZ2=0 QEZ3=0 QEZ4=0 QEZ5=0";
    for key in ["PEX1", "PEY1", "REX1", "REY1", "QEZ1"] {
        let with = |value: &str| tyre_from(&format!("{SET_B} {clean} {key}={value}"));
        let (below, one, above) = (with("0.5"), with("1"), with("7"));
        let mut differs = false;
        for [load, ratio, angle, camber, ..] in POINTS {
            let at = |tyre: &TyreCoefficients<f64>| forces_at(tyre, load, ratio, angle.tan(), camber);
            assert_eq!(at(&above), at(&one), "{key}");
            differs |= at(&below) != at(&one);
        }
        assert!(differs, "{key} has no effect");
    }
}

/// A tyre in the air pushes at nothing, and one about to lift comes there without a jump: forces go with load.
#[test]
fn a_lifted_tyre_gives_nothing() {
    let tyre = set_b();
    let nothing = TyreForces {
        x: 0.0,
        y: 0.0,
        aligning_moment: 0.0,
    };
    for load in [0.0, -0.0, -1.0, -5000.0] {
        assert_eq!(forces_at(&tyre, load, 0.1, 0.1, 0.03), nothing);
    }
    for load in [1.0, 1e-2, 1e-4] {
        let forces = forces_at(&tyre, load, 0.1, 0.1, 0.03);
        // Friction is under 2 at any load of this set, and MFeval's points show arms under 0.1 m.
        assert!(
            forces.x.hypot(forces.y) < 2.0 * load.max(1e-3),
            "{load}: {forces:?}"
        );
        assert!(
            forces.aligning_moment.abs() < 0.2 * load.max(1e-3),
            "{load}: {forces:?}"
        );
    }
}

/// The single-precision twin: eight lanes of `f32` against `f64`.
///
/// Sums of slips cancel to about 1e-2 of their terms and each of about 60 roundings is 6e-8, so forces agree to
/// 60 * 6e-8 * a few = 1e-5 of the load. The moment is a difference of products with arms under 0.35 m.
#[test]
fn single_precision_agrees_with_double() {
    use lapswarm::scalar::lanes::{Lanes, Portable};
    let double = set_b();
    let flat = double.to_flat();
    let single: TyreCoefficients<Portable> =
        TyreCoefficients::from_flat(&flat.iter().map(|x| Portable::lit(*x)).collect::<Vec<_>>());
    for points in POINTS.chunks(8) {
        let lane = |column: usize| {
            Portable::from_fn(|i| {
                let row = points[i.min(points.len() - 1)];
                (if column == 2 { row[2].tan() } else { row[column] }) as f32
            })
        };
        let forces = single.prepare(lane(3)).forces(TyreInput {
            load: lane(0),
            slip_ratio: lane(1),
            slip_tangent: lane(2),
            side: Portable::lit(1.0),
        });
        let mut out = [[0.0f32; 8]; 3];
        forces.x.write(&mut out[0]);
        forces.y.write(&mut out[1]);
        forces.aligning_moment.write(&mut out[2]);
        for (i, [load, _, _, _, fx, fy, mz]) in points.iter().enumerate() {
            for (got, want) in [(out[0][i], fx), (out[1][i], fy), (out[2][i], mz)] {
                assert!(
                    (f64::from(got) - want).abs() < 1e-5 * load,
                    "{got} for {want} at {load} N"
                );
            }
        }
    }
}

#[test]
fn ill_formed_sets_are_told_apart() {
    assert_eq!(set_b().well_formed(), Ok(()));
    let verdict = |change: &str| tyre_from(&format!("{SET_B} {change}")).well_formed();
    assert_eq!(verdict("PDX1=-1"), Err(IllFormed::Friction));
    assert_eq!(
        verdict("PDY2=2"),
        Err(IllFormed::Friction),
        "negative at a tenth of the nominal load"
    );
    assert_eq!(verdict("PKY1=21.92"), Err(IllFormed::Stiffness));
    assert_eq!(verdict("PKX1=0"), Err(IllFormed::Stiffness));
    // cos(2 atan 1) = 0: with rCx1 = 2 and B rHx1 = 1 the weight divides by zero.
    assert_eq!(
        verdict("RCX1=2 REX1=0 REX2=0 RBX1=10 RHX1=0.1"),
        Err(IllFormed::Weighting)
    );
    // cos(2 atan(20 * 0.15)) = (1 - 9)/(1 + 9): force against the slip.
    assert_eq!(verdict("RCY1=2 REY1=0 REY2=0 RBY1=20"), Err(IllFormed::Weighting));
    // 4.5 atan(25 * 0.15) = 5.9: the cosine is above zero again, and was below it on the way.
    assert_eq!(
        verdict("RCX1=4.5 REX1=0 REX2=0 RBX1=25 RHX1=0"),
        Err(IllFormed::Weighting)
    );
    // The weight at this slip vanishes where the shape factor is a right angle over that angle, 1.1989.
    for (factor, expected) in [(1.1989, Ok(())), (1.199, Err(IllFormed::Weighting))] {
        let change = format!("RCX1={factor} REX1=0 REX2=0 RBX1=25 RHX1=0 LXAL=1");
        assert_eq!(verdict(&change), expected, "{factor}");
    }
    let mut tyre = set_b();
    tyre.rvy3 = f64::NAN;
    assert_eq!(tyre.well_formed(), Err(IllFormed::NotFinite));
}

/// Stiffnesses hold at the nominal load and go with load; side force and moment oppose the slip.
#[test]
fn linear_tyre_by_hand() {
    let tyre = LinearTyre {
        nominal_load: 4000.0,
        slip_stiffness: 80_000.0,
        cornering_stiffness: 60_000.0,
        trail: 0.03,
    };
    let at = |load: f64, slip_ratio: f64, slip_tangent: f64| {
        tyre.forces(TyreInput {
            load,
            slip_ratio,
            slip_tangent,
            side: 1.0,
        })
    };
    // Each figure is a product of three or four: 4 roundings of 1.1e-16 of it.
    let close = |a: f64, b: f64| assert!((a - b).abs() <= 5e-16 * b.abs(), "{a} for {b}");
    let driven = at(4000.0, 0.02, 0.0);
    close(driven.x, 1600.0);
    assert_eq!((driven.y, driven.aligning_moment), (0.0, 0.0));
    // A slip angle of 0.05 rad to the left at half the load: 60000 * 0.05 / 2 to the right, 0.03 m behind the centre.
    let drifting = at(2000.0, 0.0, 0.05f64.tan());
    close(drifting.y, -1500.0);
    close(drifting.aligning_moment, 45.0);
    assert_eq!(drifting.x, 0.0);
    assert_eq!(at(-10.0, 0.1, 0.1).y, 0.0);
    assert_eq!(at(-10.0, 0.1, 0.1).x, 0.0);
}
