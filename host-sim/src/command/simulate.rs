//! `agv simulate`.

use std::path::PathBuf;

use agv_host_sim::recording::{RecordedEvent, Recording};
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;

/// Simulates a drive: a world, a vehicle, its encoders and its laser
#[derive(clap::Args)]
pub struct Simulate {
    /// Scenario file; see host-sim/scenarios
    scenario: PathBuf,
    /// Seed of all random numbers, instead of the scenario's
    #[arg(long)]
    seed: Option<u64>,
    /// Log to write
    #[arg(short, long)]
    output: Option<PathBuf>,
}

impl Simulate {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let mut scenario = Scenario::read(&self.scenario)?;
        scenario.seed = self.seed.unwrap_or(scenario.seed);
        eprintln!("simulating {} with seed {}", self.scenario.display(), scenario.seed);
        let recording = simulate(&scenario)?.recording;
        if let Some(path) = &self.output {
            agv_host_sim::log::write(path, &recording)?;
        }
        summarise(&recording);
        Ok(())
    }
}

fn summarise(recording: &Recording) {
    let metres: f64 =
        recording.truth.windows(2).map(|pair| (pair[1].pose.position() - pair[0].pose.position()).norm()).sum();
    let seconds = match (recording.truth.first(), recording.truth.last()) {
        (Some(first), Some(last)) => last.time.since(first.time),
        _ => 0.0,
    };
    let count = |is_kind: fn(&RecordedEvent) -> bool| recording.events.iter().filter(|event| is_kind(event)).count();
    let scans = count(|event| matches!(event, RecordedEvent::Scan(_)));
    let revolutions = count(|event| matches!(event, RecordedEvent::Reflectors(_)));
    println!("way          {metres:10.2} m");
    println!("time         {seconds:10.2} s");
    println!("events       {:10}", recording.events.len());
    println!("scans        {scans:10}");
    println!("reflectors   {:10} in the map, {revolutions} revolutions", recording.landmarks.len());
}
