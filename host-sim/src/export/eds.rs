//! The description file of the controller's node (EDS, CiA 306-1), made from the tables that the node serves.

use std::fmt::Write as _;

use agv_controller::{SettingObjects, data_type, object_of};
use agv_core::measurement::Time;
use agv_settings::leaf::Value;
use agv_settings::{LEAVES, Settings};
use agv_wire::can::bit_timing::BIT_RATES as OWN_BIT_RATES;
use agv_wire::can::canopen::NodeId;
use agv_wire::can::controller_node::dictionary::{Access, DataType, Entry, OBJECTS, Record};
use agv_wire::can::controller_node::{ControllerNode, NodeSettings};
use agv_wire::can::sdo::{Object, ValueBytes};

/// Object types (CiA 306-1, table 10).
const VARIABLE: u8 = 7;
const ARRAY: u8 = 8;
const RECORD: u8 = 9;

/// Bit rates that a description can name, kbit/s.
const BIT_RATES: [u16; 8] = [10, 20, 50, 125, 250, 500, 800, 1000];

/// A value of an object, with its name and what may be done with it.
struct Line<'a> {
    name: &'a str,
    data_type: DataType,
    access: &'static str,
    default: Option<String>,
    limits: Option<(u64, u64)>,
    is_mappable: bool,
}

/// The description of a controller with these settings.
#[must_use]
pub fn eds(settings: &Settings) -> String {
    // Any number would do: it is taken off again.
    let node = NodeId::new(1).map(|node| NodeSettings {
        vendor: settings.nodes.vendor,
        period: settings.publishing_period,
        ..NodeSettings::new(node)
    });
    let Some(node) = node else { return String::new() };
    let mut node = ControllerNode::new(node, Time::default());
    let mut text = head(settings);
    let own: Vec<u16> = OBJECTS.iter().flat_map(|record| record.indices.0..=record.indices.1).collect();
    let of_settings = LEAVES.iter().map(|leaf| object_of(leaf).index);
    let (mandatory, communication): (Vec<u16>, Vec<u16>) =
        own.iter().filter(|index| **index < 0x2000).partition(|index| matches!(index, 0x1000 | 0x1001 | 0x1018));
    let manufacturer: Vec<u16> = own.iter().copied().filter(|index| *index >= 0x2000).chain(of_settings).collect();
    list(&mut text, "MandatoryObjects", &mandatory);
    list(&mut text, "OptionalObjects", &communication);
    list(&mut text, "ManufacturerObjects", &manufacturer);
    for record in &OBJECTS {
        for index in record.indices.0..=record.indices.1 {
            describe(&mut text, record, index, &mut node);
        }
    }
    describe_settings(&mut text, settings);
    text
}

fn head(settings: &Settings) -> String {
    let rates: String =
        BIT_RATES.iter().map(|rate| format!("BaudRate_{rate}={}\n", u8::from(OWN_BIT_RATES.contains(rate)))).collect();
    format!(
        "[FileInfo]
FileName=agv.eds
FileVersion=1
FileRevision=3
EDSVersion=4.0
Description=Localisation controller of an automated guided vehicle
CreationTime=12:00AM
CreationDate=01-01-2026
CreatedBy=agv
ModificationTime=12:00AM
ModificationDate=01-01-2026
ModifiedBy=agv

[DeviceInfo]
VendorName=agv
VendorNumber=0x{:X}
ProductName=Localisation controller
ProductNumber=0x0
RevisionNumber=0x3
OrderCode=0
{rates}SimpleBootUpMaster=0
SimpleBootUpSlave=1
Granularity=8
DynamicChannelsSupported=0
GroupMessaging=0
NrOfRXPDO=3
NrOfTXPDO=5
LSS_Supported=0

[DummyUsage]
Dummy0001=0
Dummy0002=0
Dummy0003=0
Dummy0004=0
Dummy0005=0
Dummy0006=0
Dummy0007=0

[Comments]
Lines=4
Line1=Objects 2001h to 2008h are whole telegrams; their signals are described in agv.dbc.
Line2=Objects from 4000h on are the settings of the controller.
Line3=1800h to 1804h and 1A00h to 1A04h are written in pre-operational only. A controller that starts itself (bit 2 of 1F80h is 0) is put there first.
Line4=1010h stores the settings, 1014h, 1016h, 1017h and all PDO parameters, and is answered when that is done: in up to 3 s.
",
        settings.nodes.vendor
    )
}

fn list(text: &mut String, name: &str, indices: &[u16]) {
    let _ = write!(text, "\n[{name}]\nSupportedObjects={}\n", indices.len());
    for (number, index) in (1..).zip(indices) {
        let _ = writeln!(text, "{number}=0x{index:04X}");
    }
}

fn describe(text: &mut String, record: &Record, index: u16, node: &mut ControllerNode) {
    let has_several = record.indices.0 != record.indices.1;
    let number = index - record.indices.0 + 1;
    let name = if has_several { format!("{} {number}", record.name) } else { record.name.to_owned() };
    if let (true, [entry]) = (record.is_variable(), record.entries) {
        let default = default(entry, Object::new(index, 0), node);
        return line(text, &format!("{index:04X}"), &Line { default, ..entry_line(entry, &name) });
    }
    let subs: Vec<(u8, &Entry)> =
        record.entries.iter().flat_map(|entry| (entry.subs.0..=entry.subs.1).map(move |sub| (sub, entry))).collect();
    let kind = if record.is_array { ARRAY } else { RECORD };
    let _ = write!(text, "\n[{index:04X}]\nParameterName={name}\nObjectType=0x{kind:X}\nSubNumber={}\n", subs.len());
    for (sub, entry) in subs {
        let is_one_of_many = entry.subs.0 != entry.subs.1;
        let name = if is_one_of_many { format!("{} {sub}", entry.name) } else { entry.name.to_owned() };
        let default = default(entry, Object::new(index, sub), node);
        line(text, &format!("{index:04X}sub{sub:X}"), &Line { default, ..entry_line(entry, &name) });
    }
}

fn entry_line<'a>(entry: &Entry, name: &'a str) -> Line<'a> {
    Line {
        name,
        data_type: entry.data_type,
        access: match entry.access {
            Access::Constant => "const",
            Access::Read => "ro",
            Access::ReadWrite => "rw",
            Access::Write => "wo",
        },
        default: None,
        limits: None,
        is_mappable: entry.is_mappable,
    }
}

/// What a controller says that has just been switched on, with the node's number left open.
fn default(entry: &Entry, object: Object, node: &mut ControllerNode) -> Option<String> {
    let nothing = Settings::default();
    let bytes = node.read(object, None, &mut SettingObjects::new(&nothing)).ok()?;
    if entry.data_type == DataType::VisibleString {
        return String::from_utf8(bytes.to_vec()).ok().filter(|text| !text.is_empty() && object.index == 0x1008);
    }
    let value = number(&bytes);
    let is_of_node = matches!((object.index, object.sub), (0x1014, 0) | (0x1400..=0x1402 | 0x1800..=0x1804, 1));
    let digits = 2 * bytes.len();
    // The node that is asked has the number 1.
    Some(if is_of_node { format!("$NODEID+0x{:0digits$X}", value - 1) } else { format!("0x{value:0digits$X}") })
}

fn number(bytes: &ValueBytes) -> u64 {
    bytes.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte))
}

fn describe_settings(text: &mut String, settings: &Settings) {
    for leaf in &LEAVES {
        let value = leaf.value(settings);
        let name = if leaf.unit.is_empty() { leaf.name.to_owned() } else { format!("{} in {}", leaf.name, leaf.unit) };
        let default = match value {
            Value::Number(number) => number.to_string(),
            Value::Whole(whole) => format!("0x{whole:X}"),
            Value::Switch(is_on) => format!("0x{:X}", u8::from(is_on)),
            Value::Address(parts) => format!("0x{:X}", u32::from_be_bytes(parts)),
        };
        let limits = matches!(value, Value::Whole(_)).then_some((leaf.bounds.0 as u64, leaf.bounds.1 as u64));
        let described = Line {
            name: &name,
            data_type: data_type(leaf, value),
            access: "rw",
            default: Some(default),
            limits,
            is_mappable: false,
        };
        line(text, &format!("{:04X}", object_of(leaf).index), &described);
    }
}

fn line(text: &mut String, section: &str, described: &Line) {
    let Line { name, data_type, access, default, limits, is_mappable } = described;
    let _ = write!(
        text,
        "\n[{section}]\nParameterName={name}\nObjectType=0x{VARIABLE:X}\nDataType=0x{:04X}\nAccessType={access}\n",
        data_type.code()
    );
    if let Some((least, most)) = limits {
        let _ = write!(text, "LowLimit=0x{least:X}\nHighLimit=0x{most:X}\n");
    }
    if let Some(default) = default {
        let _ = writeln!(text, "DefaultValue={default}");
    }
    let _ = writeln!(text, "PDOMapping={}", u8::from(*is_mappable));
}
