//! `agv record`.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use agv_controller::EncoderNodes;
use agv_core::localizer::Parameters;
use agv_core::maps::Landmark;
use agv_core::measurement::Time;
use agv_core::odometry::Vehicle;
use agv_host_sim::link::clock::Clock;
use agv_host_sim::link::nav350::{Link, address};
use agv_host_sim::live::{self, CanSummary, Limits, LiveError, Recorder, Summary};
use agv_host_sim::recording::Recording;
use agv_host_sim::{bus, log};
use agv_wire::nav350::Configuration;
use anyhow::{Context, bail, ensure};
use serde::Serialize;

use super::encoder_arguments::EncoderArguments;
use super::like;
use super::output::{note, print_rows};
use super::progress;
use super::stop;

const HELP: &str = "\
Ends after --duration or --scans, or with Ctrl-C, and after 30 s if a sensor has measured nothing by then, unless with --wait.
What is older than a second survives a loss of power. The log is there from the first datum on; an older one of its name is
then renamed to LOG.old.

Examples:
  agv record --nav350 192.168.1.10 --can can0 --like hall.agvlog --output drive.agvlog
  agv record --nav350 localhost:2112 --duration 60 --output drive.agvlog
  agv record --can slcan:/dev/ttyACM0@500000 --output encoders.agvlog
  agv import raw drive.agvlog --output again.agvlog";

/// Record what the sensors of a vehicle say: raw bytes, and the events they mean
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Record {
    /// Address of a NAV350, with its port unless it is 2112.
    #[arg(long, value_name = "HOST", required_unless_present = "can")]
    nav350: Option<String>,
    /// CAN bus with the encoders: can0, slcan:/dev/ttyACM0@500000 or slcan-tcp:HOST:PORT.
    #[arg(long, value_name = "BUS")]
    can: Option<String>,
    #[command(flatten)]
    encoders: EncoderArguments,
    /// Log whose vehicle and map are those of this one.
    #[arg(long, value_name = "LOG")]
    like: Option<PathBuf>,
    /// How long to record, s; until Ctrl-C if absent.
    #[arg(long, value_name = "SECONDS")]
    duration: Option<f64>,
    /// End after at least so many scans of the NAV350.
    #[arg(long, value_name = "COUNT", requires = "nav350")]
    scans: Option<usize>,
    /// Wait for the first datum for as long as it takes.
    #[arg(long)]
    wait: bool,
    /// Log to write; an older one is renamed to LOG.old when the first datum has come.
    #[arg(short, long, value_name = "LOG")]
    output: PathBuf,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

/// How long the first datum may take, s.
const PATIENCE: f64 = 30.0;

#[derive(Serialize)]
struct Recorded {
    scans: usize,
    reflector_sets: usize,
    nav350_bytes: usize,
    nav350_lost: usize,
    can_frames: usize,
    encoder_samples: usize,
    encoder_fault_changes: usize,
    can_lost: usize,
}

impl Record {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        if self.duration.is_some_and(|duration| !(duration > 0.0 && duration.is_finite())) {
            bail!("--duration must be greater than zero");
        }
        let Recording { parameters, landmarks, .. } = like::drive_like(self.like.as_deref())?;
        let recorder = self.begin(&parameters, &landmarks)?;
        let is_stopped = stop::on_interrupt()?;
        let clock = Clock::new(1.0);
        let start = clock.now();
        let never = Time::from_micros(u64::MAX);
        let limits = Limits {
            until: self.duration.map_or(never, |seconds| start.offset(seconds)),
            first: if self.wait { never } else { start.offset(PATIENCE) },
        };
        // Shown on a terminal only.
        let progress = progress::spinner().with_message(format!("recording to {}", self.output.display()));
        progress.enable_steady_tick(Duration::from_millis(200));
        let (nav350, can) = std::thread::scope(|scope| {
            let can = scope.spawn(|| {
                let outcome = self.record_can(&parameters, clock, &limits, &is_stopped, &recorder);
                // The other sensor is not to be recorded for hours without the bus.
                if !outcome.as_ref().is_ok_and(|can| self.can.is_none() || can.samples > 0) {
                    is_stopped.store(true, Ordering::Relaxed);
                }
                outcome
            });
            let nav350 = self.record_nav350(clock, &limits, &is_stopped, &recorder);
            let has_laser = |laser: &Summary| self.nav350.is_none() || !laser.is_empty();
            if self.scans.is_some() || !nav350.as_ref().is_ok_and(has_laser) {
                is_stopped.store(true, Ordering::Relaxed);
            }
            (nav350, can.join())
        });
        progress.finish_and_clear();
        let has_data = recorder.has_data();
        if let Some(old) = recorder.set_aside() {
            note(&format!("agv: the older log is now {}", old.display()));
        }
        // Without a datum nothing remains of the log, and an older one stays.
        if has_data {
            recorder.finish()?;
        }
        let can = can.ok().context("the recording of the bus broke down")??;
        let nav350 = nav350?;
        let seconds = clock.now().since(start);
        self.complain(&parameters, &nav350, &can, seconds, has_data)?;
        self.print(&Recorded {
            scans: nav350.scans,
            reflector_sets: nav350.reflectors,
            nav350_bytes: nav350.received,
            nav350_lost: nav350.lost,
            can_frames: can.frames,
            encoder_samples: can.samples,
            encoder_fault_changes: can.fault_changes,
            can_lost: can.lost,
        })
    }

    /// What is wrong if a sensor has measured nothing.
    fn complain(
        &self,
        parameters: &Parameters,
        nav350: &Summary,
        can: &CanSummary,
        seconds: f64,
        has_data: bool,
    ) -> anyhow::Result<()> {
        let mut silent = Vec::new();
        if let Some(host) = &self.nav350
            && nav350.is_empty()
        {
            let reason = nav350.reason.map_or_else(String::new, |reason| format!(" ({reason})"));
            silent.push(format!("{}: nothing was measured in {seconds:.0} s{reason}", address(host)));
        }
        if let Some(name) = &self.can
            && can.frames == 0
        {
            silent.push(format!("{name}: no frame came in {seconds:.0} s"));
        }
        if let Some(name) = &self.can
            && can.frames > 0
            && can.samples == 0
        {
            let nodes = self.encoders.nodes(&parameters.vehicle);
            silent.push(format!("{name}: {}", no_sample(can, &nodes, &parameters.vehicle)));
        }
        let kept = if has_data { "what came is in" } else { "nothing is written to" };
        ensure!(silent.is_empty(), "{}; {kept} {}", silent.join("; "), self.output.display());
        Ok(())
    }

    fn begin(&self, parameters: &Parameters, landmarks: &[Landmark]) -> anyhow::Result<Recorder> {
        Ok(Recorder::new(log::Writer::begin(&self.output, parameters, landmarks)?))
    }

    fn record_nav350(
        &self,
        clock: Clock,
        limits: &Limits,
        is_stopped: &AtomicBool,
        recorder: &Recorder,
    ) -> Result<Summary, log::LogError> {
        let Some(host) = &self.nav350 else { return Ok(Summary::default()) };
        let mut link = Link::new(&address(host), Configuration::default(), clock);
        live::record_nav350(&mut link, limits, self.scans.unwrap_or(usize::MAX), is_stopped, recorder)
    }

    fn record_can(
        &self,
        parameters: &Parameters,
        clock: Clock,
        limits: &Limits,
        is_stopped: &AtomicBool,
        recorder: &Recorder,
    ) -> Result<CanSummary, LiveError> {
        let Some(name) = &self.can else { return Ok(CanSummary::default()) };
        let nodes = self.encoders.nodes(&parameters.vehicle);
        live::record_can(|| bus::open(name), &nodes, parameters, clock, limits, is_stopped, recorder)
    }

    fn print(&self, recorded: &Recorded) -> anyhow::Result<()> {
        if self.json {
            println!("{}", serde_json::to_string_pretty(recorded)?);
            return Ok(());
        }
        let row = |name: &str, value: usize| [name.to_owned(), value.to_string()];
        if self.nav350.is_some() {
            print_rows(&[
                row("scans", recorded.scans),
                row("reflector sets", recorded.reflector_sets),
                row("bytes from the laser", recorded.nav350_bytes),
                row("times the laser was lost", recorded.nav350_lost),
            ]);
        }
        if self.can.is_some() {
            print_rows(&[
                row("frames on the bus", recorded.can_frames),
                row("encoder samples", recorded.encoder_samples),
                row("encoder fault changes", recorded.encoder_fault_changes),
                row("times the bus was lost", recorded.can_lost),
            ]);
        }
        Ok(())
    }
}

/// What is heard instead of the encoders.
fn no_sample(can: &CanSummary, nodes: &EncoderNodes, vehicle: &Vehicle) -> String {
    let list = |numbers: &[u8]| numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    let wanted: Vec<u8> =
        nodes.encoders.iter().take(vehicle.counters().len().max(2)).map(|node| node.number()).collect();
    let heard = match &can.heard()[..] {
        [] => "none of them of a node of CANopen".to_owned(),
        heard => format!("of the nodes {}", list(heard)),
    };
    format!(
        "{} frames came, {heard}, and no sample of the nodes {}: state them with --drive and --steering",
        can.frames,
        list(&wanted)
    )
}
