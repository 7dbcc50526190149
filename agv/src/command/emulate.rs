//! `agv emulate`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use agv_host_sim::contour_map::ContourMap;
use agv_host_sim::emulate::vehicle::{self, Driven, Errors, InChip, InChipOptions, VehicleOptions, Watch};
use agv_host_sim::mapping::contour_file;
use agv_host_sim::recording::Recording;
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::{simulate, standard};
use agv_host_sim::{log, replay};
use anyhow::{Context, bail};
use indicatif::ProgressStyle;
use serde::Serialize;

use super::output::{note, print_rows};
use super::progress;

const HELP: &str = "\
The firmware runs on QEMU's MPS2-AN500 with an emulated NAV350 and emulated encoders, in real time. Its log stream is
replayed here afterwards, and must give the same bits. Meanwhile `agv view --live` shows the drive at the address that
is printed. In the repository, `cargo xtask emulate` builds the firmware first, and `cargo xtask emulate --chip` drives with the
image that is flashed, in the emulated chip of its board and in virtual time.

Examples:
  agv emulate --image target/firmware/an500/thumbv7em-none-eabihf/firmware/vehicle
  agv emulate --image vehicle --scenario warehouse_hall --seconds 30 --json
  agv emulate --image vehicle --untold --seconds 10
  agv emulate --image vehicle --untold --contours hall.csv --seconds 10
  agv emulate --image vehicle --folder /tmp/vehicle && defmt-print -e vehicle < /tmp/vehicle/defmt.bin";

/// Drive a vehicle whose controller runs the firmware in emulation
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Emulate {
    /// Firmware image of the emulated board.
    #[arg(long, value_name = "ELF", required_unless_present = "chip")]
    image: Option<PathBuf>,
    /// Scenario to drive; the standard hall if absent.
    #[arg(long)]
    scenario: Option<PathBuf>,
    /// How long to drive, s; to the end of the scenario if absent.
    #[arg(long)]
    seconds: Option<f64>,
    /// Folder for the board's files: flash.bin, defmt.bin, stream.agvlog. A temporary one if absent.
    #[arg(long)]
    folder: Option<PathBuf>,
    /// Do not tell the vehicle where it is: it finds itself.
    #[arg(long)]
    untold: bool,
    /// Drive in this map of contours instead of among reflectors.
    #[arg(long, value_name = "FILE")]
    contours: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
    /// Drive in virtual time instead, with the controller that this program and its arguments emulate; stands last.
    #[arg(long, value_name = "PROGRAM", num_args = 1.., allow_hyphen_values = true, conflicts_with = "image")]
    chip: Vec<OsString>,
}

#[derive(Serialize)]
struct Outcome {
    #[serde(flatten)]
    errors: Errors,
    records: usize,
    damages: usize,
    events: usize,
    is_bit_equal: bool,
    /// Bytes of the stack that were used since the program's loop began, if the emulated chip tells.
    #[serde(skip_serializing_if = "Option::is_none")]
    stack: Option<u32>,
}

impl Emulate {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let scenario = match &self.scenario {
            Some(path) => Scenario::read(path)?,
            None => toml::from_str(standard::HALL).context("standard hall")?,
        };
        let mut recording = simulate(&scenario)?.recording;
        let contours = self.contours.as_deref().map(contour_file::read).transpose()?;
        if contours.is_some() {
            recording.landmarks.clear();
        }
        let temporary = std::env::temp_dir().join(format!("agv-emulate-{}", std::process::id()));
        let folder = self.folder.clone().unwrap_or_else(|| temporary.clone());
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        let folder = folder.canonicalize()?;
        let outcome = self
            .drive(&recording, contours.as_ref(), &folder)
            .and_then(|(driven, stack)| Ok(Outcome { stack, ..judge(&driven, &recording, contours.as_ref())? }));
        if self.folder.is_none() {
            // What cannot be removed is left to the system.
            let _ = std::fs::remove_dir_all(&temporary);
        }
        let outcome = outcome?;
        if self.json {
            println!("{}", serde_json::to_string_pretty(&outcome)?);
        } else {
            let Outcome { errors, records, events, is_bit_equal, damages, stack } = &outcome;
            let mut rows = vec![
                ["poses".to_owned(), errors.poses.to_string()],
                ["localised".to_owned(), format!("{:.1} %", 100.0 * errors.localised_share)],
                ["position, 95 %".to_owned(), format!("{:.1} mm", 1e3 * errors.position_p95_m)],
                ["position, largest".to_owned(), format!("{:.1} mm", 1e3 * errors.position_max_m)],
                ["heading, 95 %".to_owned(), format!("{:.3} deg", errors.heading_p95_deg)],
                ["heading, largest".to_owned(), format!("{:.3} deg", errors.heading_max_deg)],
                ["longest gap of poses".to_owned(), format!("{:.0} ms", 1e3 * errors.longest_gap_s)],
                ["records streamed".to_owned(), records.to_string()],
                ["damages".to_owned(), damages.to_string()],
                ["events replayed".to_owned(), events.to_string()],
                ["the same bits".to_owned(), if *is_bit_equal { "yes" } else { "no" }.to_owned()],
            ];
            rows.extend(stack.map(|bytes| ["deepest stack".to_owned(), format!("{bytes} bytes")]));
            print_rows(&rows);
        }
        if !outcome.is_bit_equal {
            bail!("the replay of the log stream differs from what the firmware said");
        }
        Ok(())
    }

    /// The drive, and how much of its stack the program has used, if that is known.
    fn drive(
        &self,
        recording: &Recording,
        contours: Option<&ContourMap>,
        folder: &Path,
    ) -> anyhow::Result<(Driven, Option<u32>)> {
        let seconds = self.seconds.unwrap_or(f64::MAX);
        let Some(image) = &self.image else {
            let [program, arguments @ ..] = &self.chip[..] else { bail!("which program emulates the chip?") };
            let mut command = Command::new(program);
            command.args(arguments);
            let options = InChipOptions { contours, is_not_told: self.untold, ..InChipOptions::default() };
            let InChip { driven, stack } = vehicle::drive_in_chip(recording, command, folder, seconds, options)?;
            return Ok((driven, Some(stack)));
        };
        let image = image.canonicalize().with_context(|| image.display().to_string())?;
        let options = VehicleOptions { contours, is_told: !self.untold, ..VehicleOptions::new(&image, folder) };
        Ok((vehicle::drive(recording, &options, seconds, look)?, None))
    }
}

/// How far the poses were off, and whether the log replays to the same bits.
fn judge(driven: &Driven, recording: &Recording, contours: Option<&ContourMap>) -> anyhow::Result<Outcome> {
    let errors = vehicle::errors(driven, recording).context("the controller has said no pose")?;
    let contents = log::read_contents(&driven.log, |_| ())?;
    let again = replay::replay_in(&contents.recording, contours.map(ContourMap::view), |_| ())?;
    let outputs = replay::compare(&contents.outputs, &again);
    let published = replay::compare_published(&contents.recording, &contents.publishing, &again);
    Ok(Outcome {
        errors,
        records: driven.stream.records,
        damages: driven.stream.damages,
        events: contents.recording.events.len(),
        is_bit_equal: outputs.is_equal() && published.is_equal(),
        stack: None,
    })
}

/// Says where the drive can be seen, and shows the pose while the vehicle drives, on a terminal only.
fn look(watch: &Watch) {
    note(&format!("see it live: agv view --live 127.0.0.1:{}", watch.stream_port));
    let style = ProgressStyle::with_template("{spinner} {msg}").unwrap_or_else(|_| ProgressStyle::default_spinner());
    let progress = progress::spinner().with_style(style);
    while !watch.is_over() {
        let driven = watch.driven().map_or(0.0, |time| time.as_secs_f64());
        let line = watch.pose().map_or_else(
            || "the board starts".to_owned(),
            |heard| {
                let pose = heard.pose.pose;
                format!(
                    "{driven:6.1} s  x {:8.3} m  y {:8.3} m  heading {:8.2} deg  {:?}  laser {:?}",
                    pose.x,
                    pose.y,
                    pose.theta.to_degrees(),
                    heard.pose.mode,
                    heard.pose.health.laser
                )
            },
        );
        progress.set_message(line);
        progress.tick();
        std::thread::sleep(Duration::from_millis(100));
    }
    progress.finish_and_clear();
}
