//! What is done with a request: variables are read and written here, methods are called in `method.rs`.

use agv_wire::cola::{Dialect, Fault, Raw, Text};
use agv_wire::nav350::{Answer, Orientation, Request, Setting, Size, UserLevel, Value, Variable};

use super::encoding::{encode, refuse, why, zero};
use super::pending::Pending;
use super::sensor::Sensor;

/// Variables that the sensor has beside those that are known, as its maker's client asks for them at start-up (sick_scan_xd).
const OTHERS: [&str; 5] = ["SCdevicestate", "ODoprh", "ODpwrc", "LocationName", "LMDscandatacfg"];

impl Sensor {
    /// The bytes that answer a payload at once.
    pub(super) fn answer(&mut self, dialect: Dialect, payload: &[u8], now: f64, pending: &mut Pending) -> Vec<u8> {
        match Request::decode(dialect, payload) {
            Ok(Request::Read(variable)) => self.read(dialect, variable),
            Ok(Request::ReadOther(name)) if OTHERS.contains(&name) => zero(dialect, name),
            Ok(Request::ReadOther(_)) => refuse(dialect, Fault::UNKNOWN_VARIABLE),
            Ok(Request::Write(setting)) => self.write(dialect, &setting),
            Ok(Request::Call(method)) => self.call(dialect, &method, now, pending),
            Err(_) => refuse(dialect, why(dialect, payload)),
        }
    }

    fn read(&self, dialect: Dialect, variable: Variable) -> Vec<u8> {
        let text = |text: &'static str| Text(text.as_bytes());
        let value = match variable {
            Variable::DeviceIdent => Value::DeviceIdent(text("NAV350"), text("emulated")),
            Variable::SerialNumber => Value::SerialNumber(text("00000000")),
            Variable::FirmwareVersion => Value::FirmwareVersion(text("emulated")),
            Variable::DeviceInfo => return zero(dialect, variable.name()),
            Variable::MutedSectors if self.muted.1 == b"0" => return zero(dialect, variable.name()),
            // What the list means is not known, so it cannot be said in the other dialect.
            Variable::MutedSectors if self.muted.0 != dialect => return refuse(dialect, Fault::LOCAL_CONDITION),
            Variable::MutedSectors => Value::Setting(Setting::MutedSectors(Raw { dialect, bytes: &self.muted.1 })),
            _ => match self.settings.iter().find(|setting| setting.variable() == variable) {
                Some(setting) => Value::Setting(*setting),
                None => return refuse(dialect, Fault::UNKNOWN_VARIABLE),
            },
        };
        encode(dialect, &Answer::Value(value))
    }

    fn write(&mut self, dialect: Dialect, setting: &Setting) -> Vec<u8> {
        let variable = setting.variable();
        if let Setting::ColaDialect(_) = setting {
            return encode(dialect, &Answer::Written(variable));
        }
        if self.level < UserLevel::AuthorisedClient.number() {
            return refuse(dialect, Fault::ACCESS_DENIED);
        }
        if let Setting::MutedSectors(sectors) = setting {
            self.muted = (sectors.dialect, sectors.bytes.to_vec());
            return encode(dialect, &Answer::Written(variable));
        }
        let Some(owned) = owned(setting) else { return refuse(dialect, Fault::INVALID_DATA) };
        match owned {
            Setting::ReflectorSize(Size(size)) if !(1..=150).contains(&size) => {
                return refuse(dialect, Fault::LOCAL_CONDITION);
            }
            Setting::CoordinateOrientation(number) if Orientation::of_number(number).is_none() => {
                return refuse(dialect, Fault::LOCAL_CONDITION);
            }
            Setting::MapConfiguration(configuration) if !(1..=127).contains(&configuration.mean) => {
                return refuse(dialect, Fault::LOCAL_CONDITION);
            }
            _ => {}
        }
        self.settings.retain(|known| known.variable() != variable);
        self.settings.push(owned);
        encode(dialect, &Answer::Written(variable))
    }
}

/// The setting without borrowed parts; None if it cannot be without.
fn owned(setting: &Setting) -> Option<Setting<'static>> {
    Some(match *setting {
        Setting::MutedSectors(_) => return None,
        Setting::CurrentLayer(value) => Setting::CurrentLayer(value),
        Setting::PoseDataFormat(value) => Setting::PoseDataFormat(value),
        Setting::LandmarkDataFormat(value) => Setting::LandmarkDataFormat(value),
        Setting::ScanDataFormat(value) => Setting::ScanDataFormat(value),
        Setting::SlidingMean(value) => Setting::SlidingMean(value),
        Setting::MapConfiguration(value) => Setting::MapConfiguration(value),
        Setting::ReflectorSize(value) => Setting::ReflectorSize(value),
        Setting::ReflectorType(value) => Setting::ReflectorType(value),
        Setting::IdentificationWindow(value) => Setting::IdentificationWindow(value),
        Setting::NearestReflectors(value) => Setting::NearestReflectors(value),
        Setting::ActionRadius(nearest, farthest) => Setting::ActionRadius(nearest, farthest),
        Setting::ReflectorThreshold(value) => Setting::ReflectorThreshold(value),
        Setting::LandmarkMatching(value) => Setting::LandmarkMatching(value),
        Setting::CoordinateOrientation(value) => Setting::CoordinateOrientation(value),
        Setting::HardwareTimeSync(mode, mask) => Setting::HardwareTimeSync(mode, mask),
        Setting::ColaDialect(value) => Setting::ColaDialect(value),
    })
}
