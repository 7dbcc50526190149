//! `agv lidar3d info`.

use std::ops::ControlFlow;
use std::path::Path;
use std::process::ExitCode;

use agv_host_sim::lidar3d::kind::Kind;
use agv_host_sim::lidar3d::survey::Survey;
use agv_host_sim::lidar3d::{SetupError, Source};
use agv_lidar3d::packet::Sensor;
use serde_json::json;

use super::arguments::{SOURCES, SensorArguments, tally_object, tally_rows};
use crate::command::{import_summary, output, progress, stop};

const HELP: &str = "\
Examples:
  agv lidar3d info drive.pcap
  agv lidar3d info drive.pcap --calibration db.xml --json
  agv lidar3d info udp

Keys of --json: sensor, return_mode, port, warning, version, packets, refused, other, cut, duration_s, turns, turns_per_s,
  calibration_in_stream, lasers, returns {points, empty, false_near, false_far, unused, equal}, address, notes, warnings; returns is
  null without a calibration.";

/// What sends a stream of packets, and what is in it.
#[derive(clap::Args)]
#[command(after_help = HELP, after_long_help = format!("{SOURCES}\n\n{HELP}"))]
pub struct Info {
    /// Capture, folder of range images, or udp[:PORT]; the network is listened to until Ctrl-C.
    #[arg(value_name = "SOURCE", value_parser = Source::parse)]
    source: Source,
    #[command(flatten)]
    sensor: SensorArguments,
    /// Print one JSON object instead of a table.
    #[arg(long)]
    json: bool,
    /// End with exit code 3 if there is a warning.
    #[arg(long)]
    strict: bool,
}

impl Info {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<ExitCode> {
        let stop = stop::on_interrupt()?;
        let name = self.source.name();
        let source = self.source.open(&self.sensor.options(), &stop)?;
        let survey = source.survey.clone();
        let setup = match source.setup() {
            Ok(setup) => Some(setup),
            // What is missing is a result here.
            Err(SetupError::NoCalibration { .. } | SetupError::UnknownSensor) => None,
            Err(error) => return Err(error.into()),
        };
        let exit_code = import_summary::exit_code(&survey.account.warnings(), self.strict);
        let lasers = setup.as_ref().map(|setup| setup.lasers.len());
        let kind = setup.as_ref().map(|setup| setup.kind).or(survey.kind);
        let sensor = kind.map(Kind::name);
        let warning = setup.as_ref().and_then(|setup| setup.warning.clone());
        let bar = progress::bar("decoding", source.length().unwrap_or(0));
        let tally = match setup {
            Some(_) => Some(source.revolutions(&stop, |_| {
                bar.inc(1);
                ControlFlow::Continue(())
            })?),
            None => None,
        };
        bar.finish_and_clear();
        let duration = survey.duration();
        let rate = turn_rate(&survey);
        if self.json {
            let object = json!({
                "sensor": sensor,
                "return_mode": survey.return_mode,
                "port": survey.port,
                "warning": warning,
                "version": survey.version,
                "packets": survey.packets,
                "refused": survey.refused,
                "other": survey.other,
                "cut": survey.is_cut,
                "duration_s": duration,
                "turns": survey.turns,
                "turns_per_s": rate,
                "calibration_in_stream": survey.calibration.is_some(),
                "lasers": lasers,
                "returns": tally.map(tally_object),
                "address": survey.address.map(|address| address.to_string()),
                "notes": survey.account.notes(),
                "warnings": survey.account.warnings(),
            });
            println!("{}", serde_json::to_string_pretty(&object)?);
            import_summary::complain(Path::new(&name), &survey.account.warnings());
            return Ok(exit_code);
        }
        let mut rows = vec![
            ["source".to_owned(), name.clone()],
            ["sensor".to_owned(), sensor.unwrap_or("unknown; name it with --sensor").to_owned()],
        ];
        rows.extend(survey_rows(&survey, warning));
        rows.extend(tally.into_iter().flat_map(tally_rows));
        output::print_rows(&rows);
        import_summary::print_words(survey.account.notes(), &survey.account.warnings());
        Ok(exit_code)
    }
}

/// What the stream says about itself.
fn survey_rows(survey: &Survey, warning: Option<String>) -> Vec<[String; 2]> {
    let duration = survey.duration();
    let rate = turn_rate(survey);
    let mut rows = Vec::new();
    rows.extend(survey.return_mode.iter().map(|mode| ["returns of a firing".to_owned(), mode.clone()]));
    rows.extend(survey.address.map(|address| ["address".to_owned(), address.to_string()]));
    rows.extend(survey.port.map(|port| ["UDP port".to_owned(), port.to_string()]));
    rows.extend(survey.version.iter().map(|version| ["version".to_owned(), version.clone()]));
    rows.extend(warning.map(|warning| ["warning".to_owned(), warning]));
    if survey.packets > 0 {
        rows.push(["packets".to_owned(), survey.packets.to_string()]);
        rows.push(["not of a sensor".to_owned(), format!("{} come near, {} others", survey.refused, survey.other)]);
        rows.push(["turns".to_owned(), format!("{:.2} in {duration:.2} s, {rate:.2} a second", survey.turns)]);
    }
    if survey.is_cut {
        rows.push(["end".to_owned(), "in the middle of a packet".to_owned()]);
    }
    if survey.kind == Some(Kind::Velodyne(Sensor::Hdl64e)) {
        let found = if survey.calibration.is_some() { "in the packets" } else { "not in the packets" };
        rows.push(["calibration".to_owned(), found.to_owned()]);
    }
    rows
}

/// Turns a second.
fn turn_rate(survey: &Survey) -> f64 {
    let duration = survey.duration();
    if duration > 0.0 { survey.turns / duration } else { 0.0 }
}
