//! Types whose values have names in files and flags.

use std::fmt::Debug;

/// A type whose values have names.
pub trait Choice: Copy + PartialEq + Debug + Send + Sync + 'static {
    /// Every value.
    const ALL: &'static [Self];

    /// The name of a value in files and flags.
    fn name(self) -> &'static str;

    /// The value of a name.
    fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|value| value.name() == name)
    }

    /// All names, as in `a, b or c`.
    fn names() -> String {
        listed(Self::ALL.iter().map(|value| value.name().to_owned()))
    }
}

/// Says the names of an enum's values.
macro_rules! named {
    ($type:ty { $($value:ident = $name:literal),* $(,)? }) => {
        impl $crate::config::Choice for $type {
            const ALL: &'static [Self] = &[$(Self::$value),*];

            fn name(self) -> &'static str {
                match self {
                    $(Self::$value => $name,)*
                }
            }
        }
    };
}
pub(crate) use named;

/// Words as in `a, b or c`.
pub(super) fn listed(words: impl Iterator<Item = String>) -> String {
    let mut words: Vec<String> = words.collect();
    match (words.pop(), words.is_empty()) {
        (Some(last), true) => last,
        (Some(last), false) => format!("{} or {last}", words.join(", ")),
        (None, _) => String::new(),
    }
}
