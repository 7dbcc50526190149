//! What a drawing shows in model space: blocks in blocks, rows and columns of them, mirrored ones, and what is hidden.

use std::collections::BTreeMap;

use dxf::entities::{Entity, EntityType, Insert, MText};
use dxf::{Block, Drawing, Point, Vector};
use nalgebra::{Affine2, Matrix3, Point2, Vector3};

use crate::account::Account;

/// Blocks in blocks that are followed; deeper ones are rings.
const DEEPEST: usize = 16;
/// Copies of a block in rows and columns, at most.
const MOST_COPIES: i64 = 65_536;
/// Points of a block that are nearer to each other are one, in units of the drawing.
const SAME: f64 = 1e-6;

/// A point, circle or block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    /// Where it is, in units of the drawing.
    pub(super) at: [f64; 2],
    /// What an attribute of its block says.
    pub(super) name: Option<u16>,
}

/// What was found.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Found {
    pub(super) places: Vec<Place>,
    /// Whole numbers that are written somewhere.
    pub(super) names: Vec<(u16, [f64; 2])>,
    /// Both ends of each line, as of walls and racks, in units of the drawing; the parts of polylines, whose arcs are their chords.
    pub(super) lines: Vec<[[f64; 2]; 2]>,
}

struct Walk<'a> {
    blocks: BTreeMap<&'a str, &'a Block>,
    hidden: Vec<String>,
    layer: Option<&'a str>,
    found: Found,
    account: &'a mut Account,
}

/// Collects what is shown; only of one layer, if that is asked for.
pub(super) fn collect(drawing: &Drawing, frozen: &[String], layer: Option<&str>, account: &mut Account) -> Found {
    let off = drawing.layers().filter(|layer| !layer.is_layer_on).map(|layer| layer.name.clone());
    let mut walk = Walk {
        blocks: drawing.blocks().map(|block| (block.name.as_str(), block)).collect(),
        hidden: off.chain(frozen.iter().cloned()).collect(),
        layer,
        found: Found::default(),
        account,
    };
    for entity in drawing.entities() {
        walk.entity(entity, &Affine2::identity(), "0", 0);
    }
    walk.found
}

impl Walk<'_> {
    /// What is drawn on layer 0 of a block is on the layer of the block.
    fn entity(&mut self, entity: &Entity, placed: &Affine2<f64>, above: &str, depth: usize) {
        let layer = if entity.common.layer == "0" { above } else { entity.common.layer.as_str() };
        let is_place =
            matches!(entity.specific, EntityType::ModelPoint(_) | EntityType::Circle(_) | EntityType::Insert(_));
        if let Some(why) = self.why_hidden(entity, layer) {
            self.account.set_aside(why, usize::from(is_place));
            return;
        }
        match &entity.specific {
            // Points and long texts are drawn in the world, the others in a plane of their own.
            EntityType::ModelPoint(point) => self.place(at(placed, &point.location), None, layer),
            EntityType::Circle(circle) => {
                self.place(at(&(placed * plane(&circle.normal)), &circle.center), None, layer);
            }
            EntityType::Insert(insert) => self.insert(insert, placed, layer, depth),
            EntityType::Text(text) => {
                self.name(&text.value, at(&(placed * plane(&text.normal)), &text.location));
            }
            EntityType::MText(text) => self.name(&plain(text), at(placed, &text.insertion_point)),
            EntityType::Line(line) => self.lines([at(placed, &line.p1), at(placed, &line.p2)], false),
            EntityType::LwPolyline(lines) => {
                let own = placed * plane(&lines.extrusion_direction);
                let corners = lines.vertices.iter().map(|corner| at(&own, &Point::new(corner.x, corner.y, 0.0)));
                self.lines(corners, lines.is_closed());
            }
            EntityType::Polyline(lines) if !lines.is_3d_polygon_mesh() && !lines.is_polyface_mesh() => {
                let own = if lines.is_3d_polyline() { *placed } else { placed * plane(&lines.normal) };
                self.lines(lines.vertices().map(|corner| at(&own, &corner.location)), lines.is_closed());
            }
            _ => {}
        }
    }

    fn why_hidden(&self, entity: &Entity, layer: &str) -> Option<String> {
        if entity.common.is_in_paper_space {
            Some("points and blocks in paper space".to_owned())
        } else if !entity.common.is_visible {
            Some("points and blocks that are invisible".to_owned())
        } else if self.hidden.iter().any(|hidden| hidden == layer) {
            Some(format!("points and blocks on the layer {layer}, which is off or frozen"))
        } else {
            None
        }
    }

    fn place(&mut self, at: [f64; 2], name: Option<u16>, layer: &str) {
        if self.layer.is_some_and(|wanted| wanted != layer) {
            self.account.set_aside("points and blocks on other layers", 1);
        } else if at.iter().all(|value| value.is_finite()) {
            self.found.places.push(Place { at, name });
        } else {
            self.account.leave_out("points whose coordinates are no numbers", format!("on layer {layer}"));
        }
    }

    fn lines(&mut self, corners: impl IntoIterator<Item = [f64; 2]>, is_closed: bool) {
        let mut corners: Vec<[f64; 2]> = corners.into_iter().collect();
        if is_closed {
            corners.extend(corners.first().copied());
        }
        let parts =
            corners.array_windows().filter(|part: &&[_; 2]| part.iter().flatten().all(|value| value.is_finite()));
        self.found.lines.extend(parts);
    }

    fn name(&mut self, text: &str, at: [f64; 2]) {
        if let Ok(name) = text.trim().parse() {
            self.found.names.push((name, at));
        }
    }

    fn insert(&mut self, insert: &Insert, placed: &Affine2<f64>, layer: &str, depth: usize) {
        let own = placed * plane(&insert.extrusion_direction);
        let (columns, rows) = (i64::from(insert.column_count).max(1), i64::from(insert.row_count).max(1));
        if columns * rows > MOST_COPIES {
            self.account.leave_out("blocks in more rows and columns than a layout has", format!("on layer {layer}"));
            return;
        }
        let block = self.blocks.get(insert.name.as_str()).copied();
        let attributes: Vec<(u16, [f64; 2])> = insert
            .attributes()
            .filter_map(|one| Some((one.value.trim().parse().ok()?, at(&(placed * plane(&one.normal)), &one.location))))
            .collect();
        for (column, row) in (0..columns).flat_map(|column| (0..rows).map(move |row| (column, row))) {
            let step = [column as f64 * insert.column_spacing, row as f64 * insert.row_spacing];
            let copy = own * of_insert(insert, step);
            match block.filter(|block| is_group(block)) {
                Some(block) if depth < DEEPEST => {
                    let inner = copy * to_origin(&block.base_point);
                    block.entities.iter().for_each(|entity| self.entity(entity, &inner, layer, depth + 1));
                }
                Some(_) => self.account.leave_out("blocks that hold themselves", format!("on layer {layer}")),
                // A symbol stands where it is put.
                None => {
                    let name = if columns * rows == 1 { attributes.first().map(|(name, _)| *name) } else { None };
                    self.place(at(&copy, &Point::origin()), name, layer);
                }
            }
        }
        // Attributes of several copies, or of a block of blocks, stand beside what they name.
        self.found.names.extend(attributes);
    }
}

/// Whether a block holds landmarks at several places, or other blocks, instead of being the symbol of one.
fn is_group(block: &Block) -> bool {
    let mut places: Vec<&Point> = Vec::new();
    for entity in &block.entities {
        match &entity.specific {
            EntityType::Insert(_) => return true,
            EntityType::ModelPoint(point) => places.push(&point.location),
            EntityType::Circle(circle) => places.push(&circle.center),
            _ => {}
        }
    }
    places.windows(2).any(|pair| (pair[0].x - pair[1].x).hypot(pair[0].y - pair[1].y) > SAME)
}

fn at(placed: &Affine2<f64>, point: &Point) -> [f64; 2] {
    let found = placed * Point2::new(point.x, point.y);
    [found.x, found.y]
}

/// From the plane of an entity, of which that is the normal, to that of the world, by the "arbitrary axis algorithm" of the DXF
/// reference. What is drawn from below is mirrored.
fn plane(normal: &Vector) -> Affine2<f64> {
    const NEAR: f64 = 1.0 / 64.0;
    let up = Vector3::new(normal.x, normal.y, normal.z);
    let Some(up) = up.try_normalize(0.0) else { return Affine2::identity() };
    let other = if up.x.abs() < NEAR && up.y.abs() < NEAR { Vector3::y() } else { Vector3::z() };
    let first = other.cross(&up).normalize();
    let second = up.cross(&first);
    Affine2::from_matrix_unchecked(Matrix3::new(first.x, second.x, 0.0, first.y, second.y, 0.0, 0.0, 0.0, 1.0))
}

/// From a block whose base is the origin to where it is put; rows and columns turn with it, but are not scaled.
fn of_insert(insert: &Insert, step: [f64; 2]) -> Affine2<f64> {
    let (sine, cosine) = insert.rotation.to_radians().sin_cos();
    let (x, y) = (cosine * step[0] - sine * step[1], sine * step[0] + cosine * step[1]);
    Affine2::from_matrix_unchecked(Matrix3::new(
        cosine * insert.x_scale_factor,
        -sine * insert.y_scale_factor,
        insert.location.x + x,
        sine * insert.x_scale_factor,
        cosine * insert.y_scale_factor,
        insert.location.y + y,
        0.0,
        0.0,
        1.0,
    ))
}

fn to_origin(base: &Point) -> Affine2<f64> {
    Affine2::from_matrix_unchecked(Matrix3::new(1.0, 0.0, -base.x, 0.0, 1.0, -base.y, 0.0, 0.0, 1.0))
}

/// A long text without what says how it looks: `{\\fArial|b0;17}`, `\\A1;17`.
fn plain(text: &MText) -> String {
    let all: String = text.extended_text.iter().chain([&text.text]).map(String::as_str).collect();
    let mut shown = String::new();
    let mut letters = all.chars();
    while let Some(letter) = letters.next() {
        match letter {
            '{' | '}' => {}
            '\\' => match letters.next() {
                Some('P' | '~') => shown.push(' '),
                Some(escaped @ ('\\' | '{' | '}')) => shown.push(escaped),
                // Underlined, overlined and crossed out: nothing follows.
                Some('L' | 'l' | 'O' | 'o' | 'K' | 'k') | None => {}
                Some(_) => {
                    letters.by_ref().find(|letter| *letter == ';');
                }
            },
            _ => shown.push(letter),
        }
    }
    shown
}
