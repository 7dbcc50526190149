//! `agv layout`.

use std::path::PathBuf;
use std::process::ExitCode;

use agv_core::geometry::Point;
use agv_core::localizer::ReflectorParameters;
use agv_core::maps::Landmark;
use agv_host_sim::layout_check::{CheckOptions, Finding, Plan, check, page};
use agv_host_sim::layout_file::{self, LoadedLayout, Reading, Unit};
use agv_host_sim::mapping::map_file;
use agv_settings::map_identity;
use agv_wire::nav350::IdentifiedLandmark;
use anyhow::Context;

use super::{import_summary, layout_input, output};

const EXAMPLES: &str = "\
Examples:
  agv layout check hall.imk --report hall
  agv layout identity hall.imk
  agv layout convert hall.imk hall.dxf
  agv layout convert drawing.dxf hall.csv --map
  agv layout convert survey.dxf hall.imk --unit m --origin 691600,5334700 --layer REFLECTORS";

/// Look at a layout of reflectors.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Layout {
    #[command(subcommand)]
    action: Action,
}

#[derive(clap::Subcommand)]
enum Action {
    Check(Check),
    Convert(Convert),
    Identity(Identity),
}

/// Which map a layout is, in one number: the value of the setting 'maps.identity'
#[derive(clap::Args)]
struct Identity {
    /// File to read, .imk, .csv or .dxf.
    input: PathBuf,
    /// Print it as JSON.
    #[arg(long)]
    json: bool,
}

impl Identity {
    fn run(self) -> anyhow::Result<()> {
        let landmarks = layout_file::landmarks(&layout_input::load(&self.input)?);
        if self.json {
            println!(
                "{}",
                serde_json::json!({ "landmarks": landmarks.len(), "map_identity": map_identity(&landmarks) })
            );
        } else {
            output::print_rows(&map_rows(&landmarks));
        }
        Ok(())
    }
}

/// How many landmarks a map has, and which one it is.
pub fn map_rows(landmarks: &[Landmark]) -> [[String; 2]; 2] {
    [
        ["landmarks".to_owned(), landmarks.len().to_string()],
        ["map identity".to_owned(), map_identity(landmarks).to_string()],
    ]
}

/// From one file to another: .imk, .csv or .dxf, as the ending of the name says
#[derive(clap::Args)]
struct Convert {
    /// File to read; a map of this program (.csv), too.
    input: PathBuf,
    /// File to write; an older one is replaced.
    output: PathBuf,
    /// Write a map, as 'agv replay --map' takes it, instead of a layout.
    #[arg(long)]
    map: bool,
    /// Unit of the coordinates: mm, cm, m, in or ft; as the file says if absent.
    #[arg(long)]
    unit: Option<Unit>,
    /// Point of the file that becomes the origin, m; for coordinates of a whole country.
    #[arg(long, value_name = "X,Y", value_parser = origin, allow_hyphen_values = true)]
    origin: Option<[f64; 2]>,
    /// The only layer of a drawing whose points, circles and blocks are reflectors; all that are shown if absent.
    #[arg(long, value_name = "NAME")]
    layer: Option<String>,
    /// End with exit code 3 if there is a warning.
    #[arg(long)]
    strict: bool,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

impl Convert {
    fn run(self) -> anyhow::Result<ExitCode> {
        let reading = Reading { unit: self.unit, origin: self.origin, layer: self.layer };
        let LoadedLayout { landmarks: layout, account, .. } = layout_file::load_as(&self.input, &reading)?;
        if self.map {
            map_file::write(&self.output, &layout_file::landmarks(&layout))?;
        } else {
            layout_file::save(&self.output, &layout)?;
        }
        let rows = [["landmarks".to_owned(), layout.len().to_string()]];
        import_summary::print_account(
            &self.input,
            &rows,
            serde_json::json!({ "landmarks": layout.len() }),
            &account,
            self.json,
        )?;
        Ok(import_summary::exit_code(&account.warnings(), self.strict))
    }
}

/// Two coordinates, m.
fn origin(text: &str) -> Result<[f64; 2], String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|word| word.trim().parse().ok()).collect();
    match numbers[..] {
        [x, y] if x.is_finite() && y.is_finite() => Ok([x, y]),
        _ => Err("an origin is two numbers, X,Y".to_owned()),
    }
}

impl Layout {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<ExitCode> {
        match self.action {
            Action::Check(check) => check.run().map(|()| ExitCode::SUCCESS),
            Action::Convert(convert) => convert.run(),
            Action::Identity(identity) => identity.run().map(|()| ExitCode::SUCCESS),
        }
    }
}

const HELP: &str = "\
A vehicle that is switched on sees the nearest reflectors of the place where it stands. Where two poses would explain them,
the layout resembles itself: a reflector more, or one moved by 20 cm, tells the poses apart.

Examples:
  agv layout check reflectors.csv
  agv layout check hall.imk --spacing 1 --most-seen 8 --json
  agv layout check drawing.dxf --report layout

Keys of --json: reflectors, places, unique_share, ambiguous_share, too_few_share, resemblances (turn_deg about the origin, then
shift_m; places), median_deviation_m, close_pairs (reflectors, distance_m), mirrors (point_m, direction_deg, reflectors),
problems (x_m, y_m, seen, position_deviation_m, heading_deviation_deg, answer).";

/// Say where a layout resembles itself or has reflectors too close to each other, and how well it determines a pose
#[derive(clap::Args)]
#[command(after_help = HELP)]
struct Check {
    /// A map (.csv, as of 'agv map'), a layout of the sensor's maker (.imk, .csv), or a drawing (.dxf).
    layout: PathBuf,
    /// Distance between the places that are looked at, m.
    #[arg(long, default_value_t = 2.0, value_parser = positive)]
    spacing: f64,
    /// Farthest reflector that is seen, m.
    #[arg(long, default_value_t = 30.0, value_parser = positive)]
    farthest: f64,
    /// Most reflectors that are seen at once.
    #[arg(long, default_value_t = 12, value_parser = clap::value_parser!(u8).range(1..=64))]
    most_seen: u8,
    /// Distance below which the sensor may take two reflectors for one, m.
    #[arg(long, default_value_t = 0.5, value_parser = positive)]
    closest: f64,
    /// Write a page with pictures to DIR/index.html.
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Check {
    fn run(self) -> anyhow::Result<()> {
        let LoadedLayout { landmarks, lines, .. } = layout_input::load_whole(&self.layout)?;
        let (positions, names): (Vec<_>, Vec<_>) = landmarks.iter().map(reflector).unzip();
        anyhow::ensure!(!positions.is_empty(), "{} has no reflectors", self.layout.display());
        let options = CheckOptions {
            spacing: self.spacing,
            farthest: self.farthest,
            most_seen: usize::from(self.most_seen),
            closest: self.closest,
            noise: ReflectorParameters::default(),
        };
        let check = check(&positions, &options).with_context(|| self.layout.display().to_string())?;
        if let Some(folder) = &self.report {
            let name = self.layout.file_name().unwrap_or_default().to_string_lossy();
            let path = folder.join("index.html");
            let plan = Plan { positions: &positions, names: &names, lines: &lines };
            let page = page(&name, &plan, &options, &check)?;
            page.write(&path).with_context(|| path.display().to_string())?;
        }
        if self.json {
            println!("{}", serde_json::to_string_pretty(&check)?);
            return Ok(());
        }
        for row in check.rows() {
            println!("{:<28} {}", row[0], row[1]);
        }
        for warning in check.warnings().iter().take(SHOWN) {
            println!("{warning}");
        }
        for place in check.problems.iter().take(SHOWN) {
            let what = match place.finding {
                Finding::Resembles { x_m, y_m, heading_deg } => {
                    format!("looks like ({x_m:.1}, {y_m:.1}) m turned by {heading_deg:.0}°")
                }
                Finding::TooFew if place.seen == 1 => "sees 1 reflector only".to_owned(),
                Finding::TooFew => format!("sees {} reflectors only", place.seen),
                Finding::Unknown | Finding::Unique => "has no clear answer".to_owned(),
            };
            println!("({:.1}, {:.1}) m {what}", place.x_m, place.y_m);
        }
        if check.problems.len() > SHOWN {
            println!("and {} places more: see --json", check.problems.len() - SHOWN);
        }
        Ok(())
    }
}

/// Places and movements that are printed at the most.
const SHOWN: usize = 10;

/// Where it is, and its name.
fn reflector(entry: &IdentifiedLandmark) -> (Point, String) {
    (Point::new(entry.landmark.x.metres(), entry.landmark.y.metres()), entry.id.to_string())
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number.is_finite() => Ok(number),
        _ => Err("a number above zero is wanted".to_owned()),
    }
}
