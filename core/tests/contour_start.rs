//! Finding the pose of a vehicle that is switched on in a kept map of contours, in slices.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "a panic is how a test fails")]

use std::f64::consts::{PI, TAU};

use agv_core::contours::{KeptMap, PlaceAnswer, PlaceProgress, PlaceSearch, Submap};
use agv_core::geometry::Pose;
use agv_core::localizer::{Event, Mode, Parameters, PoseFix, StartSearch};
use agv_core::maps::FixedMap;
use agv_core::measurement::{PoseIncrement, Scan, Time};
use agv_core::odometry::Vehicle;
use agv_core::sensing::PointScan;
use agv_core::sources::Places;
use agv_core::state::Relocalization;

use super::support::kept_map::kept_map;
use super::support::walls::{BEAMS, Noise, Walls, corridor, range, ranges, room, scan};

const LASER: Pose = Pose { x: 0.4, y: 0.05, theta: 0.2 };

type Room = Submap<4096>;

/// A search and its room.
#[derive(Default)]
struct Search {
    places: PlaceSearch,
    room: Room,
}

/// A map of walls where they are.
fn map(walls: &Walls) -> KeptMap<'static> {
    kept_map(walls, &Pose::default())
}

/// The answer to a scan of a laser in walls, and the number of slices of so much effort.
fn answer(search: &mut Search, walls: &Walls, map: &KeptMap, laser: &Pose, slice: u32) -> (PlaceAnswer, usize) {
    let ranges = ranges(walls, laser, &mut Noise(7));
    let mut points: Box<PointScan<BEAMS>> = Box::default();
    points.set(&scan(&ranges, Time::default()), 0.05, 60.0);
    search.places.begin(points.view());
    for slices in 1..1_000_000 {
        if let PlaceProgress::Done(answer) = search.places.advance(map, &mut search.room, slice) {
            return (answer, slices);
        }
    }
    panic!("the search does not end");
}

fn is_near(found: &Pose, truth: &Pose) -> bool {
    let error = truth.between(found);
    error.position().norm() < 0.03 && error.theta.abs() < 0.01
}

#[test]
fn a_laser_is_found_wherever_it_is_in_a_room_and_however_it_is_turned() {
    let map = map(&room());
    let mut search: Box<Search> = Box::default();
    let mut noise = Noise(3);
    for _ in 0..20 {
        let place = Pose::new(-1.0 + 7.0 * noise.uniform(), -2.0 + 6.0 * noise.uniform(), TAU * noise.uniform());
        let (found, _) = answer(&mut search, &room(), &map, &place, 3000);
        assert!(matches!(found, PlaceAnswer::Found(fix) if is_near(&fix.pose, &place)), "{place:?}: {found:?}");
    }
}

#[test]
fn slices_of_any_length_give_the_same_answer_and_none_does_nothing() {
    let map = map(&room());
    let place = Pose::new(1.0, 2.0, 0.7);
    let whole = answer(&mut Box::<Search>::default(), &room(), &map, &place, u32::MAX);
    assert_eq!(whole.1, 1);
    for slice in [100, 1000, 10_000] {
        let (found, slices) = answer(&mut Box::<Search>::default(), &room(), &map, &place, slice);
        assert_eq!(found, whole.0, "slices of {slice}");
        assert!(slices > 10, "slices of {slice}: {slices}");
    }
}

#[test]
fn a_room_that_is_its_own_image_is_ambiguous() {
    let walls = vec![[0.0, 0.0, 12.0, 0.0], [12.0, 0.0, 12.0, 8.0], [12.0, 8.0, 0.0, 8.0], [0.0, 8.0, 0.0, 0.0]];
    let place = Pose::new(4.0, 3.0, 0.5);
    let (found, _) = answer(&mut Box::default(), &walls, &map(&walls), &place, 3000);
    let PlaceAnswer::Ambiguous(one, other) = found else { panic!("{found:?}") };
    let image = Pose::new(8.0, 5.0, 0.5 + PI);
    for sought in [place, image] {
        assert!(is_near(&one.pose, &sought) || is_near(&other.pose, &sought), "{found:?}");
    }
}

#[test]
fn along_a_plain_corridor_no_place_is_told() {
    let (found, _) =
        answer(&mut Box::default(), &corridor(None), &map(&corridor(None)), &Pose::new(3.0, 0.2, 0.1), 3000);
    assert!(!matches!(found, PlaceAnswer::Found(_)), "{found:?}");
}

/// The room has no nook and no cupboard, and stands elsewhere: the map's room looks much like it.
#[test]
fn where_the_free_space_of_the_map_is_taken_nothing_is_found() {
    let walls = vec![[0.0, 0.0, 5.0, 0.0], [5.0, 0.0, 5.0, 3.0], [5.0, 3.0, 0.0, 3.0], [0.0, 3.0, 0.0, 0.0]];
    let (found, _) = answer(&mut Box::default(), &walls, &map(&room()), &Pose::new(2.0, 1.5, 0.3), 3000);
    assert!(!matches!(found, PlaceAnswer::Found(_)), "{found:?}");
}

#[test]
fn without_a_map_or_surfaces_nothing_is_found() {
    let empty = KeptMap::EMPTY;
    let place = Pose::new(1.0, 2.0, 0.7);
    assert_eq!(answer(&mut Box::default(), &room(), &empty, &place, 3000).0, PlaceAnswer::Unknown);
    let nothing = Walls::new();
    assert_eq!(answer(&mut Box::default(), &nothing, &map(&room()), &place, 3000).0, PlaceAnswer::TooFew);
}

/// The sides of a box of that size, whose lower left corner is there.
fn sides((x, y): (f64, f64), size: f64) -> [[f64; 4]; 4] {
    let (right, top) = (x + size, y + size);
    [[x, y, right, y], [right, y, right, top], [right, top, x, top], [x, top, x, y]]
}

/// Two walls 16 m apart whose ends are out of sight, and boxes of 1 m between them, of which one was moved along by so much.
fn boxes(places: &[(f64, f64)], moved: f64) -> Walls {
    let mut walls = vec![[-80.0, -8.0, 80.0, -8.0], [-80.0, 8.0, 80.0, 8.0]];
    for (number, (x, y)) in places.iter().enumerate() {
        let x = if number == 0 { x + moved } else { *x };
        walls.extend(sides((x, *y), 1.0));
    }
    walls
}

/// A hall of 150 m by 50 m with boxes that stand irregularly.
fn hall() -> Walls {
    const SIZE: (f64, f64) = (150.0, 50.0);
    let mut noise = Noise(91);
    let mut place = || (1.0 + (SIZE.0 - 3.0) * noise.uniform(), 1.0 + (SIZE.1 - 3.0) * noise.uniform());
    let places: Vec<_> = (0..120).map(|_| place()).collect();
    let (x, y) = SIZE;
    let mut walls = boxes(&places, 0.0).split_off(2);
    walls.extend([[0.0, 0.0, x, 0.0], [x, 0.0, x, y], [x, y, 0.0, y], [0.0, y, 0.0, 0.0]]);
    walls
}

#[test]
fn a_laser_is_found_wherever_it_is_in_a_large_hall_and_no_look_takes_long() {
    const SLICE: u32 = 3000;
    let walls = hall();
    let map = map(&walls);
    let mut search: Box<Search> = Box::default();
    let mut noise = Noise(17);
    // Corners of the hall, ends of its middle, and what is between.
    let edges = [(1.0, 0.5), (149.0, 0.5), (149.0, 49.5), (0.6, 49.0), (0.6, 25.0), (149.5, 24.0)];
    let within = (0..14).map(|_| (150.0 * noise.uniform(), 50.0 * noise.uniform())).collect::<Vec<_>>();
    let is_free = |(x, y): &(f64, f64)| {
        !walls.iter().any(|[ax, ay, bx, by]| {
            (ax.min(*bx) - 0.3..=ax.max(*bx) + 0.3).contains(x) && (ay.min(*by) - 0.3..=ay.max(*by) + 0.3).contains(y)
        })
    };
    let free: Vec<_> = edges.into_iter().chain(within).filter(is_free).collect();
    assert!(free.len() >= 15, "{free:?}");
    for (x, y) in free {
        let place = Pose::new(x, y, TAU * noise.uniform());
        let (found, slices) = answer(&mut search, &walls, &map, &place, SLICE);
        assert!(matches!(found, PlaceAnswer::Found(fix) if is_near(&fix.pose, &place)), "{place:?}: {found:?}");
        assert!(slices < 1200, "{place:?}: {slices}");
    }
}

/// A corridor of 60 m that has niches at irregular distances: many places are alike, and one of them fits.
#[test]
fn a_laser_is_found_along_a_corridor_of_niches_and_no_look_takes_long() {
    const LENGTH: f64 = 60.0;
    let mut noise = Noise(23);
    let mut walls = vec![[0.0, -1.2, 0.0, 1.2], [LENGTH, -1.2, LENGTH, 1.2]];
    for side in [1.2, -1.2] {
        let (mut x, deep) = (0.0, side * 1.4 / 1.2);
        while x < LENGTH - 8.0 {
            let begin = x + 1.0 + 5.0 * noise.uniform();
            let end = begin + 0.8 + 0.6 * noise.uniform();
            walls.extend([[x, side, begin, side], [begin, side, begin, deep]]);
            walls.extend([[begin, deep, end, deep], [end, deep, end, side]]);
            x = end;
        }
        walls.push([x, side, LENGTH, side]);
    }
    let map = map(&walls);
    let mut search: Box<Search> = Box::default();
    for _ in 0..10 {
        let place = Pose::new(3.0 + 54.0 * noise.uniform(), noise.uniform() - 0.5, TAU * noise.uniform());
        let (found, slices) = answer(&mut search, &walls, &map, &place, 3000);
        assert!(matches!(found, PlaceAnswer::Found(fix) if is_near(&fix.pose, &place)), "{place:?}: {found:?}");
        assert!(slices < 3900, "{place:?}: {slices}");
    }
}

/// The nearest box shows most, and all but it stand where they stood.
#[test]
fn one_thing_that_was_moved_does_not_take_the_place_along() {
    let places = [(2.5, -0.5), (-6.0, 3.0), (-5.0, -5.5), (7.0, 4.0), (8.5, -4.5)];
    let map = map(&boxes(&places, 0.0));
    for moved in [-0.45, -0.2, 0.15, 0.4] {
        let truth = Pose::new(0.0, 0.2, 0.3);
        let (found, _) = answer(&mut Box::default(), &boxes(&places, moved), &map, &truth, 3000);
        assert!(matches!(found, PlaceAnswer::Found(fix) if is_near(&fix.pose, &truth)), "{moved}: {found:?}");
    }
}

#[test]
fn between_two_things_of_which_one_was_moved_no_place_is_told() {
    let places = [(2.5, -0.5), (-6.0, 3.0)];
    let map = map(&boxes(&places, 0.0));
    for moved in [-0.4, -0.2, 0.2, 0.4] {
        let (found, _) = answer(&mut Box::default(), &boxes(&places, moved), &map, &Pose::new(0.0, 0.2, 0.3), 3000);
        assert!(!matches!(found, PlaceAnswer::Found(_)), "{moved}: {found:?}");
    }
}

/// A hall of 12 m by 8 m that looks the same from the other end but for a cabinet, and boxes on its floor that no map has.
fn cabinet_hall(boxes: usize) -> Walls {
    let mut walls = vec![[0.0, 0.0, 12.0, 0.0], [12.0, 0.0, 12.0, 8.0], [12.0, 8.0, 0.0, 8.0], [0.0, 8.0, 0.0, 0.0]];
    walls.extend([[0.0, 1.8, 1.0, 1.8], [1.0, 1.8, 1.0, 4.2], [1.0, 4.2, 0.0, 4.2]]);
    let places = [(5.0, 4.6), (7.2, 2.2), (3.6, 1.4), (8.4, 4.4), (4.2, 6.4), (6.0, 0.9)];
    walls.extend(places.into_iter().take(boxes).flat_map(|place| sides(place, 0.8)));
    walls
}

/// The more is seen that fits neither of two places, the more must tell them apart.
#[test]
fn a_second_place_may_be_less_good_where_much_fits_neither() {
    let map = map(&cabinet_hall(0));
    let truth = Pose::new(6.5, 3.8, -1.0);
    for boxes in [0, 1, 5, 6] {
        let (found, _) = answer(&mut Box::default(), &cabinet_hall(boxes), &map, &truth, 3000);
        match found {
            PlaceAnswer::Found(fix) => assert!(boxes <= 1 && is_near(&fix.pose, &truth), "{boxes}: {found:?}"),
            PlaceAnswer::Ambiguous(one, other) => {
                let image = Pose::new(5.5, 4.2, PI - 1.0);
                assert!(boxes >= 5 && is_near(&one.pose, &truth) && is_near(&other.pose, &image), "{found:?}");
            }
            _ => panic!("{boxes}: {found:?}"),
        }
    }
}

/// What a controller does: events, and slices of the search in between.
struct Switched {
    search: Box<StartSearch<Places<'static, 400, 4096>>>,
    room: Box<Room>,
    map: KeptMap<'static>,
    time: f64,
    pose: Pose,
    noise: Noise,
}

impl Switched {
    fn new(map: KeptMap<'static>, pose: Pose) -> Self {
        let search = Box::new(StartSearch::new(&Parameters::new(Vehicle::Increments, LASER), true));
        Self { search, room: Box::default(), map, time: 1.0, pose, noise: Noise(11) }
    }

    /// Moves, sees a revolution, and searches as long as there is time for it.
    fn revolve(&mut self, walls: &Walls, step: &Pose) -> Option<PoseFix> {
        let reflectors = Box::new(FixedMap::<4>::new());
        self.time += 0.125;
        self.pose = self.pose.compose(step);
        let time = Time::from_seconds(self.time);
        let moved = Event::Increment(PoseIncrement { time, displacement: *step });
        self.search.handle(&moved, Mode::NotLocalised, reflectors.view());
        let ranges = ranges(walls, &self.pose.compose(&LASER), &mut self.noise);
        self.search.handle(&Event::Scan(scan(&ranges, time)), Mode::NotLocalised, reflectors.view());
        for _ in 0..10_000 {
            let (is_busy, found) = self.search.advance(reflectors.view(), Some((self.map, &mut self.room)));
            if found.is_some() || !is_busy {
                return found;
            }
        }
        panic!("there is no end to a revolution");
    }
}

#[test]
fn a_vehicle_finds_itself_by_two_looks_while_it_stands_and_while_it_moves() {
    for step in [Pose::default(), Pose::new(0.05, 0.0, 0.01)] {
        let mut vehicle = Switched::new(map(&room()), Pose::new(0.5, 1.0, -0.6));
        let mut found = None;
        for revolution in 0..20 {
            found = vehicle.revolve(&room(), &step);
            if found.is_some() {
                assert!(revolution > 0, "one look is not enough");
                break;
            }
            assert_ne!(vehicle.search.state(), Relocalization::Unknown, "{step:?}");
        }
        let fix = found.unwrap();
        assert!(is_near(&fix.pose, &vehicle.pose), "{fix:?} instead of {:?}", vehicle.pose);
        assert_eq!(fix.time, Time::from_seconds(vehicle.time));
    }
}

#[test]
fn an_ambiguous_start_is_told_and_no_pose() {
    let walls = vec![[0.0, 0.0, 12.0, 0.0], [12.0, 0.0, 12.0, 8.0], [12.0, 8.0, 0.0, 8.0], [0.0, 8.0, 0.0, 0.0]];
    let mut vehicle = Switched::new(map(&walls), Pose::new(4.0, 3.0, 0.5));
    for _ in 0..6 {
        assert_eq!(vehicle.revolve(&walls, &Pose::default()), None);
    }
    assert_eq!(vehicle.search.state(), Relocalization::Ambiguous);
}

/// Between two looks the vehicle is carried, to the side or round its laser, and the odometry does not see it.
#[test]
fn two_looks_at_different_places_tell_nothing() {
    for carried in [Pose::new(0.0, 0.4, 0.0), Pose::new(0.4, 0.0, 0.0), Pose::new(0.0, 0.0, 0.2)] {
        let mut vehicle = Switched::new(map(&room()), Pose::new(0.5, 1.0, -0.6));
        assert_eq!(vehicle.revolve(&room(), &Pose::default()), None);
        vehicle.pose = vehicle.pose.compose(&carried);
        assert_eq!(vehicle.revolve(&room(), &Pose::default()), None, "{carried:?}");
        let fix = vehicle.revolve(&room(), &Pose::default()).unwrap();
        assert!(is_near(&fix.pose, &vehicle.pose), "{fix:?} instead of {:?}", vehicle.pose);
    }
}

#[test]
fn what_was_seen_before_another_map_or_another_pose_tells_nothing() {
    let two = |between: &dyn Fn(&mut Switched)| {
        let mut vehicle = Switched::new(map(&room()), Pose::new(0.5, 1.0, -0.6));
        assert_eq!(vehicle.revolve(&room(), &Pose::default()), None);
        between(&mut vehicle);
        vehicle.revolve(&room(), &Pose::default()).is_some()
    };
    assert!(two(&|_| ()), "two looks are enough");
    assert!(!two(&|vehicle| vehicle.search.forget_maps()), "the map was replaced");
    let reflectors = Box::new(FixedMap::<4>::new());
    // The localiser has a pose for a while.
    let silence = Event::EncoderFaults(agv_core::measurement::EncoderFaults::default());
    assert!(!two(&|vehicle| vehicle.search.handle(&silence, Mode::Reflectors, reflectors.view())), "it was localised");
}

/// A laser that takes the time of a revolution for a scan, on a vehicle that drives a bend: the surfaces are where it saw them from.
#[test]
fn a_laser_that_moves_while_it_looks_is_found_where_it_is() {
    const REVOLUTION: f64 = 0.125;
    let map = map(&room());
    let reflectors = Box::new(FixedMap::<4>::new());
    let twist = agv_core::geometry::Twist { x: 1.2, y: 0.0, theta: 0.8 };
    let moved = |seconds: f64| {
        Pose::exp(&agv_core::geometry::Twist { x: twist.x * seconds, y: 0.0, theta: twist.theta * seconds })
    };
    let mut search: Box<StartSearch<Places<'static, 400, 4096>>> =
        Box::new(StartSearch::new(&Parameters::new(Vehicle::Increments, LASER), true));
    let mut room_of_search: Box<Room> = Box::default();
    let (mut pose, mut time, mut noise) = (Pose::new(-0.5, 0.2, 0.0), 1.0, Noise(5));
    let fix = (0..8).find_map(|_| {
        let (from, start) = (pose, Time::from_seconds(time));
        for _ in 0..5 {
            time += 0.2 * REVOLUTION;
            pose = pose.compose(&moved(0.2 * REVOLUTION));
            let increment = PoseIncrement { time: Time::from_seconds(time), displacement: moved(0.2 * REVOLUTION) };
            search.handle(&Event::Increment(increment), Mode::NotLocalised, reflectors.view());
        }
        let ranges: Vec<f32> = (0..BEAMS)
            .map(|beam| {
                let share = beam as f64 / BEAMS as f64;
                let laser = from.compose(&moved(share * REVOLUTION)).compose(&LASER);
                range(&room(), &Pose { theta: laser.theta - PI + TAU * share, ..laser }, &mut noise)
            })
            .collect();
        let scan = Scan { beam_interval: REVOLUTION / BEAMS as f64, ..scan(&ranges, start) };
        search.handle(&Event::Scan(scan), Mode::NotLocalised, reflectors.view());
        (0..10_000).find_map(|_| {
            let (is_busy, found) = search.advance(reflectors.view(), Some((map, &mut room_of_search)));
            (found.is_some() || !is_busy).then_some(found)
        })?
    });
    let off = pose.between(&fix.expect("it is found").pose);
    assert!(off.position().norm() < 0.02 && off.theta.abs() < 0.005, "{off:?}");
}

/// The map is replaced by that of a room that stands elsewhere, as the same hall in the frame of another survey.
#[test]
fn in_another_map_the_place_is_that_of_the_other_map() {
    let shift = Pose::new(3.0, -2.0, 0.0);
    let moved: Walls =
        room().iter().map(|[ax, ay, bx, by]| [ax + shift.x, ay + shift.y, bx + shift.x, by + shift.y]).collect();
    let mut vehicle = Switched::new(map(&room()), Pose::new(0.5, 1.0, -0.6));
    assert_eq!(vehicle.revolve(&room(), &Pose::default()), None);
    vehicle.map = map(&moved);
    vehicle.search.forget_maps();
    let fix = (0..6).find_map(|_| vehicle.revolve(&room(), &Pose::default())).unwrap();
    assert!(is_near(&fix.pose, &shift.compose(&vehicle.pose)), "{fix:?}");
}
