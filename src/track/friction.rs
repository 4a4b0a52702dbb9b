//! Friction across a road at one place of it.

/// Range of the friction, as a share of that of the car's own tyres: from wet ice to a surface better than the one that they were
/// measured on.
pub(super) const FRICTIONS: (f64, f64) = (0.05, 1.5);

/// Places from edge to edge at which a road's friction is known.
pub const FRICTION_PLACES: usize = 5;
/// Steps between them.
const STEPS: f64 = (FRICTION_PLACES - 1) as f64;

/// Friction across a road at one place of it, as a share of that of the car's own tyres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionAcross {
    /// Distance to the right edge of the road (m),
    pub right_m: f64,
    /// and to the left edge (m).
    pub left_m: f64,
    /// At even steps from the right edge to the left one; linear between, and beyond the edges that of the edge.
    pub of: [f64; FRICTION_PLACES],
}

impl FrictionAcross {
    /// A dry road, however wide.
    pub const DRY: Self = Self {
        right_m: 0.0,
        left_m: 0.0,
        of: [1.0; FRICTION_PLACES],
    };

    /// The friction of a place which gains so much per metre to the left (1/m), up to edges so far to the left and right (m).
    pub fn linear([friction, per_m]: [f64; 2], [left_m, right_m]: [f64; 2]) -> Self {
        let [at_right, at_left] =
            [-right_m, left_m].map(|at| (friction + per_m * at).clamp(FRICTIONS.0, FRICTIONS.1));
        Self {
            right_m,
            left_m,
            of: evenly(at_right, at_left),
        }
    }

    /// The friction so far to the left (m), and what it gains per metre to the left there (1/m).
    pub fn at(&self, left_m: f64) -> [f64; 2] {
        let width_m = self.right_m + self.left_m;
        if width_m <= 0.0 {
            return [self.of[FRICTION_PLACES / 2], 0.0];
        }
        let place = self.place(left_m).clamp(0.0, STEPS);
        let row = (place as usize).min(FRICTION_PLACES - 2);
        let rise = self.of[row + 1] - self.of[row];
        [self.of[row] + (place - row as f64) * rise, rise * STEPS / width_m]
    }

    /// How many steps from the right edge that is; half of them where there is no width.
    pub(crate) fn place(&self, left_m: f64) -> f64 {
        let width_m = self.right_m + self.left_m;
        if width_m <= 0.0 {
            return 0.5 * STEPS;
        }
        STEPS * (left_m + self.right_m) / width_m
    }

    /// The same as seen from so far to the left (m).
    pub(super) fn seen_from(&self, left_m: f64) -> Self {
        Self {
            right_m: self.right_m + left_m,
            left_m: self.left_m - left_m,
            of: self.of,
        }
    }

    /// What lies `share` of the way from one to another.
    pub(super) fn mixed(from: &Self, to: &Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| a + share * (b - a);
        Self {
            right_m: mix(from.right_m, to.right_m),
            left_m: mix(from.left_m, to.left_m),
            of: mixed(from.of, to.of, share),
        }
    }

    /// Whether it is the car's own everywhere.
    pub(super) fn is_dry(&self) -> bool {
        self.of == Self::DRY.of
    }

    /// Whether both edges tell all of it.
    pub(super) fn is_linear(&self) -> bool {
        let [right, .., left] = self.of;
        let straight = evenly(right, left);
        self.of.iter().zip(straight).all(|(a, b)| (a - b).abs() < 1e-9)
    }
}

/// Frictions from edge to edge, `share` of the way from some to others.
pub(super) fn mixed(
    from: [f64; FRICTION_PLACES],
    to: [f64; FRICTION_PLACES],
    share: f64,
) -> [f64; FRICTION_PLACES] {
    std::array::from_fn(|k| from[k] + share * (to[k] - from[k]))
}

/// Frictions that are linear from the right edge to the left one.
fn evenly(at_right: f64, at_left: f64) -> [f64; FRICTION_PLACES] {
    std::array::from_fn(|k| at_right + k as f64 / STEPS * (at_left - at_right))
}

/// The columns of a table for the friction at [`FrictionAcross::of`], by percent of the width from the right edge.
pub(super) const FRICTION_NAMES: [&str; FRICTION_PLACES] = [
    "friction_right",
    "friction_25",
    "friction_50",
    "friction_75",
    "friction_left",
];

/// What a table may say of friction.
pub(super) const FRICTION_COLUMNS: &str = "friction, or both friction_left and friction_right, with or without all of friction_25, friction_50 and friction_75";

/// Where a table has the friction.
#[derive(Clone, Copy, Debug)]
pub(super) enum FrictionColumns {
    /// One column for the whole width.
    Whole(usize),
    /// Of the right and the left edge.
    Edges([usize; 2]),
    /// Of all places, as in [`FRICTION_NAMES`].
    All([usize; FRICTION_PLACES]),
}

impl FrictionColumns {
    /// From the columns of `friction` and of [`FRICTION_NAMES`]; nothing without any.
    ///
    /// # Errors
    /// What was found where it is not one of [`FRICTION_COLUMNS`].
    pub fn of(
        whole: Option<usize>,
        across: [Option<usize>; FRICTION_PLACES],
    ) -> Result<Option<Self>, &'static str> {
        match (whole, across) {
            (None, [None, None, None, None, None]) => Ok(None),
            (Some(whole), [None, None, None, None, None]) => Ok(Some(Self::Whole(whole))),
            (None, [Some(right), None, None, None, Some(left)]) => Ok(Some(Self::Edges([right, left]))),
            (None, [Some(right), Some(a), Some(b), Some(c), Some(left)]) => {
                Ok(Some(Self::All([right, a, b, c, left])))
            }
            (Some(_), _) => Err("friction beside that of places across the road"),
            _ => Err("some of friction_right, friction_25, friction_50, friction_75 and friction_left"),
        }
    }

    /// The friction of a row, of which `cell` reads a column.
    ///
    /// # Errors
    /// Those of `cell`.
    pub fn read<E>(&self, cell: impl Fn(usize) -> Result<f64, E>) -> Result<[f64; FRICTION_PLACES], E> {
        match self {
            Self::Whole(whole) => Ok([cell(*whole)?; FRICTION_PLACES]),
            Self::Edges([right, left]) => Ok(evenly(cell(*right)?, cell(*left)?)),
            Self::All(columns) => {
                let mut of = [0.0; FRICTION_PLACES];
                for (of, column) in of.iter_mut().zip(columns) {
                    *of = cell(*column)?;
                }
                Ok(of)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Between the places it is linear, beyond the edges that of the edge; the rise is that of the step.
    #[test]
    fn friction_is_linear_between_places() {
        let across = FrictionAcross {
            right_m: 4.0,
            left_m: 4.0,
            of: [1.0, 1.0, 0.5, 0.7, 0.9],
        };
        for (left_m, wanted) in [
            (-9.0, [1.0, 0.0]),
            (-3.0, [1.0, 0.0]),
            (-1.0, [0.75, -0.25]),
            (1.0, [0.6, 0.1]),
            (9.0, [0.9, 0.1]),
        ] {
            let found = across.at(left_m);
            let far = found
                .iter()
                .zip(wanted)
                .any(|(a, b): (&f64, f64)| (a - b).abs() > 1e-12);
            assert!(!far, "{found:?} at {left_m} m");
            assert_eq!(across.seen_from(1.5).at(left_m - 1.5), across.at(left_m));
        }
        let line = FrictionAcross::linear([0.8, 0.02], [5.0, 3.0]);
        assert!(line.is_linear() && !across.is_linear());
        assert!((line.at(-2.0)[0] - 0.76).abs() < 1e-12 && (line.at(-2.0)[1] - 0.02).abs() < 1e-12);
    }
}
