//! What the localiser says of the default drive, kept in the repository: a change of behaviour is a difference to read.
//!
//! `AGV_ACCEPT=1 cargo test -p agv-tests --test golden` writes the files anew, for a change that is meant.

use std::fmt::Write as _;
use std::path::Path;

use agv_core::geometry::Pose;
use agv_core::maps::Verdict;
use agv_core::measurement::Time;
use agv_lab::evaluate::demonstration::{self, LocalisedDrive};

/// Time between the lines of a table, s.
const INTERVAL: f64 = 0.5;

/// The pose every half second to a tenth of a millimetre and a hundredth of a degree, and what led to it.
fn table(drive: &LocalisedDrive) -> String {
    let mut text = String::from("t_s,x_mm,y_mm,heading_cdeg,mode,reason,accepted,refused\n");
    let mut next = drive.replay.poses.first().map_or(Time::default(), |pose| pose.time);
    let mut from = Time::default();
    for pose in &drive.replay.poses {
        if pose.time < next {
            continue;
        }
        let since = |wanted: bool| {
            let uses = drive.replay.uses.iter().filter(|used| used.time > from && used.time <= pose.time);
            uses.filter(|used| (used.verdict == Verdict::Accepted) == wanted).count()
        };
        let Pose { x, y, theta } = pose.pose;
        let _ = writeln!(
            text,
            "{:.2},{:.1},{:.1},{:.1},{:?},{:?},{},{}",
            pose.time.seconds(),
            1e3 * x,
            1e3 * y,
            1e2 * theta.to_degrees(),
            pose.mode,
            pose.reason,
            since(true),
            since(false),
        );
        from = pose.time;
        next = pose.time.offset(INTERVAL);
    }
    text
}

#[test]
fn the_default_drive_is_localised_as_it_was() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden");
    for drive in demonstration::run(|_| ()).unwrap() {
        let path = folder.join(format!("{}.csv", drive.name.replace(' ', "_")));
        let found = table(&drive);
        if std::env::var_os("AGV_ACCEPT").is_some() {
            std::fs::write(&path, &found).unwrap();
            continue;
        }
        let kept = std::fs::read_to_string(&path).unwrap_or_default();
        let difference = kept.lines().zip(found.lines()).find(|(kept, found)| kept != found);
        assert_eq!(difference, None, "{}: first line that differs, kept and found", drive.name);
        assert_eq!(kept.lines().count(), found.lines().count(), "{}: lines kept and found", drive.name);
    }
}
