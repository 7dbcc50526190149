//! All tests of this crate from outside, in one program: it is linked once.

mod book;
mod calibrate;
mod campaign;
mod can;
mod command;
mod commissioning;
mod contours;
mod ctl;
mod exchange;
mod import;
mod import_scans;
mod imports;
mod lidar3d;
mod nav350;
mod output;
mod replay;
mod run;
mod support;
mod trust;

/// A file that is no module of this program would be no test, and nobody would notice.
#[test]
fn every_file_beside_this_one_is_a_module_of_it() {
    let entries = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/tests")).expect("this folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let sources = paths.filter(|path| path.is_dir() || path.extension().is_some_and(|extension| extension == "rs"));
    let names = sources.filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned()));
    let mut files: Vec<_> = names.filter(|name| name != "all").collect();
    files.sort_unstable();
    let declarations = include_str!("all.rs").lines().filter_map(|line| line.strip_prefix("mod ")?.strip_suffix(';'));
    assert_eq!(files, declarations.collect::<Vec<_>>());
}
