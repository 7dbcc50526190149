//! `cargo xtask seeds`.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

/// Make the seeds of the fuzz targets from recorded telegrams
#[derive(clap::Args)]
pub struct Seeds {}

/// Each telegram as a frame, and as the payload in it.
const TARGETS: [&str; 2] = ["cola_a", "cola_b"];

impl Seeds {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let repository = Path::new(env!("CARGO_MANIFEST_DIR")).parent().context("there is no repository")?;
        let data = match std::env::var_os("AGV_DATA") {
            Some(stated) => PathBuf::from(stated),
            None => repository.join("../shared/data"),
        };
        let mut files = Vec::new();
        for folder in ["nav350", "nav350/other_sick_cola"] {
            let folder = data.join(folder);
            let entries = std::fs::read_dir(&folder).with_context(|| folder.display().to_string())?;
            for entry in entries {
                let path = entry?.path();
                if path.extension().is_some_and(|ending| ending == "hexlines") {
                    files.push(path);
                }
            }
        }
        files.sort();
        let corpus = repository.join("fuzz/corpus");
        for target in TARGETS {
            std::fs::create_dir_all(corpus.join(target))?;
        }
        let mut count = 0;
        for file in files {
            let text = std::fs::read_to_string(&file).with_context(|| file.display().to_string())?;
            for line in text.lines() {
                let Some(frame) = telegram(line) else { continue };
                let (target, payload) = match frame.as_slice() {
                    [2, 2, 2, 2, _, _, _, _, payload @ .., _] => ("cola_b", payload),
                    [2, payload @ .., 3] => ("cola_a", payload),
                    _ => bail!("{}: a line is no telegram", file.display()),
                };
                std::fs::write(corpus.join(target).join(format!("frame{count}")), &frame)?;
                std::fs::write(corpus.join(target).join(format!("payload{count}")), payload)?;
                count += 1;
            }
        }
        println!("telegrams  {count}");
        Ok(())
    }
}

/// The bytes of a line `... DIR HEX ...`.
fn telegram(line: &str) -> Option<Vec<u8>> {
    let mut words = line.split(' ').skip_while(|word| !["C>S", "S>C"].contains(word));
    let digits = words.nth(1)?;
    (0..digits.len()).step_by(2).map(|index| u8::from_str_radix(digits.get(index..index + 2)?, 16).ok()).collect()
}
