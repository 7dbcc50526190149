//! The emulated sensor and the clients of others: what each puts on the wire, byte by byte, and what it must find there.

use agv_core::measurement::Time;
use agv_host_sim::serve::nav350::{Connection, Drive, Sensor, SensorClockOptions};
use agv_host_sim::simulate::block_storage::{BlockStorage, ReflectorPlacement};
use agv_host_sim::simulate::scenario::{Scenario, WorldOptions};
use agv_host_sim::simulate::simulate;
use agv_tests::recordings;
use agv_wire::cola::{Dialect, Fault, Writer};
use agv_wire::nav350::{
    Answer, Configuration, Method, MethodResult, OperatingMode, PositionMode, Request, Revolution, SensorFrame,
    Session, Step,
};

/// A sensor and one connection to it, with a time that is only counted.
struct Line {
    sensor: Sensor,
    connection: Connection,
    now: f64,
}

impl Line {
    fn new(gap: f64) -> Self {
        let world = BlockStorage { reflectors: ReflectorPlacement::Aisle, ..BlockStorage::default() };
        let mut scenario = Scenario { world: WorldOptions::BlockStorage(world), ..Scenario::default() };
        scenario.laser.intensities = true;
        let drive = Drive::new(&simulate(&scenario).unwrap().recording, SensorFrame::default()).unwrap();
        let sensor = Sensor::new(drive, SensorClockOptions::default(), None, false).with_gap(gap);
        Self { sensor, connection: Connection::default(), now: 0.0 }
    }

    fn reconnect(&mut self) {
        self.connection = Connection::default();
    }

    /// Sends bytes one by one; gives what comes back at once.
    fn send(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut answers = Vec::new();
        for byte in bytes {
            answers.extend(self.connection.receive(&mut self.sensor, &[*byte], self.now));
        }
        answers
    }

    /// Sends a text of CoLa-A.
    fn tell(&mut self, text: &str) -> String {
        let bytes = self.send(format!("\x02{text}\x03").as_bytes());
        String::from_utf8(bytes).unwrap()
    }

    /// Lets time go by; gives the pieces that come, with their times.
    fn wait(&mut self, seconds: f64) -> Vec<(f64, Vec<u8>)> {
        let end = self.now + seconds;
        let mut pieces = Vec::new();
        while let Some(due) = self.connection.due().filter(|due| *due <= end) {
            self.now = self.now.max(due);
            pieces.extend(self.connection.poll(&self.sensor, self.now).map(|bytes| (self.now, bytes)));
        }
        self.now = end;
        pieces
    }

    /// The same as one text of CoLa-A.
    fn hear(&mut self, seconds: f64) -> String {
        let pieces = self.wait(seconds);
        pieces.into_iter().map(|(_, bytes)| String::from_utf8(bytes).unwrap()).collect()
    }
}

fn framed(texts: &[&str]) -> String {
    texts.iter().map(|text| format!("\x02{text}\x03")).collect()
}

/// A number of CoLa-A, of 32 bits.
fn number(field: &str) -> i32 {
    u32::from_str_radix(field, 16).unwrap().cast_signed()
}

#[test]
fn a_client_that_never_logs_in_finds_both_answers_in_one_piece() {
    let mut line = Line::new(0.0);
    let mut heard = line.tell("sMN mNEVAChangeState 1") + &line.hear(0.5);
    heard += &(line.tell("sMN mNEVAChangeState 4") + &line.hear(1.0));
    let expected = framed(&[
        "sMA mNEVAChangeState",
        "sAN mNEVAChangeState 0 1",
        "sMA mNEVAChangeState",
        "sAN mNEVAChangeState 0 4",
    ]);
    assert_eq!(heard, expected);
    let turns: Vec<_> = line.sensor.drive().turns().to_vec();
    for _ in 0..40 {
        let heard = line.tell("sMN mNPOSGetPose 1") + &line.hear(0.125);
        let pieces: Vec<&str> = heard.split_terminator('\x03').map(|piece| piece.trim_start_matches('\x02')).collect();
        assert_eq!(pieces[0], "sMA mNPOSGetPose");
        for piece in &pieces[1..] {
            let fields: Vec<&str> = piece.split(' ').collect();
            assert!(fields.len() == 10 || fields.len() == 16, "{piece}");
            let found = [6, 7].map(|index| 1e-3 * f64::from(number(fields[index])));
            let is_there = turns
                .iter()
                .filter_map(|turn| turn.pose)
                .any(|pose| (pose.x - found[0]).abs() < 1e-3 && (pose.y - found[1]).abs() < 1e-3);
            assert!(is_there && (0..360_000).contains(&number(fields[8])), "{piece}");
        }
    }
}

#[test]
fn a_client_that_reads_answers_one_by_one_finds_them_apart() {
    let mut line = Line::new(0.03);
    assert_eq!(line.tell("sMN SetAccessMode 03 F4724744"), framed(&["sAN SetAccessMode 1"]));
    for (write, answer) in [("NPOSPoseDataFormat 1 1", "NPOSPoseDataFormat"), ("NEVACurrLayer 0", "NEVACurrLayer")] {
        assert_eq!(line.tell(&format!("sWN {write}")).trim_end_matches('\x03').trim_end(), format!("\x02sWA {answer}"));
    }
    assert_eq!(line.tell("sMN mNEVAChangeState 4"), framed(&["sMA mNEVAChangeState"]));
    let pieces = line.wait(0.5);
    let [(at, bytes)] = &pieces[..] else { panic!("{pieces:?}") };
    assert!((at - 0.03).abs() < 1e-9);
    assert_eq!(bytes, framed(&["sAN mNEVAChangeState 0 4"]).as_bytes());
    for (request, answer) in [
        ("sRN NEVACurrLayer", "sRA NEVACurrLayer 0"),
        ("sWN NLMDReflSize 28", "sWA NLMDReflSize"),
        ("sWN NPOSSlidingMean 5", "sWA NPOSSlidingMean"),
        ("sRN NLMDReflSize", "sRA NLMDReflSize 28"),
        ("sRN NPOSSlidingMean", "sRA NPOSSlidingMean 5"),
    ] {
        assert_eq!(line.tell(request).trim_end_matches('\x03').trim_end(), format!("\x02{answer}"));
    }
    // A method that is read is refused, not passed over in silence.
    assert!(line.tell("sRN mNLAYGetLayout").starts_with("\x02sFA "));
    let mut modes = Vec::new();
    for round in 0..60 {
        if round % 3 == 0 {
            line.reconnect();
        }
        assert_eq!(line.tell("sMN mNPOSGetData 1 0"), framed(&["sMA mNPOSGetData"]));
        let heard = line.hear(0.2);
        let fields: Vec<&str> = heard.trim_matches(['\x02', '\x03']).split(' ').collect();
        assert!(fields.len() > 16, "{heard}");
        // As the format of poses was set.
        assert_eq!(number(fields[11]), 1, "{heard}");
        modes.push((number(fields[14]), number(fields[16])));
    }
    // By few reflectors a pose does not rest on reflectors alone.
    assert!(modes.iter().all(|(mode, used)| (*mode == 1) == (*used >= 3)), "{modes:?}");
    assert!(modes.iter().any(|(mode, _)| *mode == 1));
}

fn requests(test: &str, name: &str) -> Option<Vec<Vec<u8>>> {
    let text = std::fs::read_to_string(recordings(test, name)?).unwrap();
    let bytes = |digits: &str| {
        let byte = |index| u8::from_str_radix(&digits[index..index + 2], 16).unwrap();
        (0..digits.len()).step_by(2).map(byte).collect()
    };
    Some(text.lines().filter_map(|line| Some(bytes(line.strip_prefix("C>S ")?.split(' ').next()?))).collect())
}

/// Moves the requests that `first` finds to the front, in its order.
fn in_order(mut requests: Vec<Vec<u8>>, first: &[&[u8]]) -> Vec<Vec<u8>> {
    let place = |request: &Vec<u8>| {
        let holds = |part: &&[u8]| request.windows(part.len()).any(|window| window == *part);
        first.iter().position(holds).unwrap_or(first.len())
    };
    requests.sort_by_key(place);
    requests
}

#[test]
fn the_toolbox_finds_acknowledgement_and_answer_of_all_it_asks() {
    let test = "the_toolbox_finds_acknowledgement_and_answer_of_all_it_asks";
    let Some(requests) = requests(test, "nav350/sicktoolbox_client_requests_colaA.hexlines") else { return };
    let order: [&[u8]; 8] = [
        b"SetAccessMode",
        b"DeviceIdent",
        b"NAVScanDataFormat",
        b"ChangeState 1",
        b"ChangeState 3",
        b"NLMDGetData",
        b"ChangeState 4",
        b"mNPOSGetData",
    ];
    for gap in [0.0, 0.03] {
        let mut line = Line::new(gap);
        for request in in_order(requests.clone(), &order) {
            let mut heard = String::from_utf8(line.send(&request)).unwrap();
            heard += &line.hear(0.3);
            let asked = String::from_utf8(request).unwrap();
            let words: Vec<&str> = asked.trim_matches(['\x02', '\x03']).split(' ').collect();
            let pieces: Vec<&str> = heard.split_terminator('\x03').map(|piece| &piece[1..]).collect();
            let is_slow = ["mNEVAChangeState", "mNLMDGetData", "mNPOSGetData"].contains(&words[1]);
            assert_eq!(pieces.len(), 1 + usize::from(is_slow), "{asked}: {heard}");
            if is_slow {
                assert_eq!(pieces[0], format!("sMA {}", words[1]));
            }
            let answer = match words[0] {
                "sRN" => "sRA",
                "sWN" => "sWA",
                _ => "sAN",
            };
            assert!(pieces.last().unwrap().starts_with(&format!("{answer} {}", words[1])), "{asked}: {heard}");
            if words[1].ends_with("GetData") {
                // With the strengths of the echoes that it has asked for.
                assert!(heard.contains("DIST1") && heard.contains("RSSI1"), "{}", &heard[..200]);
            }
        }
    }
}

#[test]
fn the_makers_driver_maps_and_drives() {
    let test = "the_makers_driver_maps_and_drives";
    let Some(requests) = requests(test, "nav350/sick_client_requests_colaB.hexlines") else { return };
    let order: [&[u8]; 12] = [
        b"SetAccessMode",
        b"ChangeState \x01",
        b"NEVACurrLayer",
        b"NLMDLandmarkDataFormat",
        b"NAVScanDataFormat",
        b"NPOSPoseDataFormat",
        b"mNLAYEraseLayout",
        b"ChangeState \x02",
        b"NMAPMapCfg",
        b"NLMDReflSize",
        b"mNMAPDoMapping",
        b"AddLandmark",
    ];
    let navigation: &[u8] = b"ChangeState \x04";
    for gap in [0.0, 0.03] {
        let mut line = Line::new(gap);
        let mut requests = in_order(requests.clone(), &order);
        let is_navigation = |request: &Vec<u8>| request.windows(navigation.len()).any(|window| window == navigation);
        let place = requests.iter().position(is_navigation).unwrap();
        let change = requests.remove(place);
        let last_edit =
            requests.iter().rposition(|request| request.windows(4).any(|window| window == b"mNLA")).unwrap();
        requests.insert(last_edit + 1, change);
        for request in requests {
            let mut heard = line.send(&request);
            heard.extend(line.wait(20.0).into_iter().flat_map(|(_, bytes)| bytes));
            let name: String =
                request[12..].iter().map(|byte| char::from(*byte)).take_while(|c| c.is_alphanumeric()).collect();
            assert!(!heard.is_empty(), "no answer to {name}");
            assert!(!heard.windows(3).any(|window| window == b"sFA"), "{name} is refused");
        }
    }
}

/// What the sensor answers to one request of ours.
fn asked(line: &mut Line, request: &Request, see: impl FnOnce(&Answer)) {
    let mut buffer = [0; 512];
    let length = request.encode(Dialect::Binary, &mut buffer).unwrap();
    let mut heard = line.send(&buffer[..length]);
    heard.extend(line.wait(20.0).into_iter().flat_map(|(_, bytes)| bytes));
    let mut deframer = Box::new(agv_wire::cola::Deframer::<65_536>::new());
    deframer.extend(&heard);
    let mut see = Some(see);
    while let Some(found) = deframer.next() {
        let agv_wire::cola::Deframed::Telegram { dialect, payload, .. } = found else { panic!("rubbish") };
        let answer = Answer::decode(dialect, payload).unwrap();
        if !matches!(answer, Answer::Accepted(_)) {
            see.take().expect("one answer")(&answer);
        }
    }
    assert!(see.is_none(), "no answer");
}

#[test]
fn mapping_takes_as_many_turns_as_it_is_told_and_answers_in_the_layout() {
    use agv_wire::nav350::{Coordinate, MapConfiguration, Milliangle, Setting};
    let mut line = Line::new(0.0);
    let layout: Vec<[f64; 2]> =
        line.sensor.layout().iter().map(|known| [known.landmark.x.metres(), known.landmark.y.metres()]).collect();
    let pose = line.sensor.drive().turns()[0].pose.unwrap();
    let heading = pose.theta + SensorFrame::default().zero;
    for mean in [1_u8, 40] {
        asked(&mut line, &Request::Call(Method::SetAccessMode { level: 3, password: 0xF472_4744 }), |_| ());
        asked(&mut line, &Request::Call(Method::ChangeState(OperatingMode::Mapping)), |_| ());
        let place = MapConfiguration {
            mean,
            only_unknown: false,
            x: Coordinate::from_metres(pose.x),
            y: Coordinate::from_metres(pose.y),
            heading: Milliangle::from_radians(heading),
        };
        asked(&mut line, &Request::Write(Setting::MapConfiguration(place)), |_| ());
        let mut buffer = [0; 64];
        let length = Request::Call(Method::DoMapping).encode(Dialect::Binary, &mut buffer).unwrap();
        let begun = line.now;
        line.send(&buffer[..length]);
        let (at, bytes) = line.wait(20.0).pop().expect("an answer");
        let turns = (at - begun) / 0.125;
        assert!(turns <= f64::from(mean) + 1e-6 && turns > f64::from(mean) - 1.0, "{turns} turns for {mean}");
        let mut deframer = Box::new(agv_wire::cola::Deframer::<65_536>::new());
        deframer.extend(&bytes);
        let Some(agv_wire::cola::Deframed::Telegram { dialect, payload, .. }) = deframer.next() else { panic!() };
        let Answer::Result(MethodResult::Mapping(_, Some(list))) = Answer::decode(dialect, payload).unwrap() else {
            panic!()
        };
        let mut errors = Vec::new();
        for reflector in list.reflectors.iter() {
            let (x, y) = reflector.cartesian.unwrap();
            let distance = |known: &[f64; 2]| (known[0] - x.metres()).hypot(known[1] - y.metres());
            errors.push(layout.iter().map(distance).fold(f64::INFINITY, f64::min));
        }
        // In the frame of the sensor they would be metres away.
        assert!(errors.len() >= 3 && errors.iter().all(|error| *error < 0.1), "{errors:?}");
    }
}

#[test]
fn reflectors_are_told_by_their_names_in_the_layout() {
    use agv_wire::nav350::{CoordinateFormat, DataMask, LandmarkDataFormat, NavigationData, Setting};
    let mut line = Line::new(0.0);
    let layout = line.sensor.layout().to_vec();
    asked(&mut line, &Request::Call(Method::SetAccessMode { level: 3, password: 0xF472_4744 }), |_| ());
    asked(&mut line, &Request::Call(Method::ChangeState(OperatingMode::Navigation)), |_| ());
    let format = LandmarkDataFormat { coordinates: CoordinateFormat::Cartesian, has_details: true, filter: 0 };
    asked(&mut line, &Request::Write(Setting::LandmarkDataFormat(format)), |_| ());
    let mut named = 0;
    for _ in 0..10 {
        line.wait(0.5);
        let question = Request::Call(Method::GetData { wait: false, mask: DataMask::PoseAndReflectors });
        asked(&mut line, &question, |answer| {
            let Answer::Result(MethodResult::Data(data)) = answer else { panic!("{answer:?}") };
            let NavigationData { pose: Some(pose), reflectors: Some(list), .. } = data else { return };
            let (sine, cosine) = pose.heading.radians().sin_cos();
            for reflector in list.reflectors.iter() {
                let (x, y) = reflector.cartesian.unwrap();
                let (x, y) = (x.metres(), y.metres());
                let place = [pose.x.metres() + cosine * x - sine * y, pose.y.metres() + sine * x + cosine * y];
                let distance = |known: &agv_wire::nav350::IdentifiedLandmark| {
                    (known.landmark.x.metres() - place[0]).hypot(known.landmark.y.metres() - place[1])
                };
                let name = reflector.details.unwrap().global_id;
                let Some(known) = layout.iter().find(|known| known.id == name) else {
                    assert_eq!(name, u16::MAX);
                    continue;
                };
                // The vehicle has moved on since it was seen.
                assert!(distance(known) < 0.4 && layout.iter().all(|other| distance(known) <= distance(other)));
                named += 1;
            }
        });
    }
    assert!(named > 5, "{named}");
}

#[test]
fn every_variable_can_be_read_before_it_is_written() {
    for dialect in [Dialect::Ascii, Dialect::Binary] {
        let mut line = Line::new(0.0);
        for variable in agv_wire::nav350::Variable::ALL {
            if variable == agv_wire::nav350::Variable::ColaDialect {
                continue;
            }
            let mut buffer = [0; 64];
            let length = Request::Read(variable).encode(dialect, &mut buffer).unwrap();
            let heard = line.send(&buffer[..length]);
            let mut refusal = [0; 64];
            let refused = Writer::fault(dialect, Fault::UNKNOWN_VARIABLE, &mut refusal).unwrap();
            assert_ne!(heard, &refusal[..refused], "{}", variable.name());
            assert!(heard.windows(3).any(|window| window == b"sRA"), "{}", variable.name());
        }
    }
}

#[test]
fn our_own_session_runs_with_both_gaps() {
    for gap in [0.0, 0.03] {
        let mut line = Line::new(gap);
        let mut session = Box::new(Session::<65_536>::new(Configuration::default()));
        let mut revolution = Box::new(Revolution::<1440>::new());
        let (mut revolutions, mut micros) = (0, 0);
        let mut details = Vec::new();
        for _ in 0..3_000 {
            micros += 1000;
            let now = Time::from_micros(micros);
            let mut heard: Vec<u8> = line.wait(1e-3).into_iter().flat_map(|(_, bytes)| bytes).collect();
            loop {
                match session.poll(now, &mut revolution) {
                    Step::Connect => session.connected(now),
                    Step::Send(bytes) => {
                        let bytes = bytes.to_vec();
                        heard.extend(line.send(&bytes));
                    }
                    Step::Revolution => {
                        revolutions += 1;
                        details.extend(revolution.pose().and_then(|pose| pose.mode));
                    }
                    Step::Report(_) => {}
                    Step::Disconnect(reason) => panic!("{gap}: {reason}"),
                    Step::Wait(_) if heard.is_empty() => break,
                    Step::Wait(_) => {
                        let taken = session.receive(&heard, now);
                        heard.drain(..taken);
                    }
                }
            }
        }
        assert!(revolutions >= 15, "{gap}: {revolutions}");
        assert!(details.contains(&PositionMode::Continuous));
    }
}
