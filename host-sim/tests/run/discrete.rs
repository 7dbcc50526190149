//! A controller with wires: what they say while it drives, when one of them fails, and when it ends.

use std::convert::Infallible;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use agv_controller::{DiscreteLines, Line, LineSet};
use agv_host_sim::run::{Demonstration, Fault, Logs, RealTime, Running};
use agv_wire::can::controller_node::ErrorKind;
use embedded_hal::digital::{ErrorKind as PinErrorKind, ErrorType, InputPin, OutputPin};

use super::vehicle::{End, hall, wait};

/// A level that the test sees, and that cannot be set when the wire is cut.
#[derive(Clone, Debug, Default)]
struct Wire {
    is_high: Arc<AtomicBool>,
    is_cut: Arc<AtomicBool>,
}

impl Wire {
    fn is_high(&self) -> bool {
        self.is_high.load(Ordering::Relaxed)
    }

    fn set(&self, is_high: bool) -> Result<(), PinErrorKind> {
        if self.is_cut.load(Ordering::Relaxed) {
            return Err(PinErrorKind::Other);
        }
        self.is_high.store(is_high, Ordering::Relaxed);
        Ok(())
    }
}

impl ErrorType for Wire {
    type Error = PinErrorKind;
}

impl OutputPin for Wire {
    fn set_low(&mut self) -> Result<(), PinErrorKind> {
        self.set(false)
    }

    fn set_high(&mut self) -> Result<(), PinErrorKind> {
        self.set(true)
    }
}

/// No input.
enum Nothing {}

impl ErrorType for Nothing {
    type Error = Infallible;
}

impl InputPin for Nothing {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        match *self {}
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        match *self {}
    }
}

#[test]
fn wires_say_what_the_bus_says_and_nothing_when_it_ends() {
    let wires: [Wire; 3] = Default::default();
    let [pose_valid, within_docking_limits, fault] = wires.clone().map(Some);
    let lines =
        DiscreteLines::<Wire, Nothing>::new(LineSet { pose_valid, within_docking_limits, fault, ..LineSet::NONE });
    let folder = tempfile::tempdir().unwrap();
    let is_stopped = Arc::new(AtomicBool::new(false));
    let end = End(Arc::clone(&is_stopped));
    let [is_valid, _, is_sound] = &wires;
    let watch = move |running: &Running| {
        let _end = end;
        wait("a valid pose without a fault", || is_valid.is_high() && is_sound.is_high());
        wait("the same on the bus", || running.condition().was_localised);
        wait("a sign of life of all threads", || running.have_all_run());
        is_valid.is_cut.store(true, Ordering::Relaxed);
        wait("the fault on its wire", || !is_sound.is_high());
        let told = Fault { code: ErrorKind::DiscreteLine.code(), parts: Line::PoseValid.bit(), is_over: false };
        wait("the fault on the bus", || std::iter::from_fn(|| running.next_fault()).any(|fault| fault == told));
        is_valid.is_cut.store(false, Ordering::Relaxed);
        wait("its end", || is_sound.is_high() && is_valid.is_high());
    };
    let remark = |text: &str| println!("{text}");
    let demonstration = Demonstration::of(hall()).with_lines(Box::new(lines));
    let summary =
        demonstration.run(folder.path(), RealTime::default(), Logs::default(), &is_stopped, &remark, watch).unwrap();
    assert!(summary.was_localised);
    assert_eq!(wires.map(|wire| wire.is_high()), [false; 3]);
}
