//! A vehicle and its maps, as sound as the service port lets them be.

use agv_core::geometry::Pose;
use agv_core::localizer::{MapUse, Parameters};
use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::odometry::{Ackermann, Integration, Vehicle};
use agv_core::sensing::{ReflectorDetection, falko};
use agv_settings::leaf::Value;
use agv_settings::{LEAVES, Settings};

use super::dice::{Dice, Source};

/// The default settings, or each drawn from all that may be set.
fn settings(dice: &mut Dice<impl Source>) -> Settings {
    let mut settings = Settings::default();
    let share = [255, 20, 4, 1][usize::from(dice.below(4))];
    for leaf in &LEAVES {
        if share == 255 || !dice.once_in(share) {
            continue;
        }
        let (least, most) = leaf.bounds;
        let number = match dice.below(8) {
            0 => least,
            1 => most,
            // Bounds are often powers of ten apart, so as many small numbers as large ones.
            2..=4 => least + (most - least) * dice.between(-9.0, 0.0).exp2().powi(3),
            _ => dice.between(least, most),
        };
        let value = match leaf.value(&settings) {
            Value::Number(_) => Value::Number(number.clamp(least, most)),
            Value::Whole(_) => Value::Whole(number.clamp(least, most) as u64),
            Value::Switch(_) => Value::Switch(dice.once_in(2)),
            Value::Address(_) => continue,
        };
        // What does not fit stays as it was.
        let _ = leaf.set(&mut settings, value);
    }
    settings
}

/// Parameters: those of drawn settings, and what no setting reaches.
pub fn parameters(dice: &mut Dice<impl Source>) -> Parameters {
    let mut parameters = settings(dice).parameters;
    match dice.below(8) {
        0 => parameters.vehicle = Vehicle::Increments,
        1 => {
            let (wheelbase, encoder_offset) = (dice.between(0.5, 3.0), dice.between(-0.8, 0.8));
            parameters.vehicle = Vehicle::Ackermann(Ackermann { wheelbase, encoder_offset });
        }
        _ => {}
    }
    if dice.once_in(3) {
        parameters.integration = Integration::Arc;
    }
    if dice.once_in(3) {
        *parameters.lasers.first_mut() =
            Pose::new(dice.between(-2.0, 2.0), dice.between(-2.0, 2.0), dice.between(-3.2, 3.2));
    }
    parameters.maps = MapUse {
        reflectors: !dice.once_in(4),
        features: !dice.once_in(4),
        dynamic: dice.once_in(2),
        slam: dice.once_in(3),
    };
    parameters.features.detector = match dice.below(5) {
        0 => falko::Parameters::thesis(),
        1 => falko::Parameters::reference(),
        _ => parameters.features.detector,
    };
    if dice.once_in(2) {
        parameters.reflectors.detection = Some(ReflectorDetection::default());
    }
    parameters.sources.key_scans = !dice.once_in(3);
    parameters.sources.corners = !dice.once_in(8);
    parameters.sources.end_points = !dice.once_in(8);
    if dice.once_in(4) {
        parameters.dynamic_map.deviation = dice.between(0.0, 0.2);
        parameters.dynamic_map.first_hits = u16::from(dice.below(4));
        parameters.dynamic_map.most_hits = u16::from(dice.byte());
    }
    parameters
}

/// Half the size of the hall, m.
pub const HALL: (f64, f64) = (12.0, 8.0);
/// Corners of the boxes in it, W, m: low and high.
pub const BOXES: [[f64; 4]; 4] =
    [[-6.0, -4.0, -4.5, -2.0], [3.0, 2.5, 6.0, 4.0], [-2.0, 5.0, 0.0, 6.5], [7.5, -6.0, 8.0, -5.5]];

/// The reflectors of the hall, on its walls.
pub fn reflectors() -> impl Iterator<Item = Landmark> + Clone {
    (0..24_u16).map(|id| {
        let along = f64::from(id / 4) * 3.7 - 9.5 + f64::from(id % 5) * 0.31;
        let (x, y) = match id % 4 {
            0 => (along, HALL.1),
            1 => (along, -HALL.1),
            2 => (HALL.0, along * 0.6),
            _ => (-HALL.0, along * 0.6),
        };
        Landmark { id, kind: LandmarkKind::Reflector, x, y, deviation: 0.002 }
    })
}

/// A map: that of the hall, with what may be wrong in it.
pub fn landmarks(dice: &mut Dice<impl Source>) -> Vec<Landmark> {
    let corners = BOXES
        .iter()
        .flat_map(|[left, low, right, high]| [(*left, *low), (*right, *low), (*right, *high), (*left, *high)]);
    let corners =
        corners.zip(100..).map(|((x, y), id)| Landmark { id, kind: LandmarkKind::Corner, x, y, deviation: 0.01 });
    let mut landmarks: Vec<Landmark> = reflectors().chain(corners).collect();
    match dice.below(6) {
        0 => landmarks.clear(),
        1 => landmarks.retain(|landmark| landmark.id % 3 == 0),
        // The same again, at the same places and a little beside.
        2 => {
            let shifts = [0.0, dice.between(-0.1, 0.1)];
            let again = landmarks.clone();
            landmarks.extend(again.iter().zip(shifts.iter().cycle()).map(|(landmark, shift)| Landmark {
                id: landmark.id + 1000,
                x: landmark.x + shift,
                ..*landmark
            }));
        }
        3 => {
            for _ in 0..dice.below(40) {
                let (x, y) = (dice.between(-200.0, 200.0), dice.between(-200.0, 200.0));
                let (x, y) = (dice.maybe_strange(x, 4), dice.maybe_strange(y, 4));
                let kind = if dice.once_in(2) { LandmarkKind::Reflector } else { LandmarkKind::Corner };
                let deviation = dice.between(0.0, 0.1);
                let deviation = dice.maybe_strange(deviation, 4) as f32;
                landmarks.push(Landmark { id: dice.word() as u16, kind, x, y, deviation });
            }
        }
        _ => {}
    }
    landmarks
}
