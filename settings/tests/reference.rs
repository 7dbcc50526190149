//! The reference of all settings in the book is made from the code.
//!
//! `AGV_ACCEPT=1 cargo test -p agv-settings --test reference` writes it anew, for a change that is meant.

use std::fmt::Write as _;
use std::path::Path;

use agv_settings::leaf::{Leaf, Value};
use agv_settings::{LEAVES, Settings, VehicleKind};

const HEAD: &str = "# All settings

This chapter is made from the code. A setting is read and changed by its name with `agv ctl`, and kept in flash under its key. Values
outside the bounds are refused. Names begin with the room of the code that they are for. `vehicle.kind` chooses the vehicle from a list;
a setting with kinds of vehicles behind it counts for those alone, and `agv ctl HOST list` shows what counts.

";

/// A number with as many digits as it needs.
fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || (1e-3..1e6).contains(&size) { format!("{value}") } else { format!("{value:e}") }
}

fn table() -> String {
    let settings = Settings::default();
    let mut text = HEAD.to_owned();
    let mut room = "";
    for leaf in &LEAVES {
        let (of, _) = leaf.name.split_once('.').unwrap();
        if of != room {
            room = of;
            let _ = write!(
                text,
                "## {room}\n\n| name | unit | default | least | greatest | key | of the kinds |\n|---|---|---|---|---|---|---|\n"
            );
        }
        let value = match leaf.value(&settings) {
            Value::Number(value) => number(value),
            Value::Whole(place) if !leaf.choices.is_empty() => leaf.choices[place as usize].to_owned(),
            Value::Whole(value) => value.to_string(),
            Value::Switch(is_on) => if is_on { "on" } else { "off" }.to_owned(),
            Value::Address([a, b, c, d]) => format!("{a}.{b}.{c}.{d}"),
        };
        let has_bounds = leaf.choices.is_empty() && matches!(leaf.value(&settings), Value::Number(_) | Value::Whole(_));
        let [least, most] =
            [leaf.bounds.0, leaf.bounds.1].map(|bound| if has_bounds { number(bound) } else { String::new() });
        let kinds = if leaf.kinds.len() == VehicleKind::ALL.len() {
            leaf.choices.join(", ")
        } else {
            leaf.kinds.iter().map(|kind| kind.name()).collect::<Vec<_>>().join(", ")
        };
        let Leaf { name, unit, key, .. } = leaf;
        let _ = writeln!(text, "| `{name}` | {unit} | {value} | {least} | {most} | {key} | {kinds} |");
        let next = LEAVES.iter().skip_while(|other| other.key != leaf.key).nth(1);
        if next.is_some_and(|next| !next.name.starts_with(&format!("{room}."))) {
            text.push('\n');
        }
    }
    text
}

#[test]
fn the_book_lists_every_setting_as_it_is() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/src/settings.md");
    let found = table();
    if std::env::var_os("AGV_ACCEPT").is_some() {
        std::fs::write(&path, &found).unwrap();
        return;
    }
    let kept = std::fs::read_to_string(&path).unwrap();
    for (kept, found) in kept.lines().zip(found.lines()) {
        assert_eq!(kept, found);
    }
    assert_eq!(kept.lines().count(), found.lines().count());
    assert!(LEAVES.iter().all(|leaf| kept.contains(&format!("`{}`", leaf.name))));
}
