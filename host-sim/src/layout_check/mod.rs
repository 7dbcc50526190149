//! What a layout of reflectors is good for: where a vehicle that is switched on finds itself, how well its pose is
//! determined, and which reflectors stand in each other's way.

mod arrangement;
mod determination;
mod page;

pub use arrangement::{ClosePair, Mirror, close_pairs, mirrors};
pub use determination::{Determination, determination};
pub use page::{Plan, page};

use std::collections::BTreeMap;

use agv_core::geometry::{Point, Pose};
use agv_core::localizer::ReflectorParameters;
use agv_core::maps::{FixedMap, Landmark, MapError};
use agv_core::relocalization::{
    IndexedReflectors, ReflectorAnswer, ReflectorIndex, ReflectorNoise, ReflectorRelocalizer, ReflectorSnapshot,
    RelocalizationParameters, RelocalizationProgress,
};
use rayon::prelude::*;
use serde::Serialize;

use crate::accuracy::Spread;

/// Most reflectors of a layout.
pub const REFLECTORS: usize = 1024;
/// Layouts are no wider, m: halls and yards reach some hundred metres.
pub const WIDEST: f64 = 3000.0;
/// Places that are looked at, at the most.
pub const PLACES: usize = 100_000;

/// Why a layout cannot be checked.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CheckError {
    /// There are too many reflectors.
    #[error("it has {found} reflectors, and {REFLECTORS} can be checked")]
    TooMany {
        /// How many there are.
        found: usize,
    },
    /// A reflector is nowhere.
    #[error("the place of a reflector is no number")]
    NotFinite,
    /// It is wider than any.
    #[error(
        "its reflectors are {extent:.0} m apart, and layouts reach {WIDEST:.0} m: are they in millimetres? Metres are wanted"
    )]
    TooWide {
        /// Its longer side, m.
        extent: f64,
    },
    /// There is too much to look at.
    #[error(
        "{places} places {spacing} m apart are too many: {PLACES} can be looked at. Is the layout of {x:.0} m by {y:.0} m in \
         millimetres? Otherwise --spacing {wanted:.0}"
    )]
    TooManyPlaces {
        /// How many there would be.
        places: u64,
        /// How far they are apart, m.
        spacing: f64,
        /// Extent of the layout, m.
        x: f64,
        /// Extent of the layout, m.
        y: f64,
        /// Distance with which there are few enough, m.
        wanted: f64,
    },
}

/// What is assumed of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CheckOptions {
    /// Distance between the places that are looked at, m.
    pub spacing: f64,
    /// Farthest reflector that is seen, m.
    pub farthest: f64,
    /// Most reflectors that are seen at once, the nearest ones: walls and racks hide others, which a layout does not say.
    pub most_seen: usize,
    /// Reflectors that are closer to each other than this may be taken for one, m.
    pub closest: f64,
    /// How well reflectors are seen.
    pub noise: ReflectorParameters,
}

/// What was found at one place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "answer")]
pub enum Finding {
    /// A vehicle there finds itself.
    Unique,
    /// It may as well be elsewhere; the pose there of a vehicle that faces along the first axis here.
    Resembles {
        /// Position, m.
        x_m: f64,
        /// Position, m.
        y_m: f64,
        /// Heading, deg.
        heading_deg: f64,
    },
    /// Too few reflectors are seen there.
    TooFew,
    /// The search finds nothing there.
    Unknown,
}

/// One place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CheckedPlace {
    /// Position, m.
    pub x_m: f64,
    /// Position, m.
    pub y_m: f64,
    /// Reflectors seen there.
    pub seen: usize,
    /// Expected standard deviation of the position along its worst axis, m; None if nothing determines it.
    pub position_deviation_m: Option<f64>,
    /// The same of the heading, deg.
    pub heading_deviation_deg: Option<f64>,
    /// What was found.
    #[serde(flatten)]
    pub finding: Finding,
}

/// A movement of the layout that puts reflectors on reflectors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Resemblance {
    /// Turn about the origin of W, deg, to whole degrees.
    pub turn_deg: f64,
    /// Shift after the turn, m.
    pub shift_m: [f64; 2],
    /// Places at which this movement cannot be told from standing still.
    pub places: usize,
}

/// The outcome of a check.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    /// Number of reflectors.
    pub reflectors: usize,
    /// Places that were looked at.
    pub places: usize,
    /// Share of them where a vehicle finds itself.
    pub unique_share: f64,
    /// Share of them where the layout resembles itself.
    pub ambiguous_share: f64,
    /// Share of them with too few reflectors.
    pub too_few_share: f64,
    /// By what movements the layout resembles itself, the commonest first.
    pub resemblances: Vec<Resemblance>,
    /// Median over the places of the expected standard deviation of the position, m; None if few are determined.
    pub median_deviation_m: Option<f64>,
    /// Pairs of reflectors that are too close to each other.
    pub close_pairs: Vec<ClosePair>,
    /// Lines about which the layout is its own mirror image.
    pub mirrors: Vec<Mirror>,
    /// All places where a vehicle does not find itself.
    pub problems: Vec<CheckedPlace>,
    /// All places.
    #[serde(skip)]
    pub looked: Vec<CheckedPlace>,
}

impl Check {
    /// The figures: name and value.
    #[must_use]
    pub fn rows(&self) -> Vec<Vec<String>> {
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        let deviation = self.median_deviation_m.map_or("-".to_owned(), |median| format!("{:.1} mm", 1e3 * median));
        let rows = [
            ("reflectors", self.reflectors.to_string()),
            ("places", self.places.to_string()),
            ("unique", percent(self.unique_share)),
            ("ambiguous", percent(self.ambiguous_share)),
            ("too few seen", percent(self.too_few_share)),
            ("expected deviation, median", deviation),
        ];
        rows.into_iter().map(|(name, value)| vec![name.to_owned(), value]).collect()
    }

    /// What somebody should look at, in sentences.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let close = self.close_pairs.iter().map(|ClosePair { reflectors: [first, second], distance_m }| {
            format!("reflectors number {first} and {second} are only {distance_m:.2} m apart and may be taken for one")
        });
        let mirrored = self.mirrors.iter().map(|Mirror { point_m: [x, y], direction_deg, reflectors }| {
            format!(
                "{reflectors} reflectors are mirror images of each other about the line through ({x:.1}, {y:.1}) m at \
                 {direction_deg:.0}°"
            )
        });
        let resembling = self.resemblances.iter().map(|Resemblance { turn_deg, shift_m: [x, y], places }| {
            format!("resembles itself turned by {turn_deg:.0}° and shifted by ({x:.1}, {y:.1}) m, at {places} places")
        });
        close.chain(mirrored).chain(resembling).collect()
    }
}

/// Looks at places on a grid over the layout, with what a vehicle would see there without noise, and asks whether it could
/// be elsewhere.
///
/// # Errors
/// [`CheckError`].
pub fn check(positions: &[Point], options: &CheckOptions) -> Result<Check, CheckError> {
    check_extent(positions, options.spacing)?;
    let (mut map, mut index) = (Box::new(FixedMap::<REFLECTORS>::new()), Box::new(ReflectorIndex::<4096>::new()));
    let reflectors: Vec<Landmark> =
        (0..).zip(positions).map(|(id, position)| Landmark::reflector(id, *position, 0.0)).collect();
    map.extend(&reflectors).map_err(|error| match error {
        MapError::NotFinite => CheckError::NotFinite,
        _ => CheckError::TooMany { found: positions.len() },
    })?;
    index.build(map.view());
    let map = index.of(map.view());
    let places = grid(positions, options.spacing);
    let looked: Vec<CheckedPlace> = places
        .par_iter()
        .map_init(
            || Box::new(ReflectorRelocalizer::<64>::new(RelocalizationParameters::default())),
            |relocalizer, place| look(place, positions, options, &map, relocalizer),
        )
        .collect();
    let share = |is: fn(&Finding) -> bool| {
        looked.iter().filter(|place| is(&place.finding)).count() as f64 / looked.len().max(1) as f64
    };
    Ok(Check {
        reflectors: positions.len(),
        places: looked.len(),
        unique_share: share(|finding| *finding == Finding::Unique),
        ambiguous_share: share(|finding| matches!(finding, Finding::Resembles { .. })),
        too_few_share: share(|finding| *finding == Finding::TooFew),
        resemblances: resemblances(&looked),
        median_deviation_m: median(looked.iter().map(|place| place.position_deviation_m.unwrap_or(f64::INFINITY))),
        close_pairs: close_pairs(positions, options.closest),
        mirrors: mirrors(positions),
        problems: looked.iter().filter(|place| place.finding != Finding::Unique).copied().collect(),
        looked,
    })
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let median = Spread::of(values).median;
    median.is_finite().then_some(median)
}

/// Whether the grid over the layout is one that can be looked at.
fn check_extent(positions: &[Point], spacing: f64) -> Result<(), CheckError> {
    if positions.iter().any(|position| !(position.x.is_finite() && position.y.is_finite())) {
        return Err(CheckError::NotFinite);
    }
    if positions.is_empty() {
        return Ok(());
    }
    let (low, high) = rectangle(positions);
    let (x, y) = (high.x - low.x, high.y - low.y);
    if x.max(y) > WIDEST {
        return Err(CheckError::TooWide { extent: x.max(y) });
    }
    let places = ((x / spacing).floor() + 1.0) * ((y / spacing).floor() + 1.0);
    if places > PLACES as f64 {
        let wanted = (x * y / PLACES as f64).sqrt().max(x.max(y) / PLACES as f64).ceil() + 1.0;
        return Err(CheckError::TooManyPlaces { places: places as u64, spacing, x, y, wanted });
    }
    Ok(())
}

fn rectangle(positions: &[Point]) -> (Point, Point) {
    let low = positions.iter().fold(Point::repeat(f64::INFINITY), |low, position| low.inf(position));
    let high = positions.iter().fold(Point::repeat(f64::NEG_INFINITY), |high, position| high.sup(position));
    (low, high)
}

/// Places over the rectangle around the reflectors.
fn grid(positions: &[Point], spacing: f64) -> Vec<Point> {
    let (low, high) = rectangle(positions);
    let steps = |axis: usize| ((high[axis] - low[axis]) / spacing).max(0.0) as usize;
    if positions.is_empty() {
        return Vec::new();
    }
    let (columns, rows) = (steps(0), steps(1));
    // The grid stands in the middle of the rectangle.
    let start =
        Point::new(0.5 * (low.x + high.x - columns as f64 * spacing), 0.5 * (low.y + high.y - rows as f64 * spacing));
    let place = |column: usize, row: usize| start + Point::new(column as f64 * spacing, row as f64 * spacing);
    (0..=columns).flat_map(|column| (0..=rows).map(move |row| place(column, row))).collect()
}

fn look(
    place: &Point,
    positions: &[Point],
    options: &CheckOptions,
    map: &IndexedReflectors,
    relocalizer: &mut ReflectorRelocalizer<64>,
) -> CheckedPlace {
    let mut near: Vec<_> = positions
        .iter()
        .map(|position| ((position - place).norm(), position))
        .filter(|(distance, _)| *distance <= options.farthest)
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    near.truncate(options.most_seen);
    let mut snapshot = ReflectorSnapshot::<64>::new();
    for (distance, position) in &near {
        snapshot.see(&(*position - place), *distance, &ReflectorNoise::default());
    }
    relocalizer.begin(&snapshot, map);
    let answer = loop {
        if let RelocalizationProgress::Done(answer) = relocalizer.advance(map, u32::MAX) {
            break answer;
        }
    };
    let here = Pose::new(place.x, place.y, 0.0);
    let finding = match answer {
        ReflectorAnswer::Found(_) => Finding::Unique,
        ReflectorAnswer::Ambiguous(one, other) => {
            let apart = |pose: &Pose| here.between(pose).position().norm() + here.between(pose).theta.abs();
            let elsewhere = if apart(&one.pose) > apart(&other.pose) { one.pose } else { other.pose };
            Finding::Resembles { x_m: elsewhere.x, y_m: elsewhere.y, heading_deg: elsewhere.theta.to_degrees() }
        }
        ReflectorAnswer::TooFew => Finding::TooFew,
        ReflectorAnswer::Unknown => Finding::Unknown,
    };
    let seen: Vec<Point> = near.iter().map(|(_, position)| **position).collect();
    let expected = determination(place, &seen, &options.noise);
    CheckedPlace {
        x_m: place.x,
        y_m: place.y,
        seen: seen.len(),
        position_deviation_m: expected.map(|expected| expected.position),
        heading_deviation_deg: expected.map(|expected| expected.heading.to_degrees()),
        finding,
    }
}

/// Movements that differ by less than a degree and half a metre are one.
fn resemblances(looked: &[CheckedPlace]) -> Vec<Resemblance> {
    let mut found: BTreeMap<(i64, i64, i64), usize> = BTreeMap::new();
    for place in looked {
        if let Finding::Resembles { x_m, y_m, heading_deg } = place.finding {
            let turn = heading_deg.round().rem_euclid(360.0);
            let (sine, cosine) = turn.to_radians().sin_cos();
            let moved = (cosine * place.x_m - sine * place.y_m, sine * place.x_m + cosine * place.y_m);
            let shift = ((x_m - moved.0) * 2.0, (y_m - moved.1) * 2.0);
            *found.entry((turn as i64, shift.0.round() as i64, shift.1.round() as i64)).or_default() += 1;
        }
    }
    let mut found: Vec<_> = found
        .into_iter()
        .map(|((turn, x, y), places)| Resemblance {
            turn_deg: turn as f64,
            shift_m: [0.5 * x as f64, 0.5 * y as f64],
            places,
        })
        .collect();
    found.sort_by_key(|resemblance| std::cmp::Reverse(resemblance.places));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPTIONS: CheckOptions = CheckOptions {
        spacing: 4.0,
        farthest: 30.0,
        most_seen: 12,
        closest: 0.5,
        noise: ReflectorParameters { range_deviation: 0.01, bearing_deviation: 0.001, detection: None },
    };

    /// Reflectors at irregular places of a hall of 40 x 20 m.
    fn irregular() -> Vec<Point> {
        (0..24_u32)
            .map(|number| {
                let (x, y) = (f64::from(number * 37 % 41), f64::from(number * number * 13 % 21));
                Point::new(x + 0.13 * f64::from(number % 7), y + 0.17 * f64::from(number % 5))
            })
            .collect()
    }

    #[test]
    fn an_irregular_layout_is_unique() {
        let check = check(&irregular(), &OPTIONS).unwrap();
        assert_eq!(check.unique_share, 1.0, "{:?}", check.problems);
    }

    #[test]
    fn a_layout_with_a_turned_copy_of_itself_resembles_itself_by_that_turn() {
        let mut positions = irregular();
        positions.extend(irregular().iter().map(|position| Point::new(50.0, 60.0) - position));
        let check = check(&positions, &OPTIONS).unwrap();
        assert_eq!(check.ambiguous_share, 1.0);
        let first = check.resemblances[0];
        assert_eq!((first.turn_deg, first.shift_m, first.places), (180.0, [50.0, 60.0], check.places));
    }

    #[test]
    fn a_layout_in_millimetres_is_asked_about_and_never_laid_out() {
        for factor in [1000.0, 70.0] {
            // The second one is of some kilometres, which a grid of 4 m could cover.
            let wide: Vec<Point> = irregular().iter().map(|position| factor * position).collect();
            let problem = check(&wide, &OPTIONS).map(|_| ()).unwrap_err().to_string();
            assert!(problem.contains("millimetres"), "{problem}");
        }
        let nowhere = [Point::new(0.0, f64::NAN), Point::new(1.0, 2.0)];
        assert_eq!(check(&nowhere, &OPTIONS).map(|_| ()).unwrap_err(), CheckError::NotFinite);
        // The spacing that is named does.
        let fine = CheckOptions { spacing: 0.01, ..OPTIONS };
        let Err(CheckError::TooManyPlaces { wanted, .. }) = check(&irregular(), &fine) else { panic!() };
        assert!(check(&irregular(), &CheckOptions { spacing: wanted, ..OPTIONS }).is_ok());
    }

    #[test]
    fn three_reflectors_are_too_few() {
        let check = check(&irregular()[..3], &OPTIONS).unwrap();
        assert_eq!(check.too_few_share, 1.0);
    }
}
