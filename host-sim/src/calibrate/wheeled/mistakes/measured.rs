//! What a fit says of a vehicle that is no adjustment any more.

use std::f64::consts::PI;

use agv_core::geometry::wrap;

use super::Mistake;
use crate::calibrate::wheeled::fit::{Fitted, WheeledFit};
use crate::calibrate::wheeled::unknowns::{Moves, Unknown, WheeledModel};

/// Differences that are told: in standard deviations, and the least ones: share of a radius and of a length, steering offset and heading,
/// rad, place, m, and time, s. Slip and drift are mistaken for less.
const CLEAR: f64 = 5.0;
pub(super) const SHARE: f64 = 0.02;
const LENGTH: f64 = 0.02;
const STEERING: f64 = 1.5 * PI / 180.0;
const HEADING: f64 = PI / 180.0;
const PLACE: f64 = 0.08;
const TIME: f64 = 0.02;
/// Radii that change alike to this share change together.
const ALIKE: f64 = 0.01;

/// Where the fitted vehicle is another than the believed one.
pub(super) fn measured(nominal: &WheeledModel, found: &WheeledFit, unknowns: &[Unknown]) -> Vec<Mistake> {
    let told =
        |name: &str| found.fitted.iter().find(|fitted| fitted.name.starts_with(name)).filter(|fitted| !fitted.is_open);
    let deviation = |name: &str| told(name).map_or(f64::INFINITY, |fitted| fitted.deviation);
    let mut mistakes = radii(nominal, found);
    mistakes.extend(lengths(nominal, found, unknowns));
    for (number, wheel) in nominal.wheels.iter().enumerate().filter(|(_, wheel)| wheel.steering.is_some()) {
        let off = wrap(found.model.wheels[number].heading - wheel.heading);
        let clear = CLEAR * deviation(&format!("steering offset of wheel {}", number + 1));
        if off.abs() > clear.max(STEERING) {
            mistakes.push(Mistake::SteeringOffset(number, off));
        }
    }
    let turn = wrap(found.model.sensor.theta - nominal.sensor.theta);
    if turn.abs() > (CLEAR * deviation("sensor heading")).max(HEADING) {
        mistakes.push(Mistake::LaserHeading(turn));
    }
    let (ahead, left) = (found.model.sensor.x - nominal.sensor.x, found.model.sensor.y - nominal.sensor.y);
    let is_ahead = ahead.abs() > (CLEAR * deviation("sensor x")).max(PLACE);
    if is_ahead || left.abs() > (CLEAR * deviation("sensor y")).max(PLACE) {
        mistakes.push(Mistake::LaserPlace(ahead, left));
    }
    let late = found.clocks.first().map_or(0.0, |clock| clock.offset_s);
    if late.abs() > TIME {
        mistakes.push(Mistake::Late(late));
    }
    mistakes
}

/// Ways of a tick: of all wheels together, or of single ones.
fn radii(nominal: &WheeledModel, found: &WheeledFit) -> Vec<Mistake> {
    let fitted = |number: usize| -> Option<&Fitted> {
        found.fitted.iter().find(|fitted| fitted.name.starts_with(&format!("radius of wheel {} ", number + 1)))
    };
    let measured: Vec<(usize, f64, f64)> = nominal
        .wheels
        .iter()
        .enumerate()
        .filter(|(_, wheel)| wheel.turn.is_some())
        .filter_map(|(number, wheel)| {
            let ratio = found.model.wheels[number].radius / wheel.radius;
            let deviation = fitted(number).filter(|fitted| !fitted.is_open)?.deviation / wheel.radius.abs();
            Some((number, ratio, deviation))
        })
        .collect();
    let mean = measured.iter().map(|(_, ratio, _)| ratio).sum::<f64>() / measured.len().max(1) as f64;
    let is_off = |ratio: f64, deviation: f64| (ratio - 1.0).abs() > (CLEAR * deviation).max(SHARE);
    let are_alike = measured.len() > 1 && measured.iter().all(|(_, ratio, _)| (ratio / mean - 1.0).abs() < ALIKE);
    if are_alike {
        let deviation = measured.iter().map(|(.., deviation)| *deviation).fold(0.0, f64::max);
        return if is_off(mean, deviation) { vec![Mistake::Scale(mean)] } else { Vec::new() };
    }
    let single = measured.iter().filter(|(_, ratio, deviation)| is_off(*ratio, *deviation));
    single.map(|(number, ratio, _)| Mistake::WheelScale(*number, *ratio)).collect()
}

/// Track, wheelbase, arm.
fn lengths(nominal: &WheeledModel, found: &WheeledFit, unknowns: &[Unknown]) -> Vec<Mistake> {
    let length = |model: &WheeledModel, name: &str| -> Option<f64> {
        let wheel = |number: usize| model.wheels.get(number);
        match name {
            "track" => Some((wheel(0)?.y - wheel(1)?.y).abs()),
            "arm" => wheel(0).map(|wheel| wheel.x.hypot(wheel.y)),
            "wheelbase" if model.wheels.len() == 1 || model.wheels.iter().all(|wheel| wheel.steering.is_none()) => {
                wheel(0).map(|wheel| wheel.x)
            }
            "wheelbase" if model.wheels.len() == 2 && wheel(1)?.steering.is_some() => Some(wheel(0)?.x - wheel(1)?.x),
            "wheelbase" => model.wheels.iter().find(|wheel| wheel.steering.is_some()).map(|wheel| wheel.x),
            _ => None,
        }
    };
    let mut mistakes = Vec::new();
    for (unknown, fitted) in unknowns.iter().zip(&found.fitted).filter(|(_, fitted)| !fitted.is_open) {
        let name = unknown.name.trim_end_matches(" m");
        let is_length = matches!(unknown.moves, Moves::Wheels(_)) && ["track", "arm", "wheelbase"].contains(&name);
        let lengths = length(nominal, name).zip(length(&found.model, name)).filter(|_| is_length);
        if let Some((believed, right)) = lengths
            && (right - believed).abs() > (CLEAR * fitted.deviation).max(LENGTH * believed.abs())
        {
            mistakes.push(Mistake::Length(name.to_owned(), right));
        }
    }
    mistakes
}
