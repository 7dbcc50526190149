//! A pose on the command line.

use agv_core::geometry::Pose;

/// The pose that `X,Y,HEADING` states, in m, m and deg.
pub fn pose(text: &str) -> Result<Pose, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, heading]) if [x, y, heading].iter().all(|value| value.is_finite()) => {
            Ok(Pose::new(x, y, heading.to_radians()))
        }
        _ => Err("three numbers X,Y,HEADING are expected".to_owned()),
    }
}
