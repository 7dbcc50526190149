//! Layouts as drawings.

use agv_wire::nav350::IdentifiedLandmark;
use dxf::entities::{Entity, EntityType, ModelPoint, Text};
use dxf::enums::Units;
use dxf::{Drawing, DxfError, Point};

use super::LoadedLayout;
use super::blocks::{self, Place};
use super::reading::{Reading, Unit};
use crate::account::Account;
use crate::foreign_code;

/// Layer of the points and their names.
const LAYER: &str = "REFLECTORS";

/// Height of the names, mm.
const TEXT_HEIGHT: f64 = 300.0;

/// A name that is farther from a point than this is that of another one, m.
const NAME_DISTANCE: f64 = 0.05;

/// A drawing in millimetres: a point and a text for each landmark.
pub(super) fn write(landmarks: &[IdentifiedLandmark]) -> String {
    let mut drawing = Drawing::new();
    drawing.header.default_drawing_units = Units::Millimeters;
    for IdentifiedLandmark { id, landmark } in landmarks {
        let place = Point::new(landmark.x.0.into(), landmark.y.0.into(), 0.0);
        let point = ModelPoint { location: place.clone(), ..ModelPoint::default() };
        let name = Text { location: place, text_height: TEXT_HEIGHT, value: id.to_string(), ..Text::default() };
        for specific in [EntityType::ModelPoint(point), EntityType::Text(name)] {
            let mut entity = Entity::new(specific);
            entity.common.layer = LAYER.to_owned();
            drawing.add_entity(entity);
        }
    }
    let mut bytes = Vec::new();
    // Nothing but memory is written to.
    let _ = drawing.save(&mut bytes);
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Whether bytes are a drawing in binary.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    bytes.starts_with(b"AutoCAD Binary DXF")
}

/// The landmarks of a drawing: its points, centres of circles and places of blocks, of what is shown in model space. A whole number that
/// is written at a landmark, or in an attribute of its block, names it; the others are numbered.
pub(super) fn parse(bytes: &[u8], reading: &Reading) -> Result<LoadedLayout, (usize, String)> {
    let mut account = Account::default();
    let read = foreign_code::read(|| Drawing::load(&mut &*bytes));
    let read =
        read.map_err(|reason| (1, format!("there is something in the drawing that no drawing has: {reason}")))?;
    let drawing = read.map_err(|error| (line(&error), error.to_string()))?;
    let found = blocks::collect(&drawing, &frozen_layers(bytes), reading.layer.as_deref(), &mut account);
    if found.places.is_empty() {
        let layer = reading.layer.as_ref().map(|layer| format!(" on the layer {layer}")).unwrap_or_default();
        let hidden: Vec<String> = account.beside().iter().map(ToString::to_string).collect();
        let hidden = if hidden.is_empty() { String::new() } else { format!(" ({})", hidden.join(", ")) };
        return Err((1, format!("there are no points, circles or blocks in the drawing{layer}{hidden}")));
    }
    let metres = metres(&drawing, &found.places, reading, &mut account).map_err(|problem| (1, problem))?;
    let distance = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) * metres;
    let name_of = |place: &Place| {
        let near = found.names.iter().filter(|(_, at)| distance(at, &place.at) < NAME_DISTANCE);
        let nearest = near.min_by(|a, b| distance(&a.1, &place.at).total_cmp(&distance(&b.1, &place.at)));
        place.name.or(nearest.map(|(name, _)| *name))
    };
    let named: Vec<Option<u16>> = found.places.iter().map(name_of).collect();
    let mut free = (0..=u16::MAX).filter(|name| !named.contains(&Some(*name)));
    let mut landmarks: Vec<IdentifiedLandmark> = Vec::with_capacity(found.places.len());
    for (place, name) in found.places.iter().zip(&named) {
        let Some(id) = name.or_else(|| free.next()) else { return Err((1, "there are too many points".to_owned())) };
        if landmarks.iter().any(|known| known.id == id) {
            return Err((1, format!("two points are named {id}")));
        }
        let at = reading.placed(place.at.map(|value| value * metres));
        super::check_range(at).map_err(|problem| (1, problem))?;
        landmarks.push(super::reflector(id, at[0], at[1]));
    }
    account.take(landmarks.len());
    let unnamed = named.iter().filter(|name| name.is_none()).count();
    if unnamed > 0 {
        account
            .note(format!("{unnamed} of {} points have no whole number beside them: they were numbered", named.len()));
    }
    let lines = found.lines.iter().map(|ends| ends.map(|at| reading.placed(at.map(|value| value * metres)))).collect();
    Ok(LoadedLayout { landmarks, lines, account })
}

/// Names of the layers that are frozen, which the reader of drawings does not tell: bit 1 of their flags (DXF reference, LAYER). Those of
/// a binary drawing are not known.
fn frozen_layers(bytes: &[u8]) -> Vec<String> {
    let Ok(text) = std::str::from_utf8(bytes) else { return Vec::new() };
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let (pairs, _) = lines.as_chunks::<2>();
    let mut frozen = Vec::new();
    let (mut is_layer, mut name) = (false, "");
    for [code, value] in pairs {
        match *code {
            "0" => (is_layer, name) = (*value == "LAYER", ""),
            "2" if is_layer => name = value,
            "70" if is_layer && value.parse::<i32>().is_ok_and(|flags| flags & 1 != 0) => frozen.push(name.to_owned()),
            _ => {}
        }
    }
    frozen
}

/// A hall is wider than this and narrower than that, m.
const HALL: (f64, f64) = (1.0, 10_000.0);

/// The length of the drawing's unit, m. A drawing that states none is in millimetres, unless it would then be no hall.
fn metres(drawing: &Drawing, places: &[Place], reading: &Reading, account: &mut Account) -> Result<f64, String> {
    if let Some(unit) = reading.unit {
        return Ok(unit.metres());
    }
    let stated = drawing.header.default_drawing_units;
    let width = |axis: usize| {
        let values = places.iter().map(|place| place.at[axis]);
        values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
    };
    let extent = width(0).max(width(1));
    let is_hall = |unit: f64| extent == 0.0 || (HALL.0..HALL.1).contains(&(extent * unit));
    let (millimetre, metre) = (Unit::Millimetre.metres(), Unit::Metre.metres());
    if stated != Units::Unitless {
        let metres =
            length(stated).ok_or(format!("the unit {stated:?} is none of a layout: state another with --unit"))?;
        if !is_hall(metres) {
            account.warn(format!(
                "in the drawing's unit ({stated:?}) the layout is {:.3} m wide: if that is wrong, state the unit with --unit",
                extent * metres
            ));
        }
        return Ok(metres);
    }
    if !is_hall(millimetre) && is_hall(metre) {
        account.warn(format!(
            "the drawing states no unit: metres were taken, as in millimetres it would be {:.3} m wide; state the unit with --unit",
            extent * millimetre
        ));
        return Ok(metre);
    }
    account.note("the drawing states no unit: millimetres were taken");
    Ok(millimetre)
}

/// The length of a unit, m.
fn length(unit: Units) -> Option<f64> {
    match unit {
        Units::Millimeters => Some(1e-3),
        Units::Centimeters => Some(1e-2),
        Units::Decimeters => Some(1e-1),
        Units::Meters => Some(1.0),
        Units::Inches => Some(0.0254),
        Units::Feet => Some(0.3048),
        _ => None,
    }
}

/// The line of the drawing that an error is about, as far as it says.
fn line(error: &DxfError) -> usize {
    match error {
        DxfError::UnexpectedCodePair(pair, _) => pair.offset,
        DxfError::ParseError(offset) | DxfError::UnexpectedCode(_, offset) => *offset,
        _ => 1,
    }
    .max(1)
}
