//! The PHY of the boards, which offers the one speed that the controller is set to.

use core::task::Context;

use embassy_stm32::eth::{GenericPhy, Phy, StationManagement};

/// Register of what is offered when both ends of the cable agree on a speed (IEEE 802.3, 22.2.4.3.3).
const OFFER: u8 = 4;
/// 100 Mbit/s in both directions at once, by IEEE 802.3: what the library sets the controller to, whatever both ends agree on.
const ONLY_FULL_DUPLEX: u16 = 1 << 8 | 1;

/// A PHY with the registers that all have.
pub struct FullDuplexPhy<M: StationManagement> {
    phy: GenericPhy<M>,
    address: u8,
}

impl<M: StationManagement> FullDuplexPhy<M> {
    /// The one at an address below 32.
    pub fn new(management: M, address: u8) -> Self {
        Self { phy: GenericPhy::new(management, address), address }
    }
}

impl<M: StationManagement> Phy for FullDuplexPhy<M> {
    fn phy_reset(&mut self) {
        self.phy.phy_reset();
    }

    fn phy_init(&mut self) {
        self.phy.station_management().smi_write(self.address, OFFER, ONLY_FULL_DUPLEX);
        // From here on both ends agree anew.
        self.phy.phy_init();
    }

    fn poll_link(&mut self, context: &mut Context) -> bool {
        self.phy.poll_link(context)
    }
}
