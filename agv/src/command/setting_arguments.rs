//! Settings on a command line.

use agv_core::localizer::Parameters;
use agv_host_sim::setting_doubts::doubt;
use agv_settings::leaf::{Leaf, LeafError, Value};
use agv_settings::{Cause, Contradiction, Settings, bus_load};
use agv_wire::can::bit_timing::BIT_RATES;
use anyhow::{Context, bail, ensure};

use super::output::note;
use super::setting_text::{named, parse_value, show_number, show_setting};

/// Options of the commands that take settings.
#[derive(clap::Args)]
pub struct SettingArguments {
    /// A setting as NAME=VALUE; `agv settings` shows the names.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    set: Vec<String>,
}

impl SettingArguments {
    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.set.is_empty()
    }

    /// As they were given.
    pub fn texts(&self) -> &[String] {
        &self.set
    }

    /// The settings that are given.
    fn leaves(&self) -> impl Iterator<Item = &'static Leaf> {
        self.set.iter().filter_map(|text| Leaf::named(text.split_once('=')?.0))
    }

    /// Whether a setting is among them.
    pub fn has(&self, leaf: &Leaf) -> bool {
        self.leaves().any(|given| given.name == leaf.name)
    }

    /// Changes settings.
    pub fn change(&self, settings: &mut Settings) -> anyhow::Result<()> {
        self.set.iter().try_for_each(|text| change(settings, text))?;
        // In any order: the kind of the vehicle may come last.
        for leaf in self.leaves() {
            ensure!(
                leaf.matters(settings),
                "{} is no setting of a vehicle of the kind {}",
                leaf.name,
                settings.vehicle.kind.name()
            );
        }
        let show = |name| Leaf::named(name).map_or_else(String::new, |leaf| show_setting(name, leaf.value(settings)));
        if let Some([leaf, other]) = settings.contradicting_pair().filter(|_| !self.is_empty()) {
            bail!("{leaf} ({}) does not go with {other} ({})", show(leaf), show(other));
        }
        match settings.check() {
            Err(Contradiction { cause: Cause::BusLoad, .. }) => bail!(
                "the CAN bus would be loaded by {:.0} % of its bit rate, more than 60 %; it needs a longer \
                 can.publishing_period or can.encoder_period, or a higher can.bit_rate",
                100.0 * bus_load(settings)
            ),
            Err(Contradiction { leaf: leaf @ "can.bit_rate", .. }) => {
                bail!("{leaf} must be one of {BIT_RATES:?} kbit/s, not {}", settings.bit_rate)
            }
            Err(Contradiction { leaf, other: Some(other), .. }) => {
                bail!("{leaf} ({}) does not go with {other} ({})", show(leaf), show(other))
            }
            Err(Contradiction { leaf, .. }) => {
                bail!("{leaf} is {}: it is out of its bounds, or does not go with the other settings", show(leaf))
            }
            Ok(()) => Ok(()),
        }
    }

    /// Changes what the localiser believes, and asks about values that hardly a vehicle has.
    pub fn apply(&self, parameters: &mut Parameters) -> anyhow::Result<()> {
        let mut settings = Settings::of(*parameters);
        self.change(&mut settings)?;
        for leaf in self.leaves() {
            if let Some(Value::Number(value)) = leaf.get(&settings)
                && let Some(doubt) = doubt(leaf.name, value)
            {
                note(&format!("agv: {doubt}"));
            }
        }
        settings.parameters.check()?;
        *parameters = settings.parameters;
        Ok(())
    }
}

fn change(settings: &mut Settings, text: &str) -> anyhow::Result<()> {
    let (name, value) = text.split_once('=').with_context(|| format!("{text} is not NAME=VALUE"))?;
    let leaf = named(name)?;
    match leaf.set(settings, parse_value(name, value, leaf.value(settings))?) {
        Ok(()) => Ok(()),
        Err(LeafError::Bounds) => {
            let [least, most] = [leaf.bounds.0, leaf.bounds.1].map(show_number);
            bail!("{name} must be from {least} to {most} {}, not {value}", leaf.unit)
        }
        Err(LeafError::Kind | LeafError::BusLoad | LeafError::Other(_)) => bail!("{value} is no value of {name}"),
    }
}
