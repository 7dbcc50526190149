//! Crates and rooms import only from floors below their own: the sources are read, and an arrow that runs up or sideways
//! fails. The floors are those of the book (`docs/src/architecture.md`).
#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use agv_tests::repository;

/// Crates by folder, floor by floor from the ground: each may use those below.
const CRATES: [&[&str]; 8] = [
    &["core", "lidar3d"],
    &["wire", "places"],
    &["settings"],
    &["controller"],
    &["firmware", "host-sim"],
    &["lab"],
    &["tests", "benches"],
    &["agv"],
];

/// A crate and its rooms, floor by floor from the ground.
struct House {
    folder: &'static str,
    floors: &'static [&'static [&'static str]],
}

const HOUSES: [House; 8] = [
    House {
        folder: "controller",
        floors: &[
            &["carried_map", "encoders", "gyro", "gyro_chip", "laser", "setting_objects", "standstill"],
            &["discrete", "progress"],
            &["localization"],
            &["bus"],
            &["controller"],
        ],
    },
    House {
        folder: "core",
        floors: &[
            &["arrays", "geometry", "order"],
            &["measurement"],
            &["maps", "odometry", "sensing"],
            &["calibration", "contours", "filter", "relocalization", "state"],
            &["sources"],
            &["integrity"],
            &["localizer"],
            &["record"],
        ],
    },
    House { folder: "wire", floors: &[&["can", "cola"], &["nav350"]] },
    House {
        folder: "settings",
        floors: &[
            &["checksum", "gyro_connection", "laser", "patient_flash", "vehicle"],
            &["map_identity"],
            &["settings"],
            &["bus_load"],
            &["contradiction"],
            &["leaf"],
            &["leaves"],
            &["store"],
            &["contour_store"],
            &["service"],
        ],
    },
    House {
        folder: "lidar3d",
        floors: &[
            &["laser"],
            &["geometry"],
            &["packet"],
            &["calibration"],
            &["cloud", "cloud_file", "intrinsic"],
            &["place"],
            &["mount"],
        ],
    },
    House {
        folder: "host-sim",
        floors: &[
            &["contour_map", "sync"],
            &[
                "account",
                "bus",
                "data",
                "delimited",
                "file_kind",
                "foreign_code",
                "hdl64e_packets",
                "left_out",
                "link",
                "output_file",
                "provision",
                "recording",
                "setting_doubts",
                "setting_meanings",
                "wording",
            ],
            &["report"],
            &["accuracy", "log", "odometry_steps", "replay", "ros", "text_file"],
            &["drive", "simulate"],
            &["acceptance", "calibrate", "layout_check"],
            &["drive_check", "import"],
            &["export", "lidar3d", "live", "places"],
            &["mapping", "view"],
            &["layout_file"],
            &["serve"],
            &["emulate"],
            &["run"],
        ],
    },
    House { folder: "firmware", floors: &[&["app"], &["board"]] },
    House { folder: "lab", floors: &[&["equipment"], &["campaign"], &["trust"], &["evaluate"]] },
];

/// Rust sources under a folder, as paths relative to it.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut left = vec![folder.to_owned()];
    while let Some(next) = left.pop() {
        for entry in fs::read_dir(&next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                left.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                found.push(path.strip_prefix(folder).unwrap().to_owned());
            }
        }
    }
    found.sort();
    found
}

/// The code without comments and without the tests at its end.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let text = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    text.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// What follows each `prefix` in the code: a name, or the first names of a list in braces.
fn named<'a>(code: &'a str, prefix: &str) -> BTreeSet<&'a str> {
    let mut names = BTreeSet::new();
    for (place, _) in code.match_indices(prefix) {
        let before = code[..place].chars().next_back();
        if before.is_some_and(|one| one.is_alphanumeric() || one == '_') {
            continue;
        }
        let rest = &code[place + prefix.len()..];
        let is_of_name = |one: char| one.is_alphanumeric() || one == '_';
        let name_of = |text: &'a str| text.split(|one: char| !is_of_name(one)).next().unwrap_or_default();
        if !rest.starts_with('{') {
            names.insert(name_of(rest));
            continue;
        }
        let mut depth = 0;
        let mut is_first = false;
        for (at, one) in rest.char_indices() {
            match one {
                '{' => {
                    depth += 1;
                    is_first = depth == 1;
                }
                '}' if depth == 1 => break,
                '}' => depth -= 1,
                ',' if depth == 1 => is_first = true,
                _ if is_first && is_of_name(one) => {
                    names.insert(name_of(&rest[at..]));
                    is_first = false;
                }
                _ => {}
            }
        }
    }
    names
}

fn floor_of(floors: &[&[&str]], room: &str) -> Option<usize> {
    floors.iter().position(|floor| floor.contains(&room))
}

/// The rooms whose items `lib.rs` hands on under their own names, by those names.
fn handed_on(library: &str) -> BTreeMap<String, String> {
    let mut rooms = BTreeMap::new();
    for line in library.lines().filter_map(|line| line.strip_prefix("pub use ")) {
        if let Some((room, items)) = line.trim_end_matches(';').split_once("::") {
            let items = items.trim_matches(['{', '}']).split(',');
            rooms.extend(items.map(|item| (item.trim().to_owned(), room.to_owned())));
        }
    }
    rooms
}

/// The arrows of a house that do not run down, one a line.
fn wrong_arrows(house: &House, folder: &Path) -> Vec<String> {
    let mut wrong = Vec::new();
    let handed_on = handed_on(&fs::read_to_string(folder.join("lib.rs")).unwrap());
    for path in sources(folder) {
        let first = path.iter().next().unwrap().to_str().unwrap();
        let room = first.strip_suffix(".rs").unwrap_or(first);
        // Programs in `bin` are crates of their own.
        if room == "lib" || room == "bin" {
            continue;
        }
        let Some(floor) = floor_of(house.floors, room) else {
            wrong.push(format!("{} has no floor for {room}", house.folder));
            continue;
        };
        for name in named(&code(&folder.join(&path)), "crate::") {
            let other = handed_on.get(name).map_or(name, String::as_str);
            if other == room {
                continue;
            }
            match floor_of(house.floors, other) {
                Some(below) if below < floor => {}
                _ => wrong.push(format!("{}/{}: {room} must not import {other}", house.folder, path.display())),
            }
        }
    }
    wrong
}

#[test]
fn rooms_import_only_from_floors_below() {
    let mut wrong = Vec::new();
    for house in &HOUSES {
        let folder = repository(house.folder).join("src");
        wrong.extend(wrong_arrows(house, &folder));
        // A room that is gone has no floor either.
        for room in house.floors.iter().copied().flatten() {
            let is_there = folder.join(room).is_dir() || folder.join(format!("{room}.rs")).is_file();
            assert!(is_there, "{} has no room {room}", house.folder);
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn crates_use_only_crates_of_floors_below() {
    let mut wrong = Vec::new();
    for (floor, folders) in CRATES.iter().enumerate() {
        for folder in folders.iter().copied() {
            let own = repository(folder).join("src");
            for path in sources(&own) {
                let code = code(&own.join(&path));
                for (other_floor, others) in CRATES.iter().enumerate() {
                    for other in others.iter().copied().filter(|other| *other != folder) {
                        let name = format!("agv_{}::", other.replace('-', "_"));
                        if other_floor >= floor && !named(&code, &name).is_empty() {
                            wrong.push(format!("{folder}/src/{} must not use {other}", path.display()));
                        }
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    // Whoever adds a crate gives it a floor.
    let manifest = fs::read_to_string(repository("Cargo.toml")).unwrap();
    let members = manifest.lines().find_map(|line| line.strip_prefix("members = [")).unwrap();
    for member in members.trim_end_matches(']').split(',').map(|member| member.trim().trim_matches('"')) {
        // These two use nothing of the others.
        let has_floor =
            ["xtask", "tests/chip/description"].contains(&member) || CRATES.iter().any(|floor| floor.contains(&member));
        assert!(has_floor, "{member} has no floor");
    }
}

#[test]
fn an_arrow_that_runs_up_or_sideways_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    };
    let house = House { folder: "house", floors: &[&["ground", "cellar"], &["roof"]] };
    write("lib.rs", "pub use ground::{Stone, Sand};\n");
    write("roof/mod.rs", "use crate::{Stone, ground::Brick};\nuse crate::cellar::Door;\n");
    write("ground.rs", "// use crate::roof::Tile;\npub struct Stone;\n");
    write("cellar.rs", "pub struct Door;\n#[cfg(test)]\nmod tests {\n    use crate::roof::Tile;\n}\n");
    assert_eq!(wrong_arrows(&house, folder.path()), [] as [String; 0]);
    write("ground.rs", "use crate::roof::{Tile, other};\n");
    write("cellar.rs", "fn door() -> crate::ground::Stone {}\n");
    write("garden.rs", "");
    assert_eq!(
        wrong_arrows(&house, folder.path()),
        [
            "house/cellar.rs: cellar must not import ground",
            "house has no floor for garden",
            "house/ground.rs: ground must not import roof",
        ]
    );
}
