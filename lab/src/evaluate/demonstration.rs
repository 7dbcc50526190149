//! The default run: one drive into a block storage, localised by each kind of landmark.
//!
//! The world has reflectors in the aisle and none in the lane between the pallets. Another drive in the same world, with
//! other noise, maps the natural features. Its poses rest on the surveyed reflectors, and on some more that stand in the
//! lane while the map is made.

use agv_core::localizer::MapUse;

use agv_host_sim::accuracy::Spread;
use agv_host_sim::drive::{
    Figures, Track, add_drive, heading_error_chart, heading_error_line, position_error_chart, position_error_line,
};
use agv_host_sim::mapping::{Clustering, map_features};
use agv_host_sim::recording::Recording;
use agv_host_sim::replay::{Replay, ReplayError, replay};
use agv_host_sim::report::{FigureError, Page, Series, Table};
use agv_host_sim::simulate::scenario::{Scenario, ScenarioError};
use agv_host_sim::simulate::standard::{BLOCK_STORAGE, MAPPING};
use agv_host_sim::simulate::{SimulateError, simulate};

/// What the localiser may use in a replay of the drive.
struct Way {
    name: &'static str,
    maps: MapUse,
    /// Whether contours correct the pose.
    contours: bool,
}

const NO_MAP: MapUse = MapUse { reflectors: false, features: false, dynamic: false, slam: false };

/// Each way to localise the drive; the last one uses everything.
const WAYS: [Way; 6] = [
    Way { name: "odometry alone", maps: NO_MAP, contours: true },
    Way { name: "reflectors", maps: MapUse { reflectors: true, ..NO_MAP }, contours: true },
    Way { name: "static features", maps: MapUse { features: true, ..NO_MAP }, contours: true },
    Way { name: "features found on the way", maps: MapUse { slam: true, ..NO_MAP }, contours: false },
    Way { name: "contours of the way behind", maps: MapUse { slam: true, ..NO_MAP }, contours: true },
    Way { name: "mixed", maps: MapUse { reflectors: true, features: true, ..NO_MAP }, contours: true },
];

/// How many ways there are to localise the drive, in a word.
pub const NUMBER_OF_WAYS: &str = "six";

const _: () = assert!(WAYS.len() == 6);

/// The drive, localised in one way.
#[derive(Clone, Debug)]
pub struct LocalisedDrive {
    /// What the localiser used.
    pub name: &'static str,
    /// The drive with its map.
    pub recording: Recording,
    /// What the localiser said.
    pub replay: Replay,
    /// The same over the way, with its errors.
    pub track: Track,
    /// Figures.
    pub figures: Figures,
}

/// Why the run cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum DemonstrationError {
    /// A drive cannot be simulated.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// A scenario makes no sense.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A drive cannot be replayed.
    #[error(transparent)]
    Replay(#[from] ReplayError),
}

/// Simulates the drive, maps its world, and localises the drive in each way, with everything in the last.
/// `begin` is called with what is done next.
///
/// # Errors
/// See [`DemonstrationError`].
pub fn run(mut begin: impl FnMut(&'static str)) -> Result<Vec<LocalisedDrive>, DemonstrationError> {
    begin("simulating the drive");
    let mut recording = simulate(&Scenario::parse(BLOCK_STORAGE)?)?.recording;
    begin("simulating the drive for the map");
    let mut mapping = simulate(&Scenario::parse(MAPPING)?)?.recording;
    begin("mapping");
    // Both drives rest on the one survey of the reflectors; those that stand in the lane for the mapping come last.
    mapping.landmarks.splice(..recording.landmarks.len(), recording.landmarks.iter().copied());
    recording.landmarks.extend(map_features(&mapping, &Clustering::default())?);
    begin("replaying");
    let localise = |way: Way| {
        let mut recording = recording.clone();
        recording.parameters.maps = way.maps;
        recording.parameters.sources.contours = way.contours;
        let replay = replay(&recording, |_| {})?;
        let track = Track::new(&recording, &replay);
        let figures = Figures::new(&recording, &replay, &track);
        Ok(LocalisedDrive { name: way.name, recording, replay, track, figures })
    };
    WAYS.into_iter().map(localise).collect()
}

/// Figures of each drive: a heading and rows.
#[must_use]
pub fn table(drives: &[LocalisedDrive]) -> Table {
    let heading = ["", "mm: median", "95 %", "max", "end", "deg: median", "95 %", "max", "end", "NEES", "ok, %"];
    let unknown = Spread { median: f64::NAN, p95: f64::NAN, max: f64::NAN };
    let row = |drive: &LocalisedDrive| {
        let accuracy = drive.figures.accuracy.as_ref();
        let position = accuracy.map_or(unknown, |accuracy| accuracy.position_mm);
        let heading = accuracy.and_then(|accuracy| accuracy.heading_deg).unwrap_or(unknown);
        let position_end = accuracy.map(|accuracy| accuracy.position_end_mm);
        let heading_end = accuracy.and_then(|accuracy| accuracy.heading_end_deg);
        let one = |value: f64| format!("{value:.1}");
        let three = |value: f64| format!("{value:.3}");
        vec![
            drive.name.to_owned(),
            one(position.median),
            one(position.p95),
            one(position.max),
            one(position_end.unwrap_or(f64::NAN)),
            three(heading.median),
            three(heading.p95),
            three(heading.max),
            three(heading_end.unwrap_or(f64::NAN)),
            one(accuracy.and_then(|accuracy| accuracy.nees).unwrap_or(f64::NAN)),
            format!("{:.0}", 100.0 * accuracy.and_then(|accuracy| accuracy.ok_share).unwrap_or(f64::NAN)),
        ]
    };
    Table { heading: heading.map(unbroken).to_vec(), rows: drives.iter().map(row).collect() }
}

/// The text with spaces at which no line breaks.
fn unbroken(text: &str) -> String {
    text.replace(' ', "\u{a0}")
}

/// A page that compares the drives, and shows the last of them in full.
///
/// # Errors
/// If a picture cannot be drawn.
pub fn page(drives: &[LocalisedDrive]) -> Result<Page, FigureError> {
    let mut page = Page::new("A drive into a block storage");
    page.paragraph(
        "Simulated: 4 m of aisle with reflectors, then 8 m into a lane between pallets without any. The encoders slip and \
         are slightly miscalibrated, the laser has noise. Natural features were mapped by another \
         drive, for which some reflectors stood in the lane.",
    );
    page.section(&format!("Localised in {NUMBER_OF_WAYS} ways")).table(&table(drives));
    page.paragraph(
        "Distance from the true position and difference from the true heading over the whole way, and at its end. NEES is \
         the mean normalised error squared: 3 is expected, less is cautious. Ok is the share of the poses within 2 cm and 0.1 deg.",
    );
    let lines = |line: fn(&Track) -> Vec<(f64, f64)>| drives.iter().map(|drive| line(&drive.track)).collect::<Vec<_>>();
    let (positions, headings) = (lines(position_error_line), lines(heading_error_line));
    page.figure(&position_error_chart(&series(drives, &positions))?, "Distance from the true position over the way.");
    page.figure(&heading_error_chart(&series(drives, &headings))?, "Difference from the true heading over the way.");
    if let Some(drive) = drives.last() {
        page.section(&format!("In full: {}", drive.name));
        add_drive(&mut page, &[], &drive.recording, &drive.replay, &drive.track, &drive.figures)?;
    }
    Ok(page)
}

fn series<'a>(drives: &[LocalisedDrive], lines: &'a [Vec<(f64, f64)>]) -> Vec<Series<'a>> {
    drives.iter().zip(lines).map(|(drive, points)| Series { name: drive.name, points }).collect()
}
