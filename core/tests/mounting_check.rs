//! What corrections say of odometry and laser, against weighted least squares over all of them at once.
#![allow(clippy::indexing_slicing, reason = "a panic is how a test fails")]

use agv_core::geometry::Pose;
use agv_core::integrity::{MountingCheck, Suspect};
use nalgebra::{Matrix2, Vector2};

use super::falko::scene::Random;

/// Rates by way and turn, once for each of along, side and heading.
struct Fit {
    rates: [Vector2<f64>; 3],
    way: f64,
    turn: f64,
}

/// How much of a revolution remains after those that follow it: 2.5 m and 1.5 rad count by 1/e.
fn fit(revolutions: &[(Pose, Pose)]) -> Fit {
    let mut information = Matrix2::new(0.01, 0.0, 0.0, 0.003);
    let mut sums = [Vector2::zeros(); 3];
    let (mut way, mut turn) = (0.0, 0.0);
    for (index, (motion, correction)) in revolutions.iter().enumerate() {
        let later = &revolutions[index + 1..];
        let gone = later.iter().map(|(motion, _)| motion.x.abs() / 2.5 + motion.theta.abs() / 1.5).sum::<f64>();
        let weight = (-gone).exp();
        let input = Vector2::new(motion.x, motion.theta);
        information += weight * input * input.transpose();
        for (sum, value) in sums.iter_mut().zip([correction.x, correction.y, correction.theta]) {
            *sum += weight * value * input;
        }
        way += weight * motion.x.abs();
        turn += weight * motion.theta.abs();
    }
    let solved = information.lu();
    let rates = sums.map(|sum| solved.solve(&sum).unwrap_or_default());
    Fit { rates, way, turn }
}

/// The verdict after the last revolution. `sound` is the way and the turn since the laser was last contradicted.
fn judge(fit: &Fit, before: Option<Suspect>, sound: &mut (f64, f64)) -> Option<Suspect> {
    let (has_way, has_turn) = (fit.way >= 0.3, fit.turn >= 0.3);
    if !has_way && !has_turn {
        return before;
    }
    let [along, side, heading] = fit.rates;
    let bend = if has_way { heading.x.abs() } else { 0.0 };
    let askew = if has_way { (side.x.abs() - 0.5 * bend).max(0.0) } else { 0.0 };
    let (way_noise, turn_noise) = (0.012 / fit.way.max(0.3), 0.012 / fit.turn.max(0.3));
    let lever = side.y.abs().max(along.y.abs());
    let is_wrong = (has_way && askew > 0.006 + way_noise) || (has_turn && lever > 0.06 + turn_noise);
    let is_contradicted =
        (has_way && askew >= 0.9 * (0.006 + way_noise)) || (has_turn && lever >= 0.9 * (0.06 + turn_noise));
    if is_contradicted {
        *sound = (0.0, 0.0);
    }
    let has_turned = has_turn && (fit.turn >= 0.45 || sound.1 >= 1.35);
    let is_right = has_way && has_turned && sound.0 >= 1.2 && sound.1 >= 0.45;
    if is_wrong || (before == Some(Suspect::Laser) && !is_right) {
        return Some(Suspect::Laser);
    }
    let is_odometry = has_way && (along.x.abs() > 0.03 + way_noise || bend > 0.01 + 0.01 / fit.way.max(0.3));
    is_odometry.then_some(Suspect::Odometry)
}

#[test]
fn verdicts_are_those_of_all_corrections_at_once() {
    let mut random = Random::new(3);
    let (mut nobody, mut odometry, mut laser, mut healed) = (0, 0, 0, 0);
    for _ in 0..900 {
        // One thing is wrong at most, and may be mended on the way.
        let mut wrong = [0.0; 5];
        let size = random.uniform(-1.5, 1.5);
        let which = (random.unit() * 5.0) as usize;
        wrong[which] = size * [0.02, 0.15, 0.15, 0.06, 0.03][which];
        let mut check = MountingCheck::new();
        let (mut revolutions, mut before) = (Vec::new(), None);
        let mut sound = (0.0, 0.0);
        let (mut way, mut turn) = (0.0, 0.0);
        for revolution in 0..60 {
            if revolution % 12 == 0 {
                let pace = random.unit();
                way = if pace < 0.2 { 0.0 } else { random.uniform(-0.05, 0.2) };
                turn = if random.unit() < 0.5 { 0.0 } else { random.uniform(-0.08, 0.08) };
            }
            if revolution == 36 && random.unit() < 0.7 {
                wrong = [0.0; 5];
            }
            let [askew_by, lever, shift, scale, bend] = wrong;
            let mut noise = || 0.001 * random.normal();
            let motion = Pose::new(way, 0.0, turn);
            let correction = Pose::new(
                scale * way + shift * turn + noise(),
                askew_by * way + lever * turn + noise(),
                bend * way + noise(),
            );
            check.add(&motion, &correction);
            revolutions.push((motion, correction));
            let fit = fit(&revolutions);
            let was = before;
            sound = (sound.0 + motion.x.abs(), sound.1 + motion.theta.abs());
            before = judge(&fit, before, &mut sound);
            assert_eq!(check.suspect(), before, "{wrong:?} {revolution}");
            healed += usize::from(was == Some(Suspect::Laser) && before.is_none());
            match before {
                None => nobody += 1,
                Some(Suspect::Odometry) => odometry += 1,
                Some(Suspect::Laser) => laser += 1,
            }
        }
    }
    assert!(nobody > 1000 && odometry > 1000 && laser > 1000 && healed > 20, "{nobody} {odometry} {laser} {healed}");
}

#[test]
fn a_new_pose_forgets_the_corrections_and_a_suspicion_of_the_odometry_alone() {
    let after = |correction: Pose| {
        let mut check = MountingCheck::new();
        for _ in 0..40 {
            check.add(&Pose::new(0.15, 0.0, 0.0), &correction);
        }
        let before = check.suspect();
        check.restart();
        (before, check.suspect())
    };
    assert_eq!(after(Pose::new(0.01, 0.0, 0.0)), (Some(Suspect::Odometry), None));
    assert_eq!(after(Pose::new(0.0, 0.01, 0.0)), (Some(Suspect::Laser), Some(Suspect::Laser)));
    assert_eq!(MountingCheck::default().suspect(), None);
}

/// A laser that stands elsewhere shows in bends alone, and one that is turned on straights alone.
#[test]
fn straights_alone_and_turns_alone_end_no_suspicion_of_the_laser() {
    for motion in [Pose::new(0.15, 0.0, 0.0), Pose::new(0.0, 0.0, 0.1)] {
        let mut check = MountingCheck::new();
        check.suspect_laser();
        for _ in 0..400 {
            check.add(&motion, &Pose::default());
            assert_eq!(check.suspect(), Some(Suspect::Laser), "{motion:?}");
        }
        // A bend without a contradiction ends it.
        for _ in 0..20 {
            check.add(&Pose::new(0.15, 0.0, 0.1), &Pose::default());
        }
        assert_eq!(check.suspect(), None, "{motion:?}");
    }
}
