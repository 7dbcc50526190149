//! One colour and one symbol for each kind of thing, in every picture; the viewer's page has the same (`view/page/map.js`).

use plotters::style::RGBColor;

use super::figure::{Shape, colour};

/// How a kind is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Look {
    pub colour: RGBColor,
    pub shape: Shape,
    /// Width of a path, pixels.
    pub width: u32,
}

const fn look(red: u8, green: u8, blue: u8, shape: Shape, width: u32) -> Look {
    Look { colour: RGBColor(red, green, blue), shape, width }
}

/// Names of the kinds, and how each looks. Colours that people with any common colour blindness tell apart (M. Okabe, K. Ito, 2008).
const KINDS: [(&str, Look); 12] = [
    ("reflectors", look(0, 114, 178, Shape::Disc, 2)),
    ("corners", look(0, 158, 115, Shape::Square, 2)),
    ("end points", look(0, 0, 0, Shape::Triangle, 2)),
    ("found while driving", look(0, 158, 115, Shape::Frame, 2)),
    ("estimated", look(204, 121, 167, Shape::Disc, 2)),
    ("true", look(110, 110, 110, Shape::Disc, 5)),
    ("references, of the laser", look(110, 110, 110, Shape::Disc, 5)),
    (FIT_TO_DOCK, look(0, 158, 115, Shape::Disc, 3)),
    (FIT_TO_TRAVEL, look(230, 159, 0, Shape::Disc, 3)),
    (NOT_FIT, look(213, 94, 0, Shape::Disc, 3)),
    (NO_POSE, look(150, 150, 150, Shape::Disc, 3)),
    ("rejected", look(213, 94, 0, Shape::Cross, 2)),
];

/// What the level of a piece of a way allows.
pub const FIT_TO_DOCK: &str = "fit to travel and to dock";
/// The same.
pub const FIT_TO_TRAVEL: &str = "fit to travel";
/// The same.
pub const NOT_FIT: &str = "fit for neither";
/// The same.
pub const NO_POSE: &str = "lost";

/// How the kind of that name looks; others by their place in the picture.
pub(super) fn look_of(name: &str, index: usize) -> Look {
    let known = KINDS.iter().find(|(known, _)| *known == name).map(|(_, look)| *look);
    known.unwrap_or(Look { colour: colour(index), shape: Shape::of(index), width: 2 })
}

#[cfg(test)]
mod tests {
    use super::{KINDS, look_of};

    #[test]
    fn every_kind_looks_the_same_in_the_viewer() {
        let page = include_str!("../view/page/map.js");
        for (name, mark) in [
            ("reflectors", "reflector"),
            ("corners", "corner"),
            ("end points", "end_point"),
            ("found while driving", "found"),
        ] {
            let look = look_of(name, 0);
            let (red, green, blue) = (look.colour.0, look.colour.1, look.colour.2);
            let long = format!("#{red:02x}{green:02x}{blue:02x}");
            let drawing = page.split(&format!("\n  {mark}(c")).nth(1).unwrap().split("\n  },").next().unwrap();
            // Black is the ink of a light page, and light on a dark one.
            let is_black = long == "#000000" && drawing.contains("INKS.ink");
            assert!(is_black || drawing.contains(&long), "{name}: {long} is not in {drawing}");
        }
    }

    #[test]
    fn no_two_kinds_of_points_look_alike() {
        for (index, (name, look)) in KINDS.iter().enumerate().take(4) {
            assert!(
                KINDS[index + 1..4].iter().all(|(_, other)| (other.colour, other.shape) != (look.colour, look.shape)),
                "{name}"
            );
        }
    }
}
