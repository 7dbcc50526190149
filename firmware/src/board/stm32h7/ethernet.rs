//! The Ethernet controller with its PHY, if both are alive. If they are not, the rest of the vehicle goes on without.

use core::task::Context;

use embassy_net_driver::{Capabilities, Driver, HardwareAddress, LinkState};
use embassy_stm32::eth::{self, PacketQueue, Sma, StationManagement};
use embassy_stm32::pac::syscfg::vals::EthSelPhy;
use embassy_stm32::pac::{ETH as REGISTERS, GPIOA, RCC, SYSCFG, gpio};
use embassy_stm32::peripherals::{ETH, ETH_SMA, PA1, PA2, PA7, PB13, PC1, PC4, PC5, PG11, PG13};
use embassy_stm32::{Peri, uid};

use super::Interrupts;
use super::phy::FullDuplexPhy;

/// Frames that wait to be sent, and that were received.
pub type Queue = PacketQueue<3, 6>;

/// How often is looked whether the reset of the controller has ended: some milliseconds.
const PATIENCE: u32 = 20_000;
/// Identifier of a PHY: what nobody answers reads as ones.
const IDENTIFIER: u8 = 2;
const NOBODY: [u16; 2] = [0, 0xFFFF];
/// Pin 1 of port A has the reference clock as its alternate function 11.
const REFERENCE_CLOCK: (usize, u8) = (1, 11);

type Controller = eth::Ethernet<'static, ETH, FullDuplexPhy<Sma<'static, ETH_SMA>>>;

/// What the controller is wired to.
pub struct Wires {
    /// The controller.
    pub controller: Peri<'static, ETH>,
    /// What speaks with the PHY.
    pub management: Peri<'static, ETH_SMA>,
    /// Reference clock, carrier, received data, sent data, their enable.
    pub data: (
        Peri<'static, PA1>,
        Peri<'static, PA7>,
        Peri<'static, PC4>,
        Peri<'static, PC5>,
        Peri<'static, PG13>,
        Peri<'static, PB13>,
        Peri<'static, PG11>,
    ),
    /// Data and clock of the management.
    pub managed: (Peri<'static, PA2>, Peri<'static, PC1>),
}

/// The controller, or none.
pub enum Ethernet {
    /// It works.
    Alive(Controller),
    /// There is no PHY, or no reference clock from it.
    Dead,
}

impl Ethernet {
    /// Starts it. The library waits for ever for a clock that does not come, and panics without a PHY: so both are looked
    /// for before.
    #[must_use]
    pub fn start(queue: &'static mut Queue, wires: Wires) -> Self {
        let Wires { controller, management, data, managed } = wires;
        let mut management = Sma::new(management, managed.0, managed.1);
        let phy = (0..32).find(|address| !NOBODY.contains(&management.smi_read(*address, IDENTIFIER)));
        let Some(phy) = phy.filter(|_| has_reference_clock()) else { return Self::Dead };
        let phy = FullDuplexPhy::new(management, phy);
        let (clock, carrier, in_0, in_1, out_0, out_1, enable) = data;
        Self::Alive(eth::Ethernet::new_with_phy(
            queue,
            controller,
            Interrupts,
            clock,
            carrier,
            in_0,
            in_1,
            out_0,
            out_1,
            enable,
            address(),
            phy,
        ))
    }

    /// Whether there is one.
    #[must_use]
    pub const fn is_alive(&self) -> bool {
        matches!(self, Self::Alive(_))
    }
}

/// Whether the reset of the controller ends, which it does only with its reference clock (RM0433, 58.11.2 "ETH_DMAMR").
fn has_reference_clock() -> bool {
    RCC.ahb1enr().modify(|enabled| {
        enabled.set_ethen(true);
        enabled.set_ethtxen(true);
        enabled.set_ethrxen(true);
    });
    SYSCFG.pmcr().modify(|mode| mode.set_eth_sel_phy(EthSelPhy::RMII));
    let (pin, function) = REFERENCE_CLOCK;
    GPIOA.afr(0).modify(|functions| functions.set_afr(pin, function));
    GPIOA.moder().modify(|modes| modes.set_moder(pin, gpio::vals::Moder::ALTERNATE));
    let mode = REGISTERS.ethernet_dma().dmamr();
    mode.modify(|mode| mode.set_swr(true));
    (0..PATIENCE).any(|_| !mode.read().swr())
}

/// A locally administered MAC address, from the chip's own number.
fn address() -> [u8; 6] {
    let sum = |part: &[u8]| part.iter().fold(0x5A_u8, |sum, byte| sum.rotate_left(3) ^ byte);
    let [.., a, b, c, d, e, f, g, h] = uid::uid();
    [2, sum(&[a, b]), sum(&[c, d]), e ^ sum(&[a]), f ^ g, h]
}

impl Driver for Ethernet {
    type RxToken<'a> = <Controller as Driver>::RxToken<'a>;
    type TxToken<'a> = <Controller as Driver>::TxToken<'a>;

    fn receive(&mut self, context: &mut Context) -> Option<(Self::RxToken<'_>, Self::TxToken<'_>)> {
        match self {
            Self::Alive(controller) => controller.receive(context),
            Self::Dead => None,
        }
    }

    fn transmit(&mut self, context: &mut Context) -> Option<Self::TxToken<'_>> {
        match self {
            Self::Alive(controller) => controller.transmit(context),
            Self::Dead => None,
        }
    }

    fn link_state(&mut self, context: &mut Context) -> LinkState {
        match self {
            Self::Alive(controller) => controller.link_state(context),
            Self::Dead => LinkState::Down,
        }
    }

    fn capabilities(&self) -> Capabilities {
        match self {
            Self::Alive(controller) => controller.capabilities(),
            Self::Dead => {
                let mut capabilities = Capabilities::default();
                capabilities.max_transmission_unit = 1514;
                capabilities
            }
        }
    }

    fn hardware_address(&self) -> HardwareAddress {
        HardwareAddress::Ethernet(address())
    }
}
