//! `agv import`.

use std::path::{Path, PathBuf};

use agv_host_sim::import::{carpark, sapienza};
use agv_host_sim::recording::{RecordedEvent, Recording};
use agv_host_sim::{file_kind, log};
use anyhow::{Context, bail};
use clap::ValueEnum;

/// Turn the recordings of others into logs.
#[derive(clap::Args)]
pub struct Import {
    /// What the input is.
    format: Format,
    /// File, or for the car park the folder of its tables.
    input: PathBuf,
    /// Where the log goes; an older one is replaced.
    #[arg(short, long, value_name = "LOG")]
    output: PathBuf,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Whatever the input looks like.
    Auto,
    /// Folder of the ACFR car park tables: an Ackermann vehicle, laser, reflectors, satellite positions.
    Carpark,
    /// Tricycle dataset of the Sapienza University of Rome: raw encoder counters and tracked poses.
    Sapienza,
}

impl Import {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let format = match self.format {
            Format::Auto => detect(&self.input)?,
            stated => stated,
        };
        eprintln!("reading {}", self.input.display());
        let recording = match format {
            Format::Carpark => carpark::read(&self.input, &carpark::WINDOW)?,
            Format::Sapienza => sapienza::read(&self.input)?,
            Format::Auto => unreachable!("the format has been found above"),
        };
        eprintln!("writing {}", self.output.display());
        log::write(&self.output, &recording)?;
        let bytes = std::fs::metadata(&self.output).context("the log has vanished")?.len();
        let summary = Summary::of(&recording, bytes);
        if self.json {
            println!("{}", serde_json::to_string(&summary)?);
        } else {
            summary.print();
        }
        Ok(())
    }
}

/// What the input looks like.
fn detect(input: &Path) -> anyhow::Result<Format> {
    let metadata = match std::fs::metadata(input) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            bail!("{}: there is no such file", input.display())
        }
        other => other.with_context(|| input.display().to_string())?,
    };
    if metadata.is_dir() {
        if input.join("laser_ranges_m.csv").exists() {
            return Ok(Format::Carpark);
        }
        bail!("{}: this folder does not hold the car park tables", input.display());
    }
    let beginning = beginning(input).with_context(|| input.display().to_string())?;
    if beginning.starts_with(sapienza::SIGNATURE.as_bytes()) {
        return Ok(Format::Sapienza);
    }
    bail!("{}: no known recording but {}", input.display(), file_kind::describe(&beginning));
}

/// The first few kilobytes of a file.
fn beginning(path: &Path) -> std::io::Result<Vec<u8>> {
    use std::io::Read;
    let mut beginning = Vec::new();
    std::fs::File::open(path)?.take(4096).read_to_end(&mut beginning)?;
    Ok(beginning)
}

/// What has become of the input.
#[derive(serde::Serialize)]
struct Summary {
    odometry: usize,
    scans: usize,
    reflectors: usize,
    landmarks: usize,
    truth: usize,
    references: usize,
    bytes: u64,
}

impl Summary {
    fn of(recording: &Recording, bytes: u64) -> Self {
        let count = |is: fn(&RecordedEvent) -> bool| recording.events.iter().filter(|event| is(event)).count();
        Self {
            odometry: count(|event| {
                matches!(event, RecordedEvent::Encoders(_) | RecordedEvent::Speed(_) | RecordedEvent::Increment(_))
            }),
            scans: count(|event| matches!(event, RecordedEvent::Scan(_))),
            reflectors: count(|event| matches!(event, RecordedEvent::Reflectors(_))),
            landmarks: recording.landmarks.len(),
            truth: recording.truth.len(),
            references: recording.references.len(),
            bytes,
        }
    }

    fn print(&self) {
        println!("odometry samples  {}", self.odometry);
        println!("scans             {}", self.scans);
        println!("reflector sets    {}", self.reflectors);
        println!("landmarks         {}", self.landmarks);
        println!("true poses        {}", self.truth);
        println!("reference poses   {}", self.references);
        println!("bytes             {}", self.bytes);
    }
}
