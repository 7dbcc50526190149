//! A bus behind a line of text.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::time::{Duration, Instant};

use agv_host_sim::bus::{self, Bus, BusError, SlcanBus};
use agv_wire::can::frame::{AnyFrame, FdFrame, Frame, extended_id, standard_id};
use agv_wire::can::slcan::BitRate;

fn soon() -> Instant {
    Instant::now() + Duration::from_secs(20)
}

fn frames() -> Vec<AnyFrame> {
    vec![
        Frame::of(standard_id(0x181), [0xEF, 0xCD, 0xAB, 0]).into(),
        Frame::remote(extended_id(0x1234_5678), 3).unwrap().into(),
        FdFrame::new(extended_id(1), &[0x5A; 64], true).unwrap().into(),
    ]
}

#[test]
fn frames_cross_a_tcp_connection_both_ways() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let mut near = bus::open(&format!("slcan-tcp:{address}@250000")).unwrap();
    let (stream, _) = listener.accept().unwrap();
    let mut far = SlcanBus::accept(stream).unwrap();
    for frame in frames() {
        near.send(&frame).unwrap();
        assert_eq!(far.receive(soon()).unwrap(), Some(frame));
        far.send(&frame).unwrap();
        assert_eq!(near.receive(soon()).unwrap(), Some(frame));
    }
    assert_eq!((far.unreadable(), far.receive(Instant::now()).unwrap()), (0, None));
    drop(far);
    assert!(matches!(near.receive(soon()), Err(BusError::Closed { .. }) | Err(BusError::Io { .. })));
}

#[test]
fn the_adapter_is_opened_and_its_rubbish_survived() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let mut near = SlcanBus::connect(&listener.local_addr().unwrap().to_string(), BitRate::Kbit125).unwrap();
    let (mut stream, _) = listener.accept().unwrap();
    let mut opening = [0; 10];
    stream.read_exact(&mut opening).unwrap();
    assert_eq!(&opening, b"\r\r\rC\rS4\rO\r"[..10].first_chunk().unwrap());
    let expected: AnyFrame = Frame::of(standard_id(0x123), [1]).into();
    for bytes in [&b"\r\x07\xff\xfet12\rt1231"[..], b"01\r"] {
        stream.write_all(bytes).unwrap();
    }
    assert_eq!(near.receive(soon()).unwrap(), Some(expected));
    assert_eq!(near.unreadable(), 1);
}

#[test]
fn names_that_are_no_bus_are_refused() {
    for name in ["", "slcan:/dev/null@77", "udp:1.2.3.4", "/dev/ttyS0"] {
        assert!(matches!(bus::open(name), Err(BusError::Name { .. })), "{name}");
    }
    assert!(matches!(bus::open("slcan:/nowhere"), Err(BusError::Io { .. })));
    assert!(matches!(bus::open("nocan77"), Err(BusError::Io { .. })));
}
