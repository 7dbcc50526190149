//! How an import ends on the screen.

use std::path::Path;
use std::process::ExitCode;

use agv_host_sim::account::Account;
use agv_host_sim::import::ImportSummary;
use serde_json::{Value, json};

use super::output;

/// Exit code of an import that ended with a warning, if that is asked for.
const DOUBTFUL: u8 = 3;

/// Prints what was found, left out and assumed; warnings come last. As JSON they are said on standard error, too.
pub fn print(input: &Path, summary: &ImportSummary, as_json: bool) -> anyhow::Result<()> {
    if as_json {
        println!("{}", serde_json::to_string(summary)?);
        complain(input, &summary.warnings);
        return Ok(());
    }
    output::print_rows(&summary.rows());
    print_words(&summary.notes, &summary.warnings);
    Ok(())
}

/// The same of an input that is no drive: `rows`, or the keys of `found`, come first.
pub fn print_account(
    input: &Path,
    rows: &[[String; 2]],
    found: Value,
    account: &Account,
    as_json: bool,
) -> anyhow::Result<()> {
    let warnings = account.warnings();
    if as_json {
        let mut all = found;
        all["left_out"] = serde_json::to_value(account.left_out())?;
        all["beside"] = serde_json::to_value(account.beside())?;
        all["notes"] = json!(account.notes());
        all["warnings"] = json!(warnings);
        println!("{all}");
        complain(input, &warnings);
        return Ok(());
    }
    output::print_rows(rows);
    for (name, all) in [("left out", account.left_out()), ("set aside", account.beside())] {
        output::print_rows(&all.iter().map(|one| [name.to_owned(), one.to_string()]).collect::<Vec<_>>());
    }
    print_words(account.notes(), &warnings);
    Ok(())
}

/// Prints what was assumed, and warnings.
pub fn print_words(notes: &[String], warnings: &[String]) {
    notes.iter().for_each(|note| println!("note: {note}"));
    warnings.iter().for_each(|warning| println!("warning: {warning}"));
}

/// Says warnings on standard error.
pub fn complain(input: &Path, warnings: &[String]) {
    for warning in warnings {
        output::note(&format!("agv: {}: warning: {warning}", input.display()));
    }
}

/// Done, or with a warning where that is not tolerated.
pub fn exit_code(warnings: &[String], is_strict: bool) -> ExitCode {
    if is_strict && !warnings.is_empty() { ExitCode::from(DOUBTFUL) } else { ExitCode::SUCCESS }
}
