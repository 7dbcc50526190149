//! What experiments in simulation are told.

/// Which drives are driven, and how the result is shown.
#[derive(clap::Args)]
pub struct Drives {
    /// Drives of each kind. [default: 5, or 10 of cloud-drive]
    #[arg(long, alias = "drives", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub runs: Option<u32>,
    /// Seed of the first drive.
    #[arg(long, default_value_t = 100_000)]
    pub seed: u64,
    /// Print JSON instead of tables.
    #[arg(long)]
    pub json: bool,
}

/// Which starts are tried, and how the result is shown.
#[derive(clap::Args)]
pub struct Starts {
    /// Starts of each case. [default: 1000, or 10000 of kidnapping]
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..))]
    pub starts: Option<u64>,
    /// Seed of the first start.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Only cases whose name contains this.
    #[arg(long, default_value = "")]
    pub only: String,
    /// Print a JSON array instead of a table.
    #[arg(long)]
    pub json: bool,
}
