//! The commands against each other for a minute of real time; only in the long form of the tests.

use std::path::Path;
use std::process::Command;

use agv_host_sim::log;
use agv_host_sim::serve::nav350::Drive;
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;
use agv_wire::nav350::SensorFrame;

use super::commands::Server;
use super::live::{check_events, localises};
use crate::support::{Files, agv, text};

const SECONDS: f64 = 60.0;

#[test]
#[ignore = "takes a minute of real time"]
fn a_minute_at_8_hz_in_both_dialects_localises_as_simulated() {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-sim/scenarios/warehouse_hall.toml");
    let simulated = simulate(&Scenario::read(&scenario).unwrap()).unwrap().recording;
    let drive = Drive::new(&simulated, SensorFrame::default()).unwrap();
    let turns = drive.turns().to_vec();
    let files = Files::new();
    let like = files.path("like.agvlog");
    log::write(Path::new(&like), &simulated).unwrap();
    let scenario = scenario.to_str().unwrap();
    let dialects = ["cola-a", "cola-b"];
    let servers =
        dialects.map(|dialect| Server::start(&["--scenario", scenario, "--dialect", dialect, "--clock", "4294950000"]));
    let recorders: Vec<_> = servers
        .iter()
        .zip(dialects)
        .map(|(server, dialect)| {
            let output = files.path(&format!("{dialect}.agvlog"));
            let arguments = ["record", "--nav350", &server.host, "--like", &like, "--duration", "60", "-o", &output];
            let child = Command::new(env!("CARGO_BIN_EXE_agv")).args(arguments).spawn().unwrap();
            (child, output)
        })
        .collect();
    for (mut child, output) in recorders {
        assert!(child.wait().unwrap().success());
        let (recorded, damages) = log::read(Path::new(&output)).unwrap();
        assert!(damages.is_empty());
        let (numbers, reflectors) = check_events(&turns, &recorded.events);
        // The start takes a second or two; a busy machine may cost a revolution now and then.
        assert!(numbers.len() as f64 > 0.9 * 8.0 * (SECONDS - 3.0), "{} revolutions", numbers.len());
        assert!(reflectors > 100);
        localises(&simulated, &recorded, &numbers, &turns);
        let again = files.path("again.agvlog");
        let result = agv(&["import", "raw", &output, "--output", &again]);
        assert!(result.status.success(), "{}", text(&result.stderr));
        assert!(log::read(Path::new(&again)).unwrap().0 == recorded);
    }
}
