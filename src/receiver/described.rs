//! Settings that know their own documentation.
//!
//! The doc comment of each field is its meaning in the reference; a field without one does not compile.

/// Declares a structure of settings and, as `MEANINGS`, each key with the lines of its doc comment.
macro_rules! described {
    (
        $(#[$attribute:meta])*
        pub struct $name:ident { $($(#[doc = $line:literal])+ pub $field:ident: $kind:ty,)+ }
    ) => {
        $(#[$attribute])*
        pub struct $name { $($(#[doc = $line])+ pub $field: $kind,)+ }

        impl $name {
            /// Each key with its meaning.
            pub const MEANINGS: &'static [(&'static str, &'static [&'static str])] =
                &[$((stringify!($field), &[$($line),+])),+];
        }
    };
}

pub(crate) use described;
