//! How a layout of others is to be understood, where it does not say.

use std::str::FromStr;

/// A unit of lengths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// mm.
    Millimetre,
    /// cm.
    Centimetre,
    /// m.
    Metre,
    /// in.
    Inch,
    /// ft.
    Foot,
}

impl Unit {
    /// Its length, m.
    #[must_use]
    pub const fn metres(self) -> f64 {
        match self {
            Self::Millimetre => 1e-3,
            Self::Centimetre => 1e-2,
            Self::Metre => 1.0,
            Self::Inch => 0.0254,
            Self::Foot => 0.3048,
        }
    }
}

impl FromStr for Unit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "mm" => Ok(Self::Millimetre),
            "cm" => Ok(Self::Centimetre),
            "m" => Ok(Self::Metre),
            "in" => Ok(Self::Inch),
            "ft" => Ok(Self::Foot),
            _ => Err("a unit is mm, cm, m, in or ft".to_owned()),
        }
    }
}

/// What somebody says of a layout beside the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reading {
    /// Unit of the coordinates; as the file says if None.
    pub unit: Option<Unit>,
    /// Point of the file that is the origin of the layout, m.
    pub origin: Option<[f64; 2]>,
    /// The only layer of a drawing that is looked at; all that are shown if None.
    pub layer: Option<String>,
}

impl Reading {
    /// A place of the file in the layout, m.
    #[must_use]
    pub fn placed(&self, place: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.origin.unwrap_or_default();
        [place[0] - x, place[1] - y]
    }
}
