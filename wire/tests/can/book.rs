//! The tables of the CAN interface in the book are made from `docs/agv.dbc`, which other tests hold against the code, and from
//! the node's own table of objects.
//!
//! `AGV_ACCEPT=1 cargo test -p agv-wire book` writes it anew, for a change that is meant.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use agv_wire::can::controller_node::dictionary::{Access, OBJECTS};

fn docs(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs").join(name)
}

const HEAD: &str = "# All CAN frames

This chapter is made from `docs/agv.dbc` and from the objects of the controller's node. Identifiers are those of node 16
(`can.controller_node`): each is its base plus the number of the node. 500 kbit/s unless `can.bit_rate` is another, eleven-bit
identifiers, data of eight bytes, least significant bit first. On the Nucleo-H743ZI the transceiver is at
PD0 (receive) and PD1 (transmit). The lowest value of a signed signal, and the highest of an unsigned one, mean that the value is not
known. The frames of a cycle have the same counter. They are what the node's PDOs hold until a master maps something else.

The encoders are nodes 1 (`can.drive_node`) and 2 (`can.steering_node`) after CiA 406: each sends its position as a process data object
every `can.encoder_period`; the controller starts them and watches their heartbeats, unless `can.nmt_master` is off.

";

/// A signal as a row of the table.
fn signal(line: &str) -> Option<(String, String)> {
    let (name, rest) = line.trim().strip_prefix("SG_ ")?.split_once(" : ")?;
    let (bits, rest) = rest.split_once('@')?;
    let (start, length) = bits.split_once('|')?;
    let is_signed = rest.starts_with("1-");
    let (factor, rest) = rest.split_once('(')?.1.split_once(',')?;
    let (least, rest) = rest.split_once('[')?.1.split_once('|')?;
    let (most, rest) = rest.split_once(']')?;
    let unit = rest.split('"').nth(1)?;
    let kind = if is_signed { "signed" } else { "unsigned" };
    Some((
        name.to_owned(),
        format!("| `{name}` | {start} | {length} | {kind} | {factor} | {unit} | {least} to {most} |"),
    ))
}

fn table(dbc: &str) -> String {
    let mut comments = BTreeMap::new();
    let mut values = BTreeMap::new();
    for line in dbc.lines() {
        if let Some(rest) = line.strip_prefix("CM_ BO_ ").or(line.strip_prefix("CM_ SG_ "))
            && let Some((of, text)) = rest.split_once(" \"")
        {
            comments.insert(of.to_owned(), text.trim_end_matches("\";").to_owned());
        }
        if let Some(rest) = line.strip_prefix("VAL_ ") {
            let mut words = rest.splitn(3, ' ');
            let of = format!("{} {}", words.next().unwrap(), words.next().unwrap());
            let list: Vec<&str> = words.next().unwrap().split('"').collect();
            let mut named: Vec<(u32, &str)> =
                list.chunks_exact(2).map(|pair| (pair[0].trim().parse().unwrap(), pair[1])).collect();
            named.sort_unstable();
            values.insert(of, named);
        }
    }
    let mut text = HEAD.to_owned();
    let mut id = String::new();
    let mut notes: Vec<String> = Vec::new();
    let finish = |text: &mut String, notes: &mut Vec<String>| {
        for note in notes.drain(..) {
            let _ = write!(text, "\n{note}\n");
        }
    };
    for line in dbc.lines() {
        if let Some(rest) = line.strip_prefix("BO_ ") {
            finish(&mut text, &mut notes);
            let words: Vec<&str> = rest.split([' ', ':']).filter(|word| !word.is_empty()).collect();
            words[0].clone_into(&mut id);
            let number: u32 = words[0].parse().unwrap();
            let who = if words[3] == "AGV" { "said by the controller" } else { "heard by the controller" };
            // Neither a gyro nor the vehicle's own controller is a node that the settings number.
            let place = if matches!(words[3], "Gyro" | "Vehicle") {
                format!("({number:03X}h)")
            } else {
                format!("({number:03X}h = {:03X}h + node)", number - 16)
            };
            let comment = comments.get(&id).map_or("", String::as_str);
            let _ = write!(
                text,
                "\n## {} {place}, {who}\n\n{comment}\n\n| signal | first bit | bits | | factor | unit | range |\n|---|---|---|---|---|---|---|\n",
                words[1],
            );
        } else if let Some((name, row)) = signal(line) {
            let _ = writeln!(text, "{row}");
            let of = format!("{id} {name}");
            if let Some(comment) = comments.get(&of) {
                notes.push(format!("`{name}`: {comment}"));
            }
            if let Some(named) = values.get(&of) {
                let list: Vec<String> = named.iter().map(|(value, name)| format!("{value} {name}")).collect();
                notes.push(format!("`{name}`: {}.", list.join(", ")));
            }
        }
    }
    finish(&mut text, &mut notes);
    text + &objects()
}

const OBJECTS_HEAD: &str = "
# Objects of the controller's node

`docs/agv.eds` has them for other programs. Objects above 4000h are the [settings](settings.md): 4000h plus the key of the setting. Values of more than four bytes come in segments. PDO parameters (1800h to 1A04h) are written in pre-operational.

| index | sub-index | object | type | access | in PDOs |
|---|---|---|---|---|---|
";

/// The table of all objects but the settings.
fn objects() -> String {
    let span = |(first, last): (u16, u16), digits: usize| {
        let one = |number: u16| if digits > 2 { format!("{number:0digits$X}h") } else { number.to_string() };
        if first == last { one(first) } else { format!("{} to {}", one(first), one(last)) }
    };
    let mut text = OBJECTS_HEAD.to_owned();
    for record in &OBJECTS {
        for entry in record.entries {
            let name =
                if record.is_variable() { entry.name.to_owned() } else { format!("{}: {}", record.name, entry.name) };
            let access = match entry.access {
                Access::Constant => "constant",
                Access::Read => "read",
                Access::ReadWrite => "read, write",
                Access::Write => "write",
            };
            let _ = writeln!(
                text,
                "| {} | {} | {name} | {:?} | {access} | {} |",
                span(record.indices, 4),
                span((entry.subs.0.into(), entry.subs.1.into()), 1),
                entry.data_type,
                if entry.is_mappable { "yes" } else { "" },
            );
        }
    }
    text
}

#[test]
fn the_book_lists_every_signal_as_it_is() {
    let dbc = std::fs::read_to_string(docs("agv.dbc")).unwrap();
    let found = table(&dbc);
    if std::env::var_os("AGV_ACCEPT").is_some() {
        std::fs::write(docs("src/can.md"), &found).unwrap();
        return;
    }
    let kept = std::fs::read_to_string(docs("src/can.md")).unwrap();
    for (kept, found) in kept.lines().zip(found.lines()) {
        assert_eq!(kept, found);
    }
    assert_eq!(kept.lines().count(), found.lines().count());
    let signals = dbc.lines().filter_map(signal);
    assert!(signals.clone().count() > 20 && signals.into_iter().all(|(name, _)| kept.contains(&format!("`{name}`"))));
}
