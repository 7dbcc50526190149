//! Whether a scenario makes sense.

use super::believed::believed_parameters;
use super::keys::{self, Key};
use super::{MotionReport, PathKind, Scenario, ScenarioError, WorldOptions};

impl Scenario {
    /// Whether every value makes sense.
    ///
    /// # Errors
    /// The first value that does not.
    pub fn check(&self) -> Result<(), ScenarioError> {
        self.check_bounds()?;
        let wheelbase = self.vehicle.believed.wheelbase + self.vehicle.truth.wheelbase_error;
        demand("vehicle.believed.wheelbase with its error", wheelbase > 0.0, "a positive number")?;
        let mut phases = self.people.iter().filter_map(|person| person.phase);
        demand("people.phase", phases.all(|phase| (0.0..=1.0).contains(&phase)), "between 0 and 1")?;
        demand("people.way", self.people.iter().all(|person| !person.way.is_empty()), "a list of at least one point")?;
        self.check_path()?;
        self.check_world()?;
        self.check_effects()?;
        believed_parameters(self).check().map_err(ScenarioError::Parameters)
    }

    /// Every number against the table of keys.
    fn check_bounds(&self) -> Result<(), ScenarioError> {
        // Seeds may be larger than TOML writes, and every one of them makes sense.
        let mut plain = Self { seed: 0, ..self.clone() };
        match &mut plain.world {
            WorldOptions::BlockStorage(storage) => storage.seed = None,
            WorldOptions::WarehouseHall(hall) => hall.seed = None,
            WorldOptions::Shapes(_) => {}
        }
        let mut found = Vec::new();
        let value = toml::Value::try_from(&plain).expect("a scenario is written as TOML");
        numbers(&value, "", &mut found);
        for (name, value) in found {
            let Some(Key { bounds: [least, most], unit, .. }) = keys::find(&name) else { continue };
            // Not a number is within no bounds.
            if !(*least <= value && value <= *most) {
                let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
                let demand = format!("from {least} to {most}{unit}, and is {value}");
                return Err(ScenarioError::Value { key: name, value: Some(value), demand });
            }
        }
        Ok(())
    }

    fn check_path(&self) -> Result<(), ScenarioError> {
        let has_legs = !self.path.legs.is_empty();
        if self.path.kind != PathKind::Legs {
            return demand("path.legs", !has_legs, "left out unless path.kind is \"legs\"");
        }
        demand("path.legs", has_legs, "a list of at least one leg")?;
        demand("path.legs.segments", self.path.legs.iter().all(|leg| !leg.segments.is_empty()), "at least one segment")
    }

    /// Whether every mistake that is stated is one that this kind of vehicle can have.
    fn check_effects(&self) -> Result<(), ScenarioError> {
        use MotionReport::{
            Ackermann, BiSteerable, Differential, Encoders, Increments, Mecanum, Omnidirectional, Speed,
            ThreeOmnidirectional, TricycleSpeed,
        };
        let reports = self.vehicle.reports;
        let truth = &self.vehicle.truth;
        let is_tricycle = reports == Encoders;
        let has_wheelbase = matches!(reports, Encoders | Speed | TricycleSpeed);
        let without = "left out: it has no effect on a vehicle that reports this";
        let of_tricycle = [
            ("vehicle.true.drive_reversed", truth.drive_reversed),
            ("vehicle.true.steering_reversed", truth.steering_reversed),
            ("vehicle.true.encoders_swapped", truth.encoders_swapped),
            ("vehicle.true.steering_offset_backward_error_deg", truth.steering_offset_backward_error_deg != 0.0),
        ];
        for (key, is_stated) in of_tricycle {
            demand(key, is_tricycle || !is_stated, without)?;
        }
        demand("vehicle.true.wheelbase_error", has_wheelbase || truth.wheelbase_error == 0.0, without)?;
        let wheels = match reports {
            Encoders | Speed | TricycleSpeed | Increments => 1,
            Differential | BiSteerable | Ackermann => 2,
            ThreeOmnidirectional => 3,
            Omnidirectional | Mecanum => 4,
        };
        let slips = &self.odometry.slips;
        let has_wheel = slips.iter().all(|slip| slip.wheel < wheels);
        demand("odometry.slips.wheel", has_wheel, "the number of a driven wheel, from 0")
    }

    fn check_world(&self) -> Result<(), ScenarioError> {
        match &self.world {
            WorldOptions::BlockStorage(_) | WorldOptions::WarehouseHall(_) => Ok(()),
            WorldOptions::Shapes(shapes) => {
                demand("world.reflectors", shapes.reflectors.len() <= usize::from(u16::MAX), "65535 reflectors at most")
            }
        }
    }
}

/// Every number with the names that lead to it; lists have the name of their key.
fn numbers(value: &toml::Value, name: &str, found: &mut Vec<(String, f64)>) {
    match value {
        toml::Value::Table(table) => {
            for (key, value) in table {
                let name = if name.is_empty() { key.clone() } else { format!("{name}.{key}") };
                numbers(value, &name, found);
            }
        }
        toml::Value::Array(values) => values.iter().for_each(|value| numbers(value, name, found)),
        toml::Value::Integer(whole) => found.push((name.to_owned(), *whole as f64)),
        toml::Value::Float(number) => found.push((name.to_owned(), *number)),
        toml::Value::String(_) | toml::Value::Boolean(_) | toml::Value::Datetime(_) => {}
    }
}

fn demand(key: &str, is_met: bool, demand: &str) -> Result<(), ScenarioError> {
    if is_met {
        Ok(())
    } else {
        Err(ScenarioError::Value { key: key.to_owned(), value: None, demand: demand.to_owned() })
    }
}
