//! What the detector takes for a corner.

use serde::{Deserialize, Serialize};

/// Beams that are no further apart than this, 0.4 deg, put enough points on the sides of a corner for any gate, rad.
const FINE: f32 = 0.007;

/// What both lines of a corner need not fulfil better where beams are further apart. It was chosen on two offices, at 0.5 and 1 deg.
const COARSE: LineGate = LineGate { residual: 0.05, sine: 0.35, deviation: 0.05, beams: 2.0, concave_spacing: 0.3 };

/// How many neighbours a side are enough there.
const COARSE_POINTS: u16 = 2;

/// The smallest departure from the surface that ends a neighbourhood there, m.
const COARSE_JUMP: f32 = 0.2;

/// The least standard deviation of a keypoint in every direction there, m.
const COARSE_DEVIATION: f32 = 0.04;

/// Ends of faces there: fewer returns of a face, farther apart, which must stand out further.
fn coarse_ends(wanted: EndPointParameters) -> EndPointParameters {
    EndPointParameters {
        points: wanted.points.min(5),
        spacing: wanted.spacing.max(0.12),
        depth: wanted.depth.max(0.5),
        ..wanted
    }
}

/// How neighbouring candidates compete.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SuppressionRule {
    /// A candidate stays if none nearer than the suppression radius is better; among equals the taller triangle
    /// wins, then the earlier beam.
    Distance,
    /// The reference program's walk over the beams, with a window of asin(radius / range) / step beams; equal
    /// candidates may both stay.
    BeamWindow,
}

/// When two lines are good enough to make a corner.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LineGate {
    /// Largest root mean square distance of a side's points from its line, m.
    pub residual: f32,
    /// Smallest sine of the angle between the two lines.
    pub sine: f32,
    /// Largest standard deviation of the corner in any direction, m.
    pub deviation: f32,
    /// Farthest that the corner may lie beside the candidate's beam, beams.
    pub beams: f32,
    /// Largest distance between the points where neighbouring beams meet a side of a concave corner, m. A gap narrower
    /// than that is not seen, and the two surfaces need not touch.
    pub concave_spacing: f32,
}

/// What an end of a face must look like.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EndPointParameters {
    /// Longest piece of the face that is fitted, m.
    pub length: f32,
    /// Shortest piece of the face that will do, m.
    pub shortest: f32,
    /// Fewest returns of the face.
    pub points: u16,
    /// Largest root mean square distance of the face's points from its line, m.
    pub residual: f32,
    /// Largest distance between the points where two neighbouring beams meet the face, m.
    pub spacing: f32,
    /// How far beyond the face's line the background must lie, measured along the beam, m.
    pub depth: f32,
}

/// Parameters of the detector. Three profiles: [`Parameters::thesis`], [`Parameters::reference`] and
/// [`Parameters::mended`], which is the default.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameters {
    /// Radius of a neighbourhood at range zero, m (K 3.1.1: a).
    pub radius_scale: f32,
    /// Growth of the radius with range, 1/m (K 3.1.1: b).
    pub radius_growth: f32,
    /// The triangle's base and height are at least the radius divided by this (K 3.1.1: beta).
    pub triangle_ratio: f32,
    /// Sectors of the polar grid (K 3.5: s_n); even, at most [`Parameters::MOST_SECTORS`].
    pub sectors: u8,
    /// Whether the orientation falls into the middle of a sector rather than on a boundary. The edges of a right
    /// angle lie 45 degrees from it, which is a boundary of 16 sectors unless they are centred.
    pub sectors_centred: bool,
    /// Fewest neighbours on each side (K 3.1.1).
    pub points_a_side: u16,
    /// Farthest candidate, m.
    pub farthest: f32,
    /// How neighbouring candidates compete. With a gate the better one is that whose lines fix the corner best, else that
    /// with the lower score (K 3.10).
    pub suppression: SuppressionRule,
    /// Distance within which candidates compete, m (K 3.1.1).
    pub suppression_radius: f32,
    /// Only scores below this share of the scan's worst score are kept; above 1 all are.
    pub score_share: f32,
    /// A position between the beams is accepted if it is nearer than this to the candidate, m (K 3.1.2).
    pub sub_beam_limit: f32,
    /// Whether the candidate's own point belongs to both lines (K 3.1.2 says so; it pulls both).
    pub lines_include_corner: bool,
    /// Whether neighbourhoods of a full circle cross the seam.
    pub crosses_seam: bool,
    /// Neighbourhoods end where the range departs by more than this from the surface, m; none if they do not end.
    pub jump: Option<f32>,
    /// What both lines of a corner must fulfil; none if every candidate counts, and then one whose lines do not meet
    /// nearby stays at its own point.
    pub gate: Option<LineGate>,
    /// Ends of faces that stand in front of something; none if they are not wanted.
    pub end_points: Option<EndPointParameters>,
    /// Standard deviation of a range that is expected of the sensor, m.
    pub range_deviation: f32,
    /// Standard deviation that is added to every keypoint in every direction, m.
    pub deviation_floor: f32,
}

impl Parameters {
    /// Most sectors of a polar grid.
    pub const MOST_SECTORS: u8 = 32;

    /// The detector as printed (K 3.1.1, 3.1.2, 3.3.1), with the corrections that [`super`] states.
    #[must_use]
    pub const fn thesis() -> Self {
        Self {
            radius_scale: 0.2,
            radius_growth: 0.07,
            triangle_ratio: 4.0,
            sectors: 16,
            sectors_centred: true,
            points_a_side: 2,
            farthest: 30.0,
            suppression: SuppressionRule::Distance,
            suppression_radius: 0.2,
            score_share: f32::MAX,
            sub_beam_limit: 0.2,
            lines_include_corner: true,
            crosses_seam: true,
            jump: None,
            gate: None,
            end_points: None,
            range_deviation: 0.01,
            deviation_floor: 0.002,
        }
    }

    /// The choices of the thesis's own program (falkolib) with the thesis's figures, its defects mended.
    #[must_use]
    pub const fn reference() -> Self {
        Self {
            sectors_centred: false,
            suppression: SuppressionRule::BeamWindow,
            score_share: 0.5,
            crosses_seam: false,
            ..Self::thesis()
        }
    }

    /// Corners whose two sides are good lines on unbroken surfaces, and ends of faces; for storage and racks, where
    /// gaps are narrower than the printed neighbourhoods.
    #[must_use]
    pub const fn mended() -> Self {
        Self {
            points_a_side: 3,
            lines_include_corner: false,
            jump: Some(0.06),
            gate: Some(LineGate { residual: 0.02, sine: 0.5, deviation: 0.009, beams: 1.0, concave_spacing: 0.05 }),
            end_points: Some(EndPointParameters {
                length: 0.6,
                shortest: 0.15,
                points: 6,
                residual: 0.02,
                spacing: 0.05,
                depth: 0.06,
            }),
            ..Self::thesis()
        }
    }

    /// Whether something can be computed with all of its numbers: none is negative, no length is beyond a kilometre, and the grid has
    /// sectors.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let is_length = |value: &f32| (0.0..=1000.0).contains(value);
        let own = [
            self.radius_scale,
            self.radius_growth,
            self.triangle_ratio,
            self.farthest,
            self.suppression_radius,
            self.sub_beam_limit,
            self.jump.unwrap_or_default(),
            self.range_deviation,
            self.deviation_floor,
        ];
        let gate = self.gate.is_none_or(|LineGate { residual, sine, deviation, beams, concave_spacing }| {
            [residual, sine, deviation, beams, concave_spacing].iter().all(is_length)
        });
        let end_points =
            self.end_points.is_none_or(|EndPointParameters { length, shortest, residual, spacing, depth, .. }| {
                [length, shortest, residual, spacing, depth].iter().all(is_length)
            });
        let has_sectors = self.sectors > 0 && self.sectors <= Self::MOST_SECTORS;
        own.iter().all(is_length) && gate && end_points && has_sectors && self.score_share >= 0.0
    }

    /// What is looked for in a scan whose beams are so far apart, rad: where they are too few for this gate a wider one, and keypoints that are
    /// as much less precise.
    #[must_use]
    pub(super) fn for_beams(&self, step: f32) -> Self {
        let Some(gate) = self.gate.filter(|_| step > FINE) else { return *self };
        let gate = LineGate {
            residual: gate.residual.max(COARSE.residual),
            sine: gate.sine.min(COARSE.sine),
            deviation: gate.deviation.max(COARSE.deviation),
            beams: gate.beams.max(COARSE.beams),
            concave_spacing: gate.concave_spacing.max(COARSE.concave_spacing),
        };
        Self {
            points_a_side: self.points_a_side.min(COARSE_POINTS),
            jump: self.jump.map(|jump| jump.max(COARSE_JUMP)),
            gate: Some(gate),
            end_points: self.end_points.map(coarse_ends),
            deviation_floor: self.deviation_floor.max(COARSE_DEVIATION),
            ..*self
        }
    }

    /// Corners for the recognition of places: as printed, but one neighbour a side is enough. More keypoints serve there
    /// better than good ones.
    #[must_use]
    pub const fn place_corners() -> Self {
        Self { points_a_side: 1, ..Self::thesis() }
    }

    /// Ends of faces for the recognition of places, and no corners.
    #[must_use]
    pub const fn place_ends() -> Self {
        Self {
            // No beam has so many neighbours.
            points_a_side: u16::MAX,
            jump: Some(0.3),
            end_points: Some(EndPointParameters {
                length: 0.6,
                shortest: 0.1,
                points: 3,
                residual: 0.03,
                spacing: 0.5,
                depth: 0.3,
            }),
            ..Self::thesis()
        }
    }
}

impl Default for Parameters {
    fn default() -> Self {
        Self::mended()
    }
}
