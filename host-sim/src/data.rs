//! Where recordings of others are kept.

use std::io::Write;
use std::path::PathBuf;

/// The folder of real recordings: the environment variable `AGV_DATA`, else `../shared/data` beside the repository.
/// None if it does not exist.
#[must_use]
pub fn folder() -> Option<PathBuf> {
    let candidates = match std::env::var_os("AGV_DATA") {
        Some(stated) => vec![PathBuf::from(stated)],
        None => {
            let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data");
            vec![PathBuf::from("../shared/data"), PathBuf::from(beside)]
        }
    };
    candidates.into_iter().find(|folder| folder.is_dir())
}

/// A file or folder of the real recordings, for a test. Where it is absent, says in one line that `test` is skipped: on
/// standard error, and in the file that the environment variable `AGV_SKIPPED` names.
#[must_use]
pub fn for_test(test: &str, name: &str) -> Option<PathBuf> {
    let found = folder().map(|folder| folder.join(name)).filter(|path| path.exists());
    if found.is_none() {
        skip(test, &format!("there is no {name} in the folder of real data (AGV_DATA)"));
    }
    found
}

/// Says in one line that `test` is skipped, and why: on standard error, and in the file that the environment variable
/// `AGV_SKIPPED` names.
pub fn skip(test: &str, reason: &str) {
    let line = format!("skipped: {test}, because {reason}\n");
    eprint!("{line}");
    if let Some(path) = std::env::var_os("AGV_SKIPPED")
        && let Ok(mut file) = std::fs::OpenOptions::new().create(true).append(true).open(path)
    {
        // A line that cannot be written changes nothing about the test.
        let _ = file.write_all(line.as_bytes());
    }
}
