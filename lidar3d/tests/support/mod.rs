//! Recorded packets of real sensors, and the clouds that other drivers made of them.
#![allow(dead_code, unused_imports)]

mod bag;
mod capture;
pub mod compared;
pub mod moosmann;
mod peer;
pub mod scan_context;

use std::io::Write;
use std::path::{Path, PathBuf};

pub use bag::packets_of_bag;
pub use capture::packets_of_capture;
pub use peer::{peer, peer_bytes};

/// A file of the real recordings. Where it is absent, `test` is skipped.
pub fn recordings(test: &str, name: &str) -> Option<PathBuf> {
    let folders = match std::env::var_os("AGV_DATA") {
        Some(stated) => vec![PathBuf::from(stated)],
        None => vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data")],
    };
    let found = folders.into_iter().map(|folder| folder.join("lidar3d").join(name)).find(|path| path.exists());
    if found.is_none() {
        skip(test, &format!("there is no lidar3d/{name} in the folder of real data (AGV_DATA)"));
    }
    found
}

/// Says in one line that `test` is skipped: on standard error, and in the file that `AGV_SKIPPED` names.
///
/// # Panics
/// If `CI` is `true`: there, everything must be there.
#[track_caller]
pub fn skip(test: &str, missing: &str) {
    let line = format!("skipped: {test}, because {missing}\n");
    eprint!("{line}");
    if let Some(path) = std::env::var_os("AGV_SKIPPED")
        && let Ok(mut file) = std::fs::OpenOptions::new().create(true).append(true).open(path)
    {
        // A line that cannot be written changes nothing about the test.
        let _ = file.write_all(line.as_bytes());
    }
    assert!(std::env::var_os("CI").is_none_or(|value| value != "true"), "{test}: {missing}");
}

/// x, y, z of a PCD, m, in the order of the file.
pub fn points_of_pcd(path: &Path) -> Vec<[f32; 3]> {
    let mut reader = pcd_rs::DynReader::open(path).unwrap();
    let names: Vec<String> = reader.meta().field_defs.iter().map(|field| field.name.clone()).collect();
    let place = |name: &str| names.iter().position(|found| found == name).unwrap();
    let places = [place("x"), place("y"), place("z")];
    let points = reader.by_ref().map(|record| {
        let record = record.unwrap();
        places.map(|place| match &record.0[place] {
            pcd_rs::Field::F32(values) => values[0],
            other => panic!("a coordinate is {other:?}"),
        })
    });
    points.collect()
}

/// The file of a folder that ends like that.
pub fn file(folder: &Path, ending: &str) -> PathBuf {
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    files.into_iter().find(|path| path.extension().is_some_and(|found| found == ending)).unwrap()
}
