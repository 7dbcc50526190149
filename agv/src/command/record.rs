//! `agv record`.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use agv_core::localizer::Parameters;
use agv_core::maps::Landmark;
use agv_core::measurement::Time;
use agv_host_sim::link::clock::Clock;
use agv_host_sim::link::nav350::{Link, address};
use agv_host_sim::live::{self, CanSummary, LiveError, Recorder, Summary};
use agv_host_sim::recording::Recording;
use agv_host_sim::{bus, log};
use agv_wire::nav350::Configuration;
use anyhow::{Context, bail};
use serde::Serialize;

use super::encoder_arguments::EncoderArguments;
use super::like;
use super::output::print_rows;
use super::progress;
use super::stop;

const HELP: &str = "\
Ends after --duration or --scans, or with Ctrl-C. What is older than a second survives a loss of power.

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
    /// Log to write; an older one is replaced.
    #[arg(short, long, value_name = "LOG")]
    output: PathBuf,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

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
        let until = match self.duration {
            Some(seconds) => clock.now().offset(seconds),
            None => Time::from_micros(u64::MAX),
        };
        // Shown on a terminal only.
        let progress = progress::spinner().with_message(format!("recording to {}", self.output.display()));
        progress.enable_steady_tick(Duration::from_millis(200));
        let (nav350, can) = std::thread::scope(|scope| {
            let can = scope.spawn(|| {
                let outcome = self.record_can(&parameters, clock, until, &is_stopped, &recorder);
                // The other sensor is not to be recorded for hours after the bus could not be opened.
                if outcome.is_err() {
                    is_stopped.store(true, Ordering::Relaxed);
                }
                outcome
            });
            let nav350 = self.record_nav350(clock, until, &is_stopped, &recorder);
            if self.scans.is_some() || nav350.is_err() {
                is_stopped.store(true, Ordering::Relaxed);
            }
            (nav350, can.join())
        });
        recorder.finish()?;
        progress.finish_and_clear();
        let can = can.ok().context("the recording of the bus broke down")??;
        let nav350 = nav350?;
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

    fn begin(&self, parameters: &Parameters, landmarks: &[Landmark]) -> anyhow::Result<Recorder> {
        let mut writer = log::Writer::begin(&self.output, parameters, landmarks)?;
        writer.flush()?;
        Ok(Recorder::new(writer))
    }

    fn record_nav350(
        &self,
        clock: Clock,
        until: Time,
        is_stopped: &AtomicBool,
        recorder: &Recorder,
    ) -> Result<Summary, log::LogError> {
        let Some(host) = &self.nav350 else { return Ok(Summary::default()) };
        let mut link = Link::new(&address(host), Configuration::default(), clock);
        live::record_nav350(&mut link, until, self.scans.unwrap_or(usize::MAX), is_stopped, recorder)
    }

    fn record_can(
        &self,
        parameters: &Parameters,
        clock: Clock,
        until: Time,
        is_stopped: &AtomicBool,
        recorder: &Recorder,
    ) -> Result<CanSummary, LiveError> {
        let Some(name) = &self.can else { return Ok(CanSummary::default()) };
        let nodes = self.encoders.nodes();
        live::record_can(|| bus::open(name), &nodes, parameters, clock, until, is_stopped, recorder)
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
