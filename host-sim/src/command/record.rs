//! `agv record`.

use std::path::PathBuf;

use agv_core::geometry::Pose;
use agv_core::localizer::Parameters;
use agv_core::measurement::Time;
use agv_core::odometry::Vehicle;
use agv_core::record::{Capacities, Header, LANDMARKS_A_RECORD, Record as LogRecord};
use agv_core::wire::nav350::Configuration;
use agv_host_sim::link::clock::Clock;
use agv_host_sim::link::nav350::{Link, address};
use agv_host_sim::{live, log};

/// Record what the sensors of a vehicle say
#[derive(clap::Args)]
pub struct Record {
    /// Address of a NAV350, with its port unless it is 2112.
    #[arg(long, value_name = "HOST")]
    nav350: String,
    /// Log whose vehicle and map are those of this one.
    #[arg(long, value_name = "LOG")]
    like: Option<PathBuf>,
    /// How long to record, s; until the program is ended if absent.
    #[arg(long, value_name = "SECONDS")]
    duration: Option<f64>,
    /// Log to write; an older one is replaced.
    #[arg(short, long, value_name = "LOG")]
    output: PathBuf,
}

impl Record {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let (parameters, landmarks) = match &self.like {
            Some(path) => {
                let (recording, _) = log::read(path)?;
                (recording.parameters, recording.landmarks)
            }
            None => (Parameters::new(Vehicle::Increments, Pose::default()), Vec::new()),
        };
        let capacities = Capacities::default();
        let header = Header { software: log::SOFTWARE, parameters: &parameters, capacities };
        let mut writer = log::Writer::create(&self.output, &header)?;
        for piece in landmarks.chunks(LANDMARKS_A_RECORD) {
            writer.write(&LogRecord::Landmarks(piece))?;
        }
        writer.flush()?;
        let clock = Clock::new(1.0);
        let mut link = Link::new(&address(&self.nav350), Configuration::default(), clock);
        let until = match self.duration {
            Some(seconds) => clock.now().offset(seconds),
            None => Time::from_micros(u64::MAX),
        };
        eprintln!("recording {} to {}", self.nav350, self.output.display());
        let summary = live::record_nav350(&mut link, until, &mut writer)?;
        writer.finish()?;
        println!("scans           {}", summary.scans);
        println!("reflector sets  {}", summary.reflectors);
        println!("bytes received  {}", summary.received);
        println!("times lost      {}", summary.lost);
        Ok(())
    }
}
