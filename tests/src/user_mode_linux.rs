//! User-mode-linux: a kernel in an ordinary process, with CAN and a bad network, for machines whose own kernel has none.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};

use seccompiler::{
    BpfProgram, SeccompAction, SeccompCmpArgLen as Length, SeccompCmpOp as Compare, SeccompCondition, SeccompFilter,
    SeccompRule, TargetArch, apply_filter,
};

use crate::is_on_path;

/// The Debian packages that bring what is needed.
pub const PACKAGES: &str = "user-mode-linux and kmod";

/// Whether it is installed.
#[must_use]
pub fn is_there() -> bool {
    ["linux.uml", "insmod"].into_iter().all(is_on_path)
}

/// A kernel to boot.
#[derive(Clone, Copy, Debug)]
pub struct Kernel<'a> {
    /// Memory, MiB.
    pub memory: u32,
    /// Its modules, in order.
    pub modules: &'a [&'a str],
    /// After which time it is ended, s.
    pub patience: u32,
    /// A further argument of the kernel.
    pub argument: Option<&'a str>,
}

impl Kernel<'_> {
    /// Boots it, with the files of this machine, and runs `lines` of a shell in it. Returns what the kernel said. The
    /// script is written to `folder`.
    ///
    /// # Panics
    /// If it cannot be started.
    #[must_use]
    pub fn run(&self, folder: &Path, lines: &str) -> String {
        let said = self.boot(folder, lines, Registers::All);
        // Before its first program, so nothing of the lines was run.
        if said.contains(CANNOT_WRITE_BACK) { self.boot(folder, lines, Registers::Narrow) } else { said }
    }

    fn boot(&self, folder: &Path, lines: &str, registers: Registers) -> String {
        let script = folder.join("init");
        let modules = self.modules.join(" ");
        let text = format!(
            "#!/bin/sh\n\
             export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin\n\
             mount -t proc proc /proc\n\
             mount -t sysfs sys /sys\n\
             mount -t devtmpfs dev /dev 2>/dev/null\n\
             for name in {modules}; do\n\
               insmod \"$(find /usr/lib/uml/modules -name $name.ko | head -n 1)\"\n\
             done\n\
             {lines}\n\
             sync\n\
             echo o > /proc/sysrq-trigger\n\
             sleep 10\n"
        );
        std::fs::write(&script, text).unwrap();
        assert!(Command::new("chmod").arg("+x").arg(&script).status().unwrap().success());
        let mut kernel = Command::new("timeout");
        kernel
            .args(["--kill-after=5", &self.patience.to_string(), "linux.uml"])
            .arg(format!("mem={}M", self.memory))
            .args(["rootfstype=hostfs", "rootflags=/", "rw", "quiet", "noreboot", "con=null", "con0=null,fd:1"])
            .arg(format!("init={}", script.display()))
            .args(self.argument)
            .stdin(Stdio::null());
        if registers == Registers::Narrow {
            // What the kernel does not know becomes the environment of its first program.
            kernel.arg(format!("GLIBC_TUNABLES={WITHOUT_WIDE}"));
        }
        // The filter is that of a thread, and of what this thread starts.
        let run = std::thread::spawn(move || {
            if registers == Registers::Narrow {
                hide_wide_registers();
            }
            kernel.output().unwrap()
        });
        String::from_utf8_lossy(&run.join().unwrap().stdout).into_owned()
    }
}

/// Which registers of its programs the kernel saves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Registers {
    All,
    /// Those of SSE.
    Narrow,
}

/// What the kernel says on a processor with more registers than it has room for, such as tiles of matrices.
const CANNOT_WRITE_BACK: &str = "ptrace set fp regs failed";

/// Keeps the C library from AVX, whose registers the kernel then does not save.
const WITHOUT_WIDE: &str =
    "glibc.cpu.hwcaps=-AVX,-AVX2,-AVX_Fast_Unaligned_Load,-AVX512F,-AVX512VL,-AVX512BW,-XSAVE,-XSAVEC";

/// Requests of `ptrace` for a set of registers, and the set that has all of them.
const GET_SET: u64 = 0x4204;
const SET_SET: u64 = 0x4205;
const EXTENDED_STATE: u64 = 0x202;
const NO_DEVICE: u32 = 19;
/// The number of `ptrace`.
const PTRACE: i64 = 101;

/// Lets the kernel that this thread starts find no extended state, so that it saves the registers of SSE.
fn hide_wide_registers() {
    let is = |argument, value| SeccompCondition::new(argument, Length::Qword, Compare::Eq, value).unwrap();
    let rule = |request| SeccompRule::new(vec![is(0, request), is(2, EXTENDED_STATE)]).unwrap();
    let rules = BTreeMap::from([(PTRACE, vec![rule(GET_SET), rule(SET_SET)])]);
    let filter =
        SeccompFilter::new(rules, SeccompAction::Allow, SeccompAction::Errno(NO_DEVICE), TargetArch::x86_64).unwrap();
    let filter: BpfProgram = filter.try_into().unwrap();
    apply_filter(&filter).unwrap();
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Also where the processor has no more registers than the kernel can save.
    #[test]
    fn programs_run_with_narrow_registers() {
        if !is_there() {
            return crate::skip("programs_run_with_narrow_registers", &format!("there are no {PACKAGES}"));
        }
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join("output");
        let lines =
            format!("env printf '%s %s' --narrow \"$(seq 1 2000 | sort | tail -n 1)\" > '{}'", output.display());
        let kernel = Kernel { memory: 128, modules: &[], patience: 60, argument: None };
        let said = kernel.boot(folder.path(), &lines, Registers::Narrow);
        assert_eq!(std::fs::read_to_string(&output).unwrap_or_default(), "--narrow 999", "{said}");
    }
}
