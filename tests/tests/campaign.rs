//! Faults through the controller's wire code: what the table in the repository says.
//!
//! `AGV_ACCEPT=1 cargo test --release -p agv-tests --test campaign` writes the table anew, for a change that is meant;
//! `AGV_LONG=1` makes every run of the campaign and every pair.

use std::path::{Path, PathBuf};

use agv_host_sim::simulate::scenario::Scenario;
use agv_lab::campaign::results::Row;
use agv_lab::campaign::table::table;
use agv_lab::campaign::{Campaign, Shard};

fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

fn campaign() -> (Campaign, Scenario) {
    Campaign::read(&repository("host-sim/scenarios/faults.toml")).unwrap()
}

fn misleading(rows: &[Row]) -> Vec<String> {
    let is_misleading = |row: &&Row| row.class == "misleading" || row.has_panicked();
    rows.iter().filter(is_misleading).map(|row| format!("{} {} {}", row.fault, row.other_fault, row.seed)).collect()
}

#[test]
fn faults_are_met_as_the_table_says() {
    let (mut campaign, scenario) = campaign();
    assert!(campaign.faults.len() >= 40);
    campaign.runs = 2;
    let rows = campaign.rows(&scenario, &campaign.alone(), Shard::ALL, || ()).unwrap();
    assert_eq!(misleading(&rows), Vec::<String>::new());
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/faults.txt");
    let found = table(&rows);
    if std::env::var_os("AGV_ACCEPT").is_some() {
        std::fs::write(&path, &found).unwrap();
        return;
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    let difference = kept.lines().zip(found.lines()).find(|(kept, found)| kept != found);
    assert_eq!(difference, None, "first line that differs, kept and found");
    assert_eq!(kept.lines().count(), found.lines().count());
}

#[test]
fn pairs_of_faults_do_not_mislead() {
    let (campaign, scenario) = campaign();
    let is_long = std::env::var_os("AGV_LONG").is_some();
    // Every fortieth pair.
    let shard = if is_long { Shard::ALL } else { Shard { number: 7, of: 40 } };
    let rows = campaign.rows(&scenario, &campaign.pairs(), shard, || ()).unwrap();
    assert!(rows.len() >= 60, "{}", rows.len());
    assert_eq!(misleading(&rows), Vec::<String>::new());
}

#[test]
fn every_seed_of_every_fault_is_no_lie() {
    if std::env::var_os("AGV_LONG").is_none() {
        return;
    }
    let (campaign, scenario) = campaign();
    let rows = campaign.rows(&scenario, &campaign.alone(), Shard::ALL, || ()).unwrap();
    assert_eq!(misleading(&rows), Vec::<String>::new());
}

#[test]
fn shards_are_the_whole() {
    let (mut campaign, scenario) = campaign();
    campaign.runs = 1;
    campaign.faults.truncate(9);
    let runs = campaign.alone();
    let whole = campaign.rows(&scenario, &runs, Shard::ALL, || ()).unwrap();
    let mut parts: Vec<Row> =
        (0..4).flat_map(|number| campaign.rows(&scenario, &runs, Shard { number, of: 4 }, || ()).unwrap()).collect();
    parts.sort_by_key(|row| row.run);
    assert_eq!(format!("{parts:?}"), format!("{whole:?}"));
}
