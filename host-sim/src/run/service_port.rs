//! The service port, as a board has it: two connections at once; one whose next request is not whole ten seconds after the last
//! answer is closed, and requests are answered no faster than one in two milliseconds.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use agv_controller::BusEvent;
use agv_settings::block_on;
use agv_settings::service::{Action, Controller, Frames, LONGEST_MESSAGE, Session};
use agv_settings::store::{Store, StoreError};
use agv_wire::can::controller_node::CommunicationParameters;

use super::exchange::Exchange;
use super::flash_file::FlashFile;
use super::incident_service;

/// Connections at once.
const CONNECTIONS: usize = 2;
/// How long a peer may take for a request, from the last answer on, and to take an answer.
const PATIENCE: Duration = Duration::from_secs(10);
/// Least time between answers.
const PACE: Duration = Duration::from_millis(2);
/// Waits are cut into pieces of this length, so that everything can end.
const LOOK: Duration = Duration::from_millis(20);

/// What the connections speak of.
pub(super) type SharedController = Mutex<Controller<FlashFile>>;

fn locked(controller: &SharedController) -> MutexGuard<'_, Controller<FlashFile>> {
    controller.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The connection is of no more use.
struct Gone;

impl<T> From<T> for Gone
where
    T: std::error::Error,
{
    fn from(_: T) -> Self {
        Self
    }
}

/// Serves connections until everything ends.
pub(super) fn serve(
    listener: &TcpListener,
    controller: &SharedController,
    incidents: Option<&Path>,
    exchange: &Exchange,
) {
    if listener.set_nonblocking(true).is_err() {
        return;
    }
    let count = AtomicUsize::new(0);
    std::thread::scope(|scope| {
        while !exchange.is_over() {
            let is_full = count.load(Ordering::Relaxed) >= CONNECTIONS;
            let Some((stream, _)) = (!is_full).then(|| listener.accept().ok()).flatten() else {
                std::thread::sleep(LOOK);
                continue;
            };
            count.fetch_add(1, Ordering::Relaxed);
            let count = &count;
            scope.spawn(move || {
                // A connection that fails is the client's affair.
                let _ = converse(stream, controller, incidents, exchange);
                count.fetch_sub(1, Ordering::Relaxed);
            });
        }
    });
}

fn converse(
    mut stream: TcpStream,
    controller: &SharedController,
    incidents: Option<&Path>,
    exchange: &Exchange,
) -> Result<(), Gone> {
    stream.set_nonblocking(false)?;
    stream.set_nodelay(true)?;
    stream.set_write_timeout(Some(PATIENCE))?;
    stream.set_read_timeout(Some(LOOK))?;
    let mut session = Session::new();
    let (mut frames, mut room) = (Box::new(Frames::new()), Box::new([0; LONGEST_MESSAGE]));
    let mut read = [0; 512];
    let mut request_due = Instant::now() + PATIENCE;
    while !exchange.is_over() && Instant::now() < request_due {
        let count = match stream.read(&mut read) {
            Ok(0) => return Ok(()),
            Ok(count) => count,
            Err(error)
                if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted) =>
            {
                continue;
            }
            Err(error) => return Err(error.into()),
        };
        let mut rest = &read[..count];
        while !rest.is_empty() {
            let (taken, is_whole) = frames.push(rest).map_err(|_| Gone)?;
            rest = &rest[taken..];
            if !is_whole {
                continue;
            }
            let (length, action) =
                if let Some(answer) = incident_service::answer(frames.message(), incidents, &mut room) {
                    (answer.map_err(|_| Gone)?, Action::None)
                } else {
                    let mut controller = locked(controller);
                    let (is_standing, now) = (exchange.is_standing(), exchange.now());
                    let answer = session.answer(frames.message(), &mut controller, is_standing, now, &mut room);
                    block_on(answer).map_err(|_| Gone)?
                };
            frames.clear();
            stream.write_all(&room[..length])?;
            match action {
                Action::None | Action::ForgetPanic => {}
                Action::SetPose(fix) => exchange.pass_on(BusEvent::SetPose(fix).into()),
                Action::Reboot => exchange.restart(),
            }
            std::thread::sleep(PACE);
            request_due = Instant::now() + PATIENCE;
        }
    }
    Ok(())
}

/// Stores the settings, and how the controller speaks on the bus, whenever somebody there wants it, until everything ends.
pub(super) fn keep(controller: &SharedController, exchange: &Exchange, note: &(dyn Fn(&str) + Sync)) {
    while !exchange.is_over() {
        let Some(parameters) = exchange.wait_for_save(LOOK) else { continue };
        let mut controller = locked(controller);
        let Controller { settings, store, .. } = &mut *controller;
        let is_stored = store_all(store.as_mut(), settings, &parameters).is_ok();
        if !is_stored {
            note("settings: they cannot be stored");
        }
        exchange.tell_saved(is_stored);
    }
}

fn store_all(
    store: Option<&mut Store<FlashFile>>,
    settings: &agv_settings::Settings,
    parameters: &CommunicationParameters,
) -> Result<(), StoreError> {
    let store = store.ok_or(StoreError::Flash)?;
    block_on(store.store_leaves(settings))?;
    block_on(store.store_communication(parameters))
}
