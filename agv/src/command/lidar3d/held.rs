//! Which parameters of which lasers a calibration left at the factory's values, and how well points are known.

use agv_lidar3d::geometry::Offsets;
use agv_lidar3d::intrinsic::{Adjustment, Held};
use serde::Serialize;
use serde_json::{Value, json};

/// Distances at which points are judged, m.
const DISTANCES: [f64; 3] = [5.0, 10.0, 20.0];

/// A parameter: its name, its key in JSON, and whether it is held.
type Parameter = (&'static str, &'static str, fn(&Held) -> bool);

const PARAMETERS: [Parameter; 5] = [
    ("D_corr", "distance", |held| held.distance),
    ("theta", "elevation", |held| held.elevation),
    ("alpha", "rotation", |held| held.rotation),
    ("V_o", "vertical_offset", |held| held.vertical_offset),
    ("H_o", "horizontal_offset", |held| held.horizontal_offset),
];

/// Root mean square deviation of the points that the lasers see at a distance, m.
#[derive(Serialize)]
pub struct PointDeviation {
    /// m.
    distance_m: f64,
    /// m.
    deviation_m: f64,
}

/// By parameter, the lasers at which it is held.
fn lasers(found: &Adjustment) -> impl Iterator<Item = (&'static str, &'static str, Vec<usize>)> {
    let of_parameter = |(name, key, is_held): Parameter| {
        let lasers = (0..found.lasers.len()).filter(|laser| is_held(&found.held(*laser))).collect();
        (name, key, lasers)
    };
    PARAMETERS.into_iter().map(of_parameter)
}

/// As JSON: by parameter, the lasers at which it is held.
pub fn object(found: &Adjustment) -> Value {
    lasers(found).map(|(_, key, lasers)| (key.to_owned(), json!(lasers))).collect::<serde_json::Map<_, _>>().into()
}

/// For people: a row a parameter that is held anywhere.
pub fn rows(found: &Adjustment) -> Vec<[String; 2]> {
    let row = |(name, _, lasers): (&str, &str, Vec<usize>)| {
        let listed = if lasers.len() == found.lasers.len() {
            "all lasers".to_owned()
        } else {
            format!("lasers {}", lasers.iter().map(usize::to_string).collect::<Vec<_>>().join(" "))
        };
        (!lasers.is_empty()).then(|| [format!("{name} as at the factory"), listed])
    };
    lasers(found).filter_map(row).collect()
}

/// How well the points of the lasers are known.
pub fn point_deviations(found: &Adjustment, offsets: Offsets) -> Vec<PointDeviation> {
    let at = |distance: f64| {
        let known = (0..found.lasers.len()).filter_map(|laser| found.point_deviation(laser, offsets, distance));
        let (sum, count) = known.fold((0.0, 0), |(sum, count), deviation| (sum + deviation * deviation, count + 1));
        PointDeviation { distance_m: distance, deviation_m: (sum / f64::from(count.max(1))).sqrt() }
    };
    DISTANCES.map(at).into()
}

/// The same for people.
pub fn point_row(deviations: &[PointDeviation]) -> [String; 2] {
    let one = |known: &PointDeviation| format!("{:.1} mm at {} m", 1000.0 * known.deviation_m, known.distance_m);
    ["points known to".to_owned(), deviations.iter().map(one).collect::<Vec<_>>().join(", ")]
}
