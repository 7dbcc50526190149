//! The sensor's own map of reflectors.

use heapless::Vec;

use super::{Coordinate, Size};
use crate::cola::{Element, ReadError, Reader, WriteError, Writer};

/// Greatest number of landmarks in one telegram. Sensors were seen to refuse more.
pub const LANDMARKS_A_TELEGRAM: usize = 50;

/// Greatest number of layers of one landmark.
pub const LAYERS_A_LANDMARK: usize = 8;

/// One reflector of the layout.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LayoutLandmark {
    /// Position in the layout.
    pub x: Coordinate,
    /// Position in the layout.
    pub y: Coordinate,
    /// What it is; 1 is a reflector.
    pub kind: u8,
    /// Its shape; 1 flat, 2 cylindrical.
    pub subtype: u8,
    /// Width of the plate, or diameter.
    pub size: Size,
    /// Layers that it belongs to.
    pub layers: Vec<u16, LAYERS_A_LANDMARK>,
}

impl Element for LayoutLandmark {
    fn read(reader: &mut Reader) -> Result<Self, ReadError> {
        let mut landmark = Self {
            x: Coordinate(reader.i32()?),
            y: Coordinate(reader.i32()?),
            kind: reader.u8()?,
            subtype: reader.u8()?,
            size: Size(reader.u16()?),
            layers: Vec::new(),
        };
        let count = usize::from(reader.u16()?);
        if count > LAYERS_A_LANDMARK {
            return Err(ReadError::Capacity);
        }
        for _ in 0..count {
            landmark.layers.push(reader.u16()?).map_err(|_| ReadError::Capacity)?;
        }
        Ok(landmark)
    }

    fn write(&self, writer: &mut Writer) -> Result<(), WriteError> {
        writer.i32(self.x.0)?;
        writer.i32(self.y.0)?;
        writer.u8(self.kind)?;
        writer.u8(self.subtype)?;
        writer.u16(self.size.0)?;
        writer.count(self.layers.len())?;
        self.layers.iter().try_for_each(|layer| writer.u16(*layer))
    }
}

/// A reflector of the layout with its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IdentifiedLandmark {
    /// Name, unique in the layout.
    pub id: u16,
    /// The landmark.
    pub landmark: LayoutLandmark,
}

impl Element for IdentifiedLandmark {
    fn read(reader: &mut Reader) -> Result<Self, ReadError> {
        Ok(Self { id: reader.u16()?, landmark: LayoutLandmark::read(reader)? })
    }

    fn write(&self, writer: &mut Writer) -> Result<(), WriteError> {
        writer.u16(self.id)?;
        self.landmark.write(writer)
    }
}
