//! Halts at marks that somebody has surveyed: whether the vehicle is where it says, and not only at the same place again.

use std::path::Path;

use agv_core::geometry::{Pose, difference};
use agv_core::measurement::Time;

use super::{HALT, Line, Verdict, verdict};
use crate::drive::Track;
use crate::text_file::{self, TextFileError};
use crate::wording::count_of;

/// A halt at a mark.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkHalt {
    /// Name of the mark.
    pub mark: String,
    /// Where the logical point of a vehicle on the mark is, by the survey, in the frame of the map: m and rad.
    pub surveyed: Pose,
    /// Where the vehicle halted, by a ruler: along the mark's heading and across, to the left, m; turned to the left, rad.
    pub by_ruler: Pose,
}

/// First line of a file of halts at marks.
pub const MARKS: &str = "mark,x_m,y_m,heading_deg,along_mm,across_mm,turned_deg";

/// Marks that are wanted at least, at different places.
pub const FEWEST_MARKS: usize = 3;
/// Marks that are nearer to each other are one place, m.
const APART: f64 = 1.0;
/// A halt belongs to the mark that is so near to what the vehicle says, m.
const NEAR: f64 = 0.5;
/// A vehicle halts if it goes no further than this, m, in that time, s.
const STILL: (f64, f64) = (0.002, 2.0);

const MUST_BE: &str =
    "halts at three marks that are surveyed, 1 m apart or more, each where the vehicle says to 20 mm and 0.1 deg";

/// Reads halts at marks, one a line, in the order in which the vehicle drove.
///
/// # Errors
/// See [`TextFileError`].
pub fn read_marks(path: &Path) -> Result<Vec<MarkHalt>, TextFileError> {
    let text = text_file::read(path, "a table of halts at marks")?;
    let mut lines = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty());
    if lines.next().is_none_or(|(_, first)| first.trim() != MARKS) {
        return Err(TextFileError::of_line(path, 1, format!("the first line must be {MARKS}")));
    }
    let wanted = "a name and six numbers are wanted";
    lines
        .map(|(number, line)| mark(line).ok_or_else(|| TextFileError::of_line(path, number, wanted.to_owned())))
        .collect()
}

fn mark(line: &str) -> Option<MarkHalt> {
    let (name, numbers) = line.split_once(',')?;
    let numbers: Option<Vec<f64>> =
        numbers.split(',').map(|field| field.trim().parse().ok().filter(|number: &f64| number.is_finite())).collect();
    let [x, y, heading, along, across, turned]: [f64; 6] = numbers?.try_into().ok()?;
    Some(MarkHalt {
        mark: Some(name.trim()).filter(|name| !name.is_empty())?.to_owned(),
        surveyed: Pose::new(x, y, heading.to_radians()),
        by_ruler: Pose::new(1e-3 * along, 1e-3 * across, turned.to_radians()),
    })
}

/// Where the vehicle said that it was when it halted, in order of time.
#[must_use]
pub fn halts_of(track: &Track) -> Vec<Pose> {
    let mut halts = Vec::new();
    let mut begin: Option<(f64, Time)> = None;
    let mut last: Option<(Pose, Time)> = None;
    for point in &track.points {
        let stands = begin.is_some_and(|(way, _)| (point.way - way).abs() <= STILL.0);
        if !stands {
            halts.extend(halt(begin, last));
            begin = Some((point.way, point.output.time));
        }
        last = Some((point.output.pose, point.output.time));
    }
    halts.extend(halt(begin, last));
    halts
}

/// The last pose of a time in which the vehicle stood, if it was long enough.
fn halt(begin: Option<(f64, Time)>, last: Option<(Pose, Time)>) -> Option<Pose> {
    let ((_, begin), (pose, end)) = begin.zip(last)?;
    (end.since(begin) >= STILL.1).then_some(pose)
}

/// Whether the vehicle is where it says at each mark.
pub(super) fn absolute(track: &Track, halts: &[MarkHalt]) -> Line {
    let line = |verdict, found| Line { what: "where it says that it is".to_owned(), verdict, found, must_be: MUST_BE };
    let places = places(halts);
    if places.len() < FEWEST_MARKS {
        let found = match places.len() {
            0 => "no halt at a surveyed mark is given (--marks)".to_owned(),
            1 => format!(
                "{} at one mark: a map that is shifted as a whole would not be seen",
                count_of(halts.len(), "halt")
            ),
            some => format!("{} at {some} marks", count_of(halts.len(), "halt")),
        };
        return line(Verdict::NotMeasured, found);
    }
    // Both are in the order of the drive; marks may be near each other.
    let is_at_mark = |pose: &Pose| halts.iter().any(|halt| distance(pose, &halt.surveyed) < NEAR);
    let said: Vec<Pose> = halts_of(track).into_iter().filter(is_at_mark).collect();
    let other = halts.iter().zip(&said).find(|(halt, said)| distance(said, &halt.surveyed) >= NEAR);
    if said.len() != halts.len() || other.is_some() {
        let (measured, said) = (count_of(halts.len(), "halt"), said.len());
        let place = other.map_or_else(String::new, |(halt, _)| format!("; the one at {} is another", halt.mark));
        let found = format!("{measured} measured, and {said} in the log, of 2 s and within 0.5 m of a mark{place}");
        return line(Verdict::NotMeasured, found);
    }
    let errors: Vec<(f64, f64, &str)> = halts
        .iter()
        .zip(&said)
        .map(|(halt, said)| {
            let really = halt.surveyed.compose(&halt.by_ruler);
            let turned = difference(said.theta, really.theta).abs().to_degrees();
            (1e3 * distance(said, &really), turned, halt.mark.as_str())
        })
        .collect();
    let (farthest, _, name) = errors.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::NAN, 0.0, ""));
    let turned = errors.iter().map(|error| error.1).fold(0.0, f64::max);
    line(
        verdict(farthest <= HALT[0] && turned <= HALT[1]),
        format!(
            "{} at {} marks, off by {farthest:.1} mm (at {name}) and {turned:.3} deg at the most",
            count_of(errors.len(), "halt"),
            places.len()
        ),
    )
}

/// Different places among the marks.
fn places(halts: &[MarkHalt]) -> Vec<Pose> {
    let mut places: Vec<Pose> = Vec::new();
    for halt in halts {
        if places.iter().all(|place| distance(place, &halt.surveyed) >= APART) {
            places.push(halt.surveyed);
        }
    }
    places
}

fn distance(a: &Pose, b: &Pose) -> f64 {
    (a.position() - b.position()).norm()
}

#[cfg(test)]
mod tests {
    use agv_core::localizer::{Mode, PoseOutput};

    use super::*;
    use crate::drive::TrackPoint;

    /// A drive that halts for 3 s at each place, as the vehicle says.
    fn track(places: &[Pose]) -> Track {
        let mut points = Vec::new();
        let example = example();
        let mut time = 0.0;
        for (number, pose) in places.iter().enumerate() {
            for moment in 0..32 {
                time += 0.1;
                let way = 10.0 * number as f64;
                let output =
                    PoseOutput { time: Time::from_seconds(time), pose: *pose, mode: Mode::Reflectors, ..example };
                points.push(TrackPoint { way: if moment < 31 { way } else { way + 5.0 }, output });
            }
        }
        Track { points, way: 0.0, standard: None, errors: Vec::new() }
    }

    fn example() -> PoseOutput {
        let recording = crate::simulate::simulate(&crate::simulate::scenario::Scenario {
            drive: crate::simulate::scenario::DriveOptions { speed: 5.0, ..Default::default() },
            ..Default::default()
        });
        let mut recording = recording.unwrap().recording;
        recording.events.truncate(3);
        crate::replay::replay(&recording, |_| ()).unwrap().poses[2]
    }

    fn marked(name: &str, surveyed: Pose) -> MarkHalt {
        MarkHalt { mark: name.to_owned(), surveyed, by_ruler: Pose::default() }
    }

    const PLACES: [Pose; 3] = [
        Pose { x: 1.0, y: 2.0, theta: 0.1 },
        Pose { x: 11.0, y: 2.0, theta: 1.5 },
        Pose { x: 11.0, y: 9.0, theta: -3.0 },
    ];

    #[test]
    fn three_marks_tell_a_map_that_is_shifted() {
        let halts: Vec<MarkHalt> =
            ["A", "B", "C"].iter().zip(PLACES).map(|(name, place)| marked(name, place)).collect();
        assert_eq!(absolute(&track(&PLACES), &halts).verdict, Verdict::Pass);
        // The whole map is elsewhere: all halts are as repeatable as before.
        let shifted = PLACES.map(|place| Pose { x: place.x + 0.03, ..place });
        let line = absolute(&track(&shifted), &halts);
        assert_eq!(line.verdict, Verdict::Fail);
        assert!(line.found.contains("30.0 mm"), "{}", line.found);
        let turned = PLACES.map(|place| Pose { theta: place.theta + 0.003, ..place });
        assert_eq!(absolute(&track(&turned), &halts).verdict, Verdict::Fail);
        // The ruler says where the vehicle halted beside the mark.
        let mut beside = halts.clone();
        beside[1].by_ruler = Pose::new(0.05, 0.0, 0.0);
        assert_eq!(absolute(&track(&PLACES), &beside).verdict, Verdict::Fail);
        let aside = PLACES[1].compose(&Pose::new(0.05, 0.0, 0.0));
        assert_eq!(absolute(&track(&[PLACES[0], aside, PLACES[2]]), &beside).verdict, Verdict::Pass);
    }

    #[test]
    fn one_place_by_any_number_of_names_is_not_measured() {
        let at_one: Vec<MarkHalt> = (0..12).map(|number| marked(&format!("mark {number}"), PLACES[0])).collect();
        assert_eq!(absolute(&track(&[PLACES[0]; 12]), &at_one).verdict, Verdict::NotMeasured);
        let at_two = [marked("A", PLACES[0]), marked("B", PLACES[1]), marked("C", PLACES[1])];
        assert_eq!(absolute(&track(&[PLACES[0], PLACES[1], PLACES[1]]), &at_two).verdict, Verdict::NotMeasured);
        assert_eq!(absolute(&track(&PLACES), &[]).verdict, Verdict::NotMeasured);
        // Marks that are nearer to each other than two places are.
        let near = PLACES[0].compose(&Pose::new(0.7, 0.0, 0.0));
        let four = [("A", PLACES[0]), ("B", near), ("C", PLACES[1]), ("D", PLACES[2])];
        let halts: Vec<MarkHalt> = four.iter().map(|(name, place)| marked(name, *place)).collect();
        assert_eq!(absolute(&track(&four.map(|(_, place)| place)), &halts).verdict, Verdict::Pass);
        // The same halts in another order than the table has.
        let other = absolute(&track(&[PLACES[1], near, PLACES[0], PLACES[2]]), &halts);
        assert!(other.verdict == Verdict::NotMeasured && other.found.ends_with("at A is another"), "{other:?}");
        // A halt that the log does not hold.
        let halts: Vec<MarkHalt> =
            ["A", "B", "C"].iter().zip(PLACES).map(|(name, place)| marked(name, place)).collect();
        assert_eq!(absolute(&track(&PLACES[..2]), &halts).verdict, Verdict::NotMeasured);
    }

    #[test]
    fn a_file_is_read_and_a_bad_line_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("marks.csv");
        crate::output_file::write(&path, format!("{MARKS}\nA,1,2,90,5,-3,0.1\n")).unwrap();
        let [halt] = &read_marks(&path).unwrap()[..] else { panic!() };
        assert_eq!((halt.mark.as_str(), halt.by_ruler.x, halt.by_ruler.y), ("A", 0.005, -0.003));
        for line in ["A,1,2,90,5,-3", "A,1,2,90,5,-3,x", ",1,2,90,5,-3,0", "A,1,2,90,5,-3,nan", "A,1,2,90,5,-3,0,0"] {
            crate::output_file::write(&path, format!("{MARKS}\nA,1,2,90,5,-3,0.1\n{line}\n")).unwrap();
            let problem = read_marks(&path).unwrap_err().to_string();
            assert!(problem.contains(":3"), "{problem}");
        }
    }
}
