//! Counts the instructions of everything that the localiser does, on the drive `drive.agvlog` of the emulating machine's
//! folder, and writes them to `instructions.csv`. The emulator must run with `-icount shift=6,sleep=off`.
#![no_std]
#![no_main]

use core::fmt::Write;
use core::panic::PanicInfo;

use agv_core::features::{Keypoint, PointScan, falko};
use agv_core::landmarks::{FixedMap, Landmark, LandmarkKind, NearestNeighbour};
use agv_core::localizer::{Event, Localizer};
use agv_core::measurement::{Reflectors, Time};
use agv_core::record::Record;
use agv_core::wire::cola::{Deframed, Deframer, Dialect, Sequence};
use agv_core::wire::nav350::Answer;
use agv_firmware::board::an500::host_file::HostFile;
use agv_firmware::board::an500::log_file::LogBuffer;
use agv_firmware::board::an500::panic;
use agv_firmware::board::an500::stopwatch::Stopwatch;
use cortex_m_semihosting::{debug, hprintln};
use heapless::{String, Vec};
use static_cell::{ConstStaticCell, StaticCell};
