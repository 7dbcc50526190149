//! Which objects the controller has: the one table that the node serves and that its description file is made from.
//!
//! | index | what is there | from |
//! |---|---|---|
//! | 1000h to 1FFFh | communication | CiA 301, 7.5.2; CiA 302-2 |
//! | 2001h to 2008h | whole telegrams, as `docs/agv.dbc` has them | here |
//! | 2010h to 2013h | the same, one value an object | here |
//! | 2014h | the map | here |
//! | from 4000h on | settings | whoever has them |

use crate::can::sdo::{AbortCode, Object};

/// How a value is to be read (CiA 301, 7.4.7).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DataType {
    /// One byte, 0 or 1.
    Boolean,
    /// A number without sign of one byte.
    Unsigned8,
    /// The same of two bytes.
    Unsigned16,
    /// The same of four bytes.
    Unsigned32,
    /// The same of eight bytes.
    Unsigned64,
    /// A number in two's complement of four bytes.
    Integer32,
    /// A number of IEEE 754 of eight bytes.
    Real64,
    /// Text.
    VisibleString,
}

impl DataType {
    /// The number that stands for the type (CiA 301, table 44).
    #[must_use]
    pub const fn code(self) -> u16 {
        match self {
            Self::Boolean => 0x01,
            Self::Integer32 => 0x04,
            Self::Unsigned8 => 0x05,
            Self::Unsigned16 => 0x06,
            Self::Unsigned32 => 0x07,
            Self::VisibleString => 0x09,
            Self::Real64 => 0x11,
            Self::Unsigned64 => 0x1B,
        }
    }

    /// Bytes of a value; none is said for text.
    #[must_use]
    pub const fn length(self) -> Option<usize> {
        Some(match self {
            Self::Boolean | Self::Unsigned8 => 1,
            Self::Unsigned16 => 2,
            Self::Unsigned32 | Self::Integer32 => 4,
            Self::Unsigned64 | Self::Real64 => 8,
            Self::VisibleString => return None,
        })
    }
}

/// What may be done with an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// It never changes.
    Constant,
    /// It can be read.
    Read,
    /// It can be read and written.
    ReadWrite,
    /// It can be written.
    Write,
}

/// One value, or several of the same kind behind each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// First and last subindex.
    pub subs: (u8, u8),
    /// Name.
    pub name: &'static str,
    /// How it is to be read.
    pub data_type: DataType,
    /// What may be done with it.
    pub access: Access,
    /// Whether it can be in a PDO.
    pub is_mappable: bool,
}

/// One object, or several of the same kind behind each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record {
    /// First and last index.
    pub indices: (u16, u16),
    /// Name of the object; its number is to be put behind it if there are several.
    pub name: &'static str,
    /// Whether it is an array.
    pub is_array: bool,
    /// Its values; a simple object has one, at subindex 0.
    pub entries: &'static [Entry],
}

impl Record {
    /// Whether it is a simple object.
    #[must_use]
    pub const fn is_variable(&self) -> bool {
        matches!(self.entries, [Entry { subs: (0, 0), .. }])
    }
}

use Access::{Constant, Read, ReadWrite, Write};
use DataType::{Integer32, Unsigned8, Unsigned16, Unsigned32, Unsigned64, VisibleString};

const fn entry(sub: u8, name: &'static str, data_type: DataType, access: Access) -> Entry {
    Entry { subs: (sub, sub), name, data_type, access, is_mappable: false }
}

const fn entries(subs: (u8, u8), name: &'static str, data_type: DataType, access: Access) -> Entry {
    Entry { subs, name, data_type, access, is_mappable: false }
}

const fn value(sub: u8, name: &'static str, data_type: DataType) -> Entry {
    Entry { subs: (sub, sub), name, data_type, access: Read, is_mappable: true }
}

const fn order(name: &'static str) -> Entry {
    Entry { subs: (0, 0), name, data_type: Unsigned64, access: Write, is_mappable: true }
}

const HIGHEST: Entry = entry(0, "Highest sub-index", Unsigned8, Constant);

const fn one(index: u16, entries: &'static [Entry]) -> Record {
    let name = match entries {
        [first, ..] => first.name,
        [] => "",
    };
    Record { indices: (index, index), name, is_array: false, entries }
}

const fn record(indices: (u16, u16), name: &'static str, entries: &'static [Entry]) -> Record {
    Record { indices, name, is_array: false, entries }
}

const fn array(index: u16, name: &'static str, entries: &'static [Entry]) -> Record {
    Record { indices: (index, index), name, is_array: true, entries }
}

/// All objects but the settings.
pub static OBJECTS: [Record; 30] = [
    one(0x1000, &[entry(0, "Device type", Unsigned32, Constant)]),
    one(0x1001, &[entry(0, "Error register", Unsigned8, Read)]),
    array(
        0x1003,
        "Pre-defined error field",
        &[
            entry(0, "Number of errors", Unsigned8, ReadWrite),
            entries((1, 8), "Standard error field", Unsigned32, Read),
        ],
    ),
    one(0x1005, &[entry(0, "COB-ID SYNC message", Unsigned32, Constant)]),
    one(0x1008, &[entry(0, "Manufacturer device name", VisibleString, Constant)]),
    one(0x1009, &[entry(0, "Manufacturer hardware version", VisibleString, Constant)]),
    one(0x100A, &[entry(0, "Manufacturer software version", VisibleString, Constant)]),
    array(0x1010, "Store parameters", &[HIGHEST, entry(1, "Save all parameters", Unsigned32, ReadWrite)]),
    one(0x1014, &[entry(0, "COB-ID EMCY", Unsigned32, ReadWrite)]),
    array(
        0x1016,
        "Consumer heartbeat time",
        &[HIGHEST, entries((1, 4), "Consumer heartbeat time", Unsigned32, ReadWrite)],
    ),
    one(0x1017, &[entry(0, "Producer heartbeat time", Unsigned16, ReadWrite)]),
    record(
        (0x1018, 0x1018),
        "Identity object",
        &[
            HIGHEST,
            entry(1, "Vendor-ID", Unsigned32, Read),
            entry(2, "Product code", Unsigned32, Constant),
            entry(3, "Revision number", Unsigned32, Constant),
            entry(4, "Serial number", Unsigned32, Read),
        ],
    ),
    record(
        (0x1400, 0x1402),
        "RPDO communication parameter",
        &[HIGHEST, entry(1, "COB-ID", Unsigned32, Constant), entry(2, "Transmission type", Unsigned8, Constant)],
    ),
    record(
        (0x1600, 0x1602),
        "RPDO mapping parameter",
        &[entry(0, "Number of mapped objects", Unsigned8, Constant), entry(1, "Mapped object", Unsigned32, Constant)],
    ),
    record(
        (0x1800, 0x1804),
        "TPDO communication parameter",
        &[
            HIGHEST,
            entry(1, "COB-ID", Unsigned32, ReadWrite),
            entry(2, "Transmission type", Unsigned8, ReadWrite),
            entry(3, "Inhibit time", Unsigned16, ReadWrite),
            entry(5, "Event timer", Unsigned16, ReadWrite),
        ],
    ),
    record(
        (0x1A00, 0x1A04),
        "TPDO mapping parameter",
        &[
            entry(0, "Number of mapped objects", Unsigned8, ReadWrite),
            entries((1, 8), "Mapped object", Unsigned32, ReadWrite),
        ],
    ),
    one(0x1F80, &[entry(0, "NMT startup", Unsigned32, Read)]),
    one(0x2001, &[value(0, "Position", Unsigned64)]),
    one(0x2002, &[value(0, "Heading", Unsigned64)]),
    one(0x2003, &[value(0, "Covariance", Unsigned64)]),
    one(0x2004, &[value(0, "Status", Unsigned64)]),
    one(0x2005, &[order("Initial position")]),
    one(0x2006, &[order("Initial heading")]),
    one(0x2007, &[order("Command")]),
    one(0x2008, &[value(0, "Integrity", Unsigned64)]),
    record(
        (0x2010, 0x2010),
        "Pose",
        &[
            HIGHEST,
            value(1, "X in 0.1 mm", Integer32),
            value(2, "Y in 0.1 mm", Integer32),
            value(3, "Heading in 1 urad", Integer32),
            value(4, "Time of the pose in 1 ms", Unsigned32),
            value(5, "Dead-reckoning distance in 1 cm", Unsigned16),
        ],
    ),
    record(
        (0x2011, 0x2011),
        "Standard deviations",
        &[
            HIGHEST,
            value(1, "Deviation of X in 0.1 mm", Unsigned16),
            value(2, "Deviation of Y in 0.1 mm", Unsigned16),
            value(3, "Deviation of the heading in 0.1 mrad", Unsigned16),
        ],
    ),
    record(
        (0x2012, 0x2012),
        "Integrity of the pose",
        &[
            HIGHEST,
            value(1, "Protection level of the position in 1 mm", Unsigned16),
            value(2, "Protection level of the heading in 0.1 mrad", Unsigned16),
            value(3, "Alert limit of the position in 1 mm", Unsigned16),
            value(4, "Alert limit of the heading in 0.1 mrad", Unsigned16),
            value(5, "Alarm", Unsigned8),
        ],
    ),
    record(
        (0x2013, 0x2013),
        "State",
        &[
            HIGHEST,
            value(1, "Mode", Unsigned8),
            value(2, "Reason", Unsigned8),
            value(3, "Fault of the driving wheel's encoder", Unsigned8),
            value(4, "Fault of the steering's encoder", Unsigned8),
            value(5, "Laser", Unsigned8),
            value(6, "Search for a pose", Unsigned8),
            value(7, "Pose is good", Unsigned8),
            value(8, "Pose was corrected", Unsigned8),
            value(9, "Resets of the pose", Unsigned8),
            value(10, "Overflows", Unsigned8),
        ],
    ),
    record(
        (0x2014, 0x2014),
        "Map",
        &[HIGHEST, entry(1, "Identity", Unsigned32, Read), entry(2, "Number of landmarks", Unsigned16, Read)],
    ),
];

/// The entry of an object.
///
/// # Errors
/// If there is no such object, or no such part of it.
pub fn find(object: Object) -> Result<&'static Entry, AbortCode> {
    let is_within = |record: &&Record| (record.indices.0..=record.indices.1).contains(&object.index);
    let record = OBJECTS.iter().find(is_within).ok_or(AbortCode::NoSuchObject)?;
    let has = |entry: &&Entry| (entry.subs.0..=entry.subs.1).contains(&object.sub);
    record.entries.iter().find(has).ok_or(AbortCode::NoSuchSubindex)
}
