//! `db.xml`, as the maker ships it: an archive of boost, in degrees and centimetres.

use std::fmt::Write;
use std::format;
use std::string::{String, ToString};
use std::vec::Vec;

use roxmltree::{Document, Node, ParsingOptions};

use super::{Calibration, CalibrationError, Full, Laser};

const CENTIMETRE: f64 = 0.01;

pub(super) fn read(text: &str) -> Result<Calibration, CalibrationError> {
    let foreign = |reason: &str| CalibrationError::Foreign { reason: reason.to_string() };
    let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| foreign(&error.to_string()))?;
    let db = child(document.root_element(), "DB").ok_or_else(|| foreign("there is no element DB"))?;
    let points = child(db, "points_").ok_or_else(|| foreign("there is no element points_"))?;
    let resolution = number(db, "distLSB_").map(|centimetres| centimetres * CENTIMETRE);
    let list = |name| {
        let items =
            child(db, name).into_iter().flat_map(|list| list.children().filter(|node| node.has_tag_name("item")));
        items.map(|item| item.text().and_then(|text| text.trim().parse::<f64>().ok())).collect::<Vec<_>>()
    };
    let (enabled, least, most) = (list("enabled_"), list("minIntensity_"), list("maxIntensity_"));
    let mut lasers = Vec::new();
    let places = points.children().filter(|node| node.has_tag_name("item")).filter_map(|item| child(item, "px"));
    for (place, px) in places.enumerate() {
        let value = |name: &'static str| number(px, name).ok_or(CalibrationError::Value { laser: place, name });
        let id = value("id_")?;
        if id != place as f64 {
            return Err(CalibrationError::Numbers { place, found: id as i64 });
        }
        let byte = |list: &[Option<f64>]| list.get(place).copied().flatten().map(|value| value as u8);
        let full = if child(px, "distCorrectionX_").is_some() {
            Some(Full {
                distance_x: value("distCorrectionX_")? * CENTIMETRE,
                distance_y: value("distCorrectionY_")? * CENTIMETRE,
                focal_distance: value("focalDistance_")? * CENTIMETRE,
                focal_slope: value("focalSlope_")?,
                min_intensity: byte(&least).unwrap_or(0),
                max_intensity: byte(&most).unwrap_or(255),
                has_two_points: true,
            })
        } else {
            None
        };
        lasers.push(Laser {
            distance: value("distCorrection_")? * CENTIMETRE,
            elevation: value("vertCorrection_")?.to_radians(),
            rotation: value("rotCorrection_")?.to_radians(),
            vertical_offset: value("vertOffsetCorrection_")? * CENTIMETRE,
            horizontal_offset: value("horizOffsetCorrection_")? * CENTIMETRE,
            is_enabled: enabled.get(place).copied().flatten().is_none_or(|value| value != 0.0),
            full,
        });
    }
    if lasers.is_empty() {
        return Err(foreign("it holds no laser"));
    }
    Ok(Calibration { distance_resolution: resolution, lasers })
}

fn child<'a, 'input>(node: Node<'a, 'input>, name: &str) -> Option<Node<'a, 'input>> {
    node.children().find(|child| child.has_tag_name(name))
}

fn number(node: Node<'_, '_>, name: &str) -> Option<f64> {
    child(node, name)?.text()?.trim().parse().ok()
}

pub(super) fn write(calibration: &Calibration) -> String {
    let lasers = &calibration.lasers;
    let list = |name: &str, value: &dyn Fn(&Laser) -> u8| {
        let items: String = lasers.iter().map(|laser| format!("\t\t<item>{}</item>\n", value(laser))).collect();
        format!("\t<{name}>\n\t\t<count>{}</count>\n{items}\t</{name}>\n", lasers.len())
    };
    let mut text = String::from(
        "<?xml version=\"1.0\" encoding=\"UTF-8\" standalone=\"yes\" ?>\n<!DOCTYPE boost_serialization>\n\
         <boost_serialization signature=\"serialization::archive\" version=\"4\">\n\
         <DB class_id=\"0\" tracking_level=\"1\" version=\"0\" object_id=\"_0\">\n",
    );
    if let Some(resolution) = calibration.distance_resolution {
        let _ = writeln!(text, "\t<distLSB_>{}</distLSB_>", resolution / CENTIMETRE);
    }
    text += &list("enabled_", &|laser| u8::from(laser.is_enabled));
    if lasers.iter().any(|laser| laser.full.is_some()) {
        text += &list("minIntensity_", &|laser| laser.full.map_or(0, |full| full.min_intensity));
        text += &list("maxIntensity_", &|laser| laser.full.map_or(255, |full| full.max_intensity));
    }
    let _ = write!(text, "\t<points_>\n\t\t<count>{}</count>\n", lasers.len());
    for (id, laser) in lasers.iter().enumerate() {
        let mut values = std::vec![
            ("rotCorrection_", laser.rotation.to_degrees()),
            ("vertCorrection_", laser.elevation.to_degrees()),
            ("distCorrection_", laser.distance / CENTIMETRE),
        ];
        if let Some(full) = &laser.full {
            values.push(("distCorrectionX_", full.distance_x / CENTIMETRE));
            values.push(("distCorrectionY_", full.distance_y / CENTIMETRE));
        }
        values.push(("vertOffsetCorrection_", laser.vertical_offset / CENTIMETRE));
        values.push(("horizOffsetCorrection_", laser.horizontal_offset / CENTIMETRE));
        if let Some(full) = &laser.full {
            values.push(("focalDistance_", full.focal_distance / CENTIMETRE));
            values.push(("focalSlope_", full.focal_slope));
        }
        let class =
            if id == 0 { "class_id=\"9\" tracking_level=\"1\" version=\"1\"" } else { "class_id_reference=\"9\"" };
        let _ = writeln!(text, "\t\t<item>\n\t\t\t<px {class} object_id=\"_{}\">", id + 1);
        let _ = writeln!(text, "\t\t\t\t<id_>{id}</id_>");
        for (name, value) in values {
            let _ = writeln!(text, "\t\t\t\t<{name}>{value}</{name}>");
        }
        text += "\t\t\t</px>\n\t\t</item>\n";
    }
    text + "\t</points_>\n</DB>\n</boost_serialization>\n"
}
