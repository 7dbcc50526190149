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
