//! Named, bounded parameters: one table per struct, from which readers, writers, optimisers and the shader
//! loader all take names, units and order.

/// The declaration of one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterInfo {
    /// The key in files and studies.
    pub name: &'static str,
    /// The unit, `-` for none.
    pub unit: &'static str,
    /// The least value that is accepted.
    pub minimum: f64,
    /// The greatest value that is accepted.
    pub maximum: f64,
    /// The default; `None` for a parameter that every file must give.
    pub default: Option<f64>,
    /// What it means.
    pub meaning: &'static str,
}

impl ParameterInfo {
    /// Whether `value` is a number within the bounds.
    pub fn admits(&self, value: f64) -> bool {
        value >= self.minimum && value <= self.maximum
    }
}

/// Declares a struct of parameters over a scalar together with its table.
macro_rules! parameters {
    (
        $(#[$doc:meta])*
        pub struct $name:ident {
            $($field:ident: $key:literal [$unit:literal] $min:literal ..= $max:literal, $default:expr, $meaning:literal;)*
        }
    ) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $name<R> {
            $(#[doc = concat!($meaning, " (", $unit, ").")] pub $field: R,)*
        }

        impl<R> $name<R> {
            /// Name, unit, bounds and meaning of each parameter, in the order of the flat form.
            pub const PARAMETERS: &'static [$crate::vehicle::parameters::ParameterInfo] = &[
                $($crate::vehicle::parameters::ParameterInfo {
                    name: $key, unit: $unit, minimum: $min, maximum: $max, default: $default, meaning: $meaning,
                },)*
            ];

            /// The fields' names in the same order, which the shaders' structs share.
            pub const FIELDS: &'static [&'static str] = &[$(stringify!($field)),*];
        }

        impl<R: Copy> $name<R> {
            /// From the flat form, in the order of the table.
            ///
            /// # Panics
            /// If it is shorter than the table.
            pub fn from_flat(flat: &[R]) -> Self {
                let flat = &flat[..Self::FIELDS.len()];
                let mut next = 0..;
                Self { $($field: flat[next.next().unwrap_or(0)]),* }
            }

            /// To the flat form, in the order of the table.
            pub fn to_flat(&self) -> Vec<R> {
                vec![$(self.$field),*]
            }
        }
    };
}
pub(crate) use parameters;

/// Declares a struct of derived figures over a scalar, with its flat form.
macro_rules! fields {
    ($(#[$doc:meta])* pub struct $name:ident { $($field:ident),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[allow(missing_docs, reason = "each is the product that `prepare` writes it as")]
        pub struct $name<R> {
            $(pub $field: R,)*
        }

        impl<R> $name<R> {
            /// Names of the figures, in the order of the flat form.
            pub const FIELDS: &'static [&'static str] = &[$(stringify!($field)),*];
        }

        impl<R: Copy> $name<R> {
            /// From the flat form, in the order of [`Self::FIELDS`].
            ///
            /// # Panics
            /// If it is shorter than that.
            pub fn from_flat(flat: &[R]) -> Self {
                let flat = &flat[..Self::FIELDS.len()];
                let mut next = 0..;
                Self { $($field: flat[next.next().unwrap_or(0)]),* }
            }

            /// Every figure put through `f`.
            #[inline(always)]
            pub fn map<S>(&self, f: impl Fn(R) -> S) -> $name<S> {
                $name { $($field: f(self.$field)),* }
            }

            /// To the flat form.
            pub fn to_flat(&self) -> Vec<R> {
                vec![$(self.$field),*]
            }
        }
    };
}
pub(crate) use fields;
