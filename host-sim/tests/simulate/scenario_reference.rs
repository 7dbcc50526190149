//! The book's reference of scenarios is made from the code, and holds every key.
//!
//! `AGV_ACCEPT=1 cargo test -p agv-host-sim scenario_reference` writes it anew, for a change that is meant.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;

use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::scenario::keys::{CHOICES, KEYS};

const HEAD: &str = "# Scenarios

A scenario is a TOML file that `agv simulate` drives. Whatever it leaves out has the value of the standard block storage. This
chapter is made from the code. Values outside of the bounds are refused with the file's name and the line. Noises are standard
deviations; angles are in degrees where the key ends in `_deg`, and counter-clockwise; R is the vehicle's frame at the middle of
its rear axle, S the laser's, W the world's.

";

/// What the standard scenario has for a key.
fn standard(value: &toml::Value, name: &str) -> String {
    let found = name.split('.').try_fold(value, |value, part| value.as_table()?.get(part));
    match found {
        Some(toml::Value::Float(number)) => format!("{number}"),
        Some(toml::Value::Integer(number)) => format!("{number}"),
        Some(toml::Value::Boolean(is_on)) => format!("{is_on}"),
        Some(toml::Value::String(word)) => word.clone(),
        _ => String::new(),
    }
}

fn reference() -> String {
    let defaults = toml::Value::try_from(Scenario::default()).unwrap();
    let mut text = HEAD.to_owned();
    text += "## Numbers\n\n| key | unit | standard | least | greatest | meaning |\n|---|---|---|---|---|---|\n";
    for key in &KEYS {
        let [least, most] =
            key.bounds.map(|bound| if bound.abs() > 1e9 { format!("{bound:e}") } else { format!("{bound}") });
        let standard = standard(&defaults, key.name);
        let _ = writeln!(text, "| `{}` | {} | {standard} | {least} | {most} | {} |", key.name, key.unit, key.meaning);
    }
    text += "\n## Choices and lists\n\n| key | values | standard | meaning |\n|---|---|---|---|\n";
    for [name, values, meaning] in CHOICES {
        let _ = writeln!(text, "| `{name}` | {values} | {} | {meaning} |", standard(&defaults, name));
    }
    text
}

#[test]
fn the_book_lists_every_key_as_it_is() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/src/scenarios.md");
    let found = reference();
    if std::env::var_os("AGV_ACCEPT").is_some() {
        std::fs::write(&path, &found).unwrap();
        return;
    }
    assert_eq!(std::fs::read_to_string(&path).unwrap(), found);
}

fn names(value: &toml::Value, name: &str, found: &mut BTreeSet<String>) {
    match value {
        toml::Value::Table(table) => {
            for (key, value) in table {
                let name = if name.is_empty() { key.clone() } else { format!("{name}.{key}") };
                names(value, &name, found);
            }
        }
        toml::Value::Array(values) if !values.is_empty() => values.iter().for_each(|value| names(value, name, found)),
        toml::Value::Array(_) => {}
        _ => {
            found.insert(name.to_owned());
        }
    }
}

/// A scenario of each kind of world that states everything.
const EVERYTHING: [&str; 3] = [
    "[world]\nkind = \"block_storage\"\nseed = 1\n",
    "[world]\nkind = \"warehouse_hall\"\nseed = 1\n",
    "[world]\nkind = \"shapes\"\nwalls = [[0, 0, 1, 0]]\nrectangles = [{ x = 0, y = 0, length = 1, width = 1 }]\n\
     circles = [{ x = 0, y = 0, radius = 1 }]\nreflectors = [{ x = 0, y = 0, facing_deg = 1 }]\n\
     [path]\nkind = \"legs\"\nlegs = [{ segments = [{ length = 1.0 }] }]\n\
     [laser]\ndirty_sectors = [{ from_deg = 0, to_deg = 1, lost_share = 0.5 }]\nknocks = [{ from = 1 }]\nages = [{ from = 1, seconds = 0.01 }]\n\
     [drive]\ncarries = [{ from = 1 }]\n\
     [odometry]\nslips = [{ from = 1, lasts = 1, share = 0.1 }]\n\
     [gyro]\nfaults = [{ from = 1, lasts = 1 }]\n\
     [[people]]\nway = [[0, 0]]\nphase = 0.5\n",
];

#[test]
fn no_key_is_left_out() {
    let mut all = BTreeSet::new();
    for text in EVERYTHING {
        names(&toml::Value::try_from(Scenario::parse(text).unwrap()).unwrap(), "", &mut all);
    }
    let known: BTreeSet<String> =
        KEYS.iter().map(|key| key.name).chain(CHOICES.iter().map(|[name, ..]| *name)).map(str::to_owned).collect();
    assert_eq!(all.difference(&known).collect::<Vec<_>>(), Vec::<&String>::new());
    // And none is listed that a scenario does not have, but for lists of tables.
    let lists = ["gyro.faults", "laser.dirty_sectors", "odometry.slips", "people", "path.legs"].map(str::to_owned);
    let extra: Vec<_> = known.difference(&all).filter(|name| !lists.contains(name)).collect();
    assert_eq!(extra, Vec::<&String>::new());
    // The standard is within its own bounds.
    assert!(Scenario::default().check().is_ok());
}

#[test]
fn what_no_drive_has_is_refused_with_file_line_and_unit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.toml");
    for (text, line, expected) in [
        ("seed = 1\n[vehicle.believed]\nwheelbase = 1500\n", 3, "from 0.05 to 50 m, and is 1500"),
        (
            "[path]\nkind = \"legs\"\nlegs = [{ segments = [{ length = 1 }] }]\n[path.start]\nheading_deg = 9000\n",
            5,
            "720 deg",
        ),
        ("[odometry]\n\nslip = 1e300\n", 3, "from 0 to 10 m/sqrt(m)"),
        ("[odometry]\nrate = 1e9 # a lot\n", 2, "from 0.1 to 10000 Hz"),
        ("[drive]\nspeed = nan\n", 2, "m/s, and is NaN"),
        ("[drive]\nsped = 1.0\n", 2, "sped"),
        ("[drive]\nspeed = \n", 2, "not a scenario"),
        ("[[people]]\nway = [[0, 0]]\nspeed = 1.0\n[[people]]\nway = [[0, 0]]\nspeed = 100.0\n", 6, "50 m/s"),
    ] {
        std::fs::write(&path, text).unwrap();
        let problem = Scenario::read(&path).unwrap_err().to_string();
        assert!(problem.starts_with(&format!("{}:{line}: ", path.display())), "{problem}");
        assert!(problem.contains(expected) && !problem.contains('\n'), "{problem}");
    }
}

#[test]
fn planted_mistakes_are_those_of_encoders_that_are_fitted_wrongly() {
    use agv_host_sim::recording::RecordedEvent;
    use agv_host_sim::simulate::simulate;
    let counters = |mistake: &str| -> Vec<[u32; 2]> {
        let text = format!("[laser]\nscans = false\n[vehicle.true]\n{mistake}\n");
        let recording = simulate(&Scenario::parse(&text).unwrap()).unwrap().recording;
        let samples = recording.events.iter().filter_map(|event| match event {
            RecordedEvent::Encoders(sample) => Some([sample.drive, sample.steering]),
            _ => None,
        });
        samples.collect()
    };
    let right = counters("");
    let opposite = |count: u32| (65_536 - count) % 65_536;
    let of = |change: &dyn Fn([u32; 2]) -> [u32; 2]| right.iter().map(|pair| change(*pair)).collect::<Vec<_>>();
    assert_eq!(counters("drive_reversed = true"), of(&|[drive, steering]| [opposite(drive), steering]));
    assert_eq!(counters("steering_reversed = true"), of(&|[drive, steering]| [drive, opposite(steering)]));
    assert_eq!(counters("encoders_swapped = true"), of(&|[drive, steering]| [steering, drive]));
}
