//! What looks after a controller while it runs: its status, and what systemd wants to hear.

use std::net::TcpListener;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use agv_core::geometry::Pose;
use agv_core::integrity::AlertLimits;

use super::Running;
use super::kept_pose::KeptPose;
use super::status::{Status, StatusBoard, serve_status};

/// How often the status is made.
const LOOK: Duration = Duration::from_millis(200);
/// How often the service manager is told that the controller runs: far below the watchdog's 10 s of the unit.
const PERIOD: Duration = Duration::from_secs(1);

/// Looks after a controller until it ends, or `look` says that it is to end. Where systemd has started it, it is told that the
/// controller is there, and, as long as bus, laser and localiser all run, that it lives. The status is served if there is a
/// listener for it.
pub fn attend(
    running: &Running,
    limits: &AlertLimits,
    listener: Option<TcpListener>,
    note: &(dyn Fn(&str) + Sync),
    mut look: impl FnMut(),
) {
    let board = StatusBoard::default();
    let is_over = Arc::new(AtomicBool::new(false));
    tell_manager(State::Ready);
    std::thread::scope(|scope| {
        if let Some(listener) = listener {
            let (ends, board) = (Arc::clone(&is_over), &board);
            scope.spawn(move || {
                if let Err(error) = serve_status(listener, board, move || ends.load(Ordering::Relaxed)) {
                    note(&format!("status: {error}"));
                }
            });
        }
        let (mut told, mut made) = (Instant::now(), None::<Instant>);
        let mut keeper = Keeper::default();
        while !running.is_over() {
            if made.is_none_or(|made| made.elapsed() >= LOOK) {
                made = Some(Instant::now());
                board.tell(Status::of(running, limits));
            }
            // Without one of the threads nothing is told, and the watchdog bites.
            if told.elapsed() >= PERIOD && running.have_all_run() {
                told = Instant::now();
                keeper.keep(running, note);
                tell_manager(State::Alive(&board.look().map(|status| summary(&status)).unwrap_or_default()));
            }
            std::thread::sleep(Duration::from_millis(10));
            look();
        }
        keeper.keep(running, note);
        is_over.store(true, Ordering::Relaxed);
    });
    tell_manager(State::Stopping);
}

/// What keeps the pose of a vehicle that knows where it is.
#[derive(Debug, Default)]
struct Keeper {
    kept: Option<Pose>,
    has_failed: bool,
}

/// A pose that is no further than this from the one that is kept, m and rad, is not kept anew.
const SAME: f64 = 0.01;

impl Keeper {
    fn keep(&mut self, running: &Running, note: &(dyn Fn(&str) + Sync)) {
        let localised = running.condition().pose.filter(|pose| pose.mode.is_localised()).map(|pose| pose.pose);
        let is_far = |pose: &Pose| {
            self.kept.is_none_or(|kept| {
                let way = kept.between(pose);
                way.x.hypot(way.y) > SAME || way.theta.abs() > SAME
            })
        };
        let Some(pose) = localised.filter(is_far) else { return };
        self.kept = Some(pose);
        let outcome = KeptPose::new(&pose, running.map).write(running.store);
        // Once, not each second.
        if let Err(error) = &outcome
            && !self.has_failed
        {
            note(&format!("start: where the vehicle is cannot be kept: {error}"));
        }
        self.has_failed = outcome.is_err();
    }
}

/// A status in a line.
fn summary(status: &Status) -> String {
    let pose = status.pose.as_ref().map_or_else(
        || "no pose".to_owned(),
        |pose| format!("{:.2} m, {:.2} m, {:.3} rad by {}", pose.x_m, pose.y_m, pose.heading_rad, pose.mode),
    );
    format!("{pose}; laser {}; {} poses, {} deadlines missed", status.laser, status.poses, status.missed)
}

/// What the service manager is told.
enum State<'a> {
    Ready,
    Alive(&'a str),
    Stopping,
}

/// Tells the service manager; nothing happens where there is none.
#[cfg(target_os = "linux")]
fn tell_manager(state: State) {
    use sd_notify::NotifyState;
    let _ = match state {
        State::Ready => sd_notify::notify(&[NotifyState::Ready]),
        State::Alive(status) => sd_notify::notify(&[NotifyState::Watchdog, NotifyState::Status(status)]),
        State::Stopping => sd_notify::notify(&[NotifyState::Stopping]),
    };
}

/// There is none.
#[cfg(not(target_os = "linux"))]
fn tell_manager(_: State) {}
