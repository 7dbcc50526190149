//! What other people's programs in Python make of packets.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::skip;

/// Runs `tests/peers/SCRIPT` with arguments and packets (length as 32 bits, then the bytes) on its standard input, and
/// returns the 32-bit floats that it writes, row by row. None if the module that it needs is not installed.
pub fn peer<const N: usize>(
    test: &str,
    script: (&str, &str),
    arguments: &[&str],
    packets: &[Vec<u8>],
) -> Option<Vec<[f32; N]>> {
    let bytes = peer_bytes(test, script, arguments, packets)?;
    let numbers: Vec<f32> = bytes.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    assert_eq!(numbers.len() % N, 0);
    Some(numbers.as_chunks::<N>().0.to_vec())
}

/// As [`peer`], the bytes themselves.
pub fn peer_bytes(
    test: &str,
    (script, module): (&str, &str),
    arguments: &[&str],
    packets: &[Vec<u8>],
) -> Option<Vec<u8>> {
    let crate_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let own = crate_folder.join("../target/python/bin/python3");
    let program = if own.exists() { own } else { PathBuf::from("python3") };
    let has_module = Command::new(&program).args(["-c", &format!("import {module}")]).output();
    if !has_module.is_ok_and(|run| run.status.success()) {
        skip(test, &format!("python3 with {module} is not there; cargo xtask test installs it"));
        return None;
    }
    let mut run = Command::new(program);
    run.arg(crate_folder.join("tests/peers").join(script)).args(arguments);
    let mut child = run.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut input = child.stdin.take().unwrap();
    let bytes: Vec<u8> =
        packets.iter().flat_map(|packet| [&(packet.len() as u32).to_le_bytes()[..], packet].concat()).collect();
    let writer = std::thread::spawn(move || input.write_all(&bytes));
    let output = child.wait_with_output().unwrap();
    let _ = writer.join();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(output.stdout)
}
