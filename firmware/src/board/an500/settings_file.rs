//! The settings of an emulated vehicle: those that `vehicle.agvlog` in the emulating machine's folder begins with.

use agv_core::landmarks::Landmark;
use agv_core::localizer::Parameters;
use agv_core::record::Record;
use heapless::Vec;
use static_cell::{ConstStaticCell, StaticCell};

use super::host_file::HostFile;
use super::log_file::LogBuffer;
use crate::app::settings::Settings;

static BUFFER: ConstStaticCell<LogBuffer> = ConstStaticCell::new(LogBuffer::new());
static LANDMARKS: StaticCell<Vec<Landmark, 1500>> = StaticCell::new();

/// The settings in the file; those of the standard vehicle, without a map, if there is none.
#[must_use]
pub fn read() -> Settings {
    let landmarks = LANDMARKS.init_with(Vec::new);
    let mut parameters: Option<Parameters> = None;
    if let Ok(mut file) = HostFile::open(c"vehicle.agvlog") {
        let _ = BUFFER.take().for_each(&mut file, |record| match record {
            Record::Header(header) => parameters = Some(*header.parameters),
            Record::Landmarks(piece) => {
                for landmark in *piece {
                    let _ = landmarks.push(*landmark);
                }
            }
            _ => {}
        });
    }
    match parameters {
        Some(parameters) => Settings::of(parameters, landmarks),
        None => Settings::standard(&[]),
    }
}
