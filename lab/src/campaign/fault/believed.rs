//! Faults of what is believed before the vehicle drives.

use agv_core::geometry::{Point, Pose, fit_rigid};
use agv_core::maps::Landmark;
use agv_core::odometry::Vehicle;

use super::{Fault, FaultKind};
use agv_host_sim::recording::{RecordedEvent, Recording};
use agv_host_sim::simulate::random::Random;
use agv_settings::VehicleSettings;

impl Fault {
    /// Makes what the localiser is told before the drive wrong.
    pub fn mislead(&self, recording: &mut Recording, random: &mut Random) {
        if let FaultKind::ReflectorMoved { metres } = self.what {
            move_one(recording, metres, random);
        }
        if let FaultKind::LayoutCutOff { share } = self.what {
            let kept = (1.0 - share) * recording.landmarks.len() as f64;
            recording.landmarks.truncate(libm::ceil(kept) as usize);
        }
        self.move_landmarks(&mut recording.landmarks, random);
        mistake(self.what, &mut recording.parameters.vehicle);
        match self.what {
            FaultKind::MountingWrong { deg, x, y } => {
                let laser = recording.parameters.lasers.first_mut();
                *laser = Pose::new(laser.x + x, laser.y + y, laser.theta + deg.to_radians());
            }
            FaultKind::StartWrong { x, y, deg } => {
                for event in &mut recording.events {
                    if let RecordedEvent::SetPose(fix) = event {
                        fix.pose = fix.pose.compose(&Pose::new(x, y, deg.to_radians()));
                    }
                }
            }
            _ => {}
        }
    }

    /// Makes the map wrong.
    fn move_landmarks(&self, landmarks: &mut [Landmark], random: &mut Random) {
        match self.what {
            FaultKind::ReflectorsMoved { share, metres } => {
                for landmark in landmarks {
                    let (is_moved, angle) = (random.happens(share), random.between(0.0, std::f64::consts::TAU));
                    if is_moved {
                        let (sine, cosine) = libm::sincos(angle);
                        landmark.x += metres * cosine;
                        landmark.y += metres * sine;
                    }
                }
            }
            FaultKind::ReflectorsMovedAlike { share, metres } => {
                let (sine, cosine) = libm::sincos(random.between(0.0, std::f64::consts::TAU));
                for landmark in landmarks {
                    if random.happens(share) {
                        landmark.x += metres * cosine;
                        landmark.y += metres * sine;
                    }
                }
            }
            FaultKind::LayoutSheared { share } => {
                let middle = mean(landmarks.iter().map(|landmark| landmark.y));
                landmarks.iter_mut().for_each(|landmark| landmark.x += share * (landmark.y - middle));
            }
            FaultKind::WallMoved { metres } => {
                let low = landmarks.iter().map(|landmark| landmark.y).fold(f64::INFINITY, f64::min);
                for landmark in landmarks.iter_mut().filter(|landmark| landmark.y < low + NEAR_WALL) {
                    landmark.x += metres;
                }
            }
            FaultKind::LayoutMirrored => {
                let middle = mean(landmarks.iter().map(|landmark| landmark.x));
                landmarks.iter_mut().for_each(|landmark| landmark.x = 2.0 * middle - landmark.x);
            }
            FaultKind::LayoutOfAnotherHall => {
                let mean_y = mean(landmarks.iter().map(|landmark| landmark.y));
                for landmark in landmarks {
                    landmark.x += random.between(-3.0, 3.0);
                    landmark.y = 2.0 * mean_y - landmark.y + random.between(-3.0, 3.0);
                }
            }
            FaultKind::SessionTurned { deg, is_laid } => distort(landmarks, is_laid, |landmarks| {
                let (seam, middle) = seam(landmarks);
                let turn = Pose::new(0.0, 0.0, deg.to_radians());
                let about = Point::new(seam, middle);
                for landmark in landmarks.iter_mut().filter(|landmark| landmark.x > seam) {
                    set(landmark, about + turn.transform(&(landmark.position() - about)));
                }
            }),
            FaultKind::SessionShifted { metres, is_laid } => {
                let (sine, cosine) = libm::sincos(random.between(0.0, std::f64::consts::TAU));
                let shift = Point::new(cosine, sine) * metres;
                distort(landmarks, is_laid, |landmarks| {
                    let (seam, _) = seam(landmarks);
                    for landmark in landmarks.iter_mut().filter(|landmark| landmark.x > seam) {
                        set(landmark, landmark.position() + shift);
                    }
                });
            }
            FaultKind::LayoutBent { metres, is_laid } => distort(landmarks, is_laid, |landmarks| {
                let xs = || landmarks.iter().map(|landmark| landmark.x);
                let (least, most) = (xs().fold(f64::INFINITY, f64::min), xs().fold(f64::NEG_INFINITY, f64::max));
                let half = (0.5 * (most - least)).max(1e-9);
                for landmark in landmarks {
                    let along = (landmark.x - least) / half - 1.0;
                    landmark.y += metres * (1.0 - along * along);
                }
            }),
            FaultKind::LayoutStretched { share } => {
                let middle = mean(landmarks.iter().map(|landmark| landmark.x));
                landmarks.iter_mut().for_each(|landmark| landmark.x += share * (landmark.x - middle));
            }
            _ => {}
        }
    }
}

/// Where a second session began: the middle of the layout, W, m.
fn seam(landmarks: &[Landmark]) -> (f64, f64) {
    (mean(landmarks.iter().map(|landmark| landmark.x)), mean(landmarks.iter().map(|landmark| landmark.y)))
}

fn set(landmark: &mut Landmark, place: Point) {
    (landmark.x, landmark.y) = (place.x, place.y);
}

/// Distorts a layout, and lays it onto where it was, as well as it fits, if that is wanted.
fn distort(landmarks: &mut [Landmark], is_laid: bool, change: impl FnOnce(&mut [Landmark])) {
    let before: Vec<Point> = landmarks.iter().map(Landmark::position).collect();
    change(landmarks);
    if !is_laid {
        return;
    }
    let after: Vec<Point> = landmarks.iter().map(Landmark::position).collect();
    let pairs = after.iter().zip(&before).map(|(place, onto)| (*place, *onto, 1.0));
    if let Some(laid) = fit_rigid(pairs) {
        landmarks.iter_mut().zip(&after).for_each(|(landmark, place)| set(landmark, laid.pose.transform(place)));
    }
}

/// Makes what is believed of the vehicle wrong; of one with several steered wheels the first.
fn mistake(what: FaultKind, vehicle: &mut Vehicle) {
    let mut settings = VehicleSettings::of(vehicle);
    match what {
        FaultKind::SteeringOffsetWrong { deg } => {
            settings.steering_offset_forward += deg.to_radians();
            settings.steering_offset_backward += deg.to_radians();
            settings.wheels[0].steering_offset += deg.to_radians();
        }
        FaultKind::WheelbaseWrong { metres } => settings.wheelbase += metres,
        FaultKind::DriveScaleWrong { share } => {
            settings.drive_scale *= 1.0 + share;
            settings.wheels.iter_mut().for_each(|wheel| wheel.scale *= 1.0 + share);
        }
        _ => return,
    }
    *vehicle = settings.vehicle();
}

/// Moves one of the reflectors that stand nearest to a place of the way.
fn move_one(recording: &mut Recording, metres: f64, random: &mut Random) {
    let place = (random.uniform() * recording.truth.len() as f64) as usize;
    let (chosen, angle) = (random.uniform(), random.between(0.0, std::f64::consts::TAU));
    let Some(here) = recording.truth.get(place).map(|truth| truth.pose.position()) else { return };
    recording.landmarks.sort_by(|a, b| (a.position() - here).norm().total_cmp(&(b.position() - here).norm()));
    let near = recording.landmarks.len().min(NEAREST);
    let (sine, cosine) = libm::sincos(angle);
    if let Some(landmark) = recording.landmarks.get_mut((chosen * near as f64) as usize) {
        landmark.x += metres * cosine;
        landmark.y += metres * sine;
    }
}

/// The one that is moved is among so many.
const NEAREST: usize = 5;

/// Reflectors no further than this from the lowest of the map, m, are on one wall.
const NEAR_WALL: f64 = 1.0;

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = values.fold((0.0, 0.0), |(count, sum), value| (count + 1.0, sum + value));
    sum / f64::max(count, 1.0)
}
