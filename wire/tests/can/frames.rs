//! Frames of any kind, for properties; and what a frame can be.

use agv_wire::can::frame::{AnyFrame, FdFrame, Frame, Id, extended_id, standard_id};
use proptest::prelude::*;

/// A frame written as `candump` and `cansend` do: `181#EFCDAB00`.
pub fn frame(text: &str) -> Frame {
    let (id, data) = text.split_once('#').unwrap();
    let digits: String = data.chars().filter(|character| !character.is_whitespace()).collect();
    let bytes: Vec<u8> =
        (0..digits.len() / 2).map(|index| u8::from_str_radix(&digits[2 * index..2 * index + 2], 16).unwrap()).collect();
    let number = u32::from_str_radix(id, 16).unwrap();
    let id = if id.len() == 3 { standard_id(number as u16) } else { extended_id(number) };
    Frame::new(id, &bytes).unwrap()
}

pub fn any_id() -> impl Strategy<Value = Id> {
    prop_oneof![(0..=0x7FFu16).prop_map(standard_id), (0..=0x1FFF_FFFFu32).prop_map(extended_id)]
}

pub fn any_classic() -> impl Strategy<Value = Frame> {
    prop_oneof![
        (any_id(), prop::collection::vec(any::<u8>(), 0..=8)).prop_map(|(id, data)| Frame::new(id, &data).unwrap()),
        (any_id(), 0..=8usize).prop_map(|(id, length)| Frame::remote(id, length).unwrap()),
    ]
}

pub fn any_fd() -> impl Strategy<Value = FdFrame> {
    let length = prop::sample::select(vec![0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64usize]);
    (any_id(), length.prop_flat_map(|length| prop::collection::vec(any::<u8>(), length)), any::<bool>())
        .prop_map(|(id, data, is_fast)| FdFrame::new(id, &data, is_fast).unwrap())
}

pub fn any_frame() -> impl Strategy<Value = AnyFrame> {
    prop_oneof![any_classic().prop_map(AnyFrame::from), any_fd().prop_map(AnyFrame::from)]
}

#[test]
fn frames_that_no_bus_can_carry_are_refused() {
    assert!(Frame::new(standard_id(1), &[0; 9]).is_none());
    assert!(Frame::remote(standard_id(1), 9).is_none());
    for length in 0..=80 {
        let is_possible = length <= 8 || [12, 16, 20, 24, 32, 48, 64].contains(&length);
        assert_eq!(FdFrame::new(standard_id(1), &[0; 80][..length], true).is_some(), is_possible, "{length}");
    }
}

#[test]
fn code_for_any_hardware_sees_the_same_frame() {
    use embedded_can::Frame as Hardware;
    let data = <Frame as Hardware>::new(standard_id(0x181), &[1, 2]).unwrap();
    assert_eq!(
        (Hardware::id(&data), Hardware::dlc(&data), Hardware::data(&data)),
        (standard_id(0x181), 2, &[1u8, 2][..])
    );
    assert!(data.is_data_frame() && data.is_standard());
    let request = <Frame as Hardware>::new_remote(extended_id(0x1234_5678), 3).unwrap();
    assert!(request.is_remote_frame() && request.is_extended());
    assert_eq!((Hardware::dlc(&request), Hardware::data(&request)), (3, &[][..]));
}
