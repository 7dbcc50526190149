//! How late a prediction comes while scans are processed: the tasks of the firmware with samples of encoders from a timer
//! and scans from the drive `drive.agvlog` of the emulating machine's folder. Writes `latency.csv`. The emulator must run
//! with `-icount shift=6,sleep=off`, so that an instruction takes 64 ns.
#![no_std]
#![no_main]

use core::fmt::Write;
use core::panic::PanicInfo;

use agv_controller::BusEvent;
use agv_core::localizer::{self, Event, OutputPredictor, Parameters};
use agv_core::measurement::{EncoderSample, Scan, Time};
use agv_core::record::Record;
use agv_firmware::app::log_stream::{LONGEST, LogQueue, LogWriter};
use agv_firmware::app::{exchange, localize};
use agv_firmware::board::an500::host_file::{HostFile, HostFileError};
use agv_firmware::board::an500::interrupts::{self, BUS_TASKS, Interrupt};
use agv_firmware::board::an500::log_file::LogBuffer;
use agv_firmware::board::an500::{panic, time_driver, uart};
use agv_settings::Settings;
use cortex_m_semihosting::{debug, hprintln};
use defmt_semihosting as _;
use embassy_time::{Duration, Instant, Timer};
use heapless::String;
use portable_atomic::{AtomicU32, Ordering};
use static_cell::{ConstStaticCell, StaticCell};

#[panic_handler]
fn on_panic(info: &PanicInfo) -> ! {
    panic::report(info)
}

defmt::timestamp!("{=u64:us}", Instant::now().as_micros());

/// The board's, but with a copy of the map, which comes in pieces.
type Capacities = localizer::SlamCapacities;
type Localizer = localizer::Localizer<Capacities>;
type Localization = localize::Localization<Capacities>;

static BUFFER: ConstStaticCell<LogBuffer> = ConstStaticCell::new(LogBuffer::new());
static LOCALIZER: StaticCell<Localizer> = StaticCell::new();
static FRAME: ConstStaticCell<[u8; LONGEST]> = ConstStaticCell::new([0; LONGEST]);
static QUEUE: StaticCell<LogQueue> = StaticCell::new();

/// Ticks between samples, and the time between them: no multiple of anything, so that they meet a scan's work everywhere.
const STEP: u32 = 120;
const PERIOD: Duration = Duration::from_micros(12_347);
/// Motions that the prediction remembers, as on the bus.
const MOTIONS: usize = agv_controller::MOTIONS;
/// Scans that are processed.
const SCANS: u32 = 60;

static SAMPLES: AtomicU32 = AtomicU32::new(0);
/// Samples that came while a scan was processed.
static DURING_SCANS: AtomicU32 = AtomicU32::new(0);
static IS_BUSY: AtomicU32 = AtomicU32::new(0);

/// Longest time from a sample to its prediction, us.
static LATEST: AtomicU32 = AtomicU32::new(0);

/// What stands for the bus: a timer's interrupt, as a frame has one, and the prediction of the pose.
#[embassy_executor::task]
async fn encoders(parameters: Parameters) {
    let mut predictor: OutputPredictor<MOTIONS> = OutputPredictor::new(&parameters);
    let mut due = Instant::now() + PERIOD;
    loop {
        Timer::at(due).await;
        let number = SAMPLES.fetch_add(1, Ordering::Relaxed);
        DURING_SCANS.fetch_add(IS_BUSY.load(Ordering::Relaxed), Ordering::Relaxed);
        let time = Time::from_micros(due.as_micros());
        let sample = EncoderSample { time, drive: number.wrapping_mul(STEP), steering: 0 };
        if let Some(estimate) = exchange::newest_estimate() {
            predictor.update(&estimate.pose, &estimate.prediction);
        }
        predictor.encoders(&sample);
        let delay = exchange::now().micros().saturating_sub(time.micros());
        LATEST.fetch_max(u32::try_from(delay).unwrap_or(u32::MAX), Ordering::Relaxed);
        exchange::pass_on(BusEvent::Encoders(sample).into());
        due += PERIOD;
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut core = cortex_m::Peripherals::take().expect("the program begins once");
    let mut file = HostFile::open(c"drive.agvlog").expect("there is a drive");
    let mut log = Some(LogWriter::new(FRAME.take(), QUEUE.init_with(LogQueue::new), 0));
    let mut localization: Option<Localization> = None;
    let mut scans = 0;
    time_driver::start();
    uart::start();
    interrupts::enable(&mut core.NVIC);
    let outcome = BUFFER.take().for_each(&mut file, |record| match record {
        Record::Header(header) if localization.is_none() => {
            let mut parameters = *header.parameters;
            parameters.maps.dynamic = true;
            let settings = Settings { start_search: false, ..Settings::of(parameters) };
            let localizer = LOCALIZER.init_with(|| Localizer::new(parameters));
            let new = |localizer| agv_controller::Localization::new(localizer, &settings);
            localization = log.take().map(|log| Localization { localization: new(localizer), log, reads_flash: false });
            BUS_TASKS.start(Interrupt::BusTasks).spawn(encoders(parameters).expect("the task runs once"));
        }
        Record::Landmarks(piece) => {
            if let Some(Localization { localization, .. }) = &mut localization {
                localization.localizer_mut().add_landmarks(piece).expect("the map has room");
            }
        }
        Record::Event(event) if scans < SCANS => {
            let Some(localization) = &mut localization else { return };
            while localization.take_bus_event() {}
            match event {
                Event::SetPose(fix) => {
                    let fix = agv_core::localizer::PoseFix { time: exchange::now(), ..*fix };
                    localization.handle(&Event::SetPose(fix));
                }
                Event::Scan(scan) => {
                    // It is true at the time of this program.
                    let length = scan.beam_interval * scan.ranges.len() as f64;
                    let scan = Scan { start: exchange::now().offset(-length), ..*scan };
                    IS_BUSY.store(1, Ordering::Relaxed);
                    localization.handle(&Event::Scan(scan));
                    IS_BUSY.store(0, Ordering::Relaxed);
                    scans += 1;
                }
                _ => {}
            }
        }
        _ => {}
    });
    let written = write_table(scans);
    if outcome == Ok(0) && written.is_ok() {
        debug::exit(debug::EXIT_SUCCESS);
    }
    hprintln!("{:?} {:?}", outcome, written);
    debug::exit(debug::EXIT_FAILURE);
    loop {
        cortex_m::asm::wfi();
    }
}

/// Writes `latency.csv`.
fn write_table(scans: u32) -> Result<(), HostFileError> {
    let mut text: String<256> = String::new();
    let samples = SAMPLES.load(Ordering::Relaxed);
    let during = DURING_SCANS.load(Ordering::Relaxed);
    let latest = LATEST.load(Ordering::Relaxed);
    let _ = writeln!(text, "scans,samples,samples during scans,latest prediction in us at 64 ns an instruction,lost");
    let _ = writeln!(text, "{scans},{samples},{during},{latest},{}", exchange::lost_events());
    HostFile::create(c"latency.csv")?.write(text.as_bytes())
}
