//! What the crate offers, kept in the repository: an item more or less is a difference to read.
//!
//! `AGV_ACCEPT=1 cargo test -p agv-core public_items` writes the list anew, for a change that is meant.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Modules of a folder that hand items on.
fn modules(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            modules(&path, found);
        } else if path.file_name().is_some_and(|name| name == "mod.rs" || name == "lib.rs") {
            found.push(path);
        }
    }
}

/// Names behind `pub use` in a source without comments.
fn handed_on(code: &str) -> Vec<String> {
    let uses = code.split("pub use ").skip(1).filter_map(|rest| rest.split(';').next());
    let names = uses.flat_map(|paths| {
        let list = paths.split_once('{').map_or(paths, |(_, list)| list.trim_end_matches('}'));
        list.split(',').map(str::trim).filter(|path| !path.is_empty()).collect::<Vec<_>>()
    });
    let last = |path: &str| path.rsplit(['/', ':', ' ']).next().unwrap_or_default().to_owned();
    names.map(last).collect()
}

#[test]
fn the_list_of_public_items_is_the_one_that_was_agreed() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    modules(&source, &mut files);
    let mut items = BTreeSet::new();
    for file in &files {
        let room = file.strip_prefix(&source).ok().and_then(Path::parent).map(|room| room.display().to_string());
        let text = fs::read_to_string(file).unwrap_or_default();
        let code: String =
            text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n");
        for name in handed_on(&code) {
            items.insert(format!("{}::{name}", room.clone().unwrap_or_default().replace('/', "::")));
        }
    }
    assert!(items.contains("filter::Ekf") && items.contains("localizer::Localizer"), "{items:?}");
    let found = items.into_iter().fold(String::new(), |text, item| text + &item + "\n");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/public_items.txt");
    if std::env::var_os("AGV_ACCEPT").is_some() {
        assert!(fs::write(&path, &found).is_ok());
        return;
    }
    let kept = fs::read_to_string(&path).unwrap_or_default();
    let differs = |(kept, found): &(&str, &str)| kept != found;
    assert_eq!(kept.lines().zip(found.lines()).find(differs), None, "kept, found");
    assert_eq!(kept.lines().count(), found.lines().count());
}
