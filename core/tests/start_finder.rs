//! A pose that is found is true at the time that it states.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]

use agv_core::geometry::{Point, Pose};
use agv_core::localizer::{Event, Parameters, PoseFix, StartFinder, StartRule, StartState};
use agv_core::maps::{FixedMap, Landmark};
use agv_core::measurement::{EncoderFault, EncoderFaults, PoseIncrement, ReflectorObservation, Reflectors, Time};
use agv_core::odometry::Vehicle;
use agv_core::relocalization::{ReflectorIndex, RelocalizationParameters};
use proptest::prelude::*;

/// Time of a revolution, s.
const REVOLUTION: f64 = 0.125;

struct Search {
    map: FixedMap<128>,
    index: Box<ReflectorIndex>,
    finder: StartFinder<64>,
    laser: Pose,
}

impl Search {
    fn new(positions: &[Point]) -> Self {
        let parameters = Parameters::new(Vehicle::Increments, Pose::new(0.6, 0.1, 0.2));
        let (mut map, mut index) = (FixedMap::new(), Box::new(ReflectorIndex::new()));
        let reflectors: Vec<Landmark> =
            (0..).zip(positions).map(|(id, position)| Landmark::reflector(id, *position, 0.002)).collect();
        map.extend(&reflectors).unwrap();
        index.build(map.view());
        let finder = StartFinder::new(parameters, RelocalizationParameters::default(), StartRule::ONE_LOOK);
        Self { map, index, finder, laser: *parameters.lasers.first() }
    }

    fn tell(&mut self, event: &Event) -> StartState {
        let reflectors = self.index.of(self.map.view());
        self.finder.handle(event, &reflectors);
        self.finder.search(&reflectors, u32::MAX)
    }

    /// A revolution of a laser at that place at every time.
    fn revolution(&mut self, start: f64, place: impl Fn(f64) -> Pose) -> StartState {
        let mut observations = Vec::new();
        for (number, landmark) in self.map.landmarks().iter().enumerate() {
            let time = start + REVOLUTION * number as f64 / self.map.landmarks().len() as f64;
            let seen = place(time).compose(&self.laser).inverse_transform(&Point::new(landmark.x, landmark.y));
            if seen.norm() < 30.0 && observations.len() < 50 {
                observations.push(ReflectorObservation {
                    time: Time::from_seconds(time),
                    range: seen.norm() as f32,
                    bearing: seen.y.atan2(seen.x) as f32,
                });
            }
        }
        self.tell(&Event::Reflectors(Reflectors::of_first(&observations)))
    }
}

fn positions() -> impl Strategy<Value = Vec<Point>> {
    prop::collection::vec((0.0..60.0, 0.0..40.0).prop_map(|(x, y)| Point::new(x, y)), 40)
}

fn poses() -> impl Strategy<Value = Pose> {
    (20.0..40.0, 10.0..30.0, -3.1..3.1).prop_map(|(x, y, theta)| Pose::new(x, y, theta))
}

fn found(state: StartState) -> Option<PoseFix> {
    match state {
        StartState::Found(fix) => Some(fix),
        _ => None,
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn without_odometry_it_is_the_time_of_the_revolution(positions in positions(), pose in poses(), start in 1.0..1e5) {
        let mut search = Search::new(&positions);
        for revolution in 0..3 {
            let start = start + f64::from(revolution) * REVOLUTION;
            if let Some(fix) = found(search.revolution(start, |_| pose)) {
                prop_assert!((fix.time.seconds() - start).abs() < 0.3 + REVOLUTION, "{fix:?}");
                prop_assert!((fix.pose.x - pose.x).hypot(fix.pose.y - pose.y) < 0.01, "{fix:?}");
                return Ok(());
            }
        }
        prop_assert!(false, "the pose is not found");
    }

    /// A revolution that was under way when the odometry spoke again tells nothing of where the vehicle was before.
    #[test]
    fn what_was_seen_before_the_odometry_spoke_again_is_not_placed(
        positions in positions(), pose in poses(), before in 0.03..0.12,
    ) {
        let mut search = Search::new(&positions);
        let place = |time: f64| pose.compose(&Pose::new(time - 10.0, 0.0, 0.0));
        let increment = |time: f64| {
            let displacement = Pose::new(0.01, 0.0, 0.0);
            Event::Increment(PoseIncrement { time: Time::from_seconds(time), displacement })
        };
        search.tell(&increment(9.99));
        search.tell(&increment(10.0));
        let time = Time::from_seconds(10.0);
        search.tell(&Event::EncoderFaults(EncoderFaults { time, drive: Some(EncoderFault::Missing), ..EncoderFaults::default() }));
        // Nobody says how far it goes meanwhile.
        let found_blindly = found(search.revolution(10.5, place));
        prop_assert!(found_blindly.is_none(), "{found_blindly:?}");
        for number in 0..=10_u8 {
            search.tell(&increment(11.0 + 0.01 * f64::from(number)));
        }
        let fix = found(search.revolution(11.0 - before, place)).or_else(|| found(search.tell(&increment(11.11))));
        if let Some(fix) = fix {
            let there = place(fix.time.seconds());
            prop_assert!((fix.pose.x - there.x).hypot(fix.pose.y - there.y) < 0.02, "{fix:?} {there:?}");
        }
    }

    /// What was seen before the last sample is placed by the pace of the last tenth of a second: one interval may be told
    /// late, and the next one early.
    #[test]
    fn samples_that_come_unevenly_do_not_displace_what_is_seen(positions in positions(), pose in poses()) {
        let mut search = Search::new(&positions);
        let place = |time: f64| pose.compose(&Pose::new(time - 10.0, 0.0, 0.0));
        let mut driven = 9.0;
        for number in 1..=100_u8 {
            let time = 9.0 + 0.01 * f64::from(number);
            // Of two samples the first has all the way, and the second has none.
            let told = if number % 2 == 1 { time + 0.01 } else { time };
            let displacement = Pose::new(told - driven, 0.0, 0.0);
            driven = told;
            search.tell(&Event::Increment(PoseIncrement { time: Time::from_seconds(time), displacement }));
        }
        let fix = found(search.revolution(10.0 - REVOLUTION, place));
        let Some(fix) = fix else { return Err(TestCaseError::fail("the pose is not found")) };
        let there = place(fix.time.seconds());
        prop_assert!((fix.pose.x - there.x).hypot(fix.pose.y - there.y) < 0.02, "{fix:?} {there:?}");
    }

    /// A vehicle drives straight on, its encoders fail for a while, and it drives on.
    #[test]
    fn after_a_fault_what_was_before_is_not_carried_on(positions in positions(), pose in poses(), silence in 0.02..2.0) {
        let mut search = Search::new(&positions);
        let place = |time: f64| pose.compose(&Pose::new(time - 10.0, 0.0, 0.0));
        let period = 0.01;
        let drive = |search: &mut Search, from: f64, to: f64| {
            let mut last = None;
            let count = ((to - from) / period).round() as usize;
            for number in 1..=count {
                let time = Time::from_seconds(from + number as f64 * period);
                let displacement = Pose::new(period, 0.0, 0.0);
                last = found(search.tell(&Event::Increment(PoseIncrement { time, displacement }))).or(last);
            }
            last
        };
        drive(&mut search, 9.9, 10.0);
        let time = Time::from_seconds(10.0);
        let faults = EncoderFaults { time, drive: Some(EncoderFault::Missing), ..EncoderFaults::default() };
        search.tell(&Event::EncoderFaults(faults));
        let again = 10.0 + silence;
        drive(&mut search, again - period, again + REVOLUTION);
        let first = found(search.revolution(again, place));
        let fix = first.or_else(|| drive(&mut search, again + REVOLUTION, again + 2.0 * REVOLUTION));
        let Some(fix) = fix else { return Err(TestCaseError::fail("the pose is not found")) };
        let there = place(fix.time.seconds());
        prop_assert!(fix.time.seconds() > again, "{fix:?}");
        prop_assert!((fix.pose.x - there.x).hypot(fix.pose.y - there.y) < 0.02, "{fix:?} {there:?}");
    }
}
