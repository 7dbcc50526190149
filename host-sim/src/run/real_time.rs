//! Threads that run before all others, on cores of their own, in memory that stays.

use std::sync::Mutex;

use serde::Deserialize;

/// What of it is wanted. Priorities are those of SCHED_FIFO, 1 to 99; cores are numbered from 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RealTime {
    /// Priority of the bus, which has the deadlines.
    pub bus_priority: Option<u8>,
    /// Priority of the laser.
    pub laser_priority: Option<u8>,
    /// Priority of the localiser.
    pub localizer_priority: Option<u8>,
    /// Core of the bus.
    pub bus_core: Option<usize>,
    /// Core of the laser.
    pub laser_core: Option<usize>,
    /// Core of the localiser.
    pub localizer_core: Option<usize>,
    /// Whether all memory is kept from being paged out.
    pub lock_memory: bool,
}

impl RealTime {
    /// Bus before laser before localiser, as on a board, on any core, in memory that stays. Below 50, the priority at which
    /// a kernel with PREEMPT_RT handles interrupts, without which nothing is heard.
    pub const USUAL: Self = Self {
        bus_priority: Some(45),
        laser_priority: Some(40),
        localizer_priority: Some(35),
        bus_core: None,
        laser_core: None,
        localizer_core: None,
        lock_memory: true,
    };
}

/// What this machine did not grant, one line each, without doubles.
#[derive(Debug, Default)]
pub(super) struct Lacks(Mutex<Vec<String>>);

impl Lacks {
    fn add(&self, lack: String) {
        let mut lacks = self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if !lacks.contains(&lack) {
            lacks.push(lack);
        }
    }

    /// What there is so far; nothing twice.
    pub fn take(&self) -> Vec<String> {
        std::mem::take(&mut self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner))
    }
}

/// Stack that a thread touches at its start, so that no page of it comes later: more than its loop needs.
const TOUCHED: usize = 256 * 1024;

#[inline(never)]
fn touch_stack() {
    std::hint::black_box(&mut [0_u8; TOUCHED]);
}

/// Keeps all memory of this program, and what it takes later, from being paged out.
#[cfg(target_os = "linux")]
pub(super) fn lock_memory(lacks: &Lacks) {
    use nix::sys::mman::{MlockAllFlags, mlockall};
    if let Err(error) = mlockall(MlockAllFlags::MCL_CURRENT | MlockAllFlags::MCL_FUTURE) {
        lacks.add(format!("memory is not locked ({error}): CAP_IPC_LOCK, or LimitMEMLOCK=infinity"));
    }
}

/// Lets this thread run with that priority, on that core.
#[cfg(target_os = "linux")]
pub(super) fn enter(name: &str, priority: Option<u8>, core: Option<usize>, lacks: &Lacks) {
    use nix::sched::{CpuSet, sched_setaffinity};
    use nix::unistd::Pid;
    use thread_priority::unix::{
        RealtimeThreadSchedulePolicy, ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
    };
    use thread_priority::{ThreadPriority, ThreadPriorityValue};
    touch_stack();
    if let Some(core) = core {
        let mut cores = CpuSet::new();
        let outcome = cores.set(core).and_then(|()| sched_setaffinity(Pid::from_raw(0), &cores));
        if let Err(error) = outcome {
            lacks.add(format!("{name} is on any core, not on core {core} ({error})"));
        }
    }
    let Some(priority) = priority else { return };
    let wanted = ThreadPriorityValue::try_from(priority).map(ThreadPriority::Crossplatform);
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    let is_granted =
        wanted.is_ok_and(|wanted| set_thread_priority_and_policy(thread_native_id(), wanted, policy).is_ok());
    if !is_granted {
        lacks.add("threads run with ordinary priority: SCHED_FIFO needs CAP_SYS_NICE, or LimitRTPRIO=99".to_owned());
    }
}

/// This system has none of it.
#[cfg(not(target_os = "linux"))]
pub(super) fn lock_memory(lacks: &Lacks) {
    lacks.add("memory is not locked: this system is not Linux".to_owned());
}

/// This system has none of it.
#[cfg(not(target_os = "linux"))]
pub(super) fn enter(_: &str, _: Option<u8>, _: Option<usize>, lacks: &Lacks) {
    touch_stack();
    lacks.add("threads run with ordinary priority: this system is not Linux".to_owned());
}
