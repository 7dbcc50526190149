//! `cargo xtask seeds`.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use crate::repository;

/// Make the seeds of the fuzz targets from recorded telegrams and files that people sent
#[derive(clap::Args)]
pub struct Seeds {}

/// Each telegram as a frame, and as the payload in it.
const TARGETS: [&str; 2] = ["cola_a", "cola_b"];

impl Seeds {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let repository = repository();
        let data = match std::env::var_os("AGV_DATA") {
            Some(stated) => PathBuf::from(stated),
            None => repository.join("../shared/data"),
        };
        let mut files = Vec::new();
        for folder in ["nav350", "nav350/other_sick_cola"] {
            let folder = data.join(folder);
            let entries = std::fs::read_dir(&folder).with_context(|| folder.display().to_string())?;
            for entry in entries {
                let path = entry?.path();
                if path.extension().is_some_and(|ending| ending == "hexlines") {
                    files.push(path);
                }
            }
        }
        files.sort();
        let corpus = repository.join("fuzz/corpus");
        for target in TARGETS {
            std::fs::create_dir_all(corpus.join(target))?;
        }
        let mut count = 0;
        for file in files {
            let text = std::fs::read_to_string(&file).with_context(|| file.display().to_string())?;
            for line in text.lines() {
                let Some(frame) = telegram(line) else { continue };
                let (target, payload) = match frame.as_slice() {
                    [2, 2, 2, 2, _, _, _, _, payload @ .., _] => ("cola_b", payload),
                    [2, payload @ .., 3] => ("cola_a", payload),
                    _ => bail!("{}: a line is no telegram", file.display()),
                };
                std::fs::write(corpus.join(target).join(format!("frame{count}")), &frame)?;
                std::fs::write(corpus.join(target).join(format!("payload{count}")), payload)?;
                count += 1;
            }
        }
        let frames = write_frames(&data, &corpus)?;
        let captures = write_captures(&data, &corpus)?;
        let imports = write_imports(&data, &corpus)?;
        let folders = write_folders(&data, &corpus)?;
        let drives = write_drives(&corpus)?;
        println!("telegrams  {count}");
        println!("frames     {frames}");
        println!("captures   {captures}");
        println!("imports    {imports}");
        println!("folders    {folders}");
        println!("drives     {drives}");
        Ok(())
    }
}

/// The recorded talk with a CANopen drive, for the targets that read frames. Returns how many frames there are.
fn write_frames(data: &Path, corpus: &Path) -> anyhow::Result<usize> {
    let file = data.join("can/candump_ros_canopen_380.log");
    let text = std::fs::read_to_string(&file).with_context(|| file.display().to_string())?;
    let frames: Vec<_> = text.lines().filter_map(frame).collect();
    for target in ["canopen", "slcan"] {
        std::fs::create_dir_all(corpus.join(target))?;
    }
    // A talk is more than its frames: pieces of growing length.
    for (number, talk) in frames.chunks(1).chain(frames.chunks(8)).chain(frames.chunks(64)).enumerate() {
        let mut packed = Vec::new();
        let mut lines = Vec::new();
        for (id, bytes) in talk {
            packed.extend([200, 0]);
            packed.extend(id.to_le_bytes());
            packed.push(bytes.len() as u8);
            packed.extend(bytes.iter().chain(&[0; 8]).take(8));
            lines.extend(format!("t{id:03X}{}", bytes.len()).into_bytes());
            lines.extend(bytes.iter().flat_map(|byte| format!("{byte:02X}").into_bytes()));
            lines.push(b'\r');
        }
        std::fs::write(corpus.join("canopen").join(format!("talk{number}")), packed)?;
        std::fs::write(corpus.join("slcan").join(format!("talk{number}")), lines)?;
    }
    Ok(frames.len())
}

/// Longest piece of a capture that is a seed: some packets of a lidar.
const CAPTURE_PIECE: usize = 8192;

/// The beginnings of recorded captures, and the packet that a lidar's manual prints. Returns how many captures there are.
fn write_captures(data: &Path, corpus: &Path) -> anyhow::Result<usize> {
    let folder = data.join("lidar3d/pcap");
    for target in ["capture", "velodyne_packet"] {
        std::fs::create_dir_all(corpus.join(target))?;
    }
    let mut count = 0;
    for entry in std::fs::read_dir(&folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        let bytes = std::fs::read(&path).with_context(|| path.display().to_string())?;
        let name = path.file_name().unwrap_or_default();
        let is_capture = path.extension().is_some_and(|ending| ending == "pcap");
        let target = if is_capture { "capture" } else { "velodyne_packet" };
        std::fs::write(corpus.join(target).join(name), &bytes[..bytes.len().min(CAPTURE_PIECE)])?;
        count += usize::from(is_capture);
    }
    Ok(count)
}

/// Folders of data, endings of the files in them that are taken, and the target that reads such files.
const IMPORTS: [(&str, &[&str], &str); 8] = [
    ("reports/can_delta", &["log"], "can_log"),
    ("reports/can_small", &["log"], "can_log"),
    ("reports/carmen_fov", &["log"], "scan_log"),
    ("reports/check_wheels", &["csv"], "table"),
    ("reports/dxf", &["dxf"], "drawing"),
    ("reports/clouds", &["pcd", "ply", "las", "bin"], "point_cloud"),
    ("lidar3d/calib", &["yaml", "xml"], "lidar_calibration"),
    ("sapienza_tricycle", &["txt"], "robot_log"),
];
/// Longest seed of an import, bytes: a drawing that people sent.
const IMPORT_PIECE: usize = 20_000;
/// Clouds that are whole.
const CLOUDS: [(&str, &str); 2] = [
    (
        "cloud.pcd",
        "VERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\n\
         VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n1 2 3 4\n5 6 7 8\n",
    ),
    (
        "cloud.ply",
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n\
         1 2 3\n4 5 6\n",
    ),
];

/// The beginnings of files that people import. Returns how many there are.
fn write_imports(data: &Path, corpus: &Path) -> anyhow::Result<usize> {
    let mut count = 0;
    for (folder, endings, target) in IMPORTS {
        let (folder, corpus) = (data.join(folder), corpus.join(target));
        std::fs::create_dir_all(&corpus)?;
        for entry in std::fs::read_dir(&folder).with_context(|| folder.display().to_string())? {
            let path = entry?.path();
            let is_one = |ending: &&str| path.extension().is_some_and(|found| *found == **ending);
            if !endings.iter().any(is_one) {
                continue;
            }
            let bytes = std::fs::read(&path).with_context(|| path.display().to_string())?;
            std::fs::write(corpus.join(path.file_name().unwrap_or_default()), &bytes[..bytes.len().min(IMPORT_PIECE)])?;
            count += 1;
        }
    }
    for (name, text) in CLOUDS {
        std::fs::write(corpus.join("point_cloud").join(name), text)?;
    }
    Ok(count + CLOUDS.len())
}

/// Tables of the car park, in the order of its target.
const CAR_PARK: [&str; 7] = [
    "odometry.csv",
    "laser_ranges_m.csv",
    "laser_intensity.csv",
    "beacons.csv",
    "gps.csv",
    "events.csv",
    "reference_smoothed.csv",
];
/// Lines of each of them in a seed.
const CAR_PARK_LINES: [usize; 2] = [4, 12];
/// Lines of a robot's run in a seed.
const RUN_LINES: usize = 40;
/// Vehicles of a table of wheels, and the columns that go with them.
const DESCRIPTIONS: [&str; 2] = [
    "[vehicle.wheels.differential]\ntrack = 0.5\nleft = { radius = 0.1, turn = { scale = 1e-4, range = 65536 } }\n\
     right = { radius = 0.1, turn = { scale = 1e-4, range = 65536 } }\n[table]\nhas_heading = false\n\
     time = { column = \"1\", unit = \"s\" }\n\
     wheel = [{ turn = { column = \"5\", unit = \"ticks\", ticks = 100.0 } }, { turn = { column = \"6\", unit = \"rad\" } }]\n\
     reference = { x = { column = \"2\", unit = \"m\" }, y = { column = \"3\", unit = \"m\" }, heading = { column = \"4\", unit = \"rad\" } }\n",
    "[vehicle.tricycle]\nwheelbase = 1.2\ndrive_scale = 1e-4\ndrive_range = 65536\nsteering_scale = 1e-4\n\
     steering_range = 65536\nsteering_offset_forward = 0.0\nsteering_offset_backward = 0.0\n[table]\nhas_heading = false\ntime = { column = \"1\", unit = \"ms\" }\n\
     wheel = [{ radius = 0.1, turn = { column = \"5\", unit = \"rad\" }, steering = { column = \"6\", unit = \"deg\" } }]\n",
];

/// Folders of tables as one text, a form feed between two of them. Returns how many there are.
fn write_folders(data: &Path, corpus: &Path) -> anyhow::Result<usize> {
    let read = |path: PathBuf, lines: usize| -> anyhow::Result<String> {
        let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        Ok(text.lines().take(lines).map(|line| format!("{line}\n")).collect())
    };
    let write = |target: &str, name: &str, files: &[String]| -> anyhow::Result<()> {
        std::fs::create_dir_all(corpus.join(target))?;
        Ok(std::fs::write(corpus.join(target).join(name), files.join("\u{c}"))?)
    };
    let mut count = 0;
    for lines in CAR_PARK_LINES {
        let tables = CAR_PARK.map(|name| read(data.join("carpark").join(name), lines));
        write("car_park", &format!("lines{lines}"), &tables.into_iter().collect::<anyhow::Result<Vec<_>>>()?)?;
        count += 1;
    }
    for robot in ["diff", "omni3", "omni4", "tricyc"] {
        for path in files_below(&data.join("optiodom").join(robot))? {
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default().to_owned();
            let Some(session) = name.strip_suffix("_run-01.csv") else { continue };
            let nominal = read(path.with_file_name(format!("{session}_metadata.csv")), usize::MAX)?;
            let run = read(path, RUN_LINES)?;
            for (number, description) in DESCRIPTIONS.iter().enumerate() {
                write("described_table", &format!("{session}_{number}"), &[(*description).to_owned(), run.clone()])?;
            }
            write("robot_session", session, &[nominal, run])?;
            count += 1 + DESCRIPTIONS.len();
        }
    }
    Ok(count)
}

/// All files in a folder and the folders in it.
fn files_below(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        if path.is_dir() {
            files.extend(files_below(&path)?);
        } else {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// Choices without a pattern, from which most events are plausible. Returns how many drives there are.
fn write_drives(corpus: &Path) -> anyhow::Result<usize> {
    let folder = corpus.join("localizer");
    std::fs::create_dir_all(&folder)?;
    let mut state = 1_u32;
    let lengths = [256, 512, 1024, 2048, 4096].repeat(8);
    for (number, length) in lengths.iter().enumerate() {
        let choices: Vec<u8> = (0..*length)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 24) as u8
            })
            .collect();
        std::fs::write(folder.join(format!("drive{number}")), choices)?;
    }
    Ok(lengths.len())
}

/// Identifier and data of a line `can0 589 [8] 4B 77 ...`.
fn frame(line: &str) -> Option<(u16, Vec<u8>)> {
    let mut words = line.split_ascii_whitespace().skip(1);
    let id = u16::from_str_radix(words.next()?, 16).ok()?;
    let bytes: Option<Vec<u8>> = words.skip(1).map(|word| u8::from_str_radix(word, 16).ok()).collect();
    Some((id, bytes.filter(|bytes| bytes.len() <= 8)?))
}

/// The bytes of a line `... DIR HEX ...`.
fn telegram(line: &str) -> Option<Vec<u8>> {
    let mut words = line.split(' ').skip_while(|word| !["C>S", "S>C"].contains(word));
    let digits = words.nth(1)?;
    (0..digits.len()).step_by(2).map(|index| u8::from_str_radix(digits.get(index..index + 2)?, 16).ok()).collect()
}
