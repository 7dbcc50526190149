//! `agv layout`.

use std::path::{Path, PathBuf};

use agv_core::geometry::Point;
use agv_core::landmarks::LandmarkKind;
use agv_host_sim::layout_check::{CheckOptions, Finding, REFLECTORS, check};
use agv_host_sim::layout_file;
use agv_host_sim::mapping::map_file;

use super::output;

/// Look at a layout of reflectors.
#[derive(clap::Args)]
pub struct Layout {
    #[command(subcommand)]
    action: Action,
}

#[derive(clap::Subcommand)]
enum Action {
    Check(Check),
}

impl Layout {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        match self.action {
            Action::Check(check) => check.run(),
        }
    }
}

const HELP: &str = "\
A vehicle that is switched on sees the nearest reflectors of the place where it stands. Where two poses would explain them,
the layout resembles itself: a reflector more, or one moved by 20 cm, tells the poses apart.

Examples:
  agv layout check reflectors.csv
  agv layout check hall.imk --spacing 1 --most-seen 8 --json

Keys of --json: reflectors, places, unique_share, ambiguous_share, too_few_share, resemblances (turn_deg about the origin, then
shift_m; places), problems (x_m, y_m, seen, answer).";

/// Say where a layout resembles itself, before a vehicle has to find itself there.
#[derive(clap::Args)]
#[command(after_help = HELP)]
struct Check {
    /// A map (.csv, as of 'agv map'), or a layout of the sensor's maker (.imk).
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
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Check {
    fn run(self) -> anyhow::Result<()> {
        let positions = reflectors(&self.layout)?;
        anyhow::ensure!(!positions.is_empty(), "{} has no reflectors", self.layout.display());
        let options =
            CheckOptions { spacing: self.spacing, farthest: self.farthest, most_seen: usize::from(self.most_seen) };
        let check = check(&positions, &options)
            .map_err(|_| anyhow::anyhow!("{} has more than {REFLECTORS} reflectors", self.layout.display()))?;
        if self.json {
            println!("{}", serde_json::to_string_pretty(&check)?);
            return Ok(());
        }
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        output::print_rows(&[
            ["reflectors".to_owned(), check.reflectors.to_string()],
            ["places".to_owned(), check.places.to_string()],
            ["unique".to_owned(), percent(check.unique_share)],
            ["ambiguous".to_owned(), percent(check.ambiguous_share)],
            ["too few seen".to_owned(), percent(check.too_few_share)],
        ]);
        for resemblance in check.resemblances.iter().take(SHOWN) {
            let [x, y] = resemblance.shift_m;
            println!(
                "resembles itself turned by {:.0}° and shifted by ({x:.1}, {y:.1}) m, at {} places",
                resemblance.turn_deg, resemblance.places
            );
        }
        for place in check.problems.iter().take(SHOWN) {
            let what = match place.finding {
                Finding::Resembles { x_m, y_m, heading_deg } => {
                    format!("looks like ({x_m:.1}, {y_m:.1}) m turned by {heading_deg:.0}°")
                }
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

fn reflectors(path: &Path) -> anyhow::Result<Vec<Point>> {
    let is_imk = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("imk"));
    if is_imk {
        let layout = layout_file::load(path)?;
        let metres = |landmark: &agv_core::wire::nav350::LayoutLandmark| {
            Point::new(f64::from(landmark.x.0) * 1e-3, f64::from(landmark.y.0) * 1e-3)
        };
        return Ok(layout.iter().map(|identified| metres(&identified.landmark)).collect());
    }
    let landmarks = map_file::read(path)?;
    let reflectors = landmarks.iter().filter(|landmark| landmark.kind == LandmarkKind::Reflector);
    Ok(reflectors.map(|landmark| Point::new(landmark.x, landmark.y)).collect())
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number.is_finite() => Ok(number),
        _ => Err("a number above zero is wanted".to_owned()),
    }
}
