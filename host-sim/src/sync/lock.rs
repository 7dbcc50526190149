//! A lock with priority inheritance: while a thread waits for it, its holder runs with the priority of that thread (L. Sha,
//! R. Rajkumar, J. Lehoczky, "Priority inheritance protocols", IEEE Transactions on Computers 39(9), 1990). With the locks of
//! the standard library, a thread in between keeps the holder from running for as long as it likes.

/// The lock. Its `lock` returns a guard.
#[cfg(target_os = "linux")]
pub type Lock<T> = priority_inheriting_lock::PriorityInheritingLock<T>;

/// The lock. Its `lock` returns a guard. This system has no priority inheritance.
#[cfg(not(target_os = "linux"))]
pub type Lock<T> = parking_lot::Mutex<T>;

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use std::sync::mpsc::channel;
    use std::time::{Duration, Instant};

    use nix::unistd::gettid;
    use thread_priority::unix::{
        RealtimeThreadSchedulePolicy, ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
    };
    use thread_priority::{ThreadPriority, ThreadPriorityValue};

    use super::Lock;

    const PRIORITY: u8 = 10;

    /// With which priority the kernel runs a thread of this program now (proc_pid_stat(5), field 18): below -1 that of SCHED_FIFO,
    /// negated, less one.
    fn priority_of(thread: nix::unistd::Pid) -> i32 {
        let stat = std::fs::read_to_string(format!("/proc/self/task/{thread}/stat")).unwrap();
        let behind_name = stat.rsplit_once(')').unwrap().1;
        behind_name.split_ascii_whitespace().nth(15).unwrap().parse().unwrap()
    }

    #[test]
    fn a_holder_has_the_priority_of_who_waits() {
        let lock = Lock::new(0);
        let inherited = -1 - i32::from(PRIORITY);
        std::thread::scope(|scope| {
            let mut held = lock.lock();
            let before = priority_of(gettid());
            assert!(before >= 0, "{before}");
            let (granted, is_granted) = channel();
            let lock = &lock;
            scope.spawn(move || {
                let priority = ThreadPriority::Crossplatform(ThreadPriorityValue::try_from(PRIORITY).unwrap());
                let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
                let outcome = set_thread_priority_and_policy(thread_native_id(), priority, policy);
                granted.send(outcome.is_ok()).unwrap();
                *lock.lock() += 1;
            });
            if !is_granted.recv().unwrap() {
                // An ordinary user cannot show it; who tests for others must.
                assert!(std::env::var_os("CI").is_none(), "SCHED_FIFO needs CAP_SYS_NICE");
                eprintln!("not tested: SCHED_FIFO needs CAP_SYS_NICE");
                return;
            }
            let patience = Instant::now() + Duration::from_secs(60);
            while priority_of(gettid()) != inherited {
                assert!(Instant::now() < patience, "the priority is {}", priority_of(gettid()));
                std::thread::yield_now();
            }
            *held = 1;
            drop(held);
            assert_eq!(priority_of(gettid()), before);
        });
        assert!(*lock.lock() >= 1);
    }
}
