//! The two dialects.

/// How telegrams are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dialect {
    /// CoLa-A.
    Ascii,
    /// CoLa-B.
    Binary,
}

impl Dialect {
    /// The other one.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::Ascii => Self::Binary,
            Self::Binary => Self::Ascii,
        }
    }
}
