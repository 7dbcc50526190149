//! `agv view`.

use std::io::Write;
use std::net::{Ipv4Addr, TcpListener};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use agv_core::record::{Item, Record};
use agv_host_sim::link::with_port;
use agv_host_sim::live::stream;
use agv_host_sim::log::{LogError, Reader};
use agv_host_sim::view::{FeedError, Shared, Timeline, follow, load, serve};
use anyhow::{Context, anyhow};

use super::output::note;
use super::stop;

const HELP: &str = "\
Prints the address of the page and serves it until Ctrl-C, to this machine only. Looking at a vehicle from elsewhere:
ssh -L 8050:localhost:8050 MACHINE.

Examples:
  agv view drive.agvlog
  agv view drive.agvlog --port 0 --json
  agv view --live 192.168.1.20
  agv view --live 127.0.0.1:5350 --output drive.agvlog";

/// Look at a log, or at a vehicle that drives, in a browser
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct View {
    /// The log.
    #[arg(required_unless_present = "live")]
    log: Option<PathBuf>,
    /// Controller to follow, with the port of its log stream unless it is 5350.
    #[arg(long, value_name = "HOST", conflicts_with = "log")]
    live: Option<String>,
    /// Write what the controller says to a log; an older one is replaced.
    #[arg(short, long, value_name = "LOG", requires = "live")]
    output: Option<PathBuf>,
    /// Port of the page on this machine; any free one if 0.
    #[arg(long, default_value_t = 8050)]
    port: u16,
    /// Print the address as JSON.
    #[arg(long)]
    json: bool,
}

/// Records among which the header of a log is.
const BEGINNING: usize = 1000;

/// Refuses a file that is no log, and a part of a log that has lost its beginning: without a header nothing can be shown.
fn check_beginning(path: &Path) -> Result<(), LogError> {
    let mut reader = Reader::open(path)?;
    let mut damage = None;
    for _ in 0..BEGINNING {
        match reader.next()? {
            Some(Item::Record { record: Record::Header(_), .. }) => return Ok(()),
            Some(Item::Record { .. }) => {}
            Some(Item::Damage(found)) => damage = damage.or(Some(found)),
            None => break,
        }
    }
    Err(LogError::Header { path: path.to_owned(), damage })
}

impl View {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let host = self.live.as_deref().map(|host| with_port(host, stream::PORT));
        let timeline = match (&self.log, &host) {
            (Some(path), _) => {
                // What is no log is refused before anything is served.
                check_beginning(path)?;
                Timeline::of_log(path.clone())
            }
            (None, Some(host)) => Timeline::of_controller(host),
            (None, None) => return Err(anyhow!("a log or --live is needed")),
        };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, self.port))
            .with_context(|| format!("port {} of this machine; choose another with --port", self.port))?;
        let url = format!("http://{}/", listener.local_addr()?);
        self.announce(&url)?;
        let is_stopped = stop::on_interrupt()?;
        let shared = Shared::new(timeline);
        let (served, fed) = std::thread::scope(|scope| {
            let feeding = scope.spawn(|| {
                let outcome = self.feed(host.as_deref(), &shared, &is_stopped);
                // Without anything to look at there is no reason to go on.
                if outcome.is_err() {
                    is_stopped.store(true, Ordering::Relaxed);
                }
                outcome
            });
            let served = serve(listener, &shared, &is_stopped);
            is_stopped.store(true, Ordering::Relaxed);
            (served, feeding.join())
        });
        fed.map_err(|_| anyhow!("the reading broke down"))??;
        served.context("the page cannot be served")
    }

    fn feed(&self, host: Option<&str>, shared: &Shared, is_stopped: &Arc<AtomicBool>) -> Result<(), FeedError> {
        match (&self.log, host) {
            (Some(path), _) => load(path, shared, is_stopped),
            (None, Some(host)) => {
                let wait =
                    |reason: &str| note(&format!("agv: nothing to see yet: {reason}; asking again until Ctrl-C"));
                follow(host, self.output.as_deref().map(Path::new), shared, is_stopped, wait)
            }
            (None, None) => Ok(()),
        }
    }

    fn announce(&self, url: &str) -> anyhow::Result<()> {
        if self.json {
            println!("{}", serde_json::json!({ "url": url }));
        } else {
            println!("{url}  (Ctrl-C ends)");
        }
        std::io::stdout().flush().context("the address cannot be printed")
    }
}
