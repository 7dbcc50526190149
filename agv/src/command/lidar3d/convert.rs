//! `agv lidar3d convert`.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use agv_core::measurement::Time;
use agv_host_sim::export::velodyne::CaptureWriter;
use agv_host_sim::file_kind;
use agv_host_sim::import::range_image::RangeImages;
use agv_host_sim::lidar3d::{SetupOptions, Source, setup};
use agv_host_sim::output_file;
use agv_lidar3d::calibration::Calibration;
use anyhow::{Context, bail};
use serde_json::json;

use crate::command::{output, progress};

const HELP: &str = "\
What is written is decided by the name: .xml is the maker's db.xml (degrees, centimetres), .yaml is that of ROS (radians,
metres), .pcap are packets of an HDL-64E.

Examples:
  agv lidar3d convert db.xml --output 64e.yaml
  agv lidar3d convert drive.pcap --output db.xml
  agv lidar3d convert velodyne_dist --output drive.pcap

Keys of --json: lasers for a calibration; scans and packets for a capture.";

/// Convert calibration files, take a calibration out of packets, or pack range images.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Convert {
    /// Calibration file, capture whose packets carry a calibration, or folder of range images.
    input: PathBuf,
    /// File to write; an older one is replaced.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

/// Time between the packets of one scan, us: a sixth of a thousand firings of the lasers.
const PACKET_INTERVAL: u64 = 300;
/// Time between two scans, us.
const SCAN_INTERVAL: u64 = 100_000;

impl Convert {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let ending = self.output.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
        match ending.as_deref() {
            Some("pcap") => self.pack(),
            Some("xml") => self.write(self.calibration()?, Calibration::to_db_xml),
            Some("yaml" | "yml") => self.write(self.calibration()?, Calibration::to_ros_yaml),
            _ => bail!("{}: the name does not end in .xml, .yaml or .pcap", self.output.display()),
        }
    }

    fn calibration(&self) -> anyhow::Result<Calibration> {
        let name = self.input.display();
        let mut beginning = [0; 4];
        if let Ok(mut file) = std::fs::File::open(&self.input) {
            use std::io::Read;
            // A file that is shorter than this is no capture.
            let _ = file.read(&mut beginning);
        }
        if !file_kind::describe(&beginning).starts_with("a network capture") {
            return Ok(setup::read_calibration(&self.input)?);
        }
        let source = Source::Capture(self.input.clone());
        let source = source.open(&SetupOptions::default(), &AtomicBool::new(false))?;
        let packets = source.survey.packets;
        source.survey.calibration.with_context(|| format!("{name}: its {packets} packets carry no whole calibration"))
    }

    fn write(&self, calibration: Calibration, text: impl Fn(&Calibration) -> String) -> anyhow::Result<()> {
        output_file::write(&self.output, text(&calibration)).with_context(|| self.output.display().to_string())?;
        let lasers = calibration.lasers.len();
        if self.json {
            println!("{}", json!({ "lasers": lasers }));
        } else {
            output::print_rows(&[["lasers".to_owned(), lasers.to_string()]]);
        }
        Ok(())
    }

    fn pack(&self) -> anyhow::Result<()> {
        let images = RangeImages::open(&self.input)?;
        let named = || self.output.display().to_string();
        let mut writer = CaptureWriter::create(&self.output).with_context(named)?;
        let bar = progress::bar("packing", images.files.len() as u64);
        let mut packets = 0_u64;
        for index in 0..images.files.len() {
            for (number, bytes) in images.packets(&images.counts(index)?).iter().enumerate() {
                let micros = index as u64 * SCAN_INTERVAL + number as u64 * PACKET_INTERVAL;
                writer.packet(Time::from_micros(micros), bytes).with_context(named)?;
                packets += 1;
            }
            bar.inc(1);
        }
        writer.finish().with_context(named)?;
        bar.finish_and_clear();
        let scans = images.files.len();
        if self.json {
            println!("{}", json!({ "scans": scans, "packets": packets }));
        } else {
            let row = |name: &str, count: String| [name.to_owned(), count];
            output::print_rows(&[row("scans", scans.to_string()), row("packets", packets.to_string())]);
        }
        Ok(())
    }
}
