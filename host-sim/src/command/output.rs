//! Results on standard output.

/// Prints names and values in two columns.
pub fn print_rows(rows: &[[String; 2]]) {
    for [name, value] in rows {
        println!("{name:<24} {value}");
    }
}
