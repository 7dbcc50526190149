//! Finding the pose of a vehicle that is switched on, in slices, from what it sees while it stands or drives.
#![allow(clippy::indexing_slicing, reason = "a panic is how a test fails")]

use agv_core::geometry::{Point, Pose};
use agv_core::localizer::{
    EFFORT_A_REVOLUTION, Event, Mode, Parameters, PoseFix, StartFinder, StartRule, StartSearch, StartState,
};
use agv_core::maps::{FixedMap, Landmark};
use agv_core::measurement::{PoseIncrement, ReflectorObservation, Reflectors, Time};
use agv_core::relocalization::{ReflectorIndex, RelocalizationParameters};
use agv_core::sensing::ReflectorDetection;
use agv_core::state::Relocalization;

use super::support::stage::{LASER, Stage, parameters, reflectors};

fn map(landmarks: &[Landmark]) -> Box<FixedMap<64>> {
    let mut map = Box::new(FixedMap::new());
    assert_eq!(map.extend(landmarks), Ok(()));
    map
}

fn at(pose: &Pose, landmark: &Landmark, time: Time) -> ReflectorObservation {
    let seen = pose.compose(&LASER).inverse_transform(&landmark.position());
    ReflectorObservation { time, range: seen.norm() as f32, bearing: seen.y.atan2(seen.x) as f32 }
}

fn is_near_within(fix: &PoseFix, pose: &Pose, distance: f64) -> bool {
    let off = pose.between(&fix.pose);
    off.x.hypot(off.y) < distance && off.theta.abs() < 0.2 * distance
}

fn is_near(fix: &PoseFix, pose: &Pose) -> bool {
    is_near_within(fix, pose, 0.005)
}

struct Search {
    map: Box<FixedMap<64>>,
    search: Box<StartSearch>,
    mode: Mode,
}

impl Search {
    fn new(landmarks: &[Landmark], is_wanted: bool) -> Self {
        let map = map(landmarks);
        let search = Box::new(StartSearch::new(&parameters(), is_wanted));
        assert_eq!(search.state(), Relocalization::Idle);
        Self { map, search, mode: Mode::NotLocalised }
    }

    fn see(&mut self, observations: &[ReflectorObservation]) {
        self.search.handle(&Event::Reflectors(Reflectors::of_first(observations)), self.mode, self.map.view());
    }

    /// Slices until there is nothing more to do.
    fn found(&mut self) -> Option<PoseFix> {
        for _ in 0..=EFFORT_A_REVOLUTION / 2_000 {
            let (goes_on, fix) = self.search.advance(self.map.view(), None);
            if fix.is_some() || !goes_on {
                return fix;
            }
            assert_eq!(self.search.state(), Relocalization::Searching);
        }
        None
    }
}

fn view(pose: &Pose) -> Vec<ReflectorObservation> {
    reflectors().iter().map(|landmark| at(pose, landmark, Time::from_seconds(2.0))).collect()
}

#[test]
fn a_vehicle_that_does_not_know_where_it_is_finds_it() {
    let pose = Pose::new(1.0, 0.5, 2.0);
    for mode in [Mode::NotLocalised, Mode::Lost] {
        let mut search = Search::new(&reflectors(), true);
        search.mode = mode;
        assert_eq!(search.search.advance(search.map.view(), None), (false, None), "nothing has been seen");
        for _ in 0..7 {
            search.see(&view(&pose));
            assert_eq!((search.found(), search.search.state()), (None, Relocalization::Searching));
        }
        search.see(&view(&pose));
        let fix = search.found();
        assert!(fix.is_some_and(|fix| is_near(&fix, &pose) && fix.time == Time::from_seconds(2.0)), "{fix:?}");
        assert!(fix.is_some_and(|fix| (0.014..0.05).contains(&fix.position_deviation)), "{fix:?}");
        assert!(fix.is_some_and(|fix| (0.003..0.02).contains(&fix.heading_deviation)), "{fix:?}");
        // The localiser knows it now.
        search.mode = Mode::Reflectors;
        search.see(&view(&pose));
        assert_eq!(search.search.state(), Relocalization::Idle);
        assert_eq!(search.found(), None);
    }
}

#[test]
fn who_knows_it_or_does_not_want_to_does_not_search() {
    let pose = Pose::new(1.0, 0.5, 2.0);
    for (mode, is_wanted) in
        [(Mode::NotLocalised, false), (Mode::Lost, false), (Mode::Degraded, true), (Mode::Mixed, true)]
    {
        let mut search = Search::new(&reflectors(), is_wanted);
        search.mode = mode;
        search.see(&view(&pose));
        assert_eq!((search.found(), search.search.state()), (None, Relocalization::Idle), "{mode:?}");
    }
}

#[test]
fn a_search_without_a_pose_says_why() {
    let pose = Pose::new(1.0, 0.5, 2.0);
    let mut search = Search::new(&reflectors(), true);
    search.see(&view(&pose)[..3]);
    assert_eq!((search.found(), search.search.state()), (None, Relocalization::TooFew));
    let mut search = Search::new(&reflectors(), true);
    let elsewhere: Vec<_> = (0..9)
        .map(|index| {
            let index = f64::from(index);
            let place = Point::new(1.3 * index - 4.0, 0.37 * index * index - 3.0);
            at(&pose, &Landmark::reflector(0, place, 0.0), Time::from_seconds(2.0))
        })
        .collect();
    search.see(&elsewhere);
    assert_eq!((search.found(), search.search.state()), (None, Relocalization::Unknown));
    // A hall that looks the same from both ends.
    let half = reflectors();
    let other = half.iter().map(|one| Landmark::reflector(one.id + 20, -one.position(), one.deviation));
    let both: Vec<_> = half.iter().copied().chain(other).collect();
    let mut search = Search::new(&both, true);
    let seen: Vec<_> = both.iter().map(|landmark| at(&pose, landmark, Time::from_seconds(2.0))).collect();
    search.see(&seen);
    assert_eq!((search.found(), search.search.state()), (None, Relocalization::Ambiguous));
    // While it searches anew, the last answer stands.
    search.see(&seen);
    assert_eq!(search.search.state(), Relocalization::Ambiguous);
}

struct Finder {
    map: Box<FixedMap<64>>,
    index: Box<ReflectorIndex>,
    finder: StartFinder<64>,
    pose: Pose,
    time: f64,
}

/// Pose of a vehicle that drives on an arc.
fn step(speed: f64, seconds: f64) -> Pose {
    Pose::exp(&agv_core::geometry::Twist { x: speed * seconds, y: 0.0, theta: 0.3 * speed * seconds })
}

impl Finder {
    fn new() -> Self {
        let parameters: Parameters = parameters();
        let map = map(&reflectors());
        let mut index = Box::new(ReflectorIndex::new());
        index.build(map.view());
        let finder = StartFinder::new(parameters, RelocalizationParameters::default(), StartRule::ONE_LOOK);
        let mut finder = Self { map, index, finder, pose: Pose::new(-3.0, 0.5, 0.2), time: 5.0 };
        finder.drive(0.0, 1);
        finder
    }

    fn tell(&mut self, event: &Event) {
        self.finder.handle(event, &self.index.of(self.map.view()));
    }

    fn drive(&mut self, speed: f64, samples: usize) {
        for _ in 0..samples {
            let displacement = step(speed, 0.02);
            self.time += 0.02;
            self.pose = self.pose.compose(&displacement);
            self.tell(&Event::Increment(PoseIncrement { time: Time::from_seconds(self.time), displacement }));
        }
    }

    /// Some reflectors, each as it was so many seconds before now.
    fn see(&mut self, seen: impl IntoIterator<Item = usize>, speed: f64, ago: impl Fn(usize) -> f64) {
        let landmarks = reflectors();
        let observations: Vec<_> = seen
            .into_iter()
            .map(|index| {
                let pose = self.pose.compose(&step(speed, -ago(index)));
                at(&pose, &landmarks[index], Time::from_seconds(self.time - ago(index)))
            })
            .collect();
        self.tell(&Event::Reflectors(Reflectors::of_first(&observations)));
    }

    fn search(&mut self) -> StartState {
        self.finder.search(&self.index.of(self.map.view()), u32::MAX)
    }

    fn found(&mut self) -> Option<PoseFix> {
        match self.search() {
            StartState::Found(fix) => {
                assert!(is_near(&fix, &self.pose), "{fix:?} {:?}", self.pose);
                Some(fix)
            }
            state => {
                assert_eq!(state, StartState::TooFew);
                None
            }
        }
    }
}

#[test]
fn reflectors_are_carried_to_one_time_by_the_motion() {
    for speed in [0.0, 1.5, -1.5] {
        let mut finder = Finder::new();
        assert_eq!(finder.search(), StartState::Waiting);
        finder.drive(speed, 4);
        // Of a revolution of 120 ms some have been seen before the last sample, and some are seen behind it.
        finder.see(0..12, speed, |index| 0.1 - 0.01 * index as f64);
        // It goes on while the search does.
        finder.drive(speed, 7);
        let fix = finder.found();
        assert!(fix.is_some_and(|fix| fix.time == Time::from_seconds(finder.time)), "{speed}: {fix:?}");
        assert_eq!(finder.search(), StartState::Waiting);
    }
}

#[test]
fn reflectors_of_several_revolutions_are_put_together_unless_the_way_between_is_not_known() {
    // Three and three alone are too few.
    let after = |between: &dyn Fn(&mut Finder)| {
        let mut finder = Finder::new();
        finder.see([0, 3, 6], 0.0, |_| 0.0);
        assert_eq!(finder.found(), None);
        between(&mut finder);
        finder.see([5, 8, 10], 0.0, |_| 0.0);
        finder.found().is_some()
    };
    assert!(after(&|finder| finder.drive(1.5, 10)));
    assert!(!after(&|finder| finder.finder.forget()));
    // The odometry is silent for long, or says what cannot be.
    assert!(after(&|finder| finder.time += 0.29));
    assert!(!after(&|finder| finder.time += 0.31));
    let jump = |finder: &mut Finder| {
        let displacement = Pose::new(1.0, 0.0, 0.0);
        finder.time += 0.02;
        finder.tell(&Event::Increment(PoseIncrement { time: Time::from_seconds(finder.time), displacement }));
    };
    assert!(!after(&jump));
    // After ten metres the odometry has carried it too far.
    let circle = |finder: &mut Finder, count: usize| {
        finder.drive(2.4, count);
        finder.drive(0.0, 2);
    };
    assert!(after(&|finder| circle(finder, 200)));
    assert!(!after(&|finder| circle(finder, 210)));
}

#[test]
fn bright_places_of_a_scan_are_looked_for_if_the_vehicle_says_how() {
    let detection = Some(ReflectorDetection::default());
    for (detection, is_bright, is_seen) in [(detection, true, true), (detection, false, false), (None, true, false)] {
        let mut stage = Stage::new(parameters());
        let way = stage.revolve(0.0, 0.0);
        let (ranges, intensities) = way.beams();
        let scan = way.scan(&ranges, if is_bright { &intensities } else { &[] });
        let mut finder = Finder::new();
        let mut parameters = parameters();
        parameters.reflectors.detection = detection;
        finder.finder = StartFinder::new(parameters, RelocalizationParameters::default(), StartRule::ONE_LOOK);
        finder.pose = stage.truth;
        finder.tell(&Event::Scan(scan));
        if is_seen {
            let state = finder.search();
            assert!(matches!(state, StartState::Found(fix) if is_near_within(&fix, &stage.truth, 0.02)), "{state:?}");
        } else {
            assert_eq!(finder.search(), StartState::Waiting);
        }
    }
}
