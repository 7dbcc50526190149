//! Tables as programs of all countries write them: separated by commas, semicolons or tabs, with points or commas in numbers, and with
//! the line `sep=;` by which spreadsheets say so.

use csv::StringRecord;

/// A table as it was written.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Lines, from 1, and what stands in them; empty lines and remarks (`#`) are left out.
    pub rows: Vec<(usize, StringRecord)>,
    /// What separates the columns.
    pub separator: u8,
    /// Whether a comma in a number stands before its fraction.
    pub has_decimal_commas: bool,
}

/// The table in a text.
#[must_use]
pub fn of_text(text: &str) -> Table {
    // The reader of tables counts lines that end in two characters one too late.
    let text = text.replace("\r\n", "\n");
    let first = text.lines().next().unwrap_or_default();
    let stated = first.trim().strip_prefix("sep=");
    let separator = stated.and_then(|stated| stated.bytes().next()).unwrap_or_else(|| separator(&text));
    let (before, body) = match stated {
        Some(_) => (1, text.get(first.len()..).unwrap_or_default().trim_start_matches('\n')),
        None => (0, text.as_str()),
    };
    let before =
        if body.is_empty() { before } else { text[..text.len() - body.len()].matches('\n').count().max(before) };
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .delimiter(separator)
        // Before quotes are looked at: a remark may hold one.
        .comment(Some(b'#'))
        .from_reader(body.as_bytes());
    let mut rows = Vec::new();
    // A text has no records that are no text.
    for record in reader.records().filter_map(Result::ok) {
        let line = before + record.position().map_or(0, |position| position.line() as usize);
        if !record.iter().all(|word| word.trim().is_empty()) {
            rows.push((line, record));
        }
    }
    let has_decimal_commas = separator != b',' && rows.iter().any(|(_, record)| record.iter().any(is_with_comma));
    Table { rows, separator, has_decimal_commas }
}

/// Whether a line begins with a remark; a name behind the sign is that of a column.
fn is_remark(word: &str) -> bool {
    word.trim_start().starts_with('#')
}

/// What separates the columns of a text that does not say: a semicolon or a tabulator, if the first lines hold any.
fn separator(text: &str) -> u8 {
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty() && !is_remark(line)).take(5).collect();
    let in_all = |one: char| !lines.is_empty() && lines.iter().all(|line| line.contains(one));
    if in_all(';') {
        b';'
    } else if in_all('\t') {
        b'\t'
    } else {
        b','
    }
}

/// A number with one comma, and no point, in it.
fn is_with_comma(word: &str) -> bool {
    let word = word.trim();
    let is_part = |one: char| one.is_ascii_digit() || matches!(one, ',' | '-' | '+' | 'e' | 'E');
    word.matches(',').count() == 1 && word.chars().any(|one| one.is_ascii_digit()) && word.chars().all(is_part)
}

/// A number that a table holds. None if it is none, or not finite.
#[must_use]
pub fn number(word: &str, has_decimal_commas: bool) -> Option<f64> {
    let word = word.trim();
    let number: f64 = if has_decimal_commas { word.replacen(',', ".", 1).parse().ok()? } else { word.parse().ok()? };
    number.is_finite().then_some(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<Vec<String>> {
        of_text(text).rows.iter().map(|(_, record)| record.iter().map(str::to_owned).collect()).collect()
    }

    #[test]
    fn tables_of_all_countries_say_the_same() {
        for text in [
            "t,x\n1,2.5\n",
            "t;x\r\n1;2.5\r\n",
            "t\tx\n1\t2.5\n",
            "sep=;\nt;x\n1;2.5\n",
            "sep=;\r\nt;x\r\n1;2.5\r\n",
            "sep=,\n\nt,x\n1,2.5",
            "# a remark, with a comma\nt;x\n1;2.5\n",
        ] {
            assert_eq!(words(text), [["t", "x"], ["1", "2.5"]], "{text}");
            assert!(!of_text(text).has_decimal_commas);
        }
        let table = of_text("t;x\n1;2,5\n");
        assert!(table.has_decimal_commas);
        assert_eq!(number(" -2,5", true), Some(-2.5));
        assert_eq!((number("2,5", false), number("nan", false), number("1e3", true)), (None, None, Some(1000.0)));
        for (text, line) in
            [("t;x\n1;2.5\n", 2), ("t;x\r\n1;2.5\r\n", 2), ("sep=;\r\nt;x\r\n1;2.5\r\n", 3), ("sep=;\n\nt;x\n1;2", 4)]
        {
            assert_eq!(of_text(text).rows[1].0, line, "{text}");
        }
    }
}
