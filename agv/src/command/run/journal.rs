//! Where a run says what happens to it: the journal of systemd where that has started it, standard error elsewhere.

use agv_host_sim::run::Fault;

use crate::command::output::note;

/// Where it is said.
#[derive(Clone, Copy, Debug)]
pub struct Journal {
    is_of_systemd: bool,
}

impl Journal {
    /// The journal, if standard error goes there.
    pub fn open() -> Self {
        Self { is_of_systemd: open() }
    }

    /// Says something.
    pub fn tell(self, text: &str) {
        if self.is_of_systemd {
            tracing::info!("{text}");
        } else {
            note(&format!("agv: {text}"));
        }
    }

    /// Says that there is a fault, or that one is over. Its number is a field of the entry, too: `F_FAULT`.
    pub fn tell_fault(self, fault: &Fault) {
        let number = format!("{:04X}h", fault.code);
        match (self.is_of_systemd, fault.is_over) {
            (true, false) => tracing::error!(fault = %number, "{fault}"),
            (true, true) => tracing::info!(fault = %number, "{fault}"),
            (false, _) => self.tell(&fault.to_string()),
        }
    }
}

#[cfg(target_os = "linux")]
fn open() -> bool {
    use tracing_subscriber::layer::SubscriberExt;
    let Some(layer) = is_standard_error().then(tracing_journald::layer).and_then(Result::ok) else { return false };
    let subscriber = tracing_subscriber::registry().with(layer.with_syslog_identifier("agv".to_owned()));
    tracing::subscriber::set_global_default(subscriber).is_ok()
}

/// Whether standard error is what systemd says that goes to the journal: programs that a service starts inherit the word, but not always
/// the stream (systemd.exec(5), `$JOURNAL_STREAM`).
#[cfg(target_os = "linux")]
fn is_standard_error() -> bool {
    use std::os::unix::fs::MetadataExt;
    let Ok(told) = std::env::var("JOURNAL_STREAM") else { return false };
    std::fs::metadata("/dev/stderr").is_ok_and(|stream| told == format!("{}:{}", stream.dev(), stream.ino()))
}

#[cfg(not(target_os = "linux"))]
fn open() -> bool {
    false
}
