//! Logs of a CAN bus in the dialects of several programs: the same frames, or a word of what is missing.

use std::fmt::Write;
use std::io::Write as _;
use std::path::Path;

use agv_core::geometry::Pose;
use agv_core::localizer::Parameters;
use agv_core::odometry::{CounterRange, Tricycle, Vehicle};
use agv_host_sim::import::can_log::{self, CanLog, CanLogError};
use agv_host_sim::log;
use agv_host_sim::recording::Recording;
use proptest::prelude::*;

use super::support::Ended;
use crate::support::Files;

/// A frame: time since the beginning in us, identifier, bytes.
#[derive(Clone, Debug, PartialEq)]
struct Sent(u64, u32, Vec<u8>);

/// When the log begins, s.
const EPOCH: u64 = 1_717_000_000;

/// Two encoders that report every 10 ms, the driving wheel 0.3 ms behind the steering.
fn drive(samples: u32) -> Vec<Sent> {
    let sample = |step: u32| {
        let time = 10_000 * u64::from(step);
        [Sent(time, 0x182, 0_u32.to_le_bytes().to_vec()), Sent(time + 300, 0x181, (20 * step).to_le_bytes().to_vec())]
    };
    (0..samples).flat_map(sample).collect()
}

fn hex(bytes: &[u8], separator: &str) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(separator)
}

fn seconds(micros: u64) -> String {
    format!("{}.{:06}", micros / 1_000_000, micros % 1_000_000)
}

/// How a program writes a line; it is given the time of the line before, too.
type Dialect = (&'static str, &'static str, fn(&Sent, u64, usize) -> String);

fn logged(stamp: &str, Sent(_, id, bytes): &Sent) -> String {
    format!("({stamp}) can0 {id:03X}#{}", hex(bytes, ""))
}

fn shown(stamp: &str, Sent(_, id, bytes): &Sent) -> String {
    format!(" ({stamp})  can0  {id:03X}   [{}]  {}", bytes.len(), hex(bytes, " "))
}

const DIALECTS: [Dialect; 21] = [
    ("candump -l", "", |sent, _, _| logged(&seconds(EPOCH * 1_000_000 + sent.0), sent)),
    ("candump -l with directions", "", |sent, _, _| logged(&seconds(EPOCH * 1_000_000 + sent.0), sent) + " R"),
    ("candump -l in nanoseconds", "", |sent, _, _| {
        logged(&format!("{}000", seconds(EPOCH * 1_000_000 + sent.0)), sent)
    }),
    ("candump -L -td", "", |sent, before, _| logged(&format!("00{}", seconds(sent.0 - before)), sent)),
    ("candump -L -tz", "", |sent, _, _| logged(&format!("00{}", seconds(sent.0)), sent)),
    ("candump -ta", "", |sent, _, _| shown(&seconds(EPOCH * 1_000_000 + sent.0), sent)),
    ("candump -td", "", |sent, before, _| shown(&format!("00{}", seconds(sent.0 - before)), sent)),
    ("candump -tz", "", |sent, _, _| shown(&format!("00{}", seconds(sent.0)), sent)),
    ("candump -tA", "", |sent, _, _| {
        let (minute, second) = (sent.0 / 60_000_000, sent.0 % 60_000_000);
        shown(&format!("2024-05-29 23:{minute:02}:{:02}.{:06}", second / 1_000_000, second % 1_000_000), sent)
    }),
    ("candump -ta -x", "", |sent, _, _| {
        shown(&seconds(EPOCH * 1_000_000 + sent.0), sent).replace("can0  ", "can0  RX - -  ")
    }),
    ("candump -ta -e", "", |sent, _, number| {
        let error = " (1717000000.000000)  can0  20000004   [8]  00 04 00 00 00 00 00 00   ERRORFRAME\n\
                     \tcontroller-problem{rx-overflow}\n";
        let line = shown(&seconds(EPOCH * 1_000_000 + sent.0), sent);
        if number % 50 == 7 { format!("{error}{line}") } else { line }
    }),
    ("candump -ta -a", "", |sent, _, _| shown(&seconds(EPOCH * 1_000_000 + sent.0), sent) + "   '....'"),
    ("candump -ta -c", "", |sent, _, _| {
        format!("\x1b[31m{}\x1b[0m", shown(&seconds(EPOCH * 1_000_000 + sent.0), sent))
    }),
    ("candump -ta -i", "", |Sent(time, id, bytes), _, _| {
        let bits: Vec<String> = bytes.iter().map(|byte| format!("{byte:08b}")).collect();
        format!(" ({})  can0  {id:03X}   [{}]  {}", seconds(EPOCH * 1_000_000 + time), bytes.len(), bits.join(" "))
    }),
    (
        "Vector, absolute",
        "date Wed May 29 10:00:00.000 am 2024\nbase hex  timestamps absolute\n// version 9.0.0\nBegin Triggerblock\n   0.000000 Start of measurement\n",
        |sent, _, _| {
            format!(
                "   {} 1  {:X}             Rx   d {} {}  Length = 0",
                seconds(sent.0),
                sent.1,
                sent.2.len(),
                hex(&sent.2, " ")
            )
        },
    ),
    ("Vector, relative and decimal", "base dec  timestamps relative\n", |sent, before, _| {
        let bytes: Vec<String> = sent.2.iter().map(u8::to_string).collect();
        format!("   {} 1  {}             Rx   d {} {}", seconds(sent.0 - before), sent.1, sent.2.len(), bytes.join(" "))
    }),
    ("PEAK 1.0", ";$FILEVERSION=1.0\n;   Message Number\n", |sent, _, number| {
        format!(
            "{:>6}) {:>10}  {:04X}  {}  {}",
            number + 1,
            sent.0 as f64 * 1e-3,
            sent.1,
            sent.2.len(),
            hex(&sent.2, " ")
        )
    }),
    ("PEAK 1.1", ";$FILEVERSION=1.1\n;$STARTTIME=45441.4166\n", |sent, _, number| {
        format!(
            "{:>6}) {:>10.1}  Rx  {:04X}  {}  {}",
            number + 1,
            sent.0 as f64 * 1e-3,
            sent.1,
            sent.2.len(),
            hex(&sent.2, " ")
        )
    }),
    ("PEAK 1.3", ";$FILEVERSION=1.3\n", |sent, _, number| {
        format!(
            "{:>6}) {:>10.3} 1  Rx  {:04X} -  {}  {}",
            number + 1,
            sent.0 as f64 * 1e-3,
            sent.1,
            sent.2.len(),
            hex(&sent.2, " ")
        )
    }),
    ("PEAK 2.0", ";$FILEVERSION=2.0\n;$COLUMNS=N,O,T,I,d,l,D\n", |sent, _, number| {
        format!(
            "{:>6} {:>10.3} DT  {:04X} Rx {}  {}",
            number + 1,
            sent.0 as f64 * 1e-3,
            sent.1,
            sent.2.len(),
            hex(&sent.2, " ")
        )
    }),
    ("PEAK 2.1", ";$FILEVERSION=2.1\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n", |sent, _, number| {
        format!(
            "{:>6} {:>10.3} DT 1  {:04X} Rx -  {}  {}",
            number + 1,
            sent.0 as f64 * 1e-3,
            sent.1,
            sent.2.len(),
            hex(&sent.2, " ")
        )
    }),
];

fn written((_, header, line): &Dialect, sent: &[Sent]) -> String {
    let mut text = (*header).to_owned();
    let mut before = 0;
    for (number, one) in sent.iter().enumerate() {
        writeln!(text, "{}", line(one, before, number)).unwrap();
        before = one.0;
    }
    text
}

fn read(text: &str) -> Result<CanLog, CanLogError> {
    can_log::of_text(Path::new("bus.log"), text)
}

/// The frames of a log, with times since the first.
fn heard(log: &CanLog) -> Vec<Sent> {
    let start = log.frames[0].time.unwrap().micros();
    let sent = log.frames.iter().map(|seen| {
        let id = match seen.frame.id() {
            agv_wire::can::frame::Id::Standard(id) => u32::from(id.as_raw()),
            agv_wire::can::frame::Id::Extended(id) => id.as_raw(),
        };
        Sent(seen.time.unwrap().micros() - start, id, seen.frame.data().to_vec())
    });
    sent.collect()
}

/// Whether frames are the same; `PEAK 1.1` writes tenths of a millisecond.
fn are_same(found: &[Sent], sent: &[Sent]) -> bool {
    let is_same = |(a, b): (&Sent, &Sent)| a.0.abs_diff(b.0) <= 100 && (a.1, &a.2) == (b.1, &b.2);
    found.len() == sent.len() && found.iter().zip(sent).all(is_same)
}

#[test]
fn every_dialect_says_the_same() {
    let sent = drive(200);
    for dialect in &DIALECTS {
        let text = written(dialect, &sent);
        for text in [text.clone(), text.replace('\n', "\r\n")] {
            let log = read(&text).unwrap_or_else(|error| panic!("{}: {error}", dialect.0));
            assert!(are_same(&heard(&log), &sent), "{}: {:?}", dialect.0, &heard(&log)[..6]);
            assert!(log.account.warnings().is_empty(), "{}: {:?}", dialect.0, log.account);
        }
    }
}

#[test]
fn every_dialect_is_read_up_to_where_it_was_cut() {
    let sent = drive(20);
    for dialect in &DIALECTS {
        let text = written(dialect, &sent);
        let begin = text[..text.len() - 1].rfind('\n').unwrap() + 1;
        // Anywhere in the last line, behind what is white.
        let begin = begin + text[begin..].find(|one: char| one != ' ').unwrap();
        for cut in begin + 1..text.len() - 1 {
            let log = read(&text[..cut]).unwrap_or_else(|error| panic!("{} {cut}: {error}", dialect.0));
            let found = heard(&log);
            let is_whole = are_same(&found, &sent);
            assert!(is_whole || are_same(&found, &sent[..sent.len() - 1]), "{} {cut}: {:?}", dialect.0, found.last());
            assert!(is_whole || log.account.warnings().len() == 1, "{} {cut}: {:?}", dialect.0, log.account);
        }
    }
}

#[test]
fn a_clock_that_was_set_goes_on_and_is_told() {
    let sent = drive(600);
    for (at, back) in [(600, 18_000_000_000_u64), (601, 3_600_000_000), (100, 50_000)] {
        let mut stamped = sent.clone();
        stamped[..at].iter_mut().for_each(|one| one.0 += back);
        let log = read(&written(&DIALECTS[0], &stamped)).unwrap();
        let found = heard(&log);
        assert_eq!(found.len(), sent.len());
        // It goes on by the usual step, which is one of the two.
        assert!(found.iter().zip(&sent).all(|(found, sent)| found.0.abs_diff(sent.0) < 10_000), "{at} {back}");
        let warnings = log.account.warnings();
        assert!(warnings.len() == 1 && warnings[0].contains("set back"), "{warnings:?}");
    }
}

#[test]
fn what_is_no_log_of_a_bus_is_refused_with_what_was_expected() {
    for (text, expected) in [
        ("once upon a time\nthere was a bus\n", "bus.log:1: this is no log of a CAN bus: \"once upon a time\""),
        ("  can0  182   [4]  00 00 00 00\n", "none of its 1 frames has a time: record with `candump -l`"),
        (";$FILEVERSION=7.0\n   1  0 DT\n", "version \"7.0\" of .trc"),
        (
            "timestamp,arbitration_id,extended,remote,error,dlc,data\n0.0,0x182,0,0,0,4,AAAAAA==\n",
            "expected lines of candump -l",
        ),
    ] {
        let error = read(text).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn lines_that_are_no_frame_are_counted_with_their_place() {
    let sent = drive(100);
    let mut lines: Vec<String> = written(&DIALECTS[0], &sent).lines().map(str::to_owned).collect();
    lines[50] = "(1717000000.250000) can0 182#000000".to_owned() + "0";
    lines.insert(60, "what is this".to_owned());
    lines.insert(70, "DROPCOUNT: dropped 7 CAN frames on 'can0' socket (total drops 7)".to_owned());
    let log = read(&(lines.join("\n") + "\n")).unwrap();
    let left_out: Vec<String> = log.account.left_out().iter().map(ToString::to_string).collect();
    assert!(left_out.iter().any(|one| one == "2 lines that are no frame, first at line 51"), "{left_out:?}");
    assert!(left_out.iter().any(|one| one == "7 frames that candump itself has lost"), "{left_out:?}");
    assert_eq!(log.account.warnings().len(), 1, "nine of two hundred are too many");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn frames_of_any_content_survive_every_dialect(
        frames in prop::collection::vec((1_u64..500_000, 1_u32..0x7FF, prop::collection::vec(any::<u8>(), 0..=8)), 20..40),
        dialect in 0..DIALECTS.len(),
    ) {
        let mut time = 0;
        let sent: Vec<Sent> = frames
            .iter()
            .map(|(step, id, bytes)| {
                time += step;
                Sent(time, *id, bytes.clone())
            })
            .collect();
        let sent: Vec<Sent> = sent.iter().map(|one| Sent(one.0 - sent[0].0, one.1, one.2.clone())).collect();
        let log = read(&written(&DIALECTS[dialect], &sent)).unwrap();
        prop_assert!(are_same(&heard(&log), &sent), "{}", DIALECTS[dialect].0);
    }

    #[test]
    fn no_text_is_too_much(text in ".{0,200}", dialect in 0..DIALECTS.len(), cut in 0_usize..2000) {
        let _ = read(&text);
        let whole = written(&DIALECTS[dialect], &drive(10));
        let mut mixed: String = whole.chars().take(cut).collect();
        mixed.push_str(&text);
        let _ = read(&mixed);
    }
}

/// A log of a tricycle of which 1000 ticks are a metre.
fn like(files: &Files) -> String {
    let vehicle = Vehicle::Tricycle(Tricycle {
        wheelbase: 1.2,
        drive_scale: 1e-3,
        drive_range: CounterRange::BITS_32,
        steering_scale: 1e-3,
        steering_range: CounterRange::BITS_32,
        steering_offset_forward: 0.0,
        steering_offset_backward: 0.0,
    });
    let mut parameters = Parameters::new(vehicle, Pose::default());
    parameters.limits.fastest = 5.0;
    let recording =
        Recording { parameters, landmarks: vec![], events: vec![], truth: vec![], references: vec![], state: None };
    let path = files.path("like.agvlog");
    log::write(Path::new(&path), &recording).unwrap();
    path
}

fn import(text: &str, options: &[&str]) -> Ended {
    let files = Files::new();
    let (like, input, output) = (like(&files), files.write("bus.log", text.as_bytes()), files.path("out.agvlog"));
    Ended::of(&[&["import", "candump", &input, "--like", &like, "-o", &output], options].concat())
}

#[test]
fn an_encoder_that_boots_again_goes_on() {
    let plain = written(&DIALECTS[0], &drive(300));
    let mut lines: Vec<&str> = plain.lines().collect();
    for (place, line) in [
        (1, "(1717000000.000100) can0 701#00"),
        (300, "(1717000001.496000) can0 702#00"),
        (302, "(1717000001.504000) can0 701#00"),
        (303, "(1717000001.504100) can0 701#05"),
    ] {
        lines.insert(place, line);
    }
    let booted = import(&(lines.join("\n") + "\n"), &[]);
    assert_eq!((booted.code, booted.count("odometry")), (Some(0), 299), "{booted:?}");
    assert!((booted.number("distance_m") - 5.96).abs() < 0.01 && booted.warnings().is_empty(), "{booted:?}");
}

#[test]
fn nodes_that_boot_apart_are_heard_from_the_second_on() {
    let mut sent = drive(600);
    sent.retain(|one| one.1 == 0x181 || one.0 > 2_000_000);
    let ended = import(&written(&DIALECTS[0], &sent), &[]);
    assert!((ended.code, ended.count("odometry") >= 370) == (Some(0), true), "{ended:?}");
    assert!(ended.warns("made no sample") || ended.warns("were left out"), "{ended:?}");
}

#[test]
fn slow_encoders_are_as_good_as_fast_ones() {
    for factor in [2, 5, 10] {
        let sent: Vec<Sent> = drive(200).into_iter().map(|one| Sent(one.0 * factor, one.1, one.2)).collect();
        let ended = import(&written(&DIALECTS[0], &sent), &[]);
        assert_eq!((ended.code, ended.count("odometry")), (Some(0), 199), "{factor}: {ended:?}");
        assert!(ended.warnings().is_empty(), "{factor}: {ended:?}");
    }
}

#[test]
fn one_of_two_buses_is_chosen() {
    let sent = drive(200);
    let one = written(&DIALECTS[0], &sent);
    let other: Vec<Sent> = sent.iter().map(|one| Sent(one.0 + 4000, one.1, vec![0x55; 4])).collect();
    let both: Vec<String> = one
        .lines()
        .map(str::to_owned)
        .zip(written(&DIALECTS[0], &other).lines().map(|line| line.replace("can0", "can1")))
        .flat_map(|(one, other)| [one, other])
        .collect();
    let both = both.join("\n") + "\n";
    let refused = import(&both, &[]);
    assert!(
        refused.code == Some(1) && refused.complaint.contains("choose one of can0, can1 with --interface"),
        "{refused:?}"
    );
    let refused = import(&both, &["--interface", "vcan7"]);
    assert!(refused.code == Some(1) && refused.complaint.contains("--interface can be can0, can1"), "{refused:?}");
    let ended = import(&both, &["--interface", "can0"]);
    assert_eq!((ended.code, ended.count("odometry")), (Some(0), 199), "{ended:?}");
    // Another bus beside that of the encoders needs no choice.
    let quiet = both.replace("can1 18", "can1 38");
    assert_eq!(import(&quiet, &[]).count("odometry"), 199);
}

#[test]
fn what_is_doubtful_is_code_three_where_that_is_asked_for() {
    let text = written(&DIALECTS[0], &drive(300));
    assert_eq!(import(&text, &["--strict"]).code, Some(0));
    let cut = import(&text[..text.len() - 7], &["--strict"]);
    assert!(cut.code == Some(3) && cut.warns("in the middle of line 600"), "{cut:?}");
    let mut sent = drive(600);
    sent.retain(|one| !(2_000_000..4_000_000).contains(&one.0));
    let gap = import(&written(&DIALECTS[0], &sent), &["--strict"]);
    assert!(gap.code == Some(3) && gap.warns("gaps over 1 s"), "{gap:?}");
    let short: Vec<Sent> = drive(300)
        .into_iter()
        .map(|one| Sent(one.0, one.1, one.2[..if one.0 < 1_000_000 { 2 } else { 4 }].to_vec()))
        .collect();
    let short = import(&written(&DIALECTS[0], &short), &["--strict"]);
    assert!(short.code == Some(3) && short.warns("less than the 4 bytes of a position"), "{short:?}");
}

#[test]
fn nodes_of_another_number_are_named() {
    let sent: Vec<Sent> = drive(100).into_iter().map(|one| Sent(one.0, one.1 + 4, one.2)).collect();
    let refused = import(&written(&DIALECTS[0], &sent), &[]);
    assert!(refused.code == Some(1) && refused.complaint.contains("comes from node 5, 6"), "{refused:?}");
    assert_eq!(import(&written(&DIALECTS[0], &sent), &["--drive", "5", "--steering", "6"]).count("odometry"), 99);
}

#[test]
fn every_dialect_is_recognised_compressed_and_in_any_encoding() {
    let files = Files::new();
    let like = like(&files);
    let auto = |name: &str, bytes: &[u8]| {
        let (input, output) = (files.write(name, bytes), files.path("out.agvlog"));
        let ended = Ended::of(&["import", "auto", &input, "--like", &like, "-o", &output]);
        assert_eq!((ended.code, ended.summary["odometry"].as_u64()), (Some(0), Some(49)), "{name}: {ended:?}");
    };
    for dialect in &DIALECTS {
        let text = written(dialect, &drive(50));
        auto(dialect.0, text.as_bytes());
        auto(dialect.0, &[b"\xEF\xBB\xBF", text.replace('\n', "\r\n").as_bytes()].concat());
    }
    let text = written(&DIALECTS[0], &drive(50));
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packed.write_all(text.as_bytes()).unwrap();
    auto("bus.log.gz", &packed.finish().unwrap());
    let wide: Vec<u8> = std::iter::once(0xFEFF).chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    auto("wide.log", &wide);
}
