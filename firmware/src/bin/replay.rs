//! Replays `drive.agvlog` of the emulating machine's folder, and writes what the localiser answers to `replayed.agvlog`.
#![no_std]
#![no_main]

use core::panic::PanicInfo;

use agv_core::localizer::Localizer;
use agv_core::record::{MAX_FRAME, Output, Record, encode};
use agv_firmware::board::an500::host_file::HostFile;
use agv_firmware::board::an500::log_file::LogBuffer;
use agv_firmware::board::an500::panic;
use cortex_m_semihosting::{debug, hprintln};
use static_cell::{ConstStaticCell, StaticCell};

#[panic_handler]
fn on_panic(info: &PanicInfo) -> ! {
    panic::report(info)
}

static BUFFER: ConstStaticCell<LogBuffer> = ConstStaticCell::new(LogBuffer::new());
static FRAME: ConstStaticCell<[u8; MAX_FRAME]> = ConstStaticCell::new([0; MAX_FRAME]);
static LOCALIZER: StaticCell<Localizer> = StaticCell::new();

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut input = HostFile::open(c"drive.agvlog").expect("drive.agvlog is in the folder");
    let mut output = HostFile::create(c"replayed.agvlog").expect("the folder can be written");
    let frame = FRAME.take();
    let (mut sequence, mut events) = (0, 0u32);
    let mut localizer: Option<&mut Localizer> = None;
    let mut write = |record: &Record| {
        let length = encode(record, sequence, frame).expect("a frame has room for every record");
        output.write(&frame[..length]).expect("the folder can be written");
        sequence += 1;
    };
    let damages = BUFFER.take().for_each(&mut input, |record| match (record, &mut localizer) {
        (Record::Header(header), None) => {
            write(record);
            localizer = Some(LOCALIZER.init_with(|| Localizer::new(*header.parameters)));
        }
        (Record::Landmarks(landmarks), Some(localizer)) => {
            write(record);
            localizer.add_landmarks(landmarks).expect("the map has room for the landmarks");
        }
        (Record::Event(event), Some(localizer)) => {
            write(record);
            events += 1;
            let outputs = localizer.handle(event);
            write(&Record::Output(Output::from(outputs)));
        }
        _ => {}
    });
    write(&Record::End);
    hprintln!("{} events, {} places damaged", events, damages.expect("the log can be read"));
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::wfi();
    }
}
