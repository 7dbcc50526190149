//! Every command that README and the book show, as they show it.
//!
//! A block of commands is marked behind its fence: `sh run` is run, all blocks of a file one after the other in one empty
//! folder; `sh run data` too, where the recordings of others are; `sh skip: REASON` is not run, but its commands are held
//! against the help.

use agv_host_sim::data;
use agv_tests::recordings;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::ctl;
use crate::nav350::commands::Server;
use crate::support::{agv, text};

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

/// README and the chapters of the book.
fn files() -> Vec<PathBuf> {
    let mut files = vec![repository().join("README.md")];
    let chapters = std::fs::read_dir(repository().join("docs/src")).unwrap().map(|entry| entry.unwrap().path());
    files.extend(chapters.filter(|path| path.extension().is_some_and(|ending| ending == "md")));
    files.sort();
    files
}

/// A block of commands.
struct Block {
    /// Line of its fence, from 1.
    line: usize,
    mark: String,
    commands: String,
}

fn blocks(path: &Path) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let mut is_open = false;
    for (line, number) in std::fs::read_to_string(path).unwrap().lines().zip(1..) {
        if let Some(mark) = line.strip_prefix("```") {
            if !is_open {
                blocks.push(Block { line: number, mark: mark.to_owned(), commands: String::new() });
            }
            is_open = !is_open;
        } else if is_open {
            let block = blocks.last_mut().unwrap();
            block.commands.push_str(line);
            block.commands.push('\n');
        }
    }
    assert!(!is_open, "{}: a block has no end", path.display());
    blocks
}

fn run(script: &str, folder: &Path) -> std::process::Output {
    let programs = Path::new(env!("CARGO_BIN_EXE_agv")).parent().unwrap().to_owned();
    let inherited = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths(std::iter::once(programs).chain(std::env::split_paths(&inherited))).unwrap();
    let mut bash = Command::new("bash");
    bash.args(["-euo", "pipefail", "-c", script]).current_dir(folder).env("PATH", path);
    if let Some(data) = data::folder() {
        bash.env("AGV_DATA", data.canonicalize().unwrap());
    }
    bash.output().unwrap()
}

/// Runs what a file shows; gives the number of commands.
fn run_file(path: &Path) -> usize {
    let folder = tempfile::tempdir().unwrap();
    let mut count = 0;
    for Block { line, mark, commands } in blocks(path) {
        let place = format!("{}:{line}", path.display());
        if mark == "sh run data" && recordings(&place, "").is_none() {
            continue;
        }
        if !mark.starts_with("sh run") {
            continue;
        }
        // Each command on its own, so that a complaint says which.
        for command in commands.lines().filter(|command| !command.trim().is_empty()) {
            let output = run(command, folder.path());
            assert!(output.status.success(), "{place}: {command}\n{}", text(&output.stderr));
            count += 1;
        }
    }
    count
}

#[test]
fn what_is_shown_works() {
    let count: usize = std::thread::scope(|scope| {
        let files: Vec<_> = files().into_iter().map(|path| scope.spawn(move || run_file(&path))).collect();
        files.into_iter().map(|file| file.join().expect("the command above")).sum()
    });
    assert!(count > 40, "{count}");
}

#[test]
fn every_block_says_whether_it_is_run() {
    for path in files() {
        for Block { line, mark, commands } in blocks(&path) {
            let place = format!("{}:{line}", path.display());
            let reason = mark.strip_prefix("sh skip: ").map(str::trim);
            let is_marked = ["sh run", "sh run data", "text"].contains(&mark.as_str())
                || reason.is_some_and(|reason| !reason.is_empty());
            assert!(is_marked, "{place}: the block is marked '{mark}'");
            let has_commands = commands.lines().any(|line| line.starts_with("agv") || line.starts_with("cargo"));
            assert!(mark != "text" || !has_commands, "{place}: commands are marked as text");
        }
    }
}

/// The words of a command of `agv` up to a pipe or a remark; None if it is another command.
fn words(command: &str) -> Option<Vec<&str>> {
    let words: Vec<&str> = command.split_whitespace().collect();
    let end = words.iter().position(|word| ["|", "#", "&&", ">", "<"].contains(word)).unwrap_or(words.len());
    (words.first() == Some(&"agv")).then(|| words[1..end].to_vec())
}

#[test]
fn what_is_not_run_is_at_least_known() {
    let mut count = 0;
    for path in files() {
        for Block { line, mark, commands } in
            blocks(&path).into_iter().filter(|block| block.mark.starts_with("sh skip"))
        {
            for words in commands.lines().filter_map(words) {
                let place = format!("{}:{line} ({mark}): {words:?}", path.display());
                // Commands within commands stand before anything else, or behind a host.
                let names: Vec<&str> = words.iter().copied().take_while(|word| !word.starts_with('-')).collect();
                let help = (1..=names.len())
                    .rev()
                    .map(|depth| agv(&[&names[..depth], &["--help"]].concat()))
                    .find(|output| output.status.success());
                let help = help.unwrap_or_else(|| panic!("{place}: there is no such command"));
                let command = agv(&[names[0], "--help"]);
                let known = format!("{}{}", text(&help.stdout), text(&command.stdout));
                assert!(known.contains("Usage: agv "), "{place}");
                for option in words.iter().filter(|word| word.starts_with("--") && word.len() > 2) {
                    assert!(known.contains(option.split('=').next().unwrap()), "{place}: no {option}");
                }
                count += 1;
            }
        }
    }
    assert!(count > 10, "{count}");
}

#[test]
fn the_book_is_whole() {
    let folder = repository().join("docs/src");
    let summary = std::fs::read_to_string(folder.join("SUMMARY.md")).unwrap();
    for path in files().iter().skip_while(|path| path.ends_with("README.md")) {
        let name = path.file_name().unwrap().to_str().unwrap();
        let is_listed = ["SUMMARY.md", "README.md"].contains(&name) || summary.contains(&format!("({name})"));
        assert!(is_listed, "{name} is in no list of chapters");
    }
    // Links within the book lead somewhere.
    for path in files() {
        let content = std::fs::read_to_string(&path).unwrap();
        let targets = content.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        for target in targets.filter(|target| !target.contains("://") && !target.starts_with('#')) {
            assert!(path.parent().unwrap().join(target).exists(), "{}: {target}", path.display());
        }
    }
}

/// What stands between back quotes in the lines of a page's tables, and begins with the command.
fn remedies(page: &str) -> Vec<String> {
    let rows = page.lines().filter(|line| line.starts_with('|'));
    let quoted = rows.flat_map(|line| line.split('`').skip(1).step_by(2));
    let mut remedies: Vec<String> = quoted.filter(|words| words.starts_with("agv ")).map(str::to_owned).collect();
    remedies.sort();
    remedies.dedup();
    remedies
}

#[test]
fn each_remedy_for_a_symptom_runs() {
    let page = std::fs::read_to_string(repository().join("docs/src/troubleshooting.md")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let succeed = |command: &str| {
        let output = run(command, folder.path());
        assert!(output.status.success(), "{command}: {}", text(&output.stderr));
    };
    succeed("agv calibrate plan --area 14x11 --steering 18..50 --time 300 --scenario plan.toml");
    succeed("agv simulate plan.toml --output drive.agvlog");
    // Noise is found on a day's drive of a vehicle that is calibrated.
    succeed("agv simulate warehouse_hall --output hall.agvlog");
    let sensor = Server::start(&[]);
    let remedies = remedies(&page);
    assert!(remedies.len() >= 4, "{remedies:?}");
    for remedy in &remedies {
        if remedy.contains(" --put-right ") {
            // The clock of this drive is right, and the command says so; one that is off is mended in the tests of the calibration.
            let output = run(&remedy.replace("LOG", "drive.agvlog"), folder.path());
            assert!(!output.status.success() && text(&output.stderr).contains("times are not off"), "{output:?}");
            continue;
        }
        let log = if remedy.contains(" noise ") { "hall.agvlog" } else { "drive.agvlog" };
        succeed(&remedy.replace("LOG", log).replace("HOST", &sensor.host));
    }
    // What needs a controller runs against one that is emulated, with the file that the calibration has left.
    std::fs::write(folder.path().join("agv.key"), ctl::KEY).unwrap();
    succeed("agv provision --key agv.key --output flash.bin");
    let controller = ctl::Emulated::of(folder.path().join("flash.bin").to_str().unwrap());
    let commands = page.lines().filter(|line| line.starts_with("agv ctl "));
    let count = commands.map(|command| succeed(&command.replace("192.168.1.20", &controller.host))).count();
    assert_eq!(count, 2);
    succeed(&format!("agv ctl {} apply vehicle.toml --dry-run | grep 'nothing differs'", controller.host));
}
