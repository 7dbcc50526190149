//! Where a planar laser is on a vehicle, by transforms in space: upright or upside down, but never tilted.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use agv_core::geometry::Pose as PlanarPose;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

use super::steps::is_orientation;
use crate::account::Account;
use crate::ros::messages::{Pose, Transforms};

/// Largest angle between the plane of the laser and that of the vehicle, rad: distances then err by 0.4 %.
const LARGEST_TILT: f64 = 5.0 * PI / 180.0;

/// Where a laser is, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mounting {
    /// Its pose on the vehicle; the heading is that of its first axis.
    pub pose: PlanarPose,
    /// Whether its bearings grow clockwise, seen from above.
    pub is_upside_down: bool,
    /// Angle between its plane and that of the vehicle, rad.
    pub tilt: f64,
}

impl Mounting {
    /// Whether it looks along the ground.
    pub fn is_level(&self) -> bool {
        self.tilt <= LARGEST_TILT
    }
}

/// The name of a frame without the stroke that old recordings put before it.
pub fn plain(frame: &str) -> &str {
    frame.trim_start_matches('/')
}

/// The name of a frame without the name of its vehicle.
fn own_name(frame: &str) -> &str {
    frame.rsplit('/').next().unwrap_or(frame)
}

/// Whether one of two frames may be the other, of which one is told with the name of its vehicle.
fn is_same(a: &str, b: &str) -> bool {
    let (a, b) = (plain(a), plain(b));
    a == b || (own_name(a) == own_name(b) && (!a.contains('/') || !b.contains('/')))
}

/// Frames of a vehicle, each with that above it and its pose there.
#[derive(Clone, Debug, Default)]
pub struct Frames {
    above: BTreeMap<String, (String, Isometry3<f64>)>,
}

/// Names that the vehicle's own frame has by custom (REP 105, and those of mobile bases).
const BASES: [&str; 3] = ["base_link", "base_footprint", "base"];

impl Frames {
    /// The frames of transforms that never change, of which the last one of a frame counts, and of those of moving ones that did
    /// not move.
    pub fn new(fixed: &Transforms, moving: &Transforms, account: &mut Account) -> Self {
        let mut frames = Self::default();
        let mut moved: BTreeMap<&str, bool> = BTreeMap::new();
        for step in &moving.transforms {
            let child = plain(&step.child_frame_id);
            let place = isometry(&step.transform);
            if let Some((_, before)) =
                frames.above.insert(child.to_owned(), (plain(&step.header.frame_id).to_owned(), place))
            {
                *moved.entry(child).or_default() |= before != place;
            }
        }
        frames.above.retain(|child, _| !moved.get(child.as_str()).is_some_and(|has_moved| *has_moved));
        let mut known: BTreeMap<&str, Isometry3<f64>> = BTreeMap::new();
        for step in &fixed.transforms {
            let child = plain(&step.child_frame_id);
            if !is_orientation(&step.transform.orientation) {
                account.warn(format!("the rotation of the frame {child} is none: it was taken not to be turned"));
            }
            let place = isometry(&step.transform);
            if known.insert(child, place).is_some_and(|before| before != place) {
                account.note(format!("the frame {child} is told at several places: the last one counts"));
            }
            frames.above.insert(child.to_owned(), (plain(&step.header.frame_id).to_owned(), place));
        }
        frames
    }

    fn name(&self, frame: &str) -> Option<&str> {
        let plain = plain(frame);
        let names = || self.above.iter().flat_map(|(child, (parent, _))| [child.as_str(), parent.as_str()]);
        names().find(|name| *name == plain).or_else(|| names().find(|name| is_same(name, plain)))
    }

    /// The frames above one, with its pose in each, from its own on.
    fn chain(&self, frame: &str) -> Vec<(String, Isometry3<f64>)> {
        let mut chain = vec![(frame.to_owned(), Isometry3::identity())];
        // As many steps as there are frames; a ring would never end.
        for _ in 0..self.above.len() {
            let Some((last, place)) = chain.last() else { break };
            let Some((above, step)) = self.above.get(last) else { break };
            let place = step * place;
            chain.push((above.clone(), place));
        }
        chain
    }

    /// Where one frame is in another; the way between them may lead over a frame above both.
    fn between(&self, base: &str, laser: &str) -> Option<Isometry3<f64>> {
        let (base, laser) = (self.name(base)?, self.name(laser)?);
        let (up, down) = (self.chain(laser), self.chain(base));
        up.iter().find_map(|(frame, of_laser)| {
            let (_, of_base) = down.iter().find(|(other, _)| other == frame)?;
            Some(of_base.inverse() * of_laser)
        })
    }

    /// Where the frame `laser` is in the frame `base`, or in what is the vehicle's by custom if no way leads there. None if there is
    /// no way at all.
    pub fn find(&self, base: &str, laser: &str, account: &mut Account) -> Option<Mounting> {
        if is_same(base, laser) {
            return Some(mounting(&Isometry3::identity()));
        }
        if let Some(place) = self.between(base, laser) {
            return Some(mounting(&place));
        }
        let custom = BASES.iter().find_map(|name| Some((name, self.between(name, laser)?)));
        custom.map(|(name, place)| {
            account.note(format!(
                "no transform leads from {base:?} to {laser}: {name} was taken to be the vehicle's frame"
            ));
            mounting(&place)
        })
    }
}

fn isometry(pose: &Pose) -> Isometry3<f64> {
    let (at, turn) = (pose.position, pose.orientation);
    let turn = Quaternion::new(turn.w, turn.x, turn.y, turn.z);
    // What was never filled in turns nothing.
    let turn = UnitQuaternion::try_new(turn, 1e-6).unwrap_or_else(UnitQuaternion::identity);
    Isometry3::from_parts(Translation3::new(at.x, at.y, at.z), turn)
}

fn mounting(place: &Isometry3<f64>) -> Mounting {
    let (ahead, up) = (place.rotation * Vector3::x(), place.rotation * Vector3::z());
    let tilt = up.x.hypot(up.y).atan2(up.z.abs());
    let at = place.translation.vector;
    Mounting { pose: PlanarPose::new(at.x, at.y, ahead.y.atan2(ahead.x)), is_upside_down: up.z < 0.0, tilt }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros::messages::{Header, Quaternion as Turn, TransformStamped, Vector};

    fn find(transforms: Vec<TransformStamped>, base: &str, laser: &str) -> Option<Mounting> {
        let account = &mut Account::default();
        Frames::new(&Transforms { transforms }, &Transforms::default(), account).find(base, laser, account)
    }

    fn step(parent: &str, child: &str, [x, y]: [f64; 2], axis: [f64; 3], angle: f64) -> TransformStamped {
        let (sine, w) = (0.5 * angle).sin_cos();
        let orientation = Turn { x: sine * axis[0], y: sine * axis[1], z: sine * axis[2], w };
        TransformStamped {
            header: Header { frame_id: parent.to_owned(), ..Header::default() },
            child_frame_id: child.to_owned(),
            transform: Pose { position: Vector { x, y, z: 0.4 }, orientation },
        }
    }

    #[test]
    fn what_hangs_from_a_mast_is_where_its_transforms_lead() {
        // Turned by a quarter on the mast, then hung by a roll: the first axis keeps its direction.
        let chain = vec![
            step("/mast", "laser", [0.2, 0.0], [1.0, 0.0, 0.0], PI),
            step("base", "mast", [1.0, 0.5], [0.0, 0.0, 1.0], PI / 2.0),
        ];
        let found = find(chain.clone(), "base", "/laser").unwrap();
        assert!(found.is_upside_down && found.is_level());
        assert!((found.pose.x - 1.0).abs() < 1e-12 && (found.pose.y - 0.7).abs() < 1e-12);
        assert!((found.pose.theta - PI / 2.0).abs() < 1e-12);
        // Hung by a pitch, the first axis looks back.
        let pitched = vec![step("base", "laser", [0.0, 0.0], [0.0, 1.0, 0.0], PI)];
        let found = find(pitched, "base", "laser").unwrap();
        assert!(found.is_upside_down && (found.pose.theta.abs() - PI).abs() < 1e-12);
        assert_eq!(find(chain, "wheel", "camera"), None);
        let tilted = find(vec![step("base", "laser", [0.0; 2], [1.0, 0.0, 0.0], 0.3)], "base", "laser").unwrap();
        assert!(!tilted.is_level() && !tilted.is_upside_down && (tilted.tilt - 0.3).abs() < 1e-12);
    }

    #[test]
    fn frames_are_found_by_the_names_that_vehicles_give_them() {
        let up = [0.0, 0.0, 1.0];
        for (base, laser, steps) in [
            ("agv1/base_link", "agv1/laser", vec![step("base_link", "laser", [0.3, 0.1], up, 0.0)]),
            ("base_link", "laser", vec![step("agv1/base_link", "agv1/laser", [0.3, 0.1], up, 0.0)]),
            // The vehicle's frame below the one that the laser hangs on.
            (
                "base_footprint",
                "laser",
                vec![
                    step("base_link", "base_footprint", [0.0; 2], up, 0.0),
                    step("base_link", "laser", [0.3, 0.1], up, 0.0),
                ],
            ),
            // Nobody says where the frame of the odometry is.
            ("base_footprint", "laser", vec![step("base_link", "laser", [0.3, 0.1], up, 0.0)]),
            ("", "laser", vec![step("base_link", "laser", [0.3, 0.1], up, 0.0)]),
            // The last one counts.
            (
                "base_link",
                "laser",
                vec![step("base_link", "laser", [9.0, 9.0], up, 1.0), step("base_link", "laser", [0.3, 0.1], up, 0.0)],
            ),
        ] {
            let found = find(steps, base, laser).unwrap_or_else(|| panic!("{base} {laser}"));
            assert_eq!((found.pose.x, found.pose.y, found.pose.theta), (0.3, 0.1, 0.0), "{base} {laser}");
        }
        let ring = vec![step("a", "b", [1.0, 0.0], up, 0.0), step("b", "a", [1.0, 0.0], up, 0.0)];
        assert_eq!(find(ring, "base", "b"), None);
    }
}
