//! Objectives of a kind of problem: one table each, of names, units and words.

use super::Objective;

/// Declares the objectives of a kind of problem: for each its name in studies and files, its unit, and the words that pictures
/// and messages use. Its place in the list is its index.
macro_rules! objectives {
    (
        $(#[$doc:meta])*
        $kind:ident {
            $( $(#[$each:meta])* $objective:ident: $name:literal, $unit:literal, $words:literal; )*
        }
    ) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
        pub enum $kind {
            $( $(#[$each])* $objective, )*
        }

        impl $kind {
            /// Every objective, in order.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$objective),*];

            /// The names of all, for help and messages.
            pub const NAMES: &'static str = {
                const LISTED: &str = concat!($($name, ", "),*);
                LISTED.split_at(LISTED.len() - 2).0
            };

            /// Its name in studies and files.
            pub fn name(self) -> &'static str {
                [$($name),*][self as usize]
            }

            /// Its unit, `-` for none.
            pub fn unit(self) -> &'static str {
                [$($unit),*][self as usize]
            }

            /// What pictures and messages call it, beside its unit.
            pub fn words(self) -> &'static str {
                [$($words),*][self as usize]
            }

            /// The objective of this name.
            pub fn named(name: &str) -> Option<Self> {
                Self::ALL.into_iter().find(|o| o.name() == name)
            }
        }

        impl $crate::config::Choice for $kind {
            const ALL: &'static [Self] = &<$kind>::ALL;

            fn name(self) -> &'static str {
                <$kind>::name(self)
            }
        }

        impl From<$kind> for $crate::evaluate::Objective {
            fn from(objective: $kind) -> Self {
                Self::new(objective.name(), objective.unit())
            }
        }
    };
}
pub(crate) use objectives;

/// The objectives of a problem.
pub(crate) fn listed<O: Copy + Into<Objective>>(objectives: &[O]) -> Vec<Objective> {
    objectives.iter().map(|o| (*o).into()).collect()
}

/// Whether objectives are missing or come twice.
pub(crate) fn missing_or_twice<O: PartialEq>(objectives: &[O]) -> bool {
    objectives.is_empty() || (1..objectives.len()).any(|i| objectives[..i].contains(&objectives[i]))
}
