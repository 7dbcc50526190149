//! The page and what it asks for, over HTTP on loopback.

use std::net::TcpListener;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};
use std::time::Duration;

use agv_core::measurement::Time;
use axum::extract::{Query, Request, State};
use axum::http::{StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use axum::{Json, Router};
use serde::Deserialize;

use super::happening::Happening;
use super::moment::Moment;
use super::overview::Overview;
use super::path::{Outline, Window};
use super::timeline::{Description, Status, Timeline};

/// A timeline that one thread adds to while others look.
#[derive(Clone, Debug)]
pub struct Shared(Arc<RwLock<Timeline>>);

impl Shared {
    /// Shares a timeline.
    #[must_use]
    pub fn new(timeline: Timeline) -> Self {
        Self(Arc::new(RwLock::new(timeline)))
    }

    /// The timeline, to look at.
    pub fn read(&self) -> RwLockReadGuard<'_, Timeline> {
        self.0.read().unwrap_or_else(PoisonError::into_inner)
    }

    /// The timeline, to add to.
    pub fn write(&self) -> RwLockWriteGuard<'_, Timeline> {
        self.0.write().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The page, in one piece: a browser asks for nothing else but data.
const PAGE: &str = concat!(
    include_str!("page/head.html"),
    "<style>\n",
    include_str!("page/page.css"),
    "</style>\n",
    include_str!("page/body.html"),
    "<script>\n\"use strict\";\n",
    include_str!("page/inks.js"),
    include_str!("page/map.js"),
    include_str!("page/curves.js"),
    include_str!("page/panel.js"),
    include_str!("page/page.js"),
    "</script>\n</body>\n</html>\n",
);

/// Nothing from elsewhere, whatever a log holds.
const POLICY: &str =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; connect-src 'self'";

/// How often the server looks whether it is to end.
const LOOK: Duration = Duration::from_millis(50);

/// Serves a timeline until `is_stopped`.
///
/// # Errors
/// If the socket fails.
pub fn serve(listener: TcpListener, shared: &Shared, is_stopped: &Arc<AtomicBool>) -> std::io::Result<()> {
    let router = Router::new()
        .route("/", get(page))
        .route("/api/description", get(description))
        .route("/api/status", get(status))
        .route("/api/happenings", get(happenings))
        .route("/api/moment", get(moment))
        .route("/api/overview", get(overview))
        .route("/api/path", get(outline))
        .layer(middleware::from_fn(guard))
        .with_state(shared.clone());
    let is_stopped = Arc::clone(is_stopped);
    serve_router(listener, router, move || is_stopped.load(Ordering::Relaxed))
}

/// Serves what a router has until `is_over`.
///
/// # Errors
/// If the socket fails.
pub(crate) fn serve_router(
    listener: TcpListener,
    router: Router,
    is_over: impl Fn() -> bool + Send + 'static,
) -> std::io::Result<()> {
    listener.set_nonblocking(true)?;
    let end = async move {
        while !is_over() {
            tokio::time::sleep(LOOK).await;
        }
    };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let outcome = runtime.block_on(async move {
        let listener = tokio::net::TcpListener::from_std(listener)?;
        tokio::select! {
            outcome = async { axum::serve(listener, router).await } => outcome,
            () = end => Ok(()),
        }
    });
    runtime.shutdown_background();
    outcome
}

/// Only pages of this machine may ask, and nothing is kept by the browser: a foreign page that has its name resolved to
/// loopback is sent away.
async fn guard(request: Request, next: Next) -> Response {
    let host = request.headers().get(header::HOST).and_then(|host| host.to_str().ok()).unwrap_or_default();
    let name = host.rsplit_once(':').map_or(host, |(name, _)| name);
    if !["localhost", "127.0.0.1", "[::1]"].contains(&name) {
        return (StatusCode::FORBIDDEN, "this page is for this machine only").into_response();
    }
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    headers.insert(header::CACHE_CONTROL, header::HeaderValue::from_static("no-store"));
    headers.insert(header::CONTENT_SECURITY_POLICY, header::HeaderValue::from_static(POLICY));
    response
}

async fn page() -> impl IntoResponse {
    ([(header::CONTENT_TYPE, "text/html; charset=utf-8")], PAGE)
}

async fn description(State(shared): State<Shared>) -> Json<Description> {
    Json(shared.read().description())
}

async fn status(State(shared): State<Shared>) -> Json<Status> {
    Json(shared.read().status())
}

async fn happenings(State(shared): State<Shared>) -> Json<Vec<Happening>> {
    Json(shared.read().happenings().to_vec())
}

/// An instant that is asked for, s.
#[derive(Deserialize)]
struct Instant {
    time_s: f64,
}

async fn moment(State(shared): State<Shared>, Query(Instant { time_s }): Query<Instant>) -> Json<Moment> {
    let draft = shared.read().draft(Time::from_seconds(time_s));
    Json(draft.finish())
}

/// A span of time that is asked for, s, and how finely.
#[derive(Deserialize)]
struct Span {
    from_s: f64,
    to_s: f64,
    intervals: usize,
}

async fn overview(State(shared): State<Shared>, Query(span): Query<Span>) -> Json<Overview> {
    let [from, to] = [span.from_s, span.to_s].map(Time::from_seconds);
    Json(shared.read().overview(from, to, span.intervals))
}

async fn outline(State(shared): State<Shared>, Query(window): Query<Window>) -> Json<Outline> {
    Json(shared.read().outline(&window))
}
