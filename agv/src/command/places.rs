//! `agv places`.

use std::path::PathBuf;

use agv_core::geometry::Pose;
use agv_host_sim::places::{
    self, CANDIDATES, FindParameters, Observer, PlaceAnswer, PlaceFix, PlaceMap, Spacing, choose,
};
use serde_json::json;

use super::evaluate::Places as Evaluate;
use super::{output, posed_scans, progress};

/// Store places of a hall, and find out where a scan was taken.
#[derive(clap::Args)]
pub struct Places {
    #[command(subcommand)]
    action: Action,
}

#[derive(clap::Subcommand)]
enum Action {
    Index(Index),
    Find(Find),
    Evaluate(Evaluate),
}

impl Places {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        match self.action {
            Action::Index(index) => index.run(),
            Action::Find(find) => find.run(),
            Action::Evaluate(evaluate) => evaluate.run(),
        }
    }
}

const INDEX_HELP: &str = "\
Examples:
  agv places index fr079.log --output hall.places
  agv places index drive.agvlog --output hall.places --shift 1 --json

Keys of --json: scans, places.";

/// Store the places of a drive with known poses.
#[derive(clap::Args)]
#[command(after_help = INDEX_HELP)]
struct Index {
    /// Log with references or true poses; or a pose-graph log (VERTEX2, ROBOTLASER1) or CARMEN log (FLASER), plain or .gz.
    log: PathBuf,
    /// Where the places go; an older file is replaced.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// A scan becomes a place if it is further than this from all places, m.
    #[arg(long, default_value_t = 0.3)]
    shift: f64,
    /// Or turned by more than this, deg.
    #[arg(long, default_value_t = 20.0)]
    turn: f64,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

impl Index {
    fn run(self) -> anyhow::Result<()> {
        let scans = posed_scans::read(&self.log)?;
        let chosen = choose(&scans, Spacing { shift: self.shift, turn: self.turn.to_radians() });
        let count = chosen.len();
        places::write(&self.output, chosen)?;
        if self.json {
            println!("{}", json!({ "scans": scans.len(), "places": count }));
        } else {
            output::print_rows(&[
                ["scans".to_owned(), scans.len().to_string()],
                ["places".to_owned(), count.to_string()],
            ]);
        }
        Ok(())
    }
}

const FIND_HELP: &str = "\
Each scan is looked at by itself. An answer is 'found' with the pose of the laser in the frame of the places, 'ambiguous' if
two poses fit almost equally, or 'unknown'.

Examples:
  agv places find hall.places today.log --every 10
  agv places find hall.places drive.agvlog --scan 17 --json

Keys of --json, one object a scan: scan, answer, place, x_m, y_m, heading_deg, confidence, keypoints; other (a second pose).";

/// Find out at which stored place each scan of a log was taken.
#[derive(clap::Args)]
#[command(after_help = FIND_HELP)]
struct Find {
    /// Places that 'agv places index' has stored.
    places: PathBuf,
    /// Log with the scans, as for 'index'; its poses are not looked at.
    log: PathBuf,
    /// Only this scan, counted from 0.
    #[arg(long, conflicts_with = "every")]
    scan: Option<usize>,
    /// Only every so many scans.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Places that are looked at for each scan.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u8).range(1..=CANDIDATES as i64))]
    candidates: u8,
    /// Print a JSON array.
    #[arg(long)]
    json: bool,
}

impl Find {
    fn run(self) -> anyhow::Result<()> {
        let stored = places::read(&self.places)?;
        let scans = posed_scans::read(&self.log)?;
        let asked: Vec<usize> = match self.scan {
            Some(scan) => {
                anyhow::ensure!(scan < scans.len(), "{} has {} scans only", self.log.display(), scans.len());
                vec![scan]
            }
            None => (0..scans.len()).step_by(self.every as usize).collect(),
        };
        let mut map = PlaceMap::new(&stored);
        let mut observer = Observer::default();
        let parameters = FindParameters { candidates: usize::from(self.candidates), ..FindParameters::default() };
        let bar = progress::bar("finding places", asked.len() as u64);
        let answers: Vec<_> = asked
            .into_iter()
            .map(|scan| {
                let answer = map.find(&observer.observe(&scans[scan].scan), &parameters);
                bar.inc(1);
                (scan, answer)
            })
            .collect();
        bar.finish_and_clear();
        if self.json {
            let objects: Vec<_> = answers.iter().map(|(scan, answer)| object(*scan, answer)).collect();
            println!("{}", serde_json::to_string_pretty(&objects)?);
            return Ok(());
        }
        println!("scan   answer     place        x        y  heading  confidence  keypoints");
        for (scan, answer) in answers {
            match answer {
                PlaceAnswer::Found(fix) => println!("{scan:<6} found      {}", row(&fix)),
                PlaceAnswer::Ambiguous(fix, other) => {
                    println!("{scan:<6} ambiguous  {}", row(&fix));
                    println!("{:<6} or         {}", "", row(&other));
                }
                PlaceAnswer::Unknown => println!("{scan:<6} unknown"),
            }
        }
        Ok(())
    }
}

fn row(fix: &PlaceFix) -> String {
    let Pose { x, y, theta } = fix.pose;
    format!(
        "{:>5} {x:>8.3} {y:>8.3} {:>7.2}° {:>11.2} {:>10}",
        fix.place,
        theta.to_degrees(),
        fix.confidence,
        fix.points
    )
}

fn object(scan: usize, answer: &PlaceAnswer) -> serde_json::Value {
    let fields = |fix: &PlaceFix| {
        json!({
            "place": fix.place,
            "x_m": fix.pose.x,
            "y_m": fix.pose.y,
            "heading_deg": fix.pose.theta.to_degrees(),
            "confidence": fix.confidence,
            "keypoints": fix.points,
        })
    };
    let (name, mut object) = match answer {
        PlaceAnswer::Found(fix) => ("found", fields(fix)),
        PlaceAnswer::Ambiguous(fix, other) => {
            let mut object = fields(fix);
            object["other"] = fields(other);
            ("ambiguous", object)
        }
        PlaceAnswer::Unknown => ("unknown", json!({})),
    };
    object["scan"] = scan.into();
    object["answer"] = name.into();
    object
}
