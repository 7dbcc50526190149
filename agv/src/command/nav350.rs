//! `agv nav350`.

use std::net::TcpListener;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use agv_host_sim::layout_file;
use agv_host_sim::link::clock::Clock;
use agv_host_sim::link::nav350::{Client, Happening, Link, PORT, address};
use agv_host_sim::log;
use agv_host_sim::recording::Recording;
use agv_host_sim::serve::nav350::{Drive, Nav350 as Sensor, Options};
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;
use agv_wire::cola::{Dialect, Sequence};
use agv_wire::nav350::{
    Answer, Configuration, ErrorCode, IdentifiedLandmark, LANDMARKS_A_TELEGRAM, Method, MethodResult, OperatingMode,
    Request, Revolution, SensorFrame, UserLevel, Value, Variable,
};
use anyhow::{Context, bail, ensure};
use clap::Subcommand;

use super::layout_input;
use super::output::{note, print_rows};

const HELP: &str = "\
Examples:
  agv nav350 probe 192.168.1.10
  agv nav350 layout download 192.168.1.10 hall.imk
  agv nav350 layout convert hall.imk hall.csv
  agv nav350 serve --scenario warehouse_hall --port 2112
  agv nav350 serve --log drive.agvlog --dialect cola-a";

/// Talk to a NAV350, or be one
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Nav350 {
    #[command(subcommand)]
    command: Command,
    /// Print the result as JSON.
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Subcommand)]
enum Command {
    /// Be a sensor that sees what a drive has seen.
    Serve(Serve),
    /// Show identity, settings and one revolution of a sensor.
    Probe {
        /// Address, with its port unless it is 2112.
        host: String,
    },
    /// Read, write or convert layouts.
    Layout {
        #[command(subcommand)]
        command: LayoutCommand,
    },
}

#[derive(clap::Args)]
struct Serve {
    /// Scenario to simulate; the standard block storage if neither this nor a log is stated.
    #[arg(long, conflicts_with = "log")]
    scenario: Option<PathBuf>,
    /// Log to serve.
    #[arg(long)]
    log: Option<PathBuf>,
    /// Port to listen on.
    #[arg(long, default_value_t = PORT)]
    port: u16,
    /// How much faster than real time the drive goes.
    #[arg(long, default_value_t = 1.0)]
    speed: f64,
    /// Time from the acknowledgement of a slow method, as a change of mode, to its result, ms; at 0 both leave in one
    /// piece. There are clients that need the one or the other.
    #[arg(long, value_name = "MS", default_value_t = 0.0)]
    gap: f64,
    /// The only dialect that is understood; both if absent.
    #[arg(long)]
    dialect: Option<DialectChoice>,
    /// What the sensor's clock shows at its start, ms; near 4294967295 it wraps soon.
    #[arg(long, value_name = "MS", default_value_t = 0)]
    clock: u32,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum DialectChoice {
    /// CoLa-A: ASCII.
    #[value(name = "cola-a")]
    Ascii,
    /// CoLa-B: binary.
    #[value(name = "cola-b")]
    Binary,
}

impl From<DialectChoice> for Dialect {
    fn from(choice: DialectChoice) -> Self {
        match choice {
            DialectChoice::Ascii => Self::Ascii,
            DialectChoice::Binary => Self::Binary,
        }
    }
}

#[derive(Subcommand)]
enum LayoutCommand {
    /// From a sensor to a file, .imk or .csv.
    Download {
        /// Address, with its port unless it is 2112.
        host: String,
        /// File to write.
        file: PathBuf,
    },
    /// From a file, .imk or .csv, to a sensor; its old layout is erased.
    Upload {
        /// Address, with its port unless it is 2112.
        host: String,
        /// File to read.
        file: PathBuf,
    },
    /// From one file to another, .imk or .csv.
    Convert {
        /// File to read.
        input: PathBuf,
        /// File to write.
        output: PathBuf,
    },
}

impl Nav350 {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        match self.command {
            Command::Serve(serve) => serve.run(),
            Command::Probe { host } => print(&probe(&host)?, self.json),
            Command::Layout { command: LayoutCommand::Download { host, file } } => {
                layout_file::Format::of(&file)?;
                let landmarks = download(&mut Client::connect(&address(&host))?)?;
                layout_file::save(&file, &landmarks)?;
                print(&[row("landmarks", landmarks.len())], self.json)
            }
            Command::Layout { command: LayoutCommand::Upload { host, file } } => {
                let landmarks = layout_input::load(&file)?;
                upload(&mut Client::connect(&address(&host))?, &landmarks)?;
                print(&[row("landmarks", landmarks.len())], self.json)
            }
            Command::Layout { command: LayoutCommand::Convert { input, output } } => {
                let landmarks = layout_input::load(&input)?;
                layout_file::save(&output, &landmarks)?;
                print(&[row("landmarks", landmarks.len())], self.json)
            }
        }
    }
}

impl Serve {
    fn run(self) -> anyhow::Result<()> {
        if !(self.speed > 0.0 && self.speed.is_finite()) {
            bail!("the speed must be greater than zero");
        }
        ensure!((0.0..=MOST_GAP).contains(&self.gap), "--gap must be from 0 to {MOST_GAP:.0} ms");
        let recording = match (&self.log, &self.scenario) {
            (Some(path), _) => log::read(path)?.0,
            (None, Some(path)) => measuring_strengths(Scenario::read(path)?)?,
            (None, None) => measuring_strengths(Scenario::default())?,
        };
        let drive = Drive::new(&recording, SensorFrame::default())?;
        let listener = TcpListener::bind(("0.0.0.0", self.port)).with_context(|| format!("port {}", self.port))?;
        let port = listener.local_addr()?.port();
        note(&format!("serving {} revolutions on port {port}", drive.turns().len()));
        let sensor = Sensor::new(
            drive,
            Options {
                speed: self.speed,
                clock_start: self.clock,
                dialect: self.dialect.map(Into::into),
                gap: 1e-3 * self.gap,
                ..Options::default()
            },
        );
        Ok(sensor.serve(&listener, &AtomicBool::new(false))?)
    }
}

/// Longest gap, ms: a client that waits longer for a result takes the sensor for silent.
const MOST_GAP: f64 = 10_000.0;

/// A simulated drive with the strengths of echoes, which the sensor always measures.
fn measuring_strengths(mut scenario: Scenario) -> anyhow::Result<Recording> {
    scenario.laser.intensities = true;
    Ok(simulate(&scenario)?.recording)
}

fn probe(host: &str) -> anyhow::Result<Vec<[String; 2]>> {
    let address = address(host);
    let mut client = Client::connect(&address)?;
    let mut rows = vec![row("dialect", format!("{:?}", client.dialect()))];
    for variable in [
        Variable::DeviceIdent,
        Variable::SerialNumber,
        Variable::FirmwareVersion,
        Variable::CurrentLayer,
        Variable::ReflectorSize,
        Variable::ReflectorType,
    ] {
        let value = client.call(&Request::Read(variable), |answer| match answer {
            Answer::Value(Value::DeviceIdent(name, version)) => format!("{name} {version}"),
            Answer::Value(Value::SerialNumber(text) | Value::FirmwareVersion(text)) => text.to_string(),
            Answer::Value(Value::Setting(setting)) => format!("{setting:?}"),
            Answer::Value(Value::Other(_, raw)) => format!("{:?}", raw.bytes),
            Answer::Fault(fault) => fault.to_string(),
            other => format!("{other:?}"),
        })?;
        rows.push(row(variable.name(), value));
    }
    drop(client);
    let clock = Clock::new(1.0);
    let mut link = Link::new(&address, Configuration::default(), clock);
    let mut trouble = None;
    // The first revolution ends the session.
    let outcome = link.run(clock.now().offset(30.0), |_, happening| match happening {
        Happening::Revolution(revolution) => Err(revolution_rows(revolution)),
        Happening::Lost(reason) => {
            trouble = Some(reason);
            Ok(())
        }
        _ => Ok(()),
    });
    match (outcome, trouble) {
        (Err(found), _) => {
            rows.extend(found);
            Ok(rows)
        }
        (Ok(()), Some(reason)) => bail!("{address}: no revolution came: {reason}"),
        (Ok(()), None) => bail!("{address}: no revolution came"),
    }
}

/// Prints a result in two columns, or as one JSON object.
fn print(rows: &[[String; 2]], as_json: bool) -> anyhow::Result<()> {
    if as_json {
        let object: serde_json::Map<_, _> =
            rows.iter().map(|[name, value]| (name.clone(), value.clone().into())).collect();
        println!("{}", serde_json::to_string_pretty(&object)?);
    } else {
        print_rows(rows);
    }
    Ok(())
}

fn row(name: &str, value: impl ToString) -> [String; 2] {
    [name.to_owned(), value.to_string()]
}

fn revolution_rows(revolution: &Revolution) -> Vec<[String; 2]> {
    let mut rows = vec![row("mode", OperatingMode::Navigation), row("answer", revolution.error())];
    if let Some(pose) = revolution.pose() {
        rows.push(row("pose", format!("{:.3} m {:.3} m {:.3} rad", pose.pose.x, pose.pose.y, pose.pose.theta)));
    }
    if let Some(scan) = revolution.scan() {
        let returns: Vec<f32> = scan.ranges.iter().copied().filter(|range| *range > 0.0).collect();
        rows.push(row("beams", scan.ranges.len()));
        rows.push(row("returns", returns.len()));
        rows.push(row("nearest", format!("{:.3} m", returns.iter().copied().fold(f32::INFINITY, f32::min))));
        rows.push(row("farthest", format!("{:.3} m", returns.iter().copied().fold(0.0, f32::max))));
    }
    if let Some(reflectors) = revolution.reflectors() {
        rows.push(row("reflectors", reflectors.observations.len()));
    }
    rows
}

fn download(client: &mut Client) -> anyhow::Result<Vec<IdentifiedLandmark>> {
    let ids = client.call(&Request::Call(Method::GetLayout), |answer| match answer {
        Answer::Result(MethodResult::LandmarkIds(_, ErrorCode::OK, ids)) => Ok(ids.iter().collect::<Vec<_>>()),
        other => Err(complaint(other)),
    })?;
    let mut landmarks = Vec::new();
    for ids in ids.map_err(anyhow::Error::msg)?.chunks(LANDMARKS_A_TELEGRAM) {
        let request = Request::Call(Method::GetLandmarks(Sequence::Values(ids)));
        let piece = client.call(&request, |answer| match answer {
            Answer::Result(MethodResult::Landmarks(ErrorCode::OK, piece)) => Ok(piece.iter().collect::<Vec<_>>()),
            other => Err(complaint(other)),
        })?;
        let piece = piece.map_err(anyhow::Error::msg)?;
        check_ids(ids, &piece)?;
        landmarks.extend(piece);
    }
    Ok(landmarks)
}

/// Whether these are the landmarks that were asked for.
fn check_ids(wanted: &[u16], got: &[IdentifiedLandmark]) -> anyhow::Result<()> {
    let mut wanted = wanted.to_vec();
    let mut found: Vec<u16> = got.iter().map(|landmark| landmark.id).collect();
    wanted.sort_unstable();
    found.sort_unstable();
    ensure!(
        wanted == found,
        "the sensor gives other landmarks than it was asked for: {found:?} instead of {wanted:?}; nothing is written"
    );
    Ok(())
}

fn upload(client: &mut Client, landmarks: &[IdentifiedLandmark]) -> anyhow::Result<()> {
    let level = UserLevel::AuthorisedClient;
    let log_in = Method::SetAccessMode { level: level.number(), password: level.default_password() };
    for method in [log_in, Method::ChangeState(OperatingMode::Standby), Method::EraseLayout(1)] {
        demand(client, method)?;
    }
    for piece in landmarks.chunks(LANDMARKS_A_TELEGRAM) {
        let piece: Vec<_> = piece.iter().map(|known| known.landmark.clone()).collect();
        demand(client, Method::AddLandmarks(Sequence::Values(&piece)))?;
    }
    demand(client, Method::StoreLayout)
}

/// Calls a method that must not fail.
fn demand(client: &mut Client, method: Method) -> anyhow::Result<()> {
    client
        .call(&Request::Call(method), |answer| match answer {
            Answer::Result(
                MethodResult::AccessMode(true)
                | MethodResult::State(ErrorCode::OK, _)
                | MethodResult::LandmarkIds(_, ErrorCode::OK, _)
                | MethodResult::Plain(_, None | Some(ErrorCode::OK)),
            ) => Ok(()),
            other => Err(complaint(other)),
        })?
        .map_err(|complaint| anyhow::anyhow!("{}: {complaint}", method.name().name()))
}

fn complaint(answer: &Answer) -> String {
    match answer {
        Answer::Fault(fault) => format!("the sensor refuses: {fault}"),
        Answer::Result(MethodResult::AccessMode(_)) => "the sensor does not grant the user level".to_owned(),
        Answer::Result(
            MethodResult::State(error, _)
            | MethodResult::LandmarkIds(_, error, _)
            | MethodResult::Landmarks(error, _)
            | MethodResult::Plain(_, Some(error)),
        ) => format!("the sensor reports: {error}"),
        other => format!("the sensor answers something else: {other:?}"),
    }
}
