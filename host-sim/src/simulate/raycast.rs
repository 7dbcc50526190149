//! What a ray hits first.

use agv_core::geometry::Point;

use super::shape::{Circle, Segment};
use super::world::World;

/// What was hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surface {
    /// Something without foil.
    Plain,
    /// The reflector of that index in the world.
    Reflector(usize),
}

/// The first surface on a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the ray's origin, m.
    pub distance: f64,
    /// What was hit.
    pub surface: Surface,
}

/// Side of a cell, m.
const CELL: f64 = 0.75;
/// Solids are listed in every cell that they come this near to, m, so that rounding at a border loses none.
const MARGIN: f64 = 1e-6;
/// Segments are taken longer by this share at both ends, so that no ray slips through a joint.
const JOINT: f64 = 1e-9;

#[derive(Clone, Copy, Debug)]
struct Round {
    circle: Circle,
    surface: Surface,
}

/// Solids that do not move, listed by the cells of a uniform grid.
///
/// A ray visits the cells on its way in order (J. Amanatides and A. Woo, "A fast voxel traversal algorithm for ray
/// tracing", 1987) and ends in the first cell that contains a hit.
#[derive(Clone, Debug)]
pub struct RayCaster {
    low: Point,
    columns: usize,
    rows: usize,
    /// Cell `i` lists `segments[segment_starts[i]..segment_starts[i + 1]]`, and likewise the round solids.
    segment_starts: Vec<u32>,
    segments: Vec<Segment>,
    round_starts: Vec<u32>,
    rounds: Vec<Round>,
    /// How many cells a ray passes from each cell on, that one included, in which nothing is; 0 where something is.
    clearance: Vec<u8>,
}

impl RayCaster {
    /// Lists what does not move in `world`.
    #[must_use]
    pub fn new(world: &World) -> Self {
        let rounds: Vec<Round> = world
            .circles
            .iter()
            .map(|&circle| Round { circle, surface: Surface::Plain })
            .chain(
                world
                    .reflectors
                    .iter()
                    .enumerate()
                    .map(|(index, reflector)| Round { circle: reflector.body, surface: Surface::Reflector(index) }),
            )
            .collect();
        let (low, high) = bounds(&world.segments, &rounds);
        let columns = ((high.x - low.x) / CELL) as usize + 1;
        let rows = ((high.y - low.y) / CELL) as usize + 1;
        let (segment_starts, segments) =
            list_by_cell(&world.segments, low, columns, rows, segment_extent, line_meets_cell);
        let (round_starts, rounds) = list_by_cell(&rounds, low, columns, rows, round_extent, circle_meets_cell);
        let is_empty = |cell: usize| range(&segment_starts, cell).is_empty() && range(&round_starts, cell).is_empty();
        let clearance = clearance(columns, rows, is_empty);
        Self { low, columns, rows, segment_starts, segments, round_starts, rounds, clearance }
    }

    /// The first surface on the ray from `origin` (W, m) in `direction` (W, of length one), not farther than `farthest`
    /// (m). Surfaces have two sides.
    #[must_use]
    pub fn first_hit(&self, origin: &Point, direction: &Point, farthest: f64) -> Option<Hit> {
        let (entry, exit) = self.clip(origin, direction, farthest)?;
        let start = origin + direction * entry;
        let mut column = cell_index(start.x - self.low.x, self.columns);
        let mut row = cell_index(start.y - self.low.y, self.rows);
        let (column_step, mut next_column, column_way) = traversal(origin.x - self.low.x, direction.x, column);
        let (row_step, mut next_row, row_way) = traversal(origin.y - self.low.y, direction.y, row);
        let mut best: Option<Hit> = None;
        let mut empty_cells = 0;
        loop {
            if empty_cells == 0 {
                let cell = row * self.columns + column;
                empty_cells = self.clearance[cell];
                if empty_cells == 0 {
                    self.nearest_in_cell(cell, origin, direction, &mut best);
                }
            }
            empty_cells = empty_cells.saturating_sub(1);
            let cell_end = next_column.min(next_row);
            if let Some(hit) = best
                && hit.distance <= cell_end
            {
                break;
            }
            if cell_end > exit {
                break;
            }
            let inside = if next_column < next_row {
                next_column += column_way;
                step(&mut column, column_step, self.columns)
            } else {
                next_row += row_way;
                step(&mut row, row_step, self.rows)
            };
            if !inside {
                break;
            }
        }
        best.filter(|hit| hit.distance <= farthest)
    }

    /// Where the ray enters and leaves the grid.
    fn clip(&self, origin: &Point, direction: &Point, farthest: f64) -> Option<(f64, f64)> {
        let (mut entry, mut exit) = (0.0_f64, farthest);
        let sizes = [self.columns as f64 * CELL, self.rows as f64 * CELL];
        for axis in 0..2 {
            let (position, slope) = (origin[axis] - self.low[axis], direction[axis]);
            if slope == 0.0 {
                if position < 0.0 || position > sizes[axis] {
                    return None;
                }
            } else {
                let (a, b) = (-position / slope, (sizes[axis] - position) / slope);
                entry = entry.max(a.min(b));
                exit = exit.min(a.max(b));
            }
        }
        (entry <= exit).then_some((entry, exit))
    }

    fn nearest_in_cell(&self, cell: usize, origin: &Point, direction: &Point, best: &mut Option<Hit>) {
        let mut nearest = best.map_or(f64::INFINITY, |hit| hit.distance);
        for segment in &self.segments[range(&self.segment_starts, cell)] {
            let distance = distance_along(origin, direction, segment);
            if distance < nearest {
                nearest = distance;
                *best = Some(Hit { distance, surface: Surface::Plain });
            }
        }
        for round in &self.rounds[range(&self.round_starts, cell)] {
            if let Some(distance) = circle_hit(origin, direction, &round.circle)
                && distance < nearest
            {
                nearest = distance;
                *best = Some(Hit { distance, surface: round.surface });
            }
        }
    }
}

/// Distance at which a ray enters `circle`, m; None if it misses it, starts inside it, or leads away.
#[must_use]
pub fn circle_hit(origin: &Point, direction: &Point, circle: &Circle) -> Option<f64> {
    let to_centre = circle.centre - origin;
    let along = to_centre.dot(direction);
    let inside = circle.radius * circle.radius - (to_centre.norm_squared() - along * along);
    if inside < 0.0 {
        return None;
    }
    let distance = along - libm::sqrt(inside);
    (distance > 0.0).then_some(distance)
}

/// Infinite if the ray misses the segment; a parallel segment has no inside that it could hit.
fn distance_along(origin: &Point, direction: &Point, segment: &Segment) -> f64 {
    let edge = segment.to - segment.from;
    let start = segment.from - origin;
    let slant = direction.perp(&edge);
    // Most segments are missed: that is found without a division.
    let share = start.perp(direction) * slant.signum();
    let whole = slant.abs();
    if share < -JOINT * whole || share > (1.0 + JOINT) * whole || whole == 0.0 {
        return f64::INFINITY;
    }
    let distance = start.perp(&edge) / slant;
    if distance > 0.0 { distance } else { f64::INFINITY }
}

fn range(starts: &[u32], cell: usize) -> std::ops::Range<usize> {
    starts[cell] as usize..starts[cell + 1] as usize
}

fn cell_index(offset: f64, count: usize) -> usize {
    // A conversion from float saturates at zero.
    ((offset / CELL) as usize).min(count - 1)
}

/// Sense of the walk on one axis, distance to the first border, distance between borders.
fn traversal(offset: f64, slope: f64, index: usize) -> (isize, f64, f64) {
    if slope > 0.0 {
        (1, ((index + 1) as f64 * CELL - offset) / slope, CELL / slope)
    } else if slope < 0.0 {
        (-1, (index as f64 * CELL - offset) / slope, -CELL / slope)
    } else {
        (0, f64::INFINITY, f64::INFINITY)
    }
}

/// False if the step leaves the grid.
fn step(index: &mut usize, sense: isize, count: usize) -> bool {
    match index.checked_add_signed(sense) {
        Some(next) if next < count => {
            *index = next;
            true
        }
        _ => false,
    }
}

fn segment_extent(segment: &Segment) -> (Point, Point) {
    (segment.from.inf(&segment.to), segment.from.sup(&segment.to))
}

fn round_extent(round: &Round) -> (Point, Point) {
    let Circle { centre, radius } = round.circle;
    (centre.add_scalar(-radius), centre.add_scalar(radius))
}

fn bounds(segments: &[Segment], rounds: &[Round]) -> (Point, Point) {
    segments
        .iter()
        .map(segment_extent)
        .chain(rounds.iter().map(round_extent))
        .reduce(|(low, high), (from, to)| (low.inf(&from), high.sup(&to)))
        .map_or((Point::zeros(), Point::zeros()), |(low, high)| {
            (low.add_scalar(-0.5 * CELL), high.add_scalar(0.5 * CELL))
        })
}

/// Whether the segment's line meets the cell around `centre`; the bounding boxes are known to meet (separating axes).
fn line_meets_cell(segment: &Segment, centre: &Point) -> bool {
    let edge = segment.to - segment.from;
    let reach = 0.5 * CELL * (edge.x.abs() + edge.y.abs()) + MARGIN * (1.0 + edge.norm());
    edge.perp(&(centre - segment.from)).abs() <= reach
}

fn circle_meets_cell(round: &Round, centre: &Point) -> bool {
    let beside = (round.circle.centre - centre).abs().add_scalar(-0.5 * CELL).sup(&Point::zeros());
    beside.norm() <= round.circle.radius + MARGIN
}

/// For each cell 0 if something is in it, else the distance to the nearest cell in which something is, where a step to any of eight
/// neighbours is one (two passes of a chamfer; A. Rosenfeld and J. Pfaltz, "Sequential operations in digital picture processing", 1966).
fn clearance(columns: usize, rows: usize, is_empty: impl Fn(usize) -> bool) -> Vec<u8> {
    let mut distances: Vec<u8> = (0..columns * rows).map(|cell| if is_empty(cell) { u8::MAX } else { 0 }).collect();
    let mut pass = |cells: &mut dyn Iterator<Item = (usize, usize)>, senses: [(isize, isize); 4]| {
        for (row, column) in cells {
            let neighbours = senses.iter().filter_map(|(down, right)| {
                let (row, column) = (row.checked_add_signed(*down)?, column.checked_add_signed(*right)?);
                (row < rows && column < columns).then(|| distances[row * columns + column].saturating_add(1))
            });
            let nearest = neighbours.min().unwrap_or(u8::MAX);
            let own = &mut distances[row * columns + column];
            *own = (*own).min(nearest);
        }
    };
    pass(
        &mut (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))),
        [(0, -1), (-1, -1), (-1, 0), (-1, 1)],
    );
    pass(
        &mut (0..rows).rev().flat_map(|row| (0..columns).rev().map(move |column| (row, column))),
        [(0, 1), (1, 1), (1, 0), (1, -1)],
    );
    distances
}

/// Copies of the items, cell after cell; `extent` gives an item's bounding box, `meets(item, centre)` whether it meets a
/// cell that the box meets.
fn list_by_cell<Item: Copy>(
    items: &[Item],
    low: Point,
    columns: usize,
    rows: usize,
    extent: impl Fn(&Item) -> (Point, Point),
    meets: impl Fn(&Item, &Point) -> bool,
) -> (Vec<u32>, Vec<Item>) {
    let mut cells = vec![Vec::new(); columns * rows];
    for item in items {
        let (from, to) = extent(item);
        let span = |axis: usize, count: usize| {
            cell_index(from[axis] - low[axis] - MARGIN, count)..=cell_index(to[axis] - low[axis] + MARGIN, count)
        };
        for row in span(1, rows) {
            for column in span(0, columns) {
                let centre = low + Point::new((column as f64 + 0.5) * CELL, (row as f64 + 0.5) * CELL);
                if meets(item, &centre) {
                    cells[row * columns + column].push(*item);
                }
            }
        }
    }
    let mut starts = vec![0];
    let mut listed = Vec::new();
    for cell in cells {
        listed.extend(cell);
        starts.push(listed.len() as u32);
    }
    (starts, listed)
}
