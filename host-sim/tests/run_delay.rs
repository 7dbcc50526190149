//! How long a program has waited for a core, by what the scheduler counts.

use std::time::{Duration, Instant};

use agv_host_sim::emulate::run_delay::RunDelay;

#[test]
fn the_longest_wait_between_two_looks_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let write = |thread: &str, waited: u64| {
        let thread = folder.path().join(thread);
        std::fs::create_dir_all(&thread).unwrap();
        // Time on a core, time that it waited for one, slices.
        std::fs::write(thread.join("schedstat"), format!("99000000000 {waited} 7\n")).unwrap();
    };
    let (mut delay, start) = (RunDelay::of_tasks(folder.path()), Instant::now());
    let mut look = |milliseconds| delay.look(start + Duration::from_millis(milliseconds));
    write("1", 5_000_000_000);
    write("2", 1_000_000);
    assert_eq!(look(0), Duration::ZERO, "what was before counts for nothing");
    write("1", 5_003_000_000);
    write("2", 16_000_000);
    assert_eq!(look(5), Duration::ZERO, "it is too soon to look");
    assert_eq!(look(20), Duration::from_millis(15));
    write("2", 20_000_000);
    assert_eq!(look(40), Duration::from_millis(15), "it is the longest");
    assert_eq!(RunDelay::of_tasks(folder.path().join("none")).look(start), Duration::ZERO);
}

#[test]
fn what_a_hypervisor_takes_is_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let statistics = folder.path().join("stat");
    // user, nice, system, idle, iowait, irq, softirq, steal, guest: hundredths of a second.
    let write =
        |stolen: u64| std::fs::write(&statistics, format!("cpu  9 8 7 6 5 4 3 {stolen} 1 0\ncpu0 1 1\n")).unwrap();
    let (mut delay, start) = (RunDelay::of_tasks(folder.path()).with_statistics(&statistics), Instant::now());
    std::fs::create_dir(folder.path().join("1")).unwrap();
    let mut look = |milliseconds| {
        let waited = format!("0 {} 1\n", milliseconds * 100_000);
        std::fs::write(folder.path().join("1/schedstat"), waited).unwrap();
        delay.look(start + Duration::from_millis(milliseconds))
    };
    write(500);
    assert_eq!(look(0), Duration::ZERO);
    write(502);
    assert_eq!(look(20), Duration::from_millis(22));
    write(503);
    assert_eq!(look(40), Duration::from_millis(22));
}
