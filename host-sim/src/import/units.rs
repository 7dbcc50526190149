//! Units of the columns of a table.

/// What a column may be given in: its name, what it measures, and the factor to SI.
const UNITS: [(&str, Measure, f64); 17] = [
    ("s", Measure::Time, 1.0),
    ("ms", Measure::Time, 1e-3),
    ("us", Measure::Time, 1e-6),
    ("ns", Measure::Time, 1e-9),
    ("m", Measure::Length, 1.0),
    ("cm", Measure::Length, 1e-2),
    ("mm", Measure::Length, 1e-3),
    ("rad", Measure::Angle, 1.0),
    ("deg", Measure::Angle, std::f64::consts::PI / 180.0),
    ("turns", Measure::Angle, std::f64::consts::TAU),
    ("m/s", Measure::Speed, 1.0),
    ("mm/s", Measure::Speed, 1e-3),
    ("km/h", Measure::Speed, 1.0 / 3.6),
    ("rad/s", Measure::Rate, 1.0),
    ("deg/s", Measure::Rate, std::f64::consts::PI / 180.0),
    ("rpm", Measure::Rate, std::f64::consts::TAU / 60.0),
    ("turns/s", Measure::Rate, std::f64::consts::TAU),
];

/// What a unit measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// s.
    Time,
    /// m.
    Length,
    /// rad.
    Angle,
    /// m/s.
    Speed,
    /// rad/s.
    Rate,
}

/// What a unit measures, and its factor to SI; of "ticks", of which `ticks` make a turn. None for no unit.
pub fn find(unit: &str, ticks: Option<f64>) -> Option<(Measure, f64)> {
    if unit == "ticks" {
        return ticks.filter(|ticks| *ticks != 0.0).map(|ticks| (Measure::Angle, std::f64::consts::TAU / ticks));
    }
    UNITS.iter().find(|(name, ..)| *name == unit).map(|(_, measure, factor)| (*measure, *factor))
}

/// All units, for a message.
pub fn names() -> String {
    let names: Vec<&str> = UNITS.iter().map(|(name, ..)| *name).collect();
    format!("{}, and ticks with how many of them make a turn", names.join(", "))
}
