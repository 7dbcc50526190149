use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;

#[test]
fn an_unknown_key_is_refused_with_a_sentence() {
    for (text, key) in [
        ("sead = 1", "sead"),
        ("[laser]\nbeems = 7", "beems"),
        ("[world]\nkind = \"block_storage\"\nmoved = 1", "moved"),
        ("[world]\nkind = \"warehouse\"", "warehouse"),
        ("[path]\nkind = \"p1\"\nspeed = 1.0", "speed"),
        ("[vehicle.true]\nscale = 1.0", "scale"),
        ("[[people]]\nway = [[0, 0]]\ncolour = 1", "colour"),
    ] {
        let sentence = Scenario::parse(text).unwrap_err().to_string();
        assert!(sentence.contains("not a scenario") && sentence.contains(key), "{sentence}");
    }
}

#[test]
fn values_without_sense_are_refused() {
    for text in [
        "[drive]\nspeed = 0.0",
        "[drive]\nbraking = nan",
        "[laser]\nbeams = 0",
        "[laser]\nrange_noise = -0.01",
        "[reflectors]\nmissing_share = 1.5",
        "[vehicle.believed]\ndrive_counter = 1",
        "[path]\nkind = \"legs\"",
        "[path]\nkind = \"legs\"\nlegs = [{ segments = [] }]",
        "[path]\nkind = \"legs\"\nlegs = [{ segments = [{ length = -1.0 }] }]",
        "[path]\nkind = \"p1\"\nlegs = [{ segments = [{ length = 1.0 }] }]",
        "[world]\nkind = \"shapes\"\nwalls = [[0, 0, inf, 0]]",
        "[[people]]\nway = []",
    ] {
        let error = Scenario::parse(text).unwrap_err().to_string();
        assert!(error.contains("must be"), "{text}: {error}");
    }
}

#[test]
fn a_vehicle_that_no_localiser_can_have_is_refused_by_name() {
    for (text, leaf) in [
        ("[vehicle.believed]\nsteering_counter = 4", "vehicle.steering_scale"),
        ("[vehicle.believed]\nsteering_offset_forward_deg = 500.0", "vehicle.steering_offset_forward"),
    ] {
        let error = Scenario::parse(text).unwrap_err().to_string();
        assert_eq!(error, format!("the scenario's vehicle cannot be: {leaf} is out of its bounds"));
    }
}

#[test]
fn an_empty_file_is_the_standard() {
    assert_eq!(Scenario::parse("").unwrap(), Scenario::default());
}

#[test]
fn the_shipped_scenarios_can_be_driven_and_survive_writing() {
    let mut count = 0;
    for entry in std::fs::read_dir("scenarios").unwrap() {
        let path = entry.unwrap().path();
        // Kinds of faults are no scenario.
        if path.ends_with("faults.toml") || path.ends_with("trust.toml") {
            continue;
        }
        let mut scenario = Scenario::read(&path).unwrap();
        let written = toml::to_string(&scenario).unwrap();
        assert_eq!(Scenario::parse(&written).unwrap(), scenario, "{}", path.display());
        scenario.laser.scans = false;
        assert!(!simulate(&scenario).unwrap().recording.landmarks.is_empty());
        count += 1;
    }
    assert_eq!(count, 7);
}
