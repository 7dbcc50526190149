//! What a controller keeps of its run: each incident can be fetched, and no more bytes are kept than are allowed.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use agv_host_sim::link::service::{Client, KeptIncident};
use agv_host_sim::run::{Demonstration, Logs, RealTime, RingOptions, Running};
use agv_tests::{covered, logs, short_ring};

use super::vehicle::{End, hall, wait};

#[test]
fn an_incident_is_fetched_from_a_controller_that_runs() {
    let folder = tempfile::tempdir().unwrap();
    let options = short_ring(folder.path().join("recording"));
    let logs_of_run = Logs { whole: None, ring: Some(options.clone()) };
    let is_stopped = Arc::new(AtomicBool::new(false));
    let end = End(Arc::clone(&is_stopped));
    let (mut fetched, mut names) = (Vec::new(), Vec::new());
    let watch = |running: &Running| {
        let _end = end;
        wait("an incident", || !logs(&options.incidents()).is_empty());
        let mut client = Client::connect(&running.service.to_string(), None).unwrap();
        let kept = client.incidents().unwrap();
        client.fetch_incident(&kept[0], &mut fetched, |_| ()).unwrap();
        names.extend(kept.into_iter().map(|incident| incident.name));
        let other = KeptIncident { name: "../ring/000001-000001.agvlog".to_owned(), length: 10 };
        let refusal = client.fetch_incident(&other, &mut Vec::new(), |_| ()).unwrap_err().to_string();
        assert!(refusal.contains("keeps no such incident"), "{refusal}");
    };
    let store = folder.path().join("store");
    let remark = |text: &str| println!("{text}");
    let demonstration = Demonstration::of(covered(hall(), 8.0));
    let summary = demonstration.run(&store, RealTime::default(), logs_of_run, &is_stopped, &remark, watch).unwrap();
    assert!(summary.was_localised && is_stopped.load(Ordering::Relaxed), "{summary:?}");
    let incidents = logs(&options.incidents());
    assert_eq!(fetched, std::fs::read(&incidents[0]).unwrap());
    assert!(incidents[0].ends_with(&names[0]), "{names:?}");
}

#[test]
fn what_is_kept_is_bounded_and_a_folder_that_vanishes_stops_nobody() {
    let folder = tempfile::tempdir().unwrap();
    let options = RingOptions {
        part: Duration::from_millis(300),
        ring_bytes: 1 << 20,
        ..RingOptions::usual(folder.path().join("recording"))
    };
    let logs_of_run = Logs { whole: None, ring: Some(options.clone()) };
    let is_stopped = Arc::new(AtomicBool::new(false));
    let end = End(Arc::clone(&is_stopped));
    let ring = options.folder.join("ring");
    let watch = |running: &Running| {
        let _end = end;
        wait("parts", || logs(&ring).len() > 3);
        let bytes = |path: &PathBuf| std::fs::metadata(path).map_or(0, |metadata| metadata.len());
        let mut most = 0;
        let before = running.poses();
        wait("400 poses", || {
            most = most.max(logs(&ring).iter().map(bytes).sum());
            running.poses() > before + 400
        });
        assert!((1..=options.ring_bytes).contains(&most), "{most}");
        std::fs::remove_dir_all(&options.folder).unwrap();
        std::fs::write(&options.folder, "no folder").unwrap();
        let before = running.poses();
        wait("200 poses", || running.poses() > before + 200);
    };
    let (store, remarks) = (folder.path().join("store"), std::sync::Mutex::new(Vec::new()));
    let remark = |text: &str| remarks.lock().unwrap().push(text.to_owned());
    let demonstration = Demonstration::of(hall());
    let summary = demonstration.run(&store, RealTime::default(), logs_of_run, &is_stopped, &remark, watch).unwrap();
    assert!(summary.was_localised, "{summary:?}");
    let remarks = remarks.into_inner().unwrap();
    let told = remarks.iter().filter(|remark| remark.starts_with("recording: ")).count();
    assert!((1..=3).contains(&told), "{remarks:?}");
}
