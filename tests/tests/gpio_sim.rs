//! The discrete lines on a chip of a Linux kernel: `gpio-sim`, whose levels the kernel shows and sets in sysfs.
//!
//! It needs a kernel that has it (`CONFIG_GPIO_SIM`), its configfs, and root.
#![cfg(target_os = "linux")]

use std::fs;
use std::path::{Path, PathBuf};

use agv_controller::{DiscreteInputs, DiscreteOutputs, DiscreteReport, Line};
use agv_core::measurement::Time;
use agv_host_sim::run::{DiscreteConfiguration, DiscretePort};
use agv_tests::no_kernel;

const NAME: &str = "the_lines_work_on_a_chip_of_a_kernel";
const CONFIGFS: &str = "/sys/kernel/config";
const LINES: usize = 8;

/// A chip that is gone when the test ends.
struct Chip {
    configuration: PathBuf,
    device: PathBuf,
    path: PathBuf,
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())).trim().to_owned()
}

fn write(path: &Path, text: &str) {
    fs::write(path, text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
}

impl Chip {
    /// Why there is none.
    fn new() -> Result<Self, String> {
        let simulated = Path::new(CONFIGFS).join("gpio-sim");
        if !simulated.is_dir() {
            return Err(format!("the kernel has no gpio-sim: there is no {}", simulated.display()));
        }
        let configuration = simulated.join(format!("agv{}", std::process::id()));
        let named = configuration.join("bank").join("line7");
        fs::create_dir_all(&named).map_err(|error| format!("{}: {error}", named.display()))?;
        write(&configuration.join("bank/num_lines"), &LINES.to_string());
        write(&named.join("name"), "AGV_RESET");
        write(&configuration.join("live"), "1");
        let name = read(&configuration.join("bank/chip_name"));
        let device = Path::new("/sys/devices/platform").join(read(&configuration.join("dev_name"))).join(&name);
        Ok(Self { configuration, device, path: Path::new("/dev").join(name) })
    }

    fn line(&self, line: usize) -> PathBuf {
        self.device.join(format!("sim_gpio{line}"))
    }

    /// The level of a line as somebody outside measures it.
    fn is_high(&self, line: usize) -> bool {
        read(&self.line(line).join("value")) == "1"
    }

    /// Somebody outside pulls a line.
    fn pull(&self, line: usize, is_high: bool) {
        write(&self.line(line).join("pull"), if is_high { "pull-up" } else { "pull-down" });
    }

    /// The chip is pulled out.
    fn remove(&self) {
        write(&self.configuration.join("live"), "0");
    }
}

impl Drop for Chip {
    fn drop(&mut self) {
        let _ = fs::write(self.configuration.join("live"), "0");
        for folder in ["bank/line7", "bank", ""] {
            let _ = fs::remove_dir(self.configuration.join(folder));
        }
    }
}

fn at(milliseconds: u64) -> Time {
    Time::from_micros(1000 * milliseconds)
}

/// What is said at a time: nothing but whether the outputs are as of a sound vehicle.
fn report(is_sound: bool, now: u64) -> DiscreteReport {
    let outputs = DiscreteOutputs { is_pose_valid: is_sound, is_within_docking_limits: is_sound, is_faulty: !is_sound };
    DiscreteReport { time: at(now), deadline: 0.05, outputs }
}

fn open(text: &str) -> Box<dyn DiscretePort> {
    toml::from_str::<DiscreteConfiguration>(text).unwrap().open().unwrap().unwrap()
}

#[test]
fn the_lines_work_on_a_chip_of_a_kernel() {
    let chip = match Chip::new() {
        Ok(chip) => chip,
        Err(reason) => return no_kernel(NAME, &reason),
    };
    let text = format!(
        "chip = \"{}\"\npose_valid = 1\nwithin_docking_limits = 2\nfault = 3\nstandstill = 5\nreset = \"AGV_RESET\"\n\
         inverted = [\"within_docking_limits\", \"standstill\"]",
        chip.path.display()
    );
    let mut lines = open(&text);
    let outputs = || [1, 2, 3].map(|line| chip.is_high(line));
    assert_eq!(
        outputs(),
        [false, true, false],
        "safe from the first moment on, the second one behind something that inverts"
    );
    lines.poll(Some(&report(true, 0)), at(0));
    assert_eq!(outputs(), [true, false, true]);
    lines.poll(Some(&report(false, 1)), at(1));
    assert_eq!(outputs(), [false, true, false]);
    // Nobody drives the inputs: neither says anything, and the inverted one is pulled up for that.
    let inputs: Vec<DiscreteInputs> = (2..100).map(|now| lines.poll(None, at(now))).collect();
    assert!(inputs.iter().all(|inputs| *inputs == DiscreteInputs::default()));
    chip.pull(5, false);
    chip.pull(7, true);
    let inputs: Vec<DiscreteInputs> = (100..200).map(|now| lines.poll(None, at(now))).collect();
    assert!(inputs.last().unwrap().is_standing);
    assert_eq!(inputs.iter().filter(|inputs| inputs.is_reset).count(), 1);
    // Nobody else gets a line of these; by its name alone it is found as well.
    let refusal = |text: &str| toml::from_str::<DiscreteConfiguration>(text).unwrap().open().err().unwrap().to_string();
    let refused = refusal("reset = \"AGV_RESET\"");
    assert!(refused.contains("reset, line AGV_RESET: "), "{refused}");
    let refused = refusal("fault = \"AGV_NOTHING\"");
    assert!(refused.contains("0 lines are called AGV_NOTHING"), "{refused}");
    // What fails is told, line by line.
    chip.remove();
    let all = [Line::PoseValid, Line::WithinDockingLimits, Line::Fault, Line::Standstill, Line::Reset];
    let failed = lines.poll(Some(&report(true, 200)), at(200)).failed;
    assert_eq!(failed, all.iter().fold(0, |bits, line| bits | line.bit()), "{failed:b}");
}
