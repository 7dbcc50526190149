#![no_main]

use std::ops::ControlFlow;

use agv_host_sim::import::packets::for_each_in;
use agv_lidar3d::packet::Packet;
use etherparse::TransportSlice;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let mut taken = 0;
    let seen = for_each_in(std::io::Cursor::new(bytes.to_vec()), |_, packet| {
        taken += 1;
        if let Some(TransportSlice::Udp(udp)) = packet.transport {
            let _ = Packet::new(udp.payload());
        }
        ControlFlow::Continue(())
    });
    // Packets of other kinds are counted but not taken.
    assert!(seen.is_none_or(|seen| taken <= seen.packets));
});
