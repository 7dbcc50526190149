//! On which line of a TOML text a key has its value.

/// The line, from 1, that gives a value to a key of tables and a name with dots between them; the first that does if several
/// give that value.
#[must_use]
pub fn of_key(text: &str, key: &str, value: Option<f64>) -> Option<usize> {
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

#[cfg(test)]
mod tests {
    use super::of_key;

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
