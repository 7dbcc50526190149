//! `agv evaluate carpark`.

use std::path::Path;

use agv_host_sim::data;
use agv_lab::evaluate::{carpark, carpark_starts};
use anyhow::Context;

/// Reflectors on a real vehicle: the car park of ACFR against its satellite receiver.
#[derive(clap::Args)]
pub struct Carpark {
    /// What is believed of the vehicle's own sensors.
    #[arg(long, value_enum, default_value = "nominal")]
    noise: Noise,
    /// What is known of the reflectors.
    #[arg(long, value_enum, default_value = "map")]
    mode: Mode,
    /// Switch the vehicle on at that many random moments instead, with no start pose: it finds itself by its reflectors.
    #[arg(long, value_name = "STARTS", num_args = 0..=1, default_missing_value = "50")]
    relocalise: Option<usize>,
    /// Seed of the random moments.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// One JSON object instead of a table.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Mode {
    /// Where all of them are.
    Map,
    /// Nothing: they are found on the way.
    Slam,
    /// Nothing, and contours of the way behind correct the pose, too, as where there is room for them.
    SlamAndContours,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Noise {
    /// Wide enough for a car whose wheel slips.
    Nominal,
    /// 0.1 m/s and 1 degree: too sure of itself.
    Tight,
}

impl Carpark {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let folder =
            data::folder().context("the recordings are not there: set AGV_DATA to their folder")?.join("carpark");
        if let Some(starts) = self.relocalise {
            return relocalise(&folder, starts, self.seed, self.json);
        }
        let noise = match self.noise {
            Noise::Nominal => carpark::Noise::Nominal,
            Noise::Tight => carpark::Noise::Tight,
        };
        let knowledge = match self.mode {
            Mode::Map => carpark::Knowledge::Map,
            Mode::Slam => carpark::Knowledge::Slam,
            Mode::SlamAndContours => carpark::Knowledge::SlamAndContours,
        };
        let (outcome, _, _) = carpark::run(&folder, noise, knowledge)?;
        if self.json {
            println!("{}", serde_json::to_string_pretty(&outcome)?);
            return Ok(());
        }
        let or_never = |time: Option<f64>| time.map_or("never".to_owned(), |time| format!("at {time:.1} s"));
        println!(
            "position     rms {:.3} m, median {:.3}, 95 % {:.3}, max {:.3}",
            outcome.rmse_m, outcome.median_m, outcome.p95_m, outcome.max_m
        );
        println!("heading      rms {:.2} deg", outcome.heading_rmse_deg);
        println!("reflectors   {} accepted, {} rejected", outcome.accepted, outcome.rejected);
        if let Some(error) = outcome.map_error_m {
            println!(
                "map          {} reflectors, rms {error:.3} m, {} elsewhere",
                outcome.landmarks, outcome.landmarks_elsewhere
            );
        }
        println!("wrong        {}", or_never(outcome.wrong_at_s));
        println!("lost         {}", or_never(outcome.lost_at_s));
        println!("speed        {:.0} times real time", outcome.realtime_factor);
        Ok(())
    }
}

fn relocalise(folder: &Path, starts: usize, seed: u64, json: bool) -> anyhow::Result<()> {
    let outcome = carpark_starts::run(folder, starts, seed)?;
    if json {
        println!("{}", serde_json::to_string_pretty(&outcome)?);
        return Ok(());
    }
    println!("starts          {}", outcome.starts);
    println!("right           {} within {} s of motion", outcome.right, carpark_starts::LONGEST);
    println!("not localised   {}, and said so", outcome.not_localised);
    println!("wrong           {}", outcome.wrong);
    Ok(())
}
