//! The vehicle that is put to the test, on the command line.

use std::path::PathBuf;

use agv_core::localizer::Parameters;
use agv_lab::equipment::Equipment;
use agv_lab::trust::hall::Generator;
use agv_lab::trust::nominal::NominalWorld;
use agv_lab::trust::trial::Tested;
use agv_settings::Settings;

use crate::command::setting_arguments::SettingArguments;

#[derive(clap::Args)]
pub struct TestedArguments {
    /// The kinds of faults.
    #[arg(long, default_value = "trust")]
    pub kinds: PathBuf,
    /// What draws the halls.
    #[arg(long, value_enum, default_value_t)]
    pub halls: Generator,
    /// How hard the world is in which a vehicle in order drives.
    #[arg(long, value_enum, default_value_t)]
    pub world: NominalWorld,
    #[command(flatten)]
    pub equipment: Equipment,
    /// Whether the vehicle has a map of the contours of its hall, which it has made among the reflectors on the same way before.
    #[arg(long)]
    pub contours: bool,
    #[command(flatten)]
    pub settings: SettingArguments,
}

impl TestedArguments {
    /// What the controller believes; refuses settings that it cannot have.
    pub fn parameters(&self) -> anyhow::Result<Parameters> {
        let mut parameters = Parameters { vehicle: self.equipment.believed(), ..Settings::default().parameters };
        self.settings.apply(&mut parameters)?;
        Ok(parameters)
    }

    /// Lets something be done with the vehicle.
    pub fn with<Made>(&self, make: impl FnOnce(&Tested) -> Made) -> Made {
        // Whatever can be refused was refused before.
        let settings = |parameters: &mut Parameters| _ = self.settings.apply(parameters);
        make(&Tested {
            equipment: self.equipment,
            halls: self.halls,
            world: self.world,
            has_contours: self.contours,
            settings: &settings,
        })
    }

    /// Says by which settings it differs from a vehicle that is delivered.
    pub fn print_settings(&self) {
        if !self.settings.is_empty() {
            println!("not the default settings: {}", self.settings.texts().join(" "));
        }
    }
}
