//! How the controller is, for people and for machines: a page, JSON and the text of Prometheus, over HTTP.

use std::net::TcpListener;
use std::sync::{Arc, Mutex, PoisonError};

use agv_core::integrity::AlertLimits;
use agv_core::state::LaserHealth;
use axum::extract::State;
use axum::http::header;
use axum::response::IntoResponse;
use axum::routing::get;
use axum::{Json, Router};
use prometheus_client::encoding::prometheus_text;
use prometheus_client::metrics::counter::ConstCounter;
use prometheus_client::metrics::gauge::ConstGauge;
use prometheus_client::registry::Registry;
use serde::Serialize;

use super::exchange::BusState;
use super::kept::SOFTWARE;
use super::periods::PeriodFigures;
use super::pose_line::PoseLine;
use super::{Condition, Running};
use crate::view::serve_router;

/// What is told.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Status {
    /// Name and version of the program.
    pub software: &'static str,
    /// Starts with this store so far.
    pub starts: u32,
    /// Time since the start, s.
    pub uptime_s: f64,
    /// The pose that was published last; none before the first one.
    pub pose: Option<PoseLine>,
    /// Whether it rests on what the vehicle sees.
    pub is_localised: bool,
    /// The bus.
    pub bus: BusState,
    /// The laser, in a word.
    pub laser: &'static str,
    /// Whether the vehicle stands.
    pub is_standing: bool,
    /// Poses on the bus.
    pub poses: u64,
    /// Times between them, ms.
    pub period_ms: PeriodFigures,
    /// Deadlines that passed without one.
    pub missed: u64,
    /// What was left out, as there was no room.
    pub left_out: LeftOut,
}

/// What was left out, as there was no room.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// Events that the localiser was too slow for.
    pub events: u32,
    /// Revolutions that it was too slow for.
    pub revolutions: u32,
    /// Records of the log.
    pub records: u32,
}

impl Status {
    /// How a controller is whose vehicle can live with these limits.
    #[must_use]
    pub fn of(running: &Running, limits: &AlertLimits) -> Self {
        let Condition { pose, poses, periods, missed, bus, laser, is_standing, left_out, .. } = running.condition();
        let [events, revolutions, records] = left_out;
        Self {
            software: SOFTWARE,
            starts: running.starts,
            uptime_s: running.uptime().as_secs_f64(),
            pose: pose.map(|pose| PoseLine::of(&pose, limits)),
            is_localised: pose.is_some_and(|pose| pose.mode.is_localised()),
            bus,
            laser: match laser {
                LaserHealth::Unknown => "unknown",
                LaserHealth::Sound => "sound",
                LaserHealth::Silent => "silent",
                LaserHealth::Faulty => "faulty",
            },
            is_standing,
            poses,
            period_ms: periods,
            missed,
            left_out: LeftOut { events, revolutions, records },
        }
    }

    /// The same as text of Prometheus (exposition format 0.0.4). What has no bound is `+Inf`.
    #[must_use]
    pub fn metrics(&self) -> String {
        let mut text = String::new();
        // A string takes all that is written to it.
        let _ = prometheus_text::encode(&mut text, &self.registry());
        text
    }

    fn registry(&self) -> Registry {
        let mut registry = Registry::with_prefix("agv");
        let level = |of: fn(&PoseLine) -> Option<f64>| self.pose.as_ref().and_then(of).unwrap_or(f64::INFINITY);
        let counters = [
            ("starts", "Starts with this store", self.starts.into()),
            ("poses", "Poses on the CAN bus", self.poses),
            ("missed_deadlines", "Deadlines without a pose", self.missed),
            ("lost_events", "Events without room", self.left_out.events.into()),
            ("lost_revolutions", "Revolutions without room", self.left_out.revolutions.into()),
            ("lost_records", "Records of the log without room", self.left_out.records.into()),
        ];
        for (name, help, count) in counters {
            registry.register(name, help, ConstCounter::new(count));
        }
        let flags = [
            ("localised", "1 if the pose rests on what the vehicle sees", self.is_localised),
            ("bus_open", "1 if the CAN bus is open", self.bus == BusState::Open),
            ("laser_sound", "1 if the laser can be used", self.laser == "sound"),
            ("standing", "1 if the vehicle stands", self.is_standing),
        ];
        for (name, help, is_set) in flags {
            registry.register(name, help, ConstGauge::new(i64::from(is_set)));
        }
        let gauges = [
            ("uptime_seconds", "Time since the start", self.uptime_s),
            ("level_metres", "Protection level of the position", level(|pose| pose.level_m)),
            ("level_radians", "Protection level of the heading", level(|pose| pose.level_rad)),
            ("pose_period_p50_seconds", "Median time between poses", 1e-3 * self.period_ms.p50),
            ("pose_period_p999_seconds", "99.9 % of the times are not longer", 1e-3 * self.period_ms.p999),
            ("pose_period_max_seconds", "Longest time between poses", 1e-3 * self.period_ms.max),
        ];
        for (name, help, value) in gauges {
            registry.register(name, help, ConstGauge::new(value));
        }
        registry
    }
}

/// A status that one thread tells while others look.
#[derive(Clone, Debug, Default)]
pub struct StatusBoard(Arc<Mutex<Option<Status>>>);

impl StatusBoard {
    /// Tells a newer one.
    pub fn tell(&self, status: Status) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(status);
    }

    /// The newest one.
    #[must_use]
    pub fn look(&self) -> Option<Status> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// The page: it asks for the status twice a second.
const PAGE: &str = include_str!("status.html");

/// Serves the board until `is_over`: the page at `/`, JSON at `/status`, text of Prometheus at `/metrics`.
///
/// # Errors
/// If the socket fails.
pub fn serve_status(
    listener: TcpListener,
    board: &StatusBoard,
    is_over: impl Fn() -> bool + Send + 'static,
) -> std::io::Result<()> {
    let router = Router::new()
        .route("/", get(|| async { ([(header::CONTENT_TYPE, "text/html; charset=utf-8")], PAGE) }))
        .route("/status", get(status))
        .route("/metrics", get(metrics))
        .with_state(board.clone());
    serve_router(listener, router, is_over)
}

async fn status(State(board): State<StatusBoard>) -> Json<Option<Status>> {
    Json(board.look())
}

async fn metrics(State(board): State<StatusBoard>) -> impl IntoResponse {
    let text = board.look().map(|status| status.metrics()).unwrap_or_default();
    ([(header::CONTENT_TYPE, prometheus_text::CONTENT_TYPE)], text)
}
