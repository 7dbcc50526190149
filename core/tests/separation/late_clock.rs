//! A laser that is late since the vehicle was switched on.

use agv_core::geometry::{Pose, Twist};

use super::drive::Drive;

/// Stands, and drives off at a metre a second, bends and stops; what the laser tells of each revolution is so much older than it says.
fn drive(seed: u64, late: f64, mut look: impl FnMut(&Drive, f64)) {
    let mut drive = Drive::new(seed);
    let mount = drive.mount;
    let parts = [
        (20, 0.0, 0.0),
        (4, 0.06, 0.0),
        (60, 0.125, 0.0),
        (20, 0.125, 0.04),
        (4, 0.06, 0.0),
        (8, 0.0, 0.0),
        (30, 0.125, 0.0),
    ];
    for (count, along, turn) in parts {
        for _ in 0..count {
            let step = Pose::new(along, 0.0, turn);
            let share = -late / 0.125;
            drive.true_mount = Pose::new(share * along, 0.0, share * turn).compose(&mount);
            drive.revolve(&step);
            look(&drive, along);
        }
    }
}

#[test]
fn a_laser_that_is_late_from_the_beginning_is_held_from_the_first_metre_on() {
    for seed in 1..6 {
        for late in [0.01, 0.02, 0.05, 0.1, -0.05] {
            let mut wrong: f64 = 0.0;
            drive(seed, late, |drive, _| {
                drive.assert_held(format_args!("{late} s"));
                wrong = wrong.max((drive.published.x - drive.truth.x).hypot(drive.published.y - drive.truth.y));
            });
            assert!(wrong > 0.9 * late.abs(), "{wrong}");
        }
    }
}

/// The age of what the laser tells changes at a stop behind others, once the clock of the first metres is known.
#[test]
fn a_laser_whose_data_become_older_at_a_stop_is_held() {
    let straight = |count: usize| vec![(0.2, 0.0); count];
    let speeds = |from: f64, to: f64| (1..=20).map(|part| (from + (to - from) * f64::from(part) / 20.0, 0.0)).collect();
    let leg: [Vec<(f64, f64)>; 6] =
        [speeds(0.0, 0.2), straight(40), vec![(0.1, 0.06); 26], straight(40), speeds(0.2, 0.0), vec![(0.0, 0.0); 24]];
    let leg = leg.concat();
    let way = [leg.clone(), leg.clone(), leg].concat();
    // How late it is behind the first stop, and behind the second one.
    let cases =
        [[0.03, 0.03], [0.05, 0.05], [0.07, 0.07], [0.1, 0.1], [-0.07, -0.07], [0.05, 0.0], [-0.05, 0.1], [0.0, 0.1]];
    let leg = way.len() / 3;
    for seed in 1..6 {
        for case in cases {
            let mut drive = Drive::new(seed);
            let mount = drive.mount;
            let mut wrong: f64 = 0.0;
            for (revolution, (along, turn)) in way.iter().enumerate() {
                let late = (revolution / leg).checked_sub(1).and_then(|stop| case.get(stop)).copied().unwrap_or(0.0);
                drive.true_mount = before(late, *along, *turn).compose(&mount);
                drive.revolve(&Pose::exp(&Twist { x: *along, y: 0.0, theta: *turn }));
                drive.assert_held(format_args!("{case:?}, revolution {revolution}"));
                wrong = wrong.max((drive.published.x - drive.truth.x).hypot(drive.published.y - drive.truth.y));
            }
            // The levels had something to hold.
            let most = case.iter().map(|late: &f64| late.abs()).fold(0.0, f64::max);
            assert!(wrong > 1.4 * most, "{case:?}: {wrong}");
        }
    }
}

/// Where the clock is in order, what the first metres have shown costs little.
#[test]
fn a_clock_in_order_costs_no_availability() {
    for seed in 1..6 {
        drive(seed, 0.0, |drive, _| {
            let level = drive.monitor.level();
            assert!(level.position < 0.1, "{level:?}");
        });
    }
}

/// Where the vehicle was so long before, in R now, that goes by so much in a revolution, on an arc.
fn before(late: f64, along: f64, turn: f64) -> Pose {
    let share = -late / 0.125;
    let (way, angle) = (share * along, share * turn);
    if angle == 0.0 {
        return Pose::new(way, 0.0, 0.0);
    }
    Pose::new(way / angle * angle.sin(), way / angle * (1.0 - angle.cos()), angle)
}

/// A controller whose power was cut finds itself on the way: the pose is where the vehicle was then, and nothing shows it on a straight.
#[test]
fn a_laser_that_is_late_of_a_vehicle_that_finds_itself_while_it_moves_is_held() {
    for seed in 1..6 {
        for late in [0.0, 0.05, 0.1, 0.25, -0.05] {
            let mut drive = Drive::new(seed);
            let mount = drive.mount;
            let parts = [(60, 0.125, 0.0), (20, 0.125, 0.04), (4, 0.06, 0.0), (8, 0.0, 0.0), (30, 0.125, 0.0)];
            // Where the laser was when it saw, the vehicle is taken to be.
            let behind = Pose::new(-late, 0.0, 0.0);
            drive.published = drive.truth.compose(&behind);
            drive.begin();
            let mut last = f64::INFINITY;
            for (count, along, turn) in parts {
                for _ in 0..count {
                    drive.true_mount = before(late, along, turn).compose(&mount);
                    drive.revolve(&Pose::exp(&Twist { x: along, y: 0.0, theta: turn }));
                    drive.assert_held(format_args!("{late} s"));
                    last = drive.monitor.level().position;
                }
            }
            // A turn and a stop have shown it.
            assert!(last < 0.1 + 1.1 * late.abs(), "{late} s: {last}");
        }
    }
}

/// At constant speed nothing shows the clock; that of single samples is not constant.
#[test]
fn what_the_wheels_round_shows_no_clock() {
    for seed in 1..6 {
        for late in [0.05, 0.125, 0.2] {
            let mut drive = Drive::new(seed);
            (drive.samples, drive.rounding) = (12, 4e-4);
            let mount = drive.mount;
            drive.published = drive.truth.compose(&Pose::new(-late * 0.4, 0.0, 0.0));
            drive.begin();
            let faster = (1..=10).map(|part| 0.05 + 0.01 * f64::from(part));
            for along in faster.chain([0.15; 160]) {
                drive.true_mount = before(late, along, 0.0).compose(&mount);
                drive.revolve(&Pose::new(along, 0.0, 0.0));
                drive.assert_held(format_args!("{seed}: {late} s"));
            }
        }
    }
}
