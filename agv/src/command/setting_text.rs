//! Names and values of settings as text.

use agv_settings::LEAVES;
use agv_settings::leaf::{Leaf, Value};
use anyhow::Context;

/// The setting of that name; what comes near it is suggested if there is none.
pub fn named(name: &str) -> anyhow::Result<&'static Leaf> {
    Leaf::named(name).with_context(|| {
        // A name without its room is that of the setting first of all.
        let within = |leaf: &&Leaf| leaf.name.split_once('.').is_some_and(|(_, last)| last == name);
        if let Some(leaf) = LEAVES.iter().find(within) {
            return format!("there is no setting of the name {name}; did you mean {}?", leaf.name);
        }
        let near = LEAVES.iter().map(|leaf| (strsim::jaro_winkler(leaf.name, name), leaf.name));
        let nearest = near.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(likeness, _)| *likeness > 0.7);
        let suggestion = nearest.map_or_else(String::new, |(_, name)| format!("; did you mean {name}?"));
        format!("there is no setting of the name {name}{suggestion}")
    })
}

/// A value as it is written on a command line or in a file, for a leaf that holds `like`.
pub fn parse_value(name: &str, text: &str, like: Value) -> anyhow::Result<Value> {
    let choices = Leaf::named(name).map_or(&[][..], |leaf| leaf.choices);
    if !choices.is_empty() {
        let place = choices.iter().position(|choice| *choice == text);
        let place = place.with_context(|| format!("{name} must be one of {}, not '{text}'", choices.join(", ")))?;
        return Ok(Value::Whole(place as u64));
    }
    let value = match like {
        Value::Number(_) => text.parse().ok().map(Value::Number),
        Value::Whole(_) => text.parse().ok().map(Value::Whole),
        Value::Switch(_) => switch(text).map(Value::Switch),
        Value::Address(_) => text.parse::<std::net::Ipv4Addr>().ok().map(|address| Value::Address(address.octets())),
    };
    let wanted = match like {
        Value::Number(_) => "a number",
        Value::Whole(_) => "a whole number",
        Value::Switch(_) => "on or off (true or false, yes or no, 1 or 0)",
        Value::Address(_) => "an address such as 192.168.1.10",
    };
    value.with_context(|| format!("{name} must be {wanted}, not '{text}'"))
}

/// A switch as people write it.
fn switch(text: &str) -> Option<bool> {
    match text.to_lowercase().as_str() {
        "on" | "true" | "yes" | "1" => Some(true),
        "off" | "false" | "no" | "0" => Some(false),
        _ => None,
    }
}

/// A value of the setting of that name with all its digits, or the word for it.
pub fn show_setting(name: &str, value: Value) -> String {
    word(name, value).map_or_else(|| show(value), str::to_owned)
}

/// The word for a value of the setting of that name, if its values have words.
pub fn word(name: &str, value: Value) -> Option<&'static str> {
    let Value::Whole(number) = value else { return None };
    Leaf::named(name)?.choices.get(usize::try_from(number).ok()?).copied()
}

/// A value with all its digits.
pub fn show(value: Value) -> String {
    match value {
        Value::Number(number) => number.to_string(),
        Value::Whole(whole) => whole.to_string(),
        Value::Switch(is_on) => is_on.to_string(),
        Value::Address([a, b, c, d]) => format!("{a}.{b}.{c}.{d}"),
    }
}

/// A number with as many digits as people read.
pub fn show_number(value: f64) -> String {
    let size = value.abs();
    let is_plain = value == 0.0 || (1e-3..1e6).contains(&size);
    if !is_plain {
        return format!("{value:.6e}").replace("000000e", "e").replace(".e", "e");
    }
    let text = format!("{value:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// A value with as many digits as people read.
pub fn show_readable(value: Value) -> String {
    match value {
        Value::Number(number) => show_number(number),
        other => show(other),
    }
}
