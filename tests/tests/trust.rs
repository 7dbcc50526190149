//! The worst size of each kind of fault, two seeds each: what the judge at the bus says of the controller as it ships.
//!
//! The table's first two columns are found by `agv evaluate trust`; the others are accepted with `AGV_ACCEPT=1`.

use std::fmt::Write as _;
use std::path::Path;

use agv_lab::campaign::Shard;
use agv_lab::trust::kinds::{self, Kind};
use agv_lab::trust::row::Row;
use agv_lab::trust::sweep;
use agv_lab::trust::trial::{Tested, Trial};
use agv_tests::repository;

const SEEDS: [u64; 2] = [1, 2];

/// One line: what the runs of a kind came to.
fn line(kind: &str, size: f64, rows: &[&Row]) -> String {
    let outcomes = || rows.iter().map(|row| row.outcome.as_ref().expect("no run panics"));
    let failures = outcomes().filter(|outcome| outcome.failures > 0).count();
    let hazards: u32 = outcomes().map(|outcome| outcome.hazards).sum();
    let is_misleading = outcomes().any(|outcome| outcome.misleading > 0);
    format!("{kind},{size},{failures},{hazards},{}", if is_misleading { "yes" } else { "no" })
}

#[test]
fn the_worst_size_of_each_kind_is_judged_as_it_was() {
    let kinds = kinds::read(&repository("host-sim/scenarios/trust.toml")).unwrap().kinds;
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/trust.csv");
    let kept = std::fs::read_to_string(&path).unwrap();
    let named: Vec<(&Kind, f64)> = kept
        .lines()
        .skip(1)
        .map(|line| {
            // Names may have commas.
            let mut cells = line.rsplitn(5, ',').skip(3);
            let (size, name) = (cells.next().unwrap(), cells.next().unwrap());
            (kinds.iter().find(|kind| kind.name == name).unwrap(), size.parse().unwrap())
        })
        .collect();
    let missing: Vec<&str> = kinds
        .iter()
        .map(|kind| kind.name.as_str())
        .filter(|name| !named.iter().any(|(kind, _)| kind.name == *name))
        .collect();
    assert!(missing.is_empty(), "the table has no line of {missing:?}");
    let trials: Vec<Trial> =
        named.iter().flat_map(|&(kind, size)| SEEDS.map(|seed| Trial::new((kind, size), None, seed))).collect();
    let rows = sweep::run(&trials, Shard::ALL, &Tested::default(), || ()).unwrap();
    let mut found = String::from("kind,worst size,runs that fail,hazardous events,misleading\n");
    for (&(kind, size), rows) in named.iter().zip(rows.chunks(SEEDS.len())) {
        writeln!(found, "{}", line(&kind.name, size, &rows.iter().collect::<Vec<_>>())).unwrap();
    }
    if std::env::var_os("AGV_ACCEPT").is_some() {
        std::fs::write(&path, &found).unwrap();
        return;
    }
    for (kept, found) in kept.lines().zip(found.lines()) {
        assert_eq!(kept, found);
    }
    assert_eq!(kept.lines().count(), found.lines().count());
}
