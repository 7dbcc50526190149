//! What may be asked of a controller, and by whom.

mod support;

use agv_core::maps::Landmark;
use agv_core::measurement::Time;
use agv_settings::contour_store::{CONTOUR_PIECE, ContourStore, checksum};
use agv_settings::leaf::{Leaf, LeafError, Value};
use agv_settings::service::authentication::{Nonce, tag};
use agv_settings::service::{
    Action, Change, Controller, Frames, LONGEST_MESSAGE, MessageError, Refusal, Request, Response, Session, encode,
};
use agv_settings::store::{PIECE, Store, StoreError};
use agv_settings::{LEAVES, Settings, block_on, bus_load};
use proptest::prelude::*;
use support::{Flash, load, map};

const PAGE: usize = 16 * 1024;
const KEY: [u8; 32] = *b"a key of thirty-two bytes, known";
const NOW: Time = Time::from_micros(5_000_000);

fn controller() -> Controller<Flash<PAGE>> {
    let mut store = Store::new(Flash::new()).unwrap();
    block_on(store.provision_key(&KEY)).unwrap();
    Controller {
        software: "test 1",
        settings: Settings::default(),
        store: Some(store),
        landmarks: Vec::leak(map(120, 0.0)),
        key: Some(KEY),
        starts: 3,
        nonces: 0,
        panic: "panicked at nothing",
        map: None,
        contours: ContourStore::open(Flash::new()),
    }
}

/// Both ends of a connection.
struct Talk {
    controller: Controller<Flash<PAGE>>,
    session: Session,
    nonce: Nonce,
    changes: u32,
    is_standing: bool,
    room: Box<[u8; LONGEST_MESSAGE]>,
}

impl Talk {
    fn new() -> Self {
        let mut talk = Self {
            controller: controller(),
            session: Session::new(),
            nonce: [0; 16],
            changes: 0,
            is_standing: true,
            room: Box::new([0; LONGEST_MESSAGE]),
        };
        talk.connect();
        talk
    }

    fn connect(&mut self) {
        self.session = Session::new();
        let Response::Nonce(nonce) = self.ask(&Request::Nonce).0 else { panic!("no nonce") };
        (self.nonce, self.changes) = (nonce, 0);
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(Response<'_>, Action), MessageError> {
        let mut frames = Frames::new();
        assert_eq!(frames.push(bytes).unwrap(), (bytes.len(), true));
        let Self { session, controller, room, .. } = self;
        let (length, action) = block_on(session.answer(frames.message(), controller, self.is_standing, NOW, room))?;
        let mut answer = Box::new(Frames::new());
        assert_eq!(answer.push(&room[..length]).unwrap(), (length, true));
        Ok((postcard::from_bytes(Box::leak(answer).message()).unwrap(), action))
    }

    fn bytes(&self, request: &Request) -> Vec<u8> {
        let mut room = [0; LONGEST_MESSAGE];
        let sign =
            |bytes: &[u8]| matches!(request, Request::Change(_)).then(|| tag(&KEY, &self.nonce, self.changes, bytes));
        let length = encode(request, sign, &mut room).unwrap();
        room[..length].to_vec()
    }

    fn ask(&mut self, request: &Request) -> (Response<'_>, Action) {
        let bytes = self.bytes(request);
        if matches!(request, Request::Change(_)) {
            self.changes += 1;
        }
        self.send(&bytes).unwrap()
    }

    fn change(&mut self, change: Change) -> (Response<'_>, Action) {
        self.ask(&Request::Change(change))
    }
}

const WHEELBASE: Change = Change::Set("vehicle.wheelbase", Value::Number(1.25));

#[test]
fn everything_can_be_read_without_a_key() {
    let mut talk = Talk::new();
    talk.controller.key = None;
    assert_eq!(
        talk.ask(&Request::Version).0,
        Response::Version { software: "test 1", protocol: 1, starts: 3, time: NOW }
    );
    assert_eq!(talk.ask(&Request::Panic).0, Response::Panic("panicked at nothing"));
    for (place, leaf) in (0..).zip(&LEAVES) {
        // Of a tricycle.
        let value = leaf.get(&Settings::default());
        let expected =
            value.map_or(Response::NoLeaf, |value| Response::Leaf { name: leaf.name, unit: leaf.unit, value });
        assert_eq!(talk.ask(&Request::Leaf(place)).0, expected);
        assert_eq!(talk.ask(&Request::Get(leaf.name)).0, expected);
    }
    assert_eq!(talk.ask(&Request::Leaf(LEAVES.len() as u16)).0, Response::End);
    assert_eq!(talk.ask(&Request::Get("nothing")).0, Response::Refused(Refusal::Name));
    let mut found: Vec<Landmark> = Vec::new();
    loop {
        let Response::Map { count, piece } = talk.ask(&Request::Map(found.len() as u16)).0 else { panic!("no map") };
        assert_eq!(count, 120);
        if piece.is_empty() {
            break;
        }
        found.extend(&piece);
    }
    assert_eq!(found, map(120, 0.0));
    assert_eq!(talk.change(WHEELBASE).0, Response::Refused(Refusal::NoKey));
    assert_eq!(talk.ask(&Request::Nonce).0, Response::Refused(Refusal::NoKey));
}

#[test]
fn settings_and_map_are_written_with_the_key() {
    let mut talk = Talk::new();
    assert_eq!(talk.change(WHEELBASE).0, Response::Done);
    assert_eq!(talk.change(Change::Store).0, Response::Done);
    let landmarks = map(130, 0.5);
    assert_eq!(talk.change(Change::BeginMap(130)).0, Response::Done);
    for piece in landmarks.chunks(PIECE) {
        let piece = heapless::Vec::from_slice(piece).unwrap();
        assert_eq!(talk.change(Change::MapPiece(piece)).0, Response::Done);
    }
    assert_eq!(talk.change(Change::FinishMap).0, Response::Done);
    let (settings, found, _) = load(talk.controller.store.as_mut().unwrap());
    let mut expected = Settings::default();
    agv_settings::leaf::Leaf::named("vehicle.wheelbase").unwrap().set(&mut expected, Value::Number(1.25)).unwrap();
    assert_eq!((settings, found), (expected, landmarks));
    let (response, action) = talk.change(Change::SetPose { pose: [1.0, 2.0, 3.0], deviations: [0.1, 0.02] });
    assert_eq!(response, Response::Done);
    let Action::SetPose(fix) = action else { panic!("{action:?}") };
    assert_eq!((fix.time, fix.pose.x, fix.pose.theta, fix.heading_deviation), (NOW, 1.0, 3.0, 0.02));
    assert_eq!(talk.change(Change::ForgetPanic).1, Action::ForgetPanic);
    assert_eq!(talk.ask(&Request::Panic).0, Response::Panic(""));
    assert_eq!(talk.change(Change::Reboot).1, Action::Reboot);
}

/// The map of contours that the controller says it uses.
fn contours(talk: &mut Talk) -> Vec<u8> {
    let mut found = Vec::new();
    loop {
        let answer = talk.ask(&Request::Contours(found.len() as u32)).0;
        let Response::Contours { length, piece } = answer else { panic!("{answer:?}") };
        found.extend_from_slice(piece);
        if piece.is_empty() {
            assert_eq!(found.len(), length as usize);
            return found;
        }
    }
}

#[test]
fn a_map_of_contours_is_written_with_the_key_and_read_without() {
    let mut talk = Talk::new();
    assert_eq!(contours(&mut talk), []);
    let bytes: Vec<u8> = (0..3000_u32).map(|place| (place * place) as u8).collect();
    let begin = |length: usize| Change::BeginContours { length: length as u32, checksum: checksum(&bytes) };
    assert_eq!(talk.change(begin(bytes.len())).0, Response::Done);
    for piece in bytes.chunks(CONTOUR_PIECE) {
        assert_eq!(talk.change(Change::ContourPiece(piece)).0, Response::Done);
    }
    assert_eq!(talk.change(Change::FinishContours).0, Response::Done);
    assert_eq!(contours(&mut talk), [], "it counts from the next start on");
    let flash = talk.controller.contours.take().unwrap().into_flash();
    talk.controller.contours = ContourStore::open(flash);
    assert_eq!(contours(&mut talk), bytes);

    let refused = |error| Response::Refused(Refusal::Store(error));
    assert_eq!(talk.change(begin(PAGE)).0, refused(StoreError::Map));
    assert_eq!(talk.change(Change::ContourPiece(&bytes[..9])).0, refused(StoreError::Map));
    talk.controller.contours = None;
    assert_eq!(talk.change(begin(bytes.len())).0, refused(StoreError::NoContours));
    assert_eq!(talk.ask(&Request::Contours(0)).0, refused(StoreError::NoContours));
}

#[test]
fn wrong_values_change_nothing() {
    let mut talk = Talk::new();
    for (change, refusal) in [
        (Change::Set("vehicle.wheelbase", Value::Number(f64::NAN)), Refusal::Bounds),
        (Change::Set("vehicle.wheelbase", Value::Number(-1.0)), Refusal::Bounds),
        (Change::Set("features.nearest", Value::Number(100.0)), Refusal::Bounds),
        (Change::Set("vehicle.drive_scale", Value::Number(0.0)), Refusal::Bounds),
        (Change::Set("vehicle.wheelbase", Value::Whole(2)), Refusal::Kind),
        (Change::Set("nav350.port", Value::Whole(65_536)), Refusal::Bounds),
        (Change::Set("maps.dynamic", Value::Number(1.0)), Refusal::Kind),
        (Change::Set("vehicle", Value::Number(1.0)), Refusal::Name),
        (Change::SetPose { pose: [f64::NAN, 0.0, 0.0], deviations: [0.1, 0.1] }, Refusal::Pose),
        (Change::SetPose { pose: [0.0; 3], deviations: [0.0, 0.1] }, Refusal::Pose),
        (Change::FinishMap, Refusal::Store(agv_settings::store::StoreError::Map)),
        (Change::BeginMap(2000), Refusal::Store(agv_settings::store::StoreError::Map)),
    ] {
        let (response, action) = talk.change(change.clone());
        assert_eq!((response, action), (Response::Refused(refusal), Action::None), "{change:?}");
    }
    assert_eq!(talk.controller.settings, Settings::default());
}

#[test]
fn a_bus_is_not_loaded_by_more_than_three_fifths() {
    // Frames of 135, 95 and 65 bits: five poses and two encoders in 10 ms, three heartbeats and a report in 100 ms.
    let bits = (5.0 * 135.0 + 2.0 * 95.0) / 0.01 + (3.0 * 65.0 + 135.0) / 0.1;
    assert!((bus_load(&Settings::default()) - bits / 500_000.0).abs() < 1e-12);
    assert!(bits / 125_000.0 > 0.6 && bits / 250_000.0 < 0.6);
    let mut settings = Settings::default();
    let leaf = |name| Leaf::named(name).unwrap();
    let change = |settings: &mut Settings, name, value| leaf(name).change(settings, Value::Whole(value));
    assert_eq!(change(&mut settings, "can.bit_rate", 125), Err(LeafError::BusLoad));
    assert_eq!(change(&mut settings, "can.bit_rate", 300), Err(LeafError::Bounds));
    assert_eq!(change(&mut settings, "can.bit_rate", 100), Err(LeafError::Bounds));
    assert_eq!(settings, Settings::default());
    assert_eq!(change(&mut settings, "can.publishing_period", 20), Ok(()));
    assert_eq!(change(&mut settings, "can.bit_rate", 125), Ok(()));
    assert_eq!(change(&mut settings, "can.publishing_period", 10), Err(LeafError::BusLoad));
    assert_eq!(change(&mut settings, "can.encoder_period", 2), Err(LeafError::BusLoad));
    assert_eq!((settings.publishing_period, settings.bit_rate, settings.encoder_period), (20, 125, 10));
}

#[test]
fn a_moving_vehicle_is_not_changed() {
    let mut talk = Talk::new();
    talk.is_standing = false;
    assert_eq!(talk.change(WHEELBASE).0, Response::Refused(Refusal::Moving));
    assert_eq!(talk.change(Change::Reboot), (Response::Refused(Refusal::Moving), Action::None));
    talk.is_standing = true;
    assert_eq!(talk.change(WHEELBASE).0, Response::Done);
}

#[test]
fn who_does_not_know_the_key_changes_nothing() {
    let mut talk = Talk::new();
    let recorded = talk.bytes(&Request::Change(WHEELBASE));
    assert_eq!(talk.change(WHEELBASE).0, Response::Done);
    talk.controller.settings = Settings::default();
    // Again on the same connection, and on another one.
    assert_eq!(talk.send(&recorded).unwrap().0, Response::Refused(Refusal::Tag));
    talk.connect();
    assert_eq!(talk.send(&recorded).unwrap().0, Response::Refused(Refusal::Tag));
    // Before a nonce was asked for.
    talk.session = Session::new();
    assert_eq!(talk.send(&recorded).unwrap().0, Response::Refused(Refusal::Tag));
    // In another order.
    talk.connect();
    talk.changes = 1;
    let second = talk.bytes(&Request::Change(WHEELBASE));
    assert_eq!(talk.send(&second).unwrap().0, Response::Refused(Refusal::Tag));
    // With any bit changed, of request or tag.
    talk.connect();
    let right = talk.bytes(&Request::Change(WHEELBASE));
    for bit in 16..8 * right.len() {
        let mut wrong = right.clone();
        wrong[bit / 8] ^= 1 << (bit % 8);
        if let Ok((response, action)) = talk.send(&wrong) {
            assert!(!matches!(response, Response::Done), "{bit}");
            assert_eq!(action, Action::None);
        }
    }
    assert_eq!(talk.controller.settings, Settings::default());
    assert_eq!(talk.send(&right).unwrap().0, Response::Done);
}

#[test]
fn nonces_do_not_come_again() {
    let mut talk = Talk::new();
    let mut seen = std::collections::HashSet::new();
    for starts in 0..10 {
        talk.controller.starts = starts;
        talk.controller.nonces = 0;
        for _ in 0..10 {
            talk.connect();
            assert!(seen.insert(talk.nonce));
        }
    }
}

/// The codes are those of another program (Python's hmac and hashlib).
#[test]
fn tags_are_hmac_sha256() {
    let nonce: Nonce = *b"0123456789abcdef";
    let found = tag(&KEY, &nonce, 7, b"request");
    let hex: String = found.iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(hex, "6c4d51b652fd7ec8e01f7e51cbc95a8c7b9b19e4cebe5b7c7293ff85c36d47c3");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn any_bytes_are_survived_in_any_pieces(bytes in proptest::collection::vec(any::<u8>(), 0..4000), cut in 1usize..200) {
        let mut controller = controller();
        let mut session = Session::new();
        let mut frames = Frames::new();
        let mut room = [0; LONGEST_MESSAGE];
        'connection: for piece in bytes.chunks(cut) {
            let mut rest = piece;
            while !rest.is_empty() {
                let Ok((taken, is_whole)) = frames.push(rest) else { break 'connection };
                rest = &rest[taken..];
                if is_whole {
                    let answer = block_on(session.answer(frames.message(), &mut controller, true, NOW, &mut room));
                    prop_assert!(answer.is_err() || answer.is_ok_and(|(_, action)| action == Action::None));
                    frames.clear();
                }
            }
        }
        prop_assert_eq!(controller.settings, Settings::default());
    }

    #[test]
    fn a_message_is_the_same_in_any_pieces(cut in 1usize..60) {
        let talk = Talk::new();
        let stream: Vec<u8> = [
            talk.bytes(&Request::Version), talk.bytes(&Request::Change(WHEELBASE)), talk.bytes(&Request::Leaf(5)),
        ].concat();
        let mut frames = Frames::new();
        let mut found = Vec::new();
        for piece in stream.chunks(cut) {
            let mut rest = piece;
            while !rest.is_empty() {
                let (taken, is_whole) = frames.push(rest).unwrap();
                rest = &rest[taken..];
                if is_whole {
                    found.push(frames.message().to_vec());
                    frames.clear();
                }
            }
        }
        let expected = [Request::Version, Request::Change(WHEELBASE), Request::Leaf(5)];
        prop_assert_eq!(found.len(), expected.len());
        for (bytes, expected) in found.iter().zip(expected) {
            prop_assert_eq!(postcard::take_from_bytes::<Request>(bytes).unwrap().0, expected);
        }
    }
}
