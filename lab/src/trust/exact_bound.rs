//! Exact 95 % bounds, from above, of what was counted.

/// How seldom so few are counted if the bound is the truth.
const RISK: f64 = 0.05;
/// Halvings of the interval in which a bound is sought; more than a number has digits.
const HALVINGS: usize = 64;

/// The share of all runs that may fail if so many of so many did (Clopper and Pearson 1934, one-sided); none of no run.
#[must_use]
pub fn of_share(failures: u64, runs: u64) -> Option<f64> {
    if failures >= runs {
        return (runs > 0).then_some(1.0);
    }
    // The chance of no more failures, where each run fails with a chance of `share`.
    let chance = |share: f64| {
        let (runs, odds) = (runs as f64, (share / (1.0 - share)).ln());
        sum(failures, runs * (-share).ln_1p(), |before| ((runs - before) / (before + 1.0)).ln() + odds)
    };
    Some(reaches(1.0, chance))
}

/// How many are to be expected where so many were counted (Garwood 1936, one-sided).
#[must_use]
pub fn of_count(count: u64) -> f64 {
    let chance = |expected: f64| sum(count, -expected, |before| (expected / (before + 1.0)).ln());
    reaches(20.0 + 4.0 * count as f64, chance)
}

/// The sum of the first terms of a series, up to the one of this number; the logarithm of the first is given, and of each the quotient to
/// the one before.
fn sum(last: u64, first: f64, quotient: impl Fn(f64) -> f64) -> f64 {
    let mut term = first;
    let mut sum = term.exp();
    for before in 0..last {
        term += quotient(before as f64);
        sum += term.exp();
    }
    sum
}

/// Where a chance that falls from 1 reaches the risk, between 0 and `most`.
fn reaches(most: f64, chance: impl Fn(f64) -> f64) -> f64 {
    let (mut least, mut most) = (0.0, most);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (least + most);
        if chance(middle) > RISK {
            least = middle;
        } else {
            most = middle;
        }
    }
    most
}
