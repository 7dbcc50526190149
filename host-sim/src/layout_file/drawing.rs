//! Layouts as drawings.

use agv_wire::nav350::IdentifiedLandmark;
use dxf::entities::{Entity, EntityType, ModelPoint, Text};
use dxf::enums::Units;
use dxf::{Drawing, DxfError, Point};

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

/// The landmarks of a drawing: its points, centres of circles and places of blocks. A whole number that is written at a
/// landmark names it; the others are numbered. A drawing that states no unit is in millimetres.
pub(super) fn parse(text: &str) -> Result<Vec<IdentifiedLandmark>, (usize, String)> {
    let drawing = Drawing::load(&mut text.as_bytes()).map_err(|error| (line(&error), error.to_string()))?;
    let Some(metres) = metres(drawing.header.default_drawing_units) else {
        return Err((1, format!("the unit {:?} is none of a layout", drawing.header.default_drawing_units)));
    };
    let (mut places, mut names) = (Vec::new(), Vec::new());
    for entity in drawing.entities() {
        match &entity.specific {
            EntityType::ModelPoint(point) => places.push(&point.location),
            EntityType::Circle(circle) => places.push(&circle.center),
            EntityType::Insert(insert) => places.push(&insert.location),
            EntityType::Text(text) => names.extend(text.value.trim().parse::<u16>().map(|name| (name, &text.location))),
            _ => {}
        }
    }
    if places.is_empty() {
        return Err((1, "there are no points, circles or blocks in the drawing".to_owned()));
    }
    let distance = |a: &Point, b: &Point| (a.x - b.x).hypot(a.y - b.y) * metres;
    let name_of = |place: &Point| {
        let near = names.iter().filter(|(_, at)| distance(at, place) < NAME_DISTANCE);
        near.min_by(|a, b| distance(a.1, place).total_cmp(&distance(b.1, place))).map(|(name, _)| *name)
    };
    let named: Vec<Option<u16>> = places.iter().map(|place| name_of(place)).collect();
    let mut free = (0..=u16::MAX).filter(|name| !named.contains(&Some(*name)));
    let mut landmarks: Vec<IdentifiedLandmark> = Vec::with_capacity(places.len());
    for (place, name) in places.iter().zip(&named) {
        let Some(id) = name.or_else(|| free.next()) else { return Err((1, "there are too many points".to_owned())) };
        if landmarks.iter().any(|known| known.id == id) {
            return Err((1, format!("two points are named {id}")));
        }
        landmarks.push(super::reflector(id, place.x * metres, place.y * metres));
    }
    Ok(landmarks)
}

/// The length of a unit, m.
fn metres(unit: Units) -> Option<f64> {
    match unit {
        Units::Unitless | Units::Millimeters => Some(1e-3),
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
