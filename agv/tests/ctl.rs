//! `agv ctl` meets a controller: the service port and the flash of the firmware, without a board.

#[path = "../../settings/tests/support/mod.rs"]
mod flash;

use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use agv_core::measurement::Time;
use agv_host_sim::layout_file;
use agv_host_sim::mapping::contour_file;
use agv_host_sim::mapping::map_file;
use agv_settings::contour_store::ContourStore;
use agv_settings::leaf::{Leaf, Value};
use agv_settings::service::{Action, Controller, Frames, LONGEST_MESSAGE, Response, Session, encode};
use agv_settings::store::Store;
use agv_settings::{Settings, block_on};
use flash::{Flash, load};

use crate::support::{Files, agv, refusal, text};

/// Bytes of a page of the vehicle's flash.
const PAGE: usize = 128 * 1024;

type Memory = Flash<PAGE>;

/// A controller as it starts with what is in its flash.
fn start(flash: Memory, contours: Option<Memory>, starts: u32) -> Controller<Memory> {
    let mut store = Store::new(flash).unwrap();
    let (settings, landmarks, _) = load(&mut store);
    let key = store.key();
    Controller {
        software: "emulated 1",
        settings,
        landmarks: Vec::leak(landmarks),
        key,
        store: Some(store),
        starts,
        nonces: 0,
        panic: "",
        map: None,
        contours: contours.and_then(ContourStore::open),
    }
}

/// A controller whose service port is open as long as the test program runs.
pub struct Emulated {
    controller: Arc<Mutex<Controller<Memory>>>,
    is_moving: Arc<AtomicBool>,
    pub host: String,
}

impl Emulated {
    /// With the flash that `agv provision` has written.
    pub fn of(image: &str) -> Self {
        let flash = Memory::filled(std::fs::read(image).unwrap());
        let controller = Arc::new(Mutex::new(start(flash, Some(Memory::new()), 1)));
        let is_moving = Arc::new(AtomicBool::new(false));
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let host = listener.local_addr().unwrap().to_string();
        let (served, moves) = (Arc::clone(&controller), Arc::clone(&is_moving));
        // The thread ends with the program.
        std::thread::spawn(move || {
            listener.incoming().flatten().for_each(|stream| converse(stream, &served, &moves));
        });
        Self { controller, is_moving, host }
    }

    /// What the flash says, read as at a start.
    fn kept(&self) -> Settings {
        let flash = Memory::filled(self.controller.lock().unwrap().store.take().map(Store::into_flash).unwrap().bytes);
        let mut store = Store::new(flash).unwrap();
        let settings = load(&mut store).0;
        self.controller.lock().unwrap().store = Some(store);
        settings
    }
}

/// One connection, as the firmware's task of the service port holds it.
fn converse(mut stream: TcpStream, controller: &Mutex<Controller<Memory>>, is_moving: &AtomicBool) {
    let (mut session, mut frames) = (Session::new(), Box::new(Frames::new()));
    let (mut read, mut room) = ([0; 512], Box::new([0; LONGEST_MESSAGE]));
    while let Ok(count) = stream.read(&mut read)
        && count > 0
    {
        let mut rest = &read[..count];
        while !rest.is_empty() {
            let Ok((taken, is_whole)) = frames.push(rest) else { return };
            rest = &rest[taken..];
            if !is_whole {
                continue;
            }
            let mut controller = controller.lock().unwrap();
            let is_standing = !is_moving.load(Ordering::Relaxed);
            let now = Time::from_micros(5_000_000);
            let answer = block_on(session.answer(frames.message(), &mut controller, is_standing, now, &mut room));
            let Ok((length, action)) = answer else { return };
            frames.clear();
            stream.write_all(&room[..length]).unwrap();
            if action == Action::Reboot {
                let flash = controller.store.take().unwrap().into_flash();
                let contours = controller.contours.take().map(ContourStore::into_flash);
                *controller = start(flash, contours, controller.starts + 1);
                let _ = stream.shutdown(Shutdown::Both);
                return;
            }
        }
    }
}

/// The key of the controllers here.
pub const KEY: &str = "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef";

/// A file as `agv calibrate --apply` writes it.
const VEHICLE: &str = "wheelbase_m = 1.482\nsteer_offset_forward_rad = -0.0127\nlaser_theta_rad = 0.007\n";

/// Names of the settings that it states, with their values.
const STATED: [(&str, f64); 3] =
    [("vehicle.wheelbase", 1.482), ("vehicle.steering_offset_forward", -0.0127), ("laser.theta", 0.007)];

struct Bench {
    files: Files,
    emulated: Emulated,
    key: String,
    vehicle: String,
}

impl Bench {
    fn new() -> Self {
        let files = Files::new();
        let (key, image) = (files.write("agv.key", KEY.as_bytes()), files.path("flash.bin"));
        let vehicle = files.write("vehicle.toml", VEHICLE.as_bytes());
        let provision =
            ["provision", "--key", &key, "--set", "vehicle.wheelbase=1.6", "--set", "laser.x=0.4", "-o", &image];
        let made = agv(&provision);
        assert!(made.status.success(), "{}", text(&made.stderr));
        let emulated = Emulated::of(&image);
        Self { files, emulated, key, vehicle }
    }

    /// What the command prints.
    fn ctl(&self, words: &[&str]) -> String {
        let run = agv(&[&["ctl", &self.emulated.host], words].concat());
        assert!(run.status.success(), "{words:?}: {}", text(&run.stderr));
        text(&run.stdout).to_owned()
    }

    fn refused(&self, words: &[&str]) -> String {
        refusal(&[&["ctl", &self.emulated.host], words].concat())
    }

    /// A setting as the controller tells it.
    fn setting(&self, name: &str) -> f64 {
        let object: serde_json::Value = serde_json::from_str(&self.ctl(&["get", name, "--json"])).unwrap();
        object[name].as_f64().unwrap()
    }

    fn kept(&self, name: &str) -> Option<Value> {
        Leaf::named(name).unwrap().get(&self.emulated.kept())
    }
}

/// A row of a table, without its spaces.
fn row<'a>(table: &'a str, name: &str) -> Vec<&'a str> {
    let line = table.lines().find(|line| line.split_whitespace().next() == Some(name));
    line.unwrap_or_else(|| panic!("no {name}: {table}")).split_whitespace().skip(1).collect()
}

#[test]
fn a_vehicle_file_is_brought_to_a_controller_and_stays_there() {
    let bench = Bench::new();
    let apply = ["--key", &bench.key, "apply", &bench.vehicle];
    assert_eq!(bench.setting("vehicle.wheelbase"), 1.6);

    // What would change is shown to anybody, and nothing changes.
    let shown = bench.ctl(&["apply", &bench.vehicle, "--dry-run"]);
    assert_eq!(row(&shown, "vehicle.wheelbase"), ["1.6", "->", "1.482", "m"]);
    assert_eq!(row(&shown, "laser.theta"), ["0", "->", "0.007", "rad"]);
    assert!(!shown.contains("laser.x ") && shown.contains("not changed"), "{shown}");
    assert_eq!(bench.setting("vehicle.wheelbase"), 1.6);

    // It is changed in the controller and in its flash; what the file does not state stays.
    let done = bench.ctl(&apply);
    assert_eq!(row(&done, "vehicle.wheelbase"), ["1.6", "->", "1.482", "m"]);
    assert!(done.contains("reboot"), "{done}");
    for (name, value) in STATED {
        assert_eq!((bench.setting(name), bench.kept(name)), (value, Some(Value::Number(value))), "{name}");
    }
    assert_eq!((bench.setting("laser.x"), bench.setting("vehicle.drive_scale")), (0.4, 1e-4));
    assert!(bench.ctl(&apply).contains("nothing differs"));

    // A setting that is not stored is gone after a start, others are not.
    bench.ctl(&["--key", &bench.key, "set", "limits.fastest", "2.5"]);
    assert_eq!(bench.setting("limits.fastest"), 2.5);
    bench.ctl(&["--key", &bench.key, "reboot"]);
    assert_eq!(row(&bench.ctl(&["version"]), "starts"), ["2"]);
    assert_eq!(bench.setting("limits.fastest"), 5.0);
    for (name, value) in STATED {
        assert_eq!(bench.setting(name), value, "{name}");
    }
    bench.ctl(&["--key", &bench.key, "set", "limits.fastest", "2.5"]);
    bench.ctl(&["--key", &bench.key, "store"]);
    // A value that hardly a vehicle has is asked about.
    let asked = agv(&["ctl", &bench.emulated.host, "--key", &bench.key, "set", "laser.y", "7.5"]);
    assert!(asked.status.success() && text(&asked.stderr).contains("in metres?"), "{}", text(&asked.stderr));
    bench.ctl(&["--key", &bench.key, "reboot"]);
    assert_eq!(bench.setting("limits.fastest"), 2.5);
}

#[test]
fn who_may_not_change_a_controller_is_told_why() {
    let bench = Bench::new();
    let before = bench.ctl(&["list"]);
    assert!(bench.refused(&["apply", &bench.vehicle]).contains("--key FILE"));
    let stranger = bench.files.write("other.key", KEY.replace('0', "f").as_bytes());
    assert!(bench.refused(&["--key", &stranger, "apply", &bench.vehicle]).contains("not that of the controller"));
    bench.emulated.is_moving.store(true, Ordering::Relaxed);
    for words in [&["apply", &bench.vehicle][..], &["store"], &["reboot"]] {
        assert!(bench.refused(&[&["--key", &bench.key], words].concat()).contains("the vehicle moves"));
    }
    bench.emulated.is_moving.store(false, Ordering::Relaxed);
    for (content, expected) in [
        ("wheelbase_m = 1500.0\n", "from 0.05 to 50"),
        ("laser_theta_rad = 0.1\nwheelbase = 1.5\n", "bad.toml:2:"),
        ("wheelbase_m = \n", "bad.toml:1:"),
        ("# wheelbase_m = 1.5\n", "states no parameter"),
    ] {
        let bad = bench.files.write("bad.toml", content.as_bytes());
        let complaint = bench.refused(&["--key", &bench.key, "apply", &bad]);
        assert!(complaint.contains(expected), "{complaint}");
    }
    assert!(bench.refused(&["get", "vehicle.wheelbse"]).contains("vehicle.wheelbase"));
    assert!(bench.refused(&["--key", &bench.key, "set", "vehicle.wheelbase", "long"]).contains("must be a number"));
    assert_eq!(bench.ctl(&["list"]), before);
    let closed = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    assert!(refusal(&["ctl", &closed, "--key", &bench.key, "apply", &bench.vehicle]).contains(&closed));
}

/// A map of features is none of a layout; it goes to the controller whole, by its port and in its image.
#[test]
fn a_map_of_features_is_brought_to_a_controller_and_back() {
    let bench = Bench::new();
    let content =
        "id,kind,x_m,y_m,deviation_m\n0,corner,1.25,-3.5,0.01\n1,end_point,2,7.75,0.02\n4,reflector,0.5,0.25,0.005\n";
    let features = bench.files.write("features.csv", content.as_bytes());
    bench.ctl(&["--key", &bench.key, "map", "upload", &features]);
    bench.ctl(&["--key", &bench.key, "reboot"]);
    let back = bench.files.path("back.csv");
    assert_eq!(row(&bench.ctl(&["map", "download", &back]), "landmarks"), ["3"]);
    let of = |path: &str| -> Vec<_> {
        let read = map_file::read(Path::new(path)).unwrap();
        read.iter().map(|one| (one.id, one.kind, one.x, one.y)).collect()
    };
    assert_eq!(of(&back), of(&features));
    assert!(bench.refused(&["map", "download", &bench.files.path("back.imk")]).contains("only a .csv holds"));
    let (key, image) = (&bench.key, bench.files.path("flash.bin"));
    let made = agv(&["provision", "--key", key, "--map", &features, "--output", &image, "--json"]);
    let made: serde_json::Value = serde_json::from_slice(&made.stdout).unwrap();
    assert_eq!(made["landmarks"], 3);
    // What holds no landmark at all, or none of a layout, is refused.
    let none = bench.files.write("none.csv", b"id,kind,x_m,y_m,deviation_m\n");
    assert!(refusal(&["provision", "--key", key, "--map", &none, "--output", &image]).contains("no landmarks"));
    let corners = bench.files.write("corners.csv", b"id,kind,x_m,y_m,deviation_m\n0,corner,1,2,0.01\n");
    let layout = bench.files.path("layout.imk");
    assert!(refusal(&["layout", "convert", &corners, &layout]).contains("holds no reflectors"));
}

#[test]
fn a_map_is_brought_to_a_controller_and_back() {
    let bench = Bench::new();
    let hall = bench.files.write("hall.imk", b"7 -1000 2000 1 2 80 0\n8 5500 -6125 1 2 80 0\n9 0 40 1 2 80 0\n");
    assert!(bench.refused(&["map", "upload", &hall]).contains("--key FILE"));
    bench.ctl(&["--key", &bench.key, "map", "upload", &hall]);
    bench.ctl(&["--key", &bench.key, "reboot"]);
    let back = bench.files.path("back.imk");
    assert_eq!(row(&bench.ctl(&["map", "download", &back]), "landmarks"), ["3"]);
    let [sent, got] = [&hall, &back].map(|path| layout_file::landmarks(&layout_file::load(Path::new(path)).unwrap()));
    assert_eq!(sent.len(), 3);
    let of_file = text(&agv(&["layout", "identity", &hall]).stdout).to_owned();
    let [of_file, of_controller] = [of_file, bench.ctl(&["map", "download", &back])]
        .map(|said| said.split_whitespace().last().unwrap_or_default().to_owned());
    assert_eq!(of_file, of_controller);
    assert_eq!(
        got.iter().map(|one| (one.id, one.x, one.y)).collect::<Vec<_>>(),
        sent.iter().map(|one| (one.id, one.x, one.y)).collect::<Vec<_>>()
    );
}

#[test]
fn a_map_of_contours_is_brought_to_a_controller_and_back_and_taken_away() {
    let bench = Bench::new();
    let points: String = (0..400).map(|place| format!("{:.4},{:.4},90.0\n", 0.25 * f64::from(place), 1.5)).collect();
    let hall = bench.files.write("hall.csv", format!("x_m,y_m,facing_deg\n{points}").as_bytes());
    let back = bench.files.path("back.csv");
    assert!(bench.refused(&["contours", "upload", &hall]).contains("--key FILE"));
    assert!(bench.refused(&["contours", "download", &back]).contains("no map of contours"));
    bench.ctl(&["--key", &bench.key, "contours", "upload", &hall]);
    assert!(bench.refused(&["contours", "download", &back]).contains("no map of contours"), "it is for the next start");
    bench.ctl(&["--key", &bench.key, "reboot"]);
    assert_eq!(row(&bench.ctl(&["contours", "download", &back]), "points"), ["400"]);
    let [sent, got] = [&hall, &back].map(|path| contour_file::read(Path::new(path)).unwrap());
    assert_eq!(sent, got);
    bench.ctl(&["--key", &bench.key, "contours", "remove"]);
    bench.ctl(&["--key", &bench.key, "reboot"]);
    assert!(bench.refused(&["contours", "download", &back]).contains("no map of contours"));
    assert_eq!(contour_file::read(Path::new(&back)).unwrap(), sent, "a failed run leaves what was there");
    let wrong = bench.files.write("wrong.csv", b"1,2,3\n");
    assert!(bench.refused(&["--key", &bench.key, "contours", "upload", &wrong]).contains("heading"));
    bench.emulated.controller.lock().unwrap().contours = None;
    assert!(bench.refused(&["--key", &bench.key, "contours", "upload", &hall]).contains("no room"));
}

#[test]
fn a_map_that_is_not_whole_is_not_written() {
    let files = Files::new();
    let keep = files.write("hall.imk", b"before");
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let host = listener.local_addr().unwrap().to_string();
    // Has 120 landmarks, as it says, and gives none.
    std::thread::spawn(move || {
        for mut stream in listener.incoming().flatten() {
            let version = Response::Version { software: "", protocol: 1, starts: 1, time: Time::from_micros(0) };
            for answer in [version, Response::Map { count: 120, piece: heapless::Vec::new() }] {
                let mut room = Box::new([0; LONGEST_MESSAGE]);
                let _ = stream.read(&mut *room);
                let length = encode(&answer, |_| None, &mut *room).unwrap();
                let _ = stream.write_all(&room[..length]);
            }
        }
    });
    let complaint = refusal(&["ctl", &host, "map", "download", &keep]);
    assert!(complaint.contains("120 landmarks") && complaint.contains("0 came"), "{complaint}");
    assert_eq!(std::fs::read(&keep).unwrap(), b"before");
}
