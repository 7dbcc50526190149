//! From a log to windows.

use agv_core::geometry::difference;
use agv_core::maps::Landmark;
use agv_core::measurement::EncoderSample;
use agv_core::odometry::{Tricycle, Vehicle};

use super::counted::{Counted, CounterFault, count};
use super::counting_direction::wrong_direction;
use super::log_input::LogInput;
use super::model::VehicleModel;
use super::odometry_path::OdometryPath;
use super::reflector_noise::ReflectorNoise;
use super::refusal::Refusal;
use super::standstill::standstills;
use super::stops::{NoMotion, Stop, between, stops, with_lasting_part};
use super::surveyed_map::stop_poses;
use super::tracking::{TrackedRevolution, track};
use super::window::Window;
use super::windows::{LaserPose, windows};
use crate::wording::count_of;

/// What says how the laser moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotionSource {
    /// Reflectors, averaged at stops.
    ReflectorsAtStops,
    /// The same, each stop placed in a known map.
    ReflectorMap,
    /// Reflectors while driving.
    ReflectorsWhileDriving,
    /// Poses of the laser in the log.
    LaserPoses,
    /// Poses of the vehicle in the log.
    GivenPoses,
}

impl MotionSource {
    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ReflectorsAtStops => "reflectors from stop to stop",
            Self::ReflectorMap => "reflectors at stops, in the known map",
            Self::ReflectorsWhileDriving => "reflectors while driving",
            Self::LaserPoses => "poses of the laser in the log",
            Self::GivenPoses => "poses of the vehicle in the log",
        }
    }
}

pub(super) fn located_poses(tracked: &[TrackedRevolution]) -> Vec<LaserPose> {
    tracked
        .iter()
        .filter(|revolution| revolution.is_located)
        .map(|revolution| LaserPose { time: revolution.time, pose: revolution.pose })
        .collect()
}

/// Share of the sightings that may be of reflectors that were not seen before; false ones are among them.
const LARGEST_NEW_SHARE: f64 = 0.05;

/// Whether the reflectors kept their names from scan to scan.
pub(super) fn is_followed(tracked: &[TrackedRevolution]) -> bool {
    let all: usize = tracked.iter().map(|revolution| revolution.sightings.len()).sum();
    let names = tracked.iter().flat_map(|revolution| &revolution.sightings).map(|sighting| sighting.reflector + 1);
    let at_once = tracked.iter().map(|revolution| revolution.sightings.len()).max().unwrap_or(0);
    let new = names.max().unwrap_or(0).saturating_sub(at_once);
    new as f64 <= LARGEST_NEW_SHARE * all as f64
}

/// A drive, ready for calibration.
#[derive(Clone, Debug)]
pub struct Drive {
    /// What the log says that the vehicle is.
    pub nominal: VehicleModel,
    /// The same with the counters.
    pub tricycle: Tricycle,
    /// The counters.
    pub counted: Vec<Counted>,
    /// What is wrong with them.
    pub faults: Vec<CounterFault>,
    /// Whether that was mended.
    pub is_mended: bool,
    /// Whether the log believes that the drive counter counts the wrong way; here it is turned already.
    is_drive_turned: bool,
    /// What says how the laser moved.
    pub source: MotionSource,
    /// The windows.
    pub windows: Vec<Window>,
    /// Into how many windows each part of the drive falls.
    pub overlap: usize,
    /// Poses of the laser, as its motion was seen.
    pub poses: Vec<LaserPose>,
    /// What else there is to say.
    pub remarks: Vec<String>,
}

/// The reading of a drive counter that counts the other way.
fn opposite(reading: u32, tricycle: &Tricycle) -> u32 {
    (-i64::from(reading)).rem_euclid(tricycle.drive_range.values() as i64) as u32
}

/// Ways shorter than this are none, m.
const SHORTEST_WAY: f64 = 0.05;
/// Stops that make a calibration drive.
const FEWEST_STOPS: usize = 2;

/// What is known before a drive, beside its log.
#[derive(Clone, Copy, Debug, Default)]
pub struct Preparation<'a> {
    /// Reflectors whose places are known.
    pub map: Option<&'a [Landmark]>,
    /// Whether faults of the counter are mended.
    pub mend: bool,
}

/// The counters as ticks, and their faults; a driving wheel with a negative scale counts the other way.
fn count_all(
    input: &LogInput,
    tricycle: &Tricycle,
    is_drive_turned: bool,
    mend: bool,
) -> Result<(Vec<Counted>, Vec<CounterFault>), Refusal> {
    if input.encoders.len() < 2 {
        return Err(Refusal::NoEncoders);
    }
    let turned = |sample: &EncoderSample| EncoderSample { drive: opposite(sample.drive, tricycle), ..*sample };
    let (counted, faults) = if is_drive_turned {
        count(&input.encoders.iter().map(turned).collect::<Vec<_>>(), tricycle, mend)
    } else {
        count(&input.encoders, tricycle, mend)
    };
    let travelled: f64 = counted.windows(2).map(|pair| (pair[1].ticks - pair[0].ticks).abs()).sum();
    if travelled < SHORTEST_WAY / tricycle.drive_scale {
        return Err(Refusal::NoMotion);
    }
    Ok((counted, faults))
}

impl Drive {
    /// Counts, follows the reflectors, and cuts the drive.
    ///
    /// # Errors
    /// [`Refusal`].
    pub fn new(input: &LogInput, preparation: &Preparation) -> Result<Self, Refusal> {
        Self::cut(input, preparation, false)
    }

    /// The same; where too few reflectors are seen from both ends of the ways between stops, the drive is cut by time.
    ///
    /// # Errors
    /// [`Refusal`].
    pub fn among_few(input: &LogInput) -> Result<Self, Refusal> {
        Self::cut(input, &Preparation::default(), true)
    }

    fn cut(input: &LogInput, preparation: &Preparation, may_be_few: bool) -> Result<Self, Refusal> {
        let Vehicle::Tricycle(tricycle) = input.parameters.vehicle else {
            return Err(Refusal::OtherVehicle);
        };
        let is_drive_turned = tricycle.drive_scale < 0.0;
        let tricycle = Tricycle { drive_scale: tricycle.drive_scale.abs(), ..tricycle };
        let (counted, faults) = count_all(input, &tricycle, is_drive_turned, preparation.mend)?;
        let shortest = SHORTEST_WAY / tricycle.drive_scale;
        let nominal = VehicleModel::nominal(&tricycle, input.parameters.lasers.first());
        let mut drive = Self {
            nominal,
            tricycle,
            counted,
            faults,
            is_mended: preparation.mend,
            is_drive_turned,
            source: MotionSource::ReflectorsAtStops,
            windows: Vec::new(),
            overlap: 1,
            poses: Vec::new(),
            remarks: Vec::new(),
        };
        if input.bad_observations > 0 {
            drive.remarks.push(format!("{} observations of reflectors are no numbers", input.bad_observations));
        }
        let direct = if input.laser_poses.len() >= 2 { &input.laser_poses } else { &input.given_poses };
        let tracked = drive.follow(input, direct, preparation.mend)?;
        let located = located_poses(&tracked);
        if located.len() >= FEWEST_STOPS {
            drive.poses = located;
            let (stops, noise) = stops(&standstills(&drive.counted, tricycle.drive_scale), &tracked);
            if stops.len() >= FEWEST_STOPS {
                match drive.cut_at_stops(&stops, &noise, shortest, preparation.map) {
                    Err(Refusal::FewReflectors { .. }) if may_be_few => drive.windows.clear(),
                    cut => cut?,
                }
            }
            if drive.windows.is_empty() {
                drive.cut_by_poses(MotionSource::ReflectorsWhileDriving, shortest);
            }
            return Ok(drive);
        }
        if direct.len() < 2 {
            return Err(if input.revolutions.is_empty() && input.bad_observations > 0 {
                Refusal::NoNumbers(input.bad_observations)
            } else {
                Refusal::NoLaserMotion
            });
        }
        drive.poses.clone_from(direct);
        let is_measured = input.laser_poses.len() >= 2;
        let source = if is_measured { MotionSource::LaserPoses } else { MotionSource::GivenPoses };
        drive.cut_by_poses(source, shortest);
        Ok(drive)
    }

    /// The same drive cut by time where it was cut at stops: for drives with so few of them that nothing is told.
    #[must_use]
    pub fn without_stops(mut self) -> Self {
        let shortest = SHORTEST_WAY / self.tricycle.drive_scale;
        self.cut_by_poses(MotionSource::ReflectorsWhileDriving, shortest);
        self
    }

    /// Whether its windows go from stop to stop, as those of a drive for calibration do.
    #[must_use]
    pub fn is_from_stops(&self) -> bool {
        matches!(self.source, MotionSource::ReflectorsAtStops | MotionSource::ReflectorMap)
    }

    /// Follows the reflectors, and turns the counter that counts the wrong way; `direct` are poses that others have found.
    fn follow(
        &mut self,
        input: &LogInput,
        direct: &[LaserPose],
        mend: bool,
    ) -> Result<Vec<TrackedRevolution>, Refusal> {
        let nominal = self.nominal;
        let follow = |counted: &[Counted]| track(&input.revolutions, &OdometryPath::new(counted, &nominal));
        let poses = |tracked: &[TrackedRevolution]| {
            let located = located_poses(tracked);
            if located.len() < FEWEST_STOPS { Some(direct.to_vec()) } else { is_followed(tracked).then_some(located) }
        };
        let tracked = follow(&self.counted);
        let seen = poses(&tracked);
        let turned = wrong_direction(&self.counted, &nominal, seen.as_deref(), |turned| poses(&follow(turned)));
        let Some((fault, turned)) = turned else { return Ok(tracked) };
        if !mend {
            return Err(Refusal::WrongDirection(fault.to_string()));
        }
        self.faults.push(fault);
        self.counted = turned;
        Ok(follow(&self.counted))
    }

    /// The vehicle with parameters that were found: a counter that counts the wrong way has a negative scale.
    #[must_use]
    pub fn vehicle(&self, model: &VehicleModel) -> Tricycle {
        let is_wrong =
            |is_steering| self.is_mended && self.faults.contains(&CounterFault::WrongDirection { is_steering });
        let sign = |is_turned: bool| if is_turned { -1.0 } else { 1.0 };
        let found = model.apply(&self.tricycle);
        // Both offsets in one turn: one just below 180 degrees and one just above it are neighbours.
        let backward =
            found.steering_offset_forward + difference(found.steering_offset_backward, found.steering_offset_forward);
        Tricycle {
            steering_offset_backward: backward,
            drive_scale: sign(is_wrong(false) != self.is_drive_turned) * found.drive_scale,
            steering_scale: sign(is_wrong(true)) * found.steering_scale,
            ..found
        }
    }

    fn cut_by_poses(&mut self, source: MotionSource, shortest: f64) {
        self.source = source;
        self.windows = windows(&self.counted, &self.poses, shortest);
        self.overlap = super::windows::WINDOW_SECONDS.len();
    }

    fn cut_at_stops(
        &mut self,
        stops: &[Stop],
        noise: &ReflectorNoise,
        shortest: f64,
        map: Option<&[Landmark]>,
    ) -> Result<(), Refusal> {
        let (mut few, mut disagree, mut all) = (0, 0, 0);
        let mut ways = Vec::new();
        for pair in stops.windows(2) {
            let start = pair[0].standstill.end.seconds();
            all += 1;
            match between(&self.counted, &pair[0], &pair[1], shortest) {
                Ok(way) => {
                    if way.moved > 0 {
                        self.remarks.push(format!(
                            "{} {} moved after {start:.1} s",
                            count_of(way.moved, "reflector"),
                            if way.moved == 1 { "was" } else { "were" }
                        ));
                    }
                    ways.push(way);
                }
                Err(NoMotion::Rest) => all -= 1,
                Err(NoMotion::Reversal) => {
                    self.remarks.push(format!("the segment from {start:.1} s goes forth and back"));
                }
                Err(NoMotion::FewReflectors) => few += 1,
                Err(NoMotion::Disagreement) => disagree += 1,
            }
        }
        let noise = with_lasting_part(&ways, noise);
        self.windows.extend(ways.iter().filter_map(|way| way.window(&noise)));
        if 4 * disagree > all {
            return Err(Refusal::ReflectorsMoved { bad: disagree, all });
        }
        if 2 * few > all {
            return Err(Refusal::FewReflectors { bad: few, all });
        }
        if disagree + few > 0 {
            self.remarks.push(format!("{} segments were left out for their reflectors", disagree + few));
        }
        if let Some(map) = map {
            self.refine(stops, map);
        }
        for index in 1..self.windows.len() {
            self.windows[index].shares_start = self.windows[index].start == self.windows[index - 1].end;
        }
        Ok(())
    }

    /// Replaces the motions of windows between stops that the map can place.
    fn refine(&mut self, stops: &[Stop], map: &[Landmark]) {
        let placed = stop_poses(stops, &self.windows, map);
        let mut refined = 0;
        for window in &mut self.windows {
            let pose = |time| placed.iter().find(|stop| stop.time == time);
            if let (Some(start), Some(end)) = (pose(window.start), pose(window.end)) {
                window.motion = start.pose.between(&end.pose);
                window.pose_errors = [start.error, end.error];
                refined += 1;
            }
        }
        if refined == 0 {
            self.remarks.push("the map does not fit to what was seen at the stops; it is not used".to_owned());
            return;
        }
        self.source = MotionSource::ReflectorMap;
        if refined < self.windows.len() {
            let left = self.windows.len() - refined;
            self.remarks.push(format!("{left} segments could not be placed in the map"));
        }
    }
}
