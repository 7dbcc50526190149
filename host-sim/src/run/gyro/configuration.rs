//! Where the gyro is.

use std::path::PathBuf;

use serde::Deserialize;

use super::OpenGyro;

/// Where the gyro is; nowhere if neither is there.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GyroConfiguration {
    /// A bus of I2C, such as `/dev/i2c-1`.
    pub i2c: Option<PathBuf>,
    /// Whether its pin SDO is high: then its address is 69h, else 68h.
    pub is_sdo_high: bool,
    /// A device of SPI, such as `/dev/spidev0.0`.
    pub spi: Option<PathBuf>,
}

/// Why it cannot be had.
#[derive(Debug, thiserror::Error)]
#[error("[gyro] {}: {problem}", path.display())]
pub struct GyroOpenError {
    /// Its device.
    path: PathBuf,
    /// What the kernel says.
    problem: String,
}

impl GyroConfiguration {
    /// What is wrong with it whatever the machine has: a key, and what there is to say of it.
    pub(in crate::run) fn problem(&self) -> Option<(&str, String)> {
        match (&self.i2c, &self.spi) {
            (Some(_), Some(_)) => Some(("spi", "a gyro is on i2c or on spi, not on both".to_owned())),
            (None, _) if self.is_sdo_high => {
                Some(("is_sdo_high", "it is the address on i2c, which is not there".to_owned()))
            }
            _ => None,
        }
    }

    /// Opens its device; none if none is wanted.
    ///
    /// # Errors
    /// If the kernel refuses.
    #[cfg(target_os = "linux")]
    pub fn open(&self) -> Result<Option<OpenGyro>, GyroOpenError> {
        use agv_controller::GyroChip;
        use linux_embedded_hal::spidev::{SpiModeFlags, SpidevOptions};
        use linux_embedded_hal::{I2cdev, SpidevDevice};

        /// A tenth of what the chip can (data sheet, table 27): 8 bytes take 64 us.
        const SPI_CLOCK: u32 = 1_000_000;

        if let Some(path) = &self.i2c {
            let refused = |problem: String| GyroOpenError { path: path.clone(), problem };
            let wires = I2cdev::new(path).map_err(|error| refused(error.to_string()))?;
            let is_sdo_high = self.is_sdo_high;
            return Ok(Some(Box::new(move |settings| Box::new(GyroChip::on_i2c(wires, is_sdo_high, settings)))));
        }
        let Some(path) = &self.spi else { return Ok(None) };
        let refused = |problem: String| GyroOpenError { path: path.clone(), problem };
        let mut wires = SpidevDevice::open(path).map_err(|error| refused(error.to_string()))?;
        let options =
            SpidevOptions::new().bits_per_word(8).max_speed_hz(SPI_CLOCK).mode(SpiModeFlags::SPI_MODE_0).build();
        wires.configure(&options).map_err(|error| refused(error.to_string()))?;
        Ok(Some(Box::new(move |settings| Box::new(GyroChip::on_spi(wires, settings)))))
    }

    /// Opens none.
    ///
    /// # Errors
    /// If one is wanted.
    #[cfg(not(target_os = "linux"))]
    pub fn open(&self) -> Result<Option<OpenGyro>, GyroOpenError> {
        let wanted = self.i2c.as_ref().or(self.spi.as_ref());
        let problem = "only Linux has such devices".to_owned();
        wanted.map_or(Ok(None), |path| Err(GyroOpenError { path: path.clone(), problem }))
    }
}
