//! Bit timings and bus loads.

use agv_wire::can::bit_timing::{BIT_RATES, BitTiming};
use agv_wire::can::bus_load::{Cycle, load, longest_frame};

/// Clock of the board's controller, Hz.
const CLOCK: u32 = 80_000_000;

#[test]
fn every_bit_rate_is_met_exactly_with_the_sample_point_of_the_standard() {
    // Prescaler, quanta before and behind, as they are computed by hand.
    for (rate, prescaler, before, behind) in
        [(125, 40, 13, 2), (250, 20, 13, 2), (500, 10, 13, 2), (800, 4, 21, 3), (1000, 5, 13, 2)]
    {
        let timing = BitTiming::new(CLOCK, rate).unwrap();
        assert_eq!(timing, BitTiming { prescaler, before, behind, jump: 2 }, "{rate}");
        let bits = CLOCK / (u32::from(prescaler) * (1 + u32::from(before) + u32::from(behind)));
        assert_eq!(bits, 1000 * u32::from(rate));
        // CiA 301, table 1: 85 to 90 %.
        assert!((850..=900).contains(&timing.sample_point()), "{rate}");
        assert!(timing.jump <= timing.behind, "{rate}");
    }
    assert_eq!(BIT_RATES.len(), 5);
    // A crystal is good enough, an oscillator of one per cent is not (ISO 11898-1, 11.3.1.2, by hand: 2 / (2 (13 x 16 - 2))).
    assert_eq!(BitTiming::new(CLOCK, 500).unwrap().tolerance(), 4854);
}

#[test]
fn what_a_clock_does_not_give_is_not_promised() {
    assert_eq!(BitTiming::new(7_000_000, 1000), None);
    assert_eq!(BitTiming::new(CLOCK, 0), None);
    assert_eq!(BitTiming::new(CLOCK, 333), None);
    assert_eq!(BitTiming::new(0, 500).map(|timing| timing.prescaler), None);
    // Eight quanta have their sample point at 75 or 87.5 %, and then no room to jump.
    assert_eq!(BitTiming::new(8_000_000, 1000), None);
}

#[test]
fn frames_have_as_many_bits_as_the_literature_says() {
    // Davis and others 2007, section 3.1: 55 + 10 bits for each byte.
    for bytes in 0..=8 {
        assert_eq!(longest_frame(bytes), 55 + 10 * bytes);
    }
    let cycle = Cycle { frames: 5, bytes: 8, period: 0.01 };
    assert!((load(&[cycle], 500) - 0.135).abs() < 1e-12);
    assert!((load(&[cycle, cycle], 1000) - 0.135).abs() < 1e-12);
}
