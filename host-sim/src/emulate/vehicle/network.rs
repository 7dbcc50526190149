//! What the controller meets on its network: the laser, and who listens to its log.

use std::net::TcpListener;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::live::relay::Relay;
use crate::live::stream::{StreamSummary, record_stream};
use crate::log::LogError;
use crate::serve::nav350::Nav350;

/// Records the log stream of a controller that begins to listen at some time.
pub(super) fn record(
    port: u16,
    log: &Path,
    stopped: &Arc<AtomicBool>,
    is_streaming: &AtomicBool,
    relay: &Relay,
) -> Result<StreamSummary, LogError> {
    let host = format!("127.0.0.1:{port}");
    // Until the controller listens, the emulator's network resets the connection.
    loop {
        let begun = || is_streaming.store(true, Ordering::Release);
        match record_stream(&host, log, stopped, begun, |record| relay.pass(record)) {
            Err(LogError::Empty { .. } | LogError::Io { .. }) if !stopped.load(Ordering::Relaxed) => {
                std::thread::sleep(Duration::from_millis(20));
            }
            outcome => return outcome,
        }
    }
}

/// Serves the sensor while it is on.
pub(super) fn serve_laser(sensor: &Nav350, listener: &TcpListener, is_on: &AtomicBool, stopped: &AtomicBool) {
    while !stopped.load(Ordering::Relaxed) {
        if !is_on.load(Ordering::Relaxed) {
            // Who connects meanwhile is sent away.
            if let Ok((stream, _)) = listener.accept() {
                drop(stream);
            }
            std::thread::sleep(Duration::from_millis(5));
            continue;
        }
        let is_off = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while is_on.load(Ordering::Relaxed) && !stopped.load(Ordering::Relaxed) {
                    std::thread::sleep(Duration::from_millis(2));
                }
                is_off.store(true, Ordering::Relaxed);
            });
            // A failure ends the drive without the laser, which the controller says.
            let _ = sensor.serve(listener, &is_off);
        });
    }
}
