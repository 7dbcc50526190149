//! Programs that are packages of Debian.

use std::process::Command;

use super::{debian, succeeds};

/// One program that must be there.
struct Program {
    /// What needs it.
    purpose: &'static str,
    /// A line for the shell that succeeds if it is there, wherever it came from.
    probe: &'static str,
    /// The Debian package that brings it.
    package: &'static str,
}

const EMULATOR: Program =
    Program { purpose: "the firmware in emulation", probe: "command -v qemu-system-arm", package: "qemu-system-arm" };

const PROGRAMS: [Program; 9] = [
    EMULATOR,
    Program {
        purpose: "the tests in a browser, and reports as PDF",
        probe: "command -v chromium || command -v \"$CHROMIUM\"",
        package: "chromium",
    },
    Program { purpose: "what drives the browser of the tests", probe: "command -v node", package: "nodejs" },
    // Node from elsewhere than Debian brings its own, and Debian's would be in conflict with it.
    Program { purpose: "what installs the driver of the browser", probe: "command -v npm", package: "npm" },
    // A kernel with CAN in an ordinary process, for machines whose own kernel has none.
    Program { purpose: "the tests on a real CAN stack", probe: "command -v linux.uml", package: "user-mode-linux" },
    Program { purpose: "the tests on a real CAN stack", probe: "command -v candump", package: "can-utils" },
    Program { purpose: "the tests on a real CAN stack", probe: "command -v insmod", package: "kmod" },
    Program { purpose: "the tests on a real network", probe: "command -v ip", package: "iproute2" },
    Program { purpose: "the tests on a real network", probe: "command -v unshare", package: "util-linux" },
];

impl Program {
    /// Installs it if it is missing. What to do, if it cannot be installed.
    fn prepare(&self) -> Option<String> {
        if self.is_there() {
            return None;
        }
        let why = debian::install(self.package).err();
        (!self.is_there()).then(|| {
            let why = why.unwrap_or_else(|| "it was installed, and is not found".to_owned());
            format!("missing: {}; install the Debian package {}: {why}", self.purpose, self.package)
        })
    }

    fn is_there(&self) -> bool {
        // A program that root runs need not be on the path of this user.
        let path = std::env::var("PATH").unwrap_or_default();
        succeeds(Command::new("sh").args(["-c", self.probe]).env("PATH", format!("{path}:/usr/sbin:/sbin")))
    }
}

/// Installs the programs that are missing. Returns what is still missing, one line each.
pub fn prepare() -> Vec<String> {
    PROGRAMS.iter().filter_map(Program::prepare).collect()
}

/// The same for the emulator alone.
pub fn prepare_emulator() -> Vec<String> {
    EMULATOR.prepare().into_iter().collect()
}
