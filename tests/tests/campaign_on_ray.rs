//! A campaign on a Ray cluster that loses a worker gives the bytes that one machine gives.

use agv_tests::{python, repository, skip};
use std::io::Read as _;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

const TEST: &str = "a_lost_worker_changes_nothing";

/// Long enough for a shard of it to be caught while it runs.
const RUNS: [&str; 2] = ["--runs", "2"];

/// A process that runs a shard.
struct Shard {
    process: u32,
    /// Who started it.
    parent: u32,
}

/// State and parent of a process; none if it has ended.
fn state(process: u32) -> Option<(char, u32)> {
    let text = std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The name before them may hold anything.
    let mut fields = text.rsplit_once(") ")?.1.split(' ');
    let state = fields.next()?.chars().next()?;
    (state != 'Z').then_some((state, fields.next()?.parse().ok()?))
}

fn arguments_of(process: u32) -> Vec<String> {
    let text = std::fs::read(format!("/proc/{process}/cmdline")).unwrap_or_default();
    text.split(|byte| *byte == 0).map(|argument| String::from_utf8_lossy(argument).into_owned()).collect()
}

/// A shard of this campaign that a worker of Ray runs.
fn running(campaign: &str) -> Option<Shard> {
    let processes = std::fs::read_dir("/proc").unwrap();
    processes.filter_map(|entry| entry.unwrap().file_name().to_str()?.parse().ok()).find_map(|process| {
        let arguments = arguments_of(process);
        let is_shard = ["campaign", campaign, "--shard"].iter().all(|word| arguments.iter().any(|is| is == word));
        let (_, parent) = is_shard.then(|| state(process)).flatten()?;
        let is_worker = arguments_of(parent).first().is_some_and(|name| name.starts_with("ray::"));
        is_worker.then_some(Shard { process, parent })
    })
}

fn signal(name: &str, process: u32) -> bool {
    let mut kill = Command::new("kill");
    kill.args([name, &process.to_string()]).stderr(Stdio::null()).status().unwrap().success()
}

/// Kills the worker of a shard while the shard runs: it is held first, so that it cannot end before its worker does.
fn kill_a_worker(campaign: &str, driver: &mut Child) -> Shard {
    let start = Instant::now();
    loop {
        assert!(driver.try_wait().unwrap().is_none(), "no shard was caught while it ran");
        assert!(start.elapsed() < Duration::from_secs(120), "no shard has begun");
        if let Some(shard) = running(campaign)
            && signal("-STOP", shard.process)
        {
            while state(shard.process).is_some_and(|(state, _)| !['T', 'D'].contains(&state)) {
                std::thread::yield_now();
            }
            if state(shard.process) == Some(('T', shard.parent)) {
                assert!(signal("-KILL", shard.parent));
                return shard;
            }
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn checked(output: &Output) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_lost_worker_changes_nothing() {
    let Some(agv) = agv_tests::agv(TEST) else { return };
    if !Path::new("/proc/self/stat").exists() {
        skip(TEST, "there is no /proc, where the workers are found");
        return;
    }
    let Some(mut python) = python(TEST, "ray") else { return };
    // Its path tells the shards of this campaign from those of any other.
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path().canonicalize().unwrap();
    for name in ["faults.toml", "warehouse_hall.toml"] {
        std::fs::copy(repository("host-sim/scenarios").join(name), folder.join(name)).unwrap();
    }
    let campaign = folder.join("faults.toml");
    let campaign = campaign.to_str().unwrap();

    let one_machine = folder.join("one_machine.parquet");
    let mut alone = Command::new(&agv);
    let alone = alone.args(["campaign", campaign, "--output"]).arg(&one_machine).args(RUNS).output().unwrap();
    checked(&alone);

    let cluster = folder.join("cluster.parquet");
    let mut driver = python
        .arg(repository("lab/ray/campaign.py"))
        .args([campaign, "--workers", "2", "--shards", "6", "--agv"])
        .arg(&agv)
        .arg("--output")
        .arg(&cluster)
        .arg("--")
        .args(RUNS)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut complaint = driver.stderr.take().unwrap();
    // Nobody may wait for a full pipe.
    let reader = std::thread::spawn(move || {
        let mut bytes = Vec::new();
        complaint.read_to_end(&mut bytes).map(|_| bytes)
    });
    let lost = kill_a_worker(campaign, &mut driver);
    let mut on_ray = driver.wait_with_output().unwrap();
    on_ray.stderr = reader.join().unwrap().unwrap();
    checked(&on_ray);

    assert_eq!(String::from_utf8_lossy(&on_ray.stdout), String::from_utf8_lossy(&alone.stdout));
    assert!(std::fs::read(&cluster).unwrap() == std::fs::read(&one_machine).unwrap(), "the rows differ");
    // The shard was not left behind by its worker.
    let is_left = state(lost.process).is_some_and(|(state, _)| state == 'T');
    assert!(!(is_left && signal("-KILL", lost.process)));
}
