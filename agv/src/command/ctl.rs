//! `agv ctl`.

use std::path::{Path, PathBuf};

use agv_core::geometry::Pose;
use agv_core::maps::LandmarkKind;
use agv_host_sim::calibrate::vehicle_file::VehicleFile;
use agv_host_sim::contour_map::ContourMap;
use agv_host_sim::layout_file;
use agv_host_sim::link::service::{Client, KeptIncident, PORT, ServiceError, Setting};
use agv_host_sim::link::with_port;
use agv_host_sim::mapping::{contour_file, map_file};
use agv_host_sim::output_file::OutputFile;
use agv_host_sim::setting_doubts::doubt;
use agv_settings::leaf::{Leaf, Value};
use agv_settings::service::Refusal;
use anyhow::{Context, bail, ensure};
use serde_json::json;

use super::layout::map_rows;
use super::layout_input;
use super::output::{note, print_rows};
use super::progress;
use super::setting_text::{named, parse_value, show, show_setting, word};

const HELP: &str = "\
Reading needs nothing; changing needs the controller's key (64 hexadecimal digits in a file) and a vehicle that stands.
A setting that is changed counts from the next start on, once it is stored: set, store, reboot; apply does the first two.

Examples:
  agv ctl 192.168.1.20 version
  agv ctl 192.168.1.20 list
  agv ctl 192.168.1.20 --key agv.key set vehicle.kind differential
  agv ctl 192.168.1.20 --key agv.key set vehicle.track 0.612
  agv ctl 192.168.1.20 --key agv.key apply vehicle.toml
  agv ctl 192.168.1.20 --key agv.key map upload hall.imk
  agv ctl 192.168.1.20 --key agv.key contours upload hall.csv
  agv ctl 192.168.1.20 --key agv.key store
  agv ctl 192.168.1.20 --key agv.key reboot
  agv ctl 192.168.1.20 incidents --output incidents
  agv ctl 192.168.1.20 --key agv.key set-pose 12.5 3.2 1.57";

/// Set up a controller over its service port
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Ctl {
    /// Address of the controller, with its port unless it is 5351.
    host: String,
    /// File with the controller's key.
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    action: Action,
}

#[derive(clap::Subcommand)]
enum Action {
    /// What runs there, and since when.
    Version,
    /// All settings with their units.
    List,
    /// One setting.
    Get {
        /// Its name.
        name: String,
    },
    /// Change a setting; it counts from the next start on, once it is stored.
    #[command(allow_negative_numbers = true)]
    Set {
        /// Its name.
        name: String,
        /// A number, on or off, an IPv4 address, or a word of a list.
        value: String,
    },
    /// Change the settings that a file of the vehicle's parameters states, show what changes, and keep them in flash.
    Apply {
        /// File as `agv calibrate --apply` writes it.
        file: PathBuf,
        /// Show what would change, and change nothing.
        #[arg(long)]
        dry_run: bool,
    },
    /// Keep all settings in flash.
    Store,
    /// The map of reflectors.
    Map {
        #[command(subcommand)]
        action: MapAction,
    },
    /// The map of contours.
    Contours {
        #[command(subcommand)]
        action: ContourAction,
    },
    /// Tell the vehicle where it is: x and y in metres, heading in radians.
    #[command(allow_negative_numbers = true)]
    SetPose {
        /// x, m.
        x: f64,
        /// y, m.
        y: f64,
        /// Heading, rad.
        theta: f64,
        /// Standard deviation of the position along each axis, m.
        #[arg(long, default_value_t = 0.1)]
        position_deviation: f64,
        /// Standard deviation of the heading, rad.
        #[arg(long, default_value_t = 0.03)]
        heading_deviation: f64,
    },
    /// What the last panic said.
    Panic {
        /// Forget it.
        #[arg(long)]
        forget: bool,
    },
    /// The incidents that it keeps (lost, fault, alarm), each a log for agv replay.
    Incidents {
        /// Folder to which they are fetched; one that is there already is not fetched again.
        #[arg(long, value_name = "DIR")]
        output: Option<PathBuf>,
    },
    /// Start the controller again.
    Reboot,
}

#[derive(clap::Subcommand)]
enum MapAction {
    /// From a file, .imk or .csv, to the controller.
    Upload {
        /// File to read.
        file: PathBuf,
    },
    /// From the controller to a file, .imk or .csv.
    Download {
        /// File to write.
        file: PathBuf,
    },
}

#[derive(clap::Subcommand)]
enum ContourAction {
    /// From a file, as agv map --kind contours writes it, to the controller, for its next start.
    Upload {
        /// File to read.
        file: PathBuf,
    },
    /// From the controller to a file.
    Download {
        /// File to write.
        file: PathBuf,
    },
    /// Take it away, from the next start on.
    Remove,
}

/// The key in a file: 64 hexadecimal digits.
pub fn read_key(path: &Path) -> anyhow::Result<[u8; 32]> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let digits = text.trim().as_bytes();
    let mut key = [0; 32];
    if digits.len() != 2 * key.len() {
        bail!("{}: a key has 64 hexadecimal digits, not {}", path.display(), digits.len());
    }
    for (byte, pair) in key.iter_mut().zip(digits.chunks(2)) {
        let pair = std::str::from_utf8(pair).ok();
        let value = pair.and_then(|pair| u8::from_str_radix(pair, 16).ok());
        *byte = value.with_context(|| format!("{}: the key has something else than digits", path.display()))?;
    }
    Ok(key)
}

fn show_settings(settings: &[Setting], as_json: bool) -> anyhow::Result<()> {
    if as_json {
        let object: serde_json::Map<_, _> = settings
            .iter()
            .map(|setting| {
                let value = match setting.value {
                    Value::Number(number) => json!(number),
                    Value::Whole(whole) => word(&setting.name, setting.value).map_or(json!(whole), |word| json!(word)),
                    Value::Switch(is_on) => json!(is_on),
                    Value::Address(_) => json!(show(setting.value)),
                };
                (setting.name.clone(), value)
            })
            .collect();
        println!("{}", serde_json::to_string_pretty(&object)?);
    } else {
        let row = |setting: &Setting| {
            [setting.name.clone(), {
                let value = show_setting(&setting.name, setting.value);
                format!("{value} {}", setting.unit).trim_end().to_owned()
            }]
        };
        print_rows(&settings.iter().map(row).collect::<Vec<_>>());
    }
    Ok(())
}

/// The kinds of vehicles that have a setting.
fn kinds(leaf: &Leaf) -> String {
    leaf.kinds.iter().map(|kind| kind.name()).collect::<Vec<_>>().join(", ")
}

/// What a map of contours is.
fn contour_rows(map: &ContourMap) -> [[String; 2]; 2] {
    [["points", &map.len().to_string()], ["bytes", &map.bytes().len().to_string()]].map(|row| row.map(str::to_owned))
}

/// A setting of a controller; what comes near the name is suggested if there is none.
fn get(client: &mut Client, name: &str) -> anyhow::Result<Setting> {
    match client.get(name) {
        Err(ServiceError::Refused(Refusal::Name)) if let Err(error) = named(name) => Err(error),
        Err(error @ ServiceError::OtherKind) => Err(match Leaf::named(name) {
            Some(leaf) => {
                anyhow::anyhow!("{name} is a setting of vehicles of the kinds {}; vehicle.kind is another", kinds(leaf))
            }
            None => error.into(),
        }),
        outcome => Ok(outcome?),
    }
}

/// Brings a vehicle's parameters to a controller; gives a row for each setting that differs.
fn apply(client: &mut Client, file: &Path, dry_run: bool) -> anyhow::Result<Vec<[String; 2]>> {
    let vehicle = VehicleFile::read(file)?;
    ensure!(vehicle.settings().next().is_some(), "{}: the file states no parameter of a vehicle", file.display());
    let known = client.list()?;
    let mut rows = Vec::new();
    let mut changes = Vec::new();
    for (name, value) in vehicle.settings() {
        let setting = known.iter().find(|setting| setting.name == name);
        let setting = setting.with_context(|| format!("the controller has no setting {name}"))?;
        if let Some(doubt) = doubt(name, value) {
            note(&format!("agv: {}: {doubt}", file.display()));
        }
        if setting.value != Value::Number(value) {
            let change = format!("{} -> {value} {}", show(setting.value), setting.unit);
            rows.push([name.to_owned(), change.trim_end().to_owned()]);
            changes.push((name, value));
        }
    }
    if !dry_run && !changes.is_empty() {
        changes.iter().try_for_each(|(name, value)| client.set(name, Value::Number(*value)))?;
        client.store()?;
    }
    let outcome = match (changes.is_empty(), dry_run) {
        (true, _) => "nothing differs",
        (false, true) => "not changed",
        (false, false) => "changed and stored; they count after agv ctl HOST reboot",
    };
    rows.push(["settings".to_owned(), outcome.to_owned()]);
    Ok(rows)
}

/// Fetches the log of an incident, unless it is there. What a controller calls it must be the name of a file and nothing else.
fn fetch(client: &mut Client, incident: &KeptIncident, folder: &Path) -> anyhow::Result<()> {
    let name = Path::new(&incident.name);
    ensure!(
        name.file_name() == Some(name.as_os_str()),
        "the controller has an incident of the name {:?}",
        incident.name
    );
    let path = folder.join(name);
    if std::fs::metadata(&path).is_ok_and(|metadata| metadata.len() == u64::from(incident.length)) {
        return Ok(());
    }
    let context = || path.display().to_string();
    let mut log = OutputFile::create(&path).with_context(context)?;
    let progress = progress::bar("fetching", incident.length.into());
    client.fetch_incident(incident, &mut log, |count| progress.inc(count as u64))?;
    progress.finish_and_clear();
    log.finish().with_context(context)
}

impl Ctl {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let key = self.key.as_deref().map(read_key).transpose()?;
        let host = with_port(&self.host, PORT);
        let mut client = Client::connect(&host, key)?;
        match &self.action {
            Action::Version => {
                let version = client.version()?;
                let rows = [
                    ["software", &version.software],
                    ["starts", &version.starts.to_string()],
                    ["running for", &format!("{:.1} s", version.uptime)],
                ];
                self.print(&rows.map(|[name, value]| [name.to_owned(), value.to_owned()]))?;
            }
            Action::List => show_settings(&client.list()?, self.json)?,
            Action::Get { name } => show_settings(&[get(&mut client, name)?], self.json)?,
            Action::Set { name, value } => {
                let like = get(&mut client, name)?.value;
                let value = parse_value(name, value, like)?;
                if let Value::Number(number) = value
                    && let Some(doubt) = doubt(name, number)
                {
                    note(&format!("agv: {doubt}"));
                }
                client.set(name, value)?;
                note("agv: changed; it counts after agv ctl HOST store and agv ctl HOST reboot");
            }
            Action::Apply { file, dry_run } => self.print(&apply(&mut client, file, *dry_run)?)?,
            Action::Store => client.store()?,
            Action::Map { action: MapAction::Upload { file } } => {
                let landmarks = layout_input::load_map(file)?;
                let progress = progress::bar("uploading", landmarks.len() as u64);
                client.upload_map(&landmarks, |count| progress.inc(count as u64))?;
                progress.finish_and_clear();
                self.print(&map_rows(&landmarks))?;
            }
            Action::Map { action: MapAction::Download { file } } => {
                layout_file::Format::of(file)?;
                let landmarks = client.download_map()?;
                if landmarks.iter().all(|landmark| landmark.kind == LandmarkKind::Reflector) {
                    layout_file::save(file, &layout_file::layout(&landmarks))?;
                } else {
                    let format = layout_file::Format::of(file)?;
                    ensure!(
                        format == layout_file::Format::Csv,
                        "{}: the map has natural features, which only a .csv holds",
                        file.display()
                    );
                    map_file::write(file, &landmarks)?;
                }
                self.print(&map_rows(&landmarks))?;
            }
            Action::Contours { action: ContourAction::Upload { file } } => {
                let map = contour_file::read(file)?;
                let progress = progress::bar("uploading", map.bytes().len() as u64);
                client.upload_contours(Some(&map), |count| progress.inc(count as u64))?;
                progress.finish_and_clear();
                self.print(&contour_rows(&map))?;
            }
            Action::Contours { action: ContourAction::Download { file } } => {
                let map = client.download_contours()?.context("the controller has no map of contours")?;
                contour_file::write(file, &map)?;
                self.print(&contour_rows(&map))?;
            }
            Action::Contours { action: ContourAction::Remove } => client.upload_contours(None, |_| ())?,
            Action::SetPose { x, y, theta, position_deviation, heading_deviation } => {
                client.set_pose(Pose { x: *x, y: *y, theta: *theta }, [*position_deviation, *heading_deviation])?;
            }
            Action::Panic { forget } => {
                let text = client.last_panic()?;
                let shown = if text.is_empty() { "none" } else { text.as_str() };
                self.print(&[["last panic".to_owned(), shown.to_owned()]])?;
                if *forget {
                    client.forget_panic()?;
                }
            }
            Action::Incidents { output } => self.incidents(&mut client, output.as_deref())?,
            Action::Reboot => client.reboot()?,
        }
        Ok(())
    }

    fn incidents(&self, client: &mut Client, folder: Option<&Path>) -> anyhow::Result<()> {
        let incidents = client.incidents()?;
        if let Some(folder) = folder {
            std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
            for incident in &incidents {
                fetch(client, incident, folder)?;
            }
        }
        if self.json {
            println!("{}", serde_json::to_string_pretty(&incidents)?);
        } else if incidents.is_empty() {
            note("agv: the controller has no incidents");
        } else {
            let row = |incident: &KeptIncident| [incident.name.clone(), format!("{} bytes", incident.length)];
            print_rows(&incidents.iter().map(row).collect::<Vec<_>>());
        }
        Ok(())
    }

    fn print(&self, rows: &[[String; 2]]) -> anyhow::Result<()> {
        if self.json {
            let object: serde_json::Map<_, _> =
                rows.iter().map(|[name, value]| (name.replace(' ', "_"), json!(value))).collect();
            println!("{}", serde_json::to_string_pretty(&object)?);
        } else {
            print_rows(rows);
        }
        Ok(())
    }
}
