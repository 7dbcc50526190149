//! Everything that handles input while a vehicle runs, on input of which the compiler knows nothing.

mod bus;
mod laser;
mod localization;
mod service;

use core::hint::black_box;

use static_cell::StaticCell;

use bus::Bus;
use laser::Laser;
use localization::Localization;
use service::Service;

/// A value of which the compiler knows no more than its type.
pub fn any<T>(value: T) -> T {
    black_box(value)
}

static LASER: StaticCell<Laser> = StaticCell::new();
static LOCALIZATION: StaticCell<Localization> = StaticCell::new();
static SERVICE: StaticCell<Service> = StaticCell::new();
static BUS: StaticCell<Bus> = StaticCell::new();

/// The state of all that takes part. Each is hidden from the compiler between the steps, so that what it was does not
/// tell what may come.
pub struct ControlLoop {
    bus: &'static mut Bus,
    laser: &'static mut Laser,
    localization: &'static mut Localization,
    service: &'static mut Service,
}

impl ControlLoop {
    /// A loop that has not begun; None if one was taken before.
    pub fn take() -> Option<Self> {
        Some(Self {
            bus: BUS.try_init_with(Bus::new)?,
            laser: LASER.try_init_with(Laser::new)?,
            localization: LOCALIZATION.try_init_with(Localization::new)?,
            service: SERVICE.try_init_with(Service::new)?,
        })
    }

    /// Handles one input of every kind.
    pub fn step(&mut self) {
        black_box(&mut *self.bus).step();
        black_box(&mut *self.laser).step();
        black_box(&mut *self.localization).step();
        black_box(&mut *self.service).step();
    }
}
