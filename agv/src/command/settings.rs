//! `agv settings`.

use agv_host_sim::setting_meanings::meaning;
use agv_settings::leaf::{Leaf, Value};
use agv_settings::{LEAVES, Settings as Defaults, bus_load};
use serde_json::json;

use super::setting_text::{named, show_number, show_readable as show, word};

const HELP: &str = "\
Examples:
  agv settings
  agv settings laser
  agv settings vehicle.wheelbase --json

Keys of --json: name, unit, default, least, most, choices, kinds, meaning; least and most are null for switches, addresses and
words, of which choices lists all; kinds are those of vehicles (vehicle.kind) that have the setting.";

/// List all settings of a controller: unit, default, bounds and meaning
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Settings {
    /// Show one setting, or those that begin with this room; all if absent.
    name: Option<String>,
    /// Print a JSON array instead of a table.
    #[arg(long)]
    json: bool,
}

impl Settings {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let leaves = self.wanted()?;
        let defaults = Defaults::default();
        if self.json {
            let entries: Vec<_> = leaves.iter().map(|leaf| entry(leaf, &defaults)).collect();
            println!("{}", serde_json::to_string_pretty(&entries)?);
            return Ok(());
        }
        println!("{:<38} {:<10} {:>14} {:>12} {:>12}  meaning", "name", "unit", "default", "least", "greatest");
        for leaf in leaves {
            let [least, most] =
                bounds(leaf, &defaults).map_or(["".to_owned(), "".to_owned()], |both| both.map(show_number));
            let value = leaf.value(&defaults);
            let value = word(leaf.name, value).map_or_else(|| show(value), str::to_owned);
            println!("{:<38} {:<10} {value:>14} {least:>12} {most:>12}  {}", leaf.name, leaf.unit, meaning(leaf.name));
        }
        println!("Which settings a vehicle has depends on vehicle.kind: --json names the kinds of each.");
        println!(
            "The CAN bus is loaded by {:.1} % of its bit rate with the defaults; more than 60 % is refused.",
            100.0 * bus_load(&defaults)
        );
        Ok(())
    }

    fn wanted(&self) -> anyhow::Result<Vec<&'static Leaf>> {
        let Some(name) = &self.name else { return Ok(LEAVES.iter().collect()) };
        let room = format!("{}.", name.trim_end_matches('.'));
        let of_room: Vec<_> = LEAVES.iter().filter(|leaf| leaf.name.starts_with(&room)).collect();
        if of_room.is_empty() { Ok(vec![named(name)?]) } else { Ok(of_room) }
    }
}

fn entry(leaf: &Leaf, defaults: &Defaults) -> serde_json::Value {
    let bounds = bounds(leaf, defaults);
    let default = match leaf.value(defaults) {
        Value::Number(number) => json!(number),
        value @ Value::Whole(whole) => word(leaf.name, value).map_or(json!(whole), |word| json!(word)),
        Value::Switch(is_on) => json!(is_on),
        value @ Value::Address(_) => json!(show(value)),
    };
    json!({
        "name": leaf.name,
        "unit": leaf.unit,
        "default": default,
        "least": bounds.map(|[least, _]| least),
        "most": bounds.map(|[_, most]| most),
        "choices": leaf.choices,
        "kinds": leaf.kinds.iter().map(|kind| kind.name()).collect::<Vec<_>>(),
        "meaning": meaning(leaf.name),
    })
}

/// Bounds, if the setting is a number.
fn bounds(leaf: &Leaf, defaults: &Defaults) -> Option<[f64; 2]> {
    let is_number = matches!(leaf.value(defaults), Value::Number(_) | Value::Whole(_)) && leaf.choices.is_empty();
    is_number.then_some([leaf.bounds.0, leaf.bounds.1])
}
