//! `agv run`.

mod journal;

use std::io::Write;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use agv_host_sim::bus;
use agv_host_sim::run::{
    self, Configuration, Demonstration, Logs, Options, Ports, RealTime, RecordingConfiguration, RingOptions, Running,
    Summary,
};
use agv_host_sim::view::{Shared, Timeline, follow, serve};
use anyhow::{Context, bail, ensure};

use self::journal::Journal;
use super::output::print_rows;
use super::stop;

const HELP: &str = "\
--demo drives an emulated vehicle through a simulated hall: its encoders are on a bus inside this program, its NAV350 is asked over
loopback. The page that is printed shows it; agv ctl, agv view --live and agv record meet it at the ports that are told.

A configuration is a file like this; what is left out is as here, but for store and bus, which must be there:
  store = \"/var/lib/agv\"            # settings, key and maps: flash.bin and contours.bin of agv provision
  bus = \"can0\"                      # or slcan:/dev/ttyACM0@500000, slcan-tcp:HOST:PORT
  listen = \"0.0.0.0\"                # log stream and service port, at the ports of the settings
  [real_time]                       # SCHED_FIFO 1 to 99, and cores; none of it if the table is there and empty
  bus_priority = 45
  laser_priority = 40
  localizer_priority = 35
  lock_memory = true
  [discrete]                        # no lines if absent; a line is a number of the chip, or a name
  chip = \"/dev/gpiochip0\"
  pose_valid = 17
  within_docking_limits = 27
  fault = 22                        # low while something is wrong
  standstill = \"STANDSTILL\"
  reset = 6
  inverted = [\"reset\"]             # lines whose hardware inverts
  [gyro]                            # none if absent; a BMI160 on i2c or spi
  i2c = \"/dev/i2c-1\"
  is_sdo_high = false               # true: its address is 69h, not 68h
  # spi = \"/dev/spidev0.0\"
  [pose]
  unix = \"/run/agv/pose\"            # none if absent
  udp = [\"127.0.0.1:5355\"]          # none if absent
  [status]
  listen = \"127.0.0.1:8051\"
  [recording]                       # nothing is kept if absent
  folder = \"/var/lib/agv/recording\"
  minutes = 10                      # the last ones, in ring/; an incident (lost, fault, alarm) is a log in incidents/
  ring_mib = 512
  incidents_mib = 512

Ends with Ctrl-C, SIGTERM, or after --seconds; 1 if the vehicle never knew where it is, of a demonstration and with --seconds.

Examples:
  agv run --demo
  agv run --demo --seconds 10 --json
  agv run --demo --seconds 60 --output drive.agvlog --no-page && agv replay drive.agvlog
  agv provision --key agv.key --map hall.imk --output /var/lib/agv/flash.bin && agv run --config vehicle.toml";

/// Run the controller of a vehicle on this machine, or show it with an emulated one
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Run {
    /// What this machine is told: bus, store, priorities, who is told the pose.
    #[arg(long, value_name = "FILE", required_unless_present = "demo", conflicts_with = "demo")]
    config: Option<PathBuf>,
    /// Drive an emulated vehicle.
    #[arg(long)]
    demo: bool,
    /// End after so many seconds.
    #[arg(long, value_name = "SECONDS")]
    seconds: Option<f64>,
    /// Serve no page of the demonstration.
    #[arg(long, requires = "demo")]
    no_page: bool,
    /// Port of the page of the demonstration on this machine; any free one if 0.
    #[arg(long, default_value_t = 8050, requires = "demo")]
    page_port: u16,
    /// Folder for the store of the demonstration; what is there is replaced. A temporary one if absent.
    #[arg(long, value_name = "FOLDER", requires = "demo")]
    store: Option<PathBuf>,
    /// Log to write, from the first event on; an older one is renamed to LOG.old.
    #[arg(short, long, value_name = "LOG")]
    output: Option<PathBuf>,
    /// Folder for the last minutes of the demonstration, and its incidents.
    #[arg(long, value_name = "FOLDER", requires = "demo")]
    recording: Option<PathBuf>,
    /// Print what the run has brought as JSON, and serve no page.
    #[arg(long)]
    json: bool,
}

impl Run {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        if let Some(seconds) = self.seconds {
            ensure!(seconds > 0.0 && seconds.is_finite(), "--seconds must be greater than zero");
        }
        // What cannot be used is refused before anything begins.
        let configuration = self.config.as_deref().map(Configuration::read).transpose()?;
        if let Some(configuration) = &configuration
            && let Err(error) = bus::check_name(&configuration.bus)
        {
            bail!("{}: bus: {error}", self.config.as_deref().unwrap_or(Path::new("")).display());
        }
        let is_stopped = stop::on_interrupt()?;
        let journal = Journal::open();
        let summary = match configuration {
            Some(configuration) => self.with_vehicle(&configuration, &is_stopped, journal)?,
            None => self.demonstrate(&is_stopped, journal)?,
        };
        self.print(&summary)?;
        let must_localise = self.demo || self.seconds.is_some();
        ensure!(
            !must_localise || summary.was_localised,
            "the vehicle never knew where it is: {} poses went to the bus, the last one {}",
            summary.poses,
            summary.mode
        );
        Ok(())
    }

    fn with_vehicle(
        &self,
        configuration: &Configuration,
        is_stopped: &Arc<AtomicBool>,
        journal: Journal,
    ) -> anyhow::Result<Summary> {
        let address = configuration.status.listen;
        let note = |text: &str| journal.tell(text);
        again(journal, |restarts| {
            let listener = TcpListener::bind(address)
                .with_context(|| format!("{address}; another address is set with listen in [status]"))?;
            let name = configuration.bus.clone();
            let options = Options {
                store: configuration.store.clone(),
                open_bus: Box::new(move || bus::open(&name)),
                lines: configuration.discrete.open()?,
                gyro: configuration.gyro.open()?,
                ports: Ports::Set(configuration.listen),
                real_time: configuration.real_time,
                datagrams: configuration.pose.udp.clone(),
                socket: configuration.pose.unix.clone(),
                logs: self.logs(configuration.recording.as_ref().map(RecordingConfiguration::options)),
            };
            let watch = |running: &Running| {
                tell_ports(running, journal);
                let end = self.end();
                run::attend(running, &running.limits, Some(listener), &note, || {
                    tell_faults(running, journal);
                    stop_at(end, is_stopped);
                });
            };
            let summary = run::run(options, is_stopped, &note, watch)?;
            Ok(Summary { restarts, ..summary })
        })
    }

    fn demonstrate(&self, is_stopped: &Arc<AtomicBool>, journal: Journal) -> anyhow::Result<Summary> {
        let page = if self.json || self.no_page { None } else { Some(self.bind_page()?) };
        let demonstration = Demonstration::new()?;
        let temporary = std::env::temp_dir().join(format!("agv-run-{}", std::process::id()));
        let folder = self.store.clone().unwrap_or_else(|| temporary.clone());
        let watch = |running: &Running| {
            tell_ports(running, journal);
            let Some(listener) = page else { return self.wait(running, is_stopped, journal) };
            let log = running.log;
            std::thread::scope(|scope| {
                let served = scope.spawn(|| serve_page(listener, log, is_stopped, journal));
                self.wait(running, is_stopped, journal);
                if let Ok(Err(error)) = served.join() {
                    journal.tell(&format!("the page cannot be served: {error}"));
                }
            });
        };
        let note = |text: &str| journal.tell(text);
        let outcome = demonstration.run(
            &folder,
            RealTime::USUAL,
            self.logs(self.recording.clone().map(RingOptions::usual)),
            is_stopped,
            &note,
            watch,
        );
        if self.store.is_none() {
            // What cannot be removed is left to the system.
            let _ = std::fs::remove_dir_all(&temporary);
        }
        Ok(outcome?)
    }

    fn logs(&self, ring: Option<RingOptions>) -> Logs {
        Logs { whole: self.output.clone(), ring }
    }

    fn bind_page(&self) -> anyhow::Result<TcpListener> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, self.page_port))
            .with_context(|| format!("port {} of this machine; choose another with --page-port", self.page_port))?;
        println!("http://{}/  (Ctrl-C ends)", listener.local_addr()?);
        std::io::stdout().flush().context("the address cannot be printed")?;
        Ok(listener)
    }

    /// Waits for the end, and makes it when the time is over.
    fn wait(&self, running: &Running, is_stopped: &Arc<AtomicBool>, journal: Journal) {
        let end = self.end();
        while !running.is_over() {
            std::thread::sleep(Duration::from_millis(10));
            tell_faults(running, journal);
            stop_at(end, is_stopped);
        }
    }

    fn end(&self) -> Option<Instant> {
        self.seconds.map(|seconds| Instant::now() + Duration::from_secs_f64(seconds))
    }

    fn print(&self, summary: &Summary) -> anyhow::Result<()> {
        if self.json {
            println!("{}", serde_json::to_string(summary)?);
            return Ok(());
        }
        let Summary { poses, period_ms, missed, mode, level_mm, restarts, .. } = summary;
        let level = level_mm.map_or_else(|| "none".to_owned(), |level| format!("{level:.1} mm"));
        let row = |name: &str, value: String| [name.to_owned(), value];
        print_rows(&[
            row("poses on the bus", poses.to_string()),
            row("period, half", format!("{:.3} ms", period_ms.p50)),
            row("period, 99.9 %", format!("{:.3} ms", period_ms.p999)),
            row("period, longest", format!("{:.3} ms", period_ms.max)),
            row("missed deadlines", missed.to_string()),
            row("last mode", (*mode).to_owned()),
            row("last protection level", level),
            row("started again", restarts.to_string()),
        ]);
        Ok(())
    }
}

/// Ends the run when the time is over.
fn stop_at(end: Option<Instant>, is_stopped: &AtomicBool) {
    if end.is_some_and(|end| Instant::now() >= end) {
        is_stopped.store(true, Ordering::Relaxed);
    }
}

/// Runs again as often as somebody wants that.
fn again(journal: Journal, mut once: impl FnMut(u32) -> anyhow::Result<Summary>) -> anyhow::Result<Summary> {
    let mut restarts = 0;
    loop {
        let summary = once(restarts)?;
        if !summary.is_restart_wanted {
            return Ok(summary);
        }
        restarts += 1;
        journal.tell("starts again, as the service port was asked to");
    }
}

fn tell_faults(running: &Running, journal: Journal) {
    while let Some(fault) = running.next_fault() {
        journal.tell_fault(&fault);
    }
}

fn tell_ports(running: &Running, journal: Journal) {
    let Running { log, service, starts, .. } = running;
    journal.tell(&format!("start {starts}; agv view --live {log}; agv ctl {service} list"));
}

/// Shows what the controller says at its log stream.
fn serve_page(
    listener: TcpListener,
    log: SocketAddr,
    is_stopped: &Arc<AtomicBool>,
    journal: Journal,
) -> std::io::Result<()> {
    let host = log.to_string();
    let shared = Shared::new(Timeline::of_controller(&host));
    std::thread::scope(|scope| {
        scope.spawn(|| {
            if let Err(error) = follow(&host, None, &shared, is_stopped, |_| ()) {
                journal.tell(&format!("the page shows no more: {error}"));
            }
        });
        serve(listener, &shared, is_stopped)
    })
}
