//! `docs/agv.eds` is what the controller's tables say.
//!
//! `AGV_ACCEPT=1 cargo test -p agv-host-sim eds` writes it anew, for a change that is meant.

use agv_host_sim::export::eds::eds;
use agv_settings::Settings;

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/agv.eds");

#[test]
fn the_description_file_is_made_from_the_tables() {
    let found = eds(&Settings::default());
    if std::env::var_os("AGV_ACCEPT").is_some() {
        std::fs::write(FILE, &found).unwrap();
        return;
    }
    let kept = std::fs::read_to_string(FILE).unwrap();
    for (kept, found) in kept.lines().zip(found.lines()) {
        assert_eq!(kept, found);
    }
    assert_eq!(kept.lines().count(), found.lines().count());
}

#[test]
fn a_maker_has_a_description_of_its_own() {
    let mut settings = Settings::default();
    settings.nodes.vendor = 0x1A2;
    let text = eds(&settings);
    assert!(text.contains("\nVendorNumber=0x1A2\n"));
    let vendor = text.split("\n[1018sub1]\n").nth(1).unwrap();
    assert!(vendor.split("\n\n").next().unwrap().contains("DefaultValue=0x000001A2"));
}
