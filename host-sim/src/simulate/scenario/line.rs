//! On which line of a TOML text a key has its value.

use super::keys;

/// The line, from 1, that gives a value to a key of tables and a name with dots between them; the first that does if several
/// give that value.
#[must_use]
pub fn of_key(text: &str, key: &str, value: Option<f64>) -> Option<usize> {
    let key = key.split(' ').next().unwrap_or(key);
    let mut table = String::new();
    for (line, number) in text.lines().zip(1..) {
        let line = line.trim();
        if let Some(header) = line.strip_prefix('[') {
            table = header.trim_start_matches('[').split(']').next().unwrap_or_default().trim().to_owned();
            continue;
        }
        let Some((name, rest)) = line.split_once('=') else { continue };
        let full = if table.is_empty() { name.trim().to_owned() } else { format!("{table}.{}", name.trim()) };
        let is_within = key.strip_prefix(&full).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
        let stated = rest.split('#').next().unwrap_or_default().trim().replace('_', "").parse::<f64>();
        let is_other = matches!((stated, value), (Ok(stated), Some(value)) if stated != value && !value.is_nan());
        if is_within && !is_other {
            return Some(number);
        }
    }
    None
}

/// The line, from 1, of the key whose value a setting of the vehicle is made of: they share the last word of their names.
#[must_use]
pub fn of_leaf(text: &str, leaf: &str) -> Option<usize> {
    let word = leaf.rsplit('.').next().unwrap_or(leaf);
    let word = word.trim_end_matches("_scale").trim_end_matches("_theta");
    let word = if word == "theta" { "heading" } else { word };
    let room = leaf.split('.').next().unwrap_or_default();
    let keys = keys::KEYS.iter().filter(|key| key.name.starts_with(room));
    let named = keys.filter(|key| key.name.rsplit('.').next().is_some_and(|last| last.starts_with(word)));
    named.filter_map(|key| of_key(text, key.name, None)).next()
}

/// The line of the value that an error is about. What is read within a kind of world names the table alone: the line without which there
/// is no such error any more is the one.
#[must_use]
pub fn of_error(text: &str, line: usize, is_wrong: impl Fn(&str) -> Option<String>) -> usize {
    let Some(problem) = is_wrong(text) else { return line };
    let lines: Vec<&str> = text.lines().collect();
    let named = lines.get(line.saturating_sub(1)).copied().unwrap_or_default().trim();
    if !named.starts_with('[') {
        return line;
    }
    let own = |(_, content): &(usize, &&str)| content.contains('=') && !content.trim_start().starts_with('#');
    let behind = lines.iter().enumerate().skip(line).take_while(|(_, content)| !content.trim_start().starts_with('['));
    let without = |index: usize| {
        let kept = lines.iter().enumerate().filter(|(other, _)| *other != index).map(|(_, content)| *content);
        kept.collect::<Vec<_>>().join("\n")
    };
    let is_it = |index: &usize| is_wrong(&without(*index)).is_none_or(|other| other != problem);
    let found = behind.filter(own).map(|(index, _)| index).find(is_it);
    found.map_or(line, |index| index + 1)
}

/// A complaint of the reader of TOML without the words of a programmer.
#[must_use]
pub fn in_plain_words(problem: &str) -> String {
    let mut words = problem.to_owned();
    for (word, plain) in [
        ("expected f64", "a number is wanted"),
        ("expected u64", "a whole number is wanted"),
        ("expected u32", "a whole number is wanted"),
        ("expected u8", "a small whole number is wanted"),
        ("expected usize", "a whole number is wanted"),
        ("expected a boolean", "true or false is wanted"),
        ("expected a sequence", "a list is wanted"),
        ("floating point `", "number `"),
        ("floating point", "number"),
    ] {
        words = words.replace(word, plain);
    }
    words
}

#[cfg(test)]
mod tests {
    use super::{in_plain_words, of_key, of_leaf};

    #[test]
    fn a_setting_is_found_by_its_key() {
        let text =
            "[laser.mounting]\nx = 50.0\n[vehicle.believed]\ndrive_scale = 9.0\nsteering_offset_forward_deg = 999.0\n";
        assert_eq!(of_leaf(text, "laser.x"), Some(2));
        assert_eq!(of_leaf(text, "vehicle.drive_scale"), Some(4));
        assert_eq!(of_leaf(text, "vehicle.steering_offset_forward"), Some(5));
        assert_eq!(of_leaf(text, "limits.fastest"), None);
    }

    #[test]
    fn a_complaint_speaks_of_numbers() {
        assert_eq!(
            in_plain_words("invalid type: string \"a\", expected f64"),
            "invalid type: string \"a\", a number is wanted"
        );
    }

    #[test]
    fn tables_lists_and_inline_tables_are_found() {
        let text = "seed = 1\n[drive]\nspeed = 0.5 # slow\n[[people]]\nspeed = 1.0\n[[people]]\nspeed = 99.0\n\
                    [path]\nlegs = [{ segments = [{ length = -1.0 }] }]\n";
        assert_eq!(of_key(text, "seed", Some(1.0)), Some(1));
        assert_eq!(of_key(text, "drive.speed", Some(0.5)), Some(3));
        assert_eq!(of_key(text, "people.speed", Some(99.0)), Some(7));
        assert_eq!(of_key(text, "path.legs.segments.length", Some(-1.0)), Some(9));
        assert_eq!(of_key(text, "laser.beams", None), None);
    }
}
