//! What the PARAM lines of a CARMEN log say of its lasers: resolution, field of view, place.
//!
//! Names are those of CARMEN (`laser_front_laser_resolution`) or of a robot (`p3dx_front_laser_resolution`,
//! `robot_frontlaser_offset`): what matters is how they end.

use std::f64::consts::PI;

use agv_core::geometry::Pose;

use crate::account::Account;

/// What is said of one laser.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct LaserParameters {
    /// Angle between beams, rad.
    resolution: Option<f64>,
    /// Angle between the first beam and the last, rad.
    field_of_view: Option<f64>,
    /// Where it is on the robot.
    pub(super) place: Pose,
    /// Whether anything was said of that.
    pub(super) has_place: bool,
}

/// What the names of a laser's parameters have before the parameter.
const NAMES: [[&str; 2]; 2] = [["front_laser", "frontlaser"], ["rear_laser", "rearlaser"]];

/// Resolutions are written with two or three digits: what is so near to half a turn is half a turn, as a share of it.
const ROUNDED: f64 = 0.011;

/// Numbers of beams of scanners that see half a turn, in degrees, halves, or both with both ends.
const HALF_TURN: [usize; 4] = [180, 181, 360, 361];

impl LaserParameters {
    /// What is said first of the front laser and of the rear one.
    pub(super) fn first(text: &str) -> [Self; 2] {
        let mut lasers = [Self::default(); 2];
        // The first line that says something counts for the scans before it.
        let lines: Vec<&str> = text.lines().filter(|line| line.starts_with("PARAM ")).collect();
        lines.iter().rev().for_each(|line| Self::take(&mut lasers, line));
        lasers
    }

    /// Takes a line.
    pub(super) fn take(lasers: &mut [Self; 2], line: &str) {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        for (laser, names) in lasers.iter_mut().zip(NAMES) {
            let value = |parameter: &str| {
                let is_it = |word: &str| {
                    names.iter().any(|name| word.strip_suffix(parameter).is_some_and(|rest| rest.ends_with(name)))
                };
                let [_, value] = words.windows(2).find(|pair| is_it(pair[0]))? else { return None };
                value.parse::<f64>().ok().filter(|value| value.is_finite())
            };
            let angle = |parameter: &str| value(parameter).filter(|value| *value > 0.0).map(f64::to_radians);
            laser.resolution = angle("_resolution").or(laser.resolution);
            laser.field_of_view = angle("_fov").or(laser.field_of_view);
            let place = [value("_offset"), value("_side_offset"), value("_angular_offset")];
            let [x, y, theta] = place;
            laser.has_place |= place.iter().any(Option::is_some);
            let before = laser.place;
            laser.place = Pose::new(x.unwrap_or(before.x), y.unwrap_or(before.y), theta.unwrap_or(before.theta));
        }
    }

    /// Bearing of the first of that many beams, and the step between them, rad. An odd number measures both ends of the field of view.
    /// What is `stated` counts more than what the log says; where nobody says anything, it is half a turn.
    pub(super) fn beams(&self, beams: usize, stated: Option<f64>, account: &mut Account) -> (f64, f64) {
        let steps = (if beams % 2 == 1 { beams - 1 } else { beams }).max(1) as f64;
        let logged = self.field_of_view.or(self.resolution.map(|resolution| resolution * steps));
        let field = match stated.or(logged) {
            Some(field) if (field / PI - 1.0).abs() < ROUNDED => PI,
            Some(field) => field,
            None => {
                if !HALF_TURN.contains(&beams) && beams > 0 {
                    account.warn(format!(
                        "no PARAM says which field of view the {beams} beams have: half a turn was assumed; state it with \
                         --field-of-view DEG"
                    ));
                } else {
                    account.note("no PARAM says which field of view the laser has: half a turn was assumed");
                }
                PI
            }
        };
        if field > 2.0 * PI * (1.0 + ROUNDED) {
            account.warn(format!(
                "the resolution of the log gives {beams} beams a field of view of {:.0} deg: state the right one with --field-of-view \
                 DEG",
                field.to_degrees()
            ));
        }
        (-0.5 * field, field / steps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beams(text: &str, beams: usize, stated: Option<f64>) -> (f64, f64, Vec<String>) {
        let mut account = Account::default();
        let (first, step) = LaserParameters::first(text)[0].beams(beams, stated, &mut account);
        (first.to_degrees(), step.to_degrees(), account.warnings())
    }

    #[test]
    fn the_field_of_view_is_what_the_log_says_by_any_of_its_names() {
        for (text, count, first, step) in [
            ("PARAM laser_front_laser_resolution 0.5\n", 541, -135.0, 0.5),
            ("PARAM laser_front_laser_resolution 0.5 nohost 0\n", 360, -90.0, 0.5),
            ("PARAM p3dx_front_laser_resolution 0.25\n", 1081, -135.0, 0.25),
            ("PARAM laser_frontlaser_resolution 1 0.0 nohost 0\n", 180, -90.0, 1.0),
            ("PARAM laser_front_laser_fov 240\n", 683, -120.0, 240.0 / 682.0),
            ("PARAM laser_front_laser_resolution 0.33\n", 541, -90.0, 1.0 / 3.0),
            ("PARAM laser_front_laser_resolution 1\n", 360, -180.0, 1.0),
            ("PARAM laser_rear_laser_resolution 0.5\n", 181, -90.0, 1.0),
            ("", 361, -90.0, 0.5),
        ] {
            let found = beams(text, count, None);
            assert!((found.0 - first).abs() < 1e-9 && (found.1 - step).abs() < 1e-9, "{text}: {found:?}");
            assert!(found.2.is_empty(), "{text}: {found:?}");
        }
    }

    #[test]
    fn an_odd_number_of_beams_without_a_word_is_a_doubt_and_can_be_stated() {
        assert_eq!(beams("", 541, None).2.len(), 1);
        let stated = beams("", 541, Some(1.5 * PI));
        assert!((stated.0 + 135.0).abs() < 1e-9 && (stated.1 - 0.5).abs() < 1e-9 && stated.2.is_empty());
        assert_eq!(beams("PARAM laser_front_laser_resolution 1\n", 541, None).2.len(), 1);
    }
}
