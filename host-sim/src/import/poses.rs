//! Poses as most programs for multi-beam lidars write them: twelve numbers a line, the three rows of a rotation with its translation.
//!
//! Those of KITTI's odometry are of the left camera (x to the right, y down, z ahead), those of most others of the lidar (x ahead, y to
//! the left, z up). Nothing in the file says which; a vehicle goes ahead, so the axis along which it goes does.

use std::path::Path;

use crate::account::Account;
use crate::text_file::{self, TextFileError};

/// Rows of the rotation, each with its part of the translation, m.
type Matrix = [[f64; 4]; 3];

/// Poses, and what was assumed and is doubtful.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadPoses {
    /// x, y (m) and heading (rad) of each line.
    pub poses: Vec<[f64; 3]>,
    /// What was left out and assumed.
    pub account: Account,
}

/// Columns and rows of a rotation are unit vectors, but for roundings.
const UNIT: f64 = 0.02;

/// Reads x, y (m) and heading (rad) of each line, see [`read_all`].
///
/// # Errors
/// As [`read_all`].
pub fn read(path: &Path) -> Result<Vec<[f64; 3]>, TextFileError> {
    read_all(path).map(|found| found.poses)
}

/// Reads the poses of a file; those of a camera become those of a lidar. A file that ends early is read up to there.
///
/// # Errors
/// If the file cannot be read, or a line is something else.
pub fn read_all(path: &Path) -> Result<ReadPoses, TextFileError> {
    let text = text_file::read(path, "a file of poses")?;
    let mut account = Account::default();
    let count = text.lines().count();
    let mut matrices: Vec<Matrix> = Vec::with_capacity(count);
    for (line, words) in (1..).zip(text.lines()) {
        match matrix(words) {
            Some(found) => matrices.push(found),
            None if line == count && !text.ends_with('\n') && !matrices.is_empty() => {
                account.warn(format!("the file ends in the middle of line {line}: it was read up to there"));
            }
            None => {
                let seen = words.split_whitespace().count();
                let problem = format!(
                    "this is no pose of twelve numbers, three rows of a rotation with its translation, but {seen} words"
                );
                return Err(TextFileError::of_line(path, line, problem));
            }
        }
    }
    if let Some(line) = matrices.iter().position(|matrix| !is_rotation(matrix)) {
        let problem = "the rotation is none: its rows are no unit vectors";
        return Err(TextFileError::of_line(path, line + 1, problem));
    }
    account.take(matrices.len());
    if is_of_camera(&matrices) {
        account.note(
            "the poses are those of a camera (x to the right, y down, z ahead): they were turned into those of a lidar",
        );
        matrices.iter_mut().for_each(|matrix| *matrix = of_lidar(matrix));
    }
    let pose = |[[r00, _, _, x], [r10, _, _, y], _]: &Matrix| [*x, *y, r10.atan2(*r00)];
    Ok(ReadPoses { poses: matrices.iter().map(pose).collect(), account })
}

fn matrix(line: &str) -> Option<Matrix> {
    let values: Vec<f64> = line.split_whitespace().map(str::parse).collect::<Result<_, _>>().ok()?;
    let (rows, rest) = values.as_chunks::<4>();
    let are_finite = values.iter().all(|value| value.is_finite());
    if are_finite && rest.is_empty() { <&Matrix>::try_from(rows).ok().copied() } else { None }
}

fn is_rotation(matrix: &Matrix) -> bool {
    matrix.iter().all(|[a, b, c, _]| ((a * a + b * b + c * c).sqrt() - 1.0).abs() < UNIT)
}

/// Whether the way lies along the third axis rather than along the first.
fn is_of_camera(matrices: &[Matrix]) -> bool {
    let mut along = [0.0; 3];
    for pair in matrices.windows(2) {
        let way: Vec<f64> = (0..3).map(|row| pair[1][row][3] - pair[0][row][3]).collect();
        for (axis, sum) in along.iter_mut().enumerate() {
            *sum += (0..3).map(|row| pair[0][row][axis] * way[row]).sum::<f64>().abs();
        }
    }
    along[2] > along[0] && along[2] > along[1]
}

/// The same pose of a frame that looks ahead, to the left and up, in a world that does so, too.
fn of_lidar(matrix: &Matrix) -> Matrix {
    // Ahead is what the camera calls its third axis, the left is against its first, up against its second.
    const AXES: [(usize, f64); 3] = [(2, 1.0), (0, -1.0), (1, -1.0)];
    AXES.map(|(row, sign)| {
        let [(a, s), (b, t), (c, u)] = AXES;
        let from = matrix[row];
        [sign * s * from[a], sign * t * from[b], sign * u * from[c], sign * from[3]]
    })
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    fn written(matrices: &[Matrix]) -> String {
        let line = |matrix: &Matrix| {
            matrix.iter().flatten().map(|value| format!("{value:.6}")).collect::<Vec<_>>().join(" ") + "\n"
        };
        matrices.iter().map(line).collect()
    }

    fn read_text(text: &str) -> Result<ReadPoses, TextFileError> {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(text.as_bytes()).unwrap();
        read_all(file.path())
    }

    /// A drive on an arc that goes up a little.
    fn arc() -> Vec<Matrix> {
        let pose = |step: u32| {
            let turned = 0.02 * f64::from(step);
            let (sine, cosine) = turned.sin_cos();
            [
                [cosine, -sine, 0.0, 20.0 * sine],
                [sine, cosine, 0.0, 20.0 * (1.0 - cosine)],
                [0.0, 0.0, 1.0, 0.5 * turned],
            ]
        };
        (0..100).map(pose).collect()
    }

    /// As KITTI writes them.
    fn of_camera(matrix: &Matrix) -> Matrix {
        // Right is against the left, down against up, and ahead is ahead.
        const AXES: [(usize, f64); 3] = [(1, -1.0), (2, -1.0), (0, 1.0)];
        AXES.map(|(row, sign)| {
            let [(a, s), (b, t), (c, u)] = AXES;
            let from = matrix[row];
            [sign * s * from[a], sign * t * from[b], sign * u * from[c], sign * from[3]]
        })
    }

    #[test]
    fn poses_of_a_camera_are_those_of_the_lidar() {
        let arc = arc();
        let lidar = read_text(&written(&arc)).unwrap();
        assert!(lidar.account.notes().is_empty());
        let camera = read_text(&written(&arc.iter().map(of_camera).collect::<Vec<_>>())).unwrap();
        assert_eq!(camera.account.notes().len(), 1);
        for (found, right) in camera.poses.iter().zip(&lidar.poses) {
            assert!(found.iter().zip(right).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?} {right:?}");
        }
        assert_eq!(lidar.poses.len(), 100);
    }

    #[test]
    fn what_is_no_pose_is_refused_with_its_line() {
        let text = written(&arc());
        let cut = read_text(&text[..text.len() - 30]).unwrap();
        assert_eq!((cut.poses.len(), cut.account.warnings().len()), (99, 1));
        for (text, expected) in [
            ("1 0 0 0 0 1 0 0\n", "but 8 words"),
            ("1 0 0 0 0 1 0 0 0 0 1 nan\n", ":1: this is no pose"),
            ("1 0 0 0 0 1 0 0 0 0 7 0\n", ":1: the rotation is none"),
        ] {
            let error = read_text(text).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
