//! All tests of this crate from outside, in one program: it is linked once.

mod drive_check;
mod eds;
mod fitted_vehicle;
mod gyro;
mod lent_map;
mod lidar3d_bridge;
mod lidar3d_mount;
mod log;
mod motion;
mod output_file;
mod published;
mod report;
mod ros_import;
mod run;
mod run_delay;
mod simulate;
mod truth;
mod two_lasers;
mod wheel_table;
mod wheeled_fit;

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
