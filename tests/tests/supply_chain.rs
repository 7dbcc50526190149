//! What the project rests on: licences and sources of its dependencies, and every place where its own code is `unsafe`.
//! `cargo xtask audit` looks further, with programs that must be installed.

use agv_tests::skip;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::str::FromStr;

use proc_macro2::{Delimiter, TokenStream, TokenTree};
use serde_json::Value;

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

fn toml(path: &str) -> toml::Table {
    std::fs::read_to_string(repository().join(path)).unwrap().parse().unwrap()
}

const CRATES_IO: &str = "registry+https://github.com/rust-lang/crates.io-index";

/// A dependency comes from crates.io and has a checksum there, or is one of the project's own packages.
fn sources(lock: &toml::Table) -> Vec<String> {
    let mut wrong = Vec::new();
    for package in lock["package"].as_array().unwrap() {
        let name = package["name"].as_str().unwrap();
        let is_own = name.starts_with("agv-") || ["agv", "xtask"].contains(&name);
        let is_right = match package.get("source").and_then(toml::Value::as_str) {
            Some(source) => source == CRATES_IO && package.get("checksum").is_some() && !is_own,
            None => is_own,
        };
        if !is_right {
            wrong.push(name.to_owned());
        }
    }
    wrong
}

#[test]
fn everything_comes_from_crates_io() {
    for path in ["Cargo.lock", "fuzz/Cargo.lock"] {
        if repository().join(path).exists() {
            assert_eq!(sources(&toml(path)), Vec::<String>::new(), "{path}");
        }
    }
    let foreign = "[[package]]\nname = \"evil\"\nversion = \"1.0.0\"\nsource = \"git+https://example.org/evil\"\n";
    assert_eq!(sources(&foreign.parse().unwrap()), ["evil"]);
}

/// Whether `deny.toml` allows a licence as manifests state it.
fn is_allowed(license: &str, allowed: &BTreeSet<String>) -> bool {
    let Ok(expression) = spdx::Expression::parse_mode(license, spdx::ParseMode::LAX) else { return false };
    expression.evaluate(|requirement| allowed.contains(&requirement.to_string()))
}

#[test]
fn licences_are_those_that_are_allowed() {
    const NAME: &str = "licences_are_those_that_are_allowed";
    let deny = toml("deny.toml");
    let names = |list: &toml::Value| -> BTreeSet<String> {
        list.as_array().unwrap().iter().map(|one| one.as_str().unwrap().to_owned()).collect()
    };
    let allowed = names(&deny["licenses"]["allow"]);
    let exceptions = deny["licenses"]["exceptions"].as_array().unwrap().iter();
    let exceptions: BTreeMap<&str, BTreeSet<String>> =
        exceptions.map(|one| (one["crate"].as_str().unwrap(), names(&one["allow"]))).collect();
    assert!(is_allowed("MIT/Apache-2.0", &allowed) && is_allowed("LGPL-2.1-or-later OR MIT", &allowed));
    assert!(!is_allowed("GPL-3.0-only", &allowed) && !is_allowed("MIT AND GPL-3.0-only", &allowed));
    assert!(!is_allowed("MPL-2.0", &allowed) && !is_allowed("", &allowed));
    // Everything that is built for a host or a board; packages of other systems need not be there.
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.args(["metadata", "--offline", "--locked", "--format-version", "1", "--all-features"]);
    for target in ["x86_64-unknown-linux-gnu", "thumbv7em-none-eabihf"] {
        cargo.args(["--filter-platform", target]);
    }
    let output = cargo.current_dir(repository()).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() && said.contains("--offline") {
        return skip(NAME, "a package was not downloaded yet; cargo fetch");
    }
    assert!(output.status.success(), "{said}");
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    let packages = metadata["packages"].as_array().unwrap();
    let mut wrong = Vec::new();
    for package in packages {
        let (name, folder) = (package["name"].as_str().unwrap(), Path::new(package["manifest_path"].as_str().unwrap()));
        let is_right = match (package["license"].as_str(), package["license_file"].as_str()) {
            (Some(license), _) => {
                is_allowed(license, &allowed) || exceptions.get(name).is_some_and(|more| is_allowed(license, more))
            }
            // A manifest may name a file instead.
            (None, Some(file)) => {
                let text = std::fs::read_to_string(folder.with_file_name(file)).unwrap_or_default();
                text.starts_with("MIT License\n") && allowed.contains("MIT")
            }
            (None, None) => false,
        };
        if !is_right {
            wrong.push(format!("{name}: {} {}", package["license"], package["license_file"]));
        }
    }
    assert!(packages.len() > 300, "{}", packages.len());
    assert_eq!(wrong, Vec::<String>::new());
}

/// What is unsafe in a file, by kind.
type Unsafe = BTreeMap<&'static str, usize>;

fn find_unsafe(tokens: TokenStream, found: &mut Unsafe) {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    for (place, token) in tokens.iter().enumerate() {
        match token {
            TokenTree::Group(group) => find_unsafe(group.stream(), found),
            TokenTree::Ident(word) if word == "unsafe" => {
                *found.entry(kind(&tokens[place + 1..])).or_default() += 1;
            }
            TokenTree::Ident(word) if word == "allow" || word == "expect" || word == "warn" => {
                if let Some(TokenTree::Group(group)) = tokens.get(place + 1)
                    && group
                        .stream()
                        .into_iter()
                        .any(|token| matches!(token, TokenTree::Ident(name) if name == "unsafe_code"))
                {
                    *found.entry("permission").or_default() += 1;
                }
            }
            _ => {}
        }
    }
}

/// What the tokens behind `unsafe` make of it.
fn kind(behind: &[TokenTree]) -> &'static str {
    let word = |place: usize, text: &str| matches!(behind.get(place), Some(TokenTree::Ident(word)) if word == text);
    let group = |place: usize, wanted| matches!(behind.get(place), Some(TokenTree::Group(group)) if group.delimiter() == wanted);
    // The name of the foreign language may be left out.
    let place =
        if word(0, "extern") { if matches!(behind.get(1), Some(TokenTree::Literal(_))) { 2 } else { 1 } } else { 0 };
    if word(place, "fn") {
        return if group(place + 1, Delimiter::Parenthesis) { "function type" } else { "function" };
    }
    match () {
        () if place > 0 && group(place, Delimiter::Brace) => "foreign block",
        () if group(0, Delimiter::Brace) => "block",
        () if group(0, Delimiter::Parenthesis) => "attribute",
        () if word(0, "impl") => "implementation",
        () if word(0, "trait") => "trait",
        () => "other",
    }
}

fn count_unsafe(source: &str) -> Unsafe {
    let mut found = Unsafe::new();
    find_unsafe(TokenStream::from_str(source).unwrap(), &mut found);
    found
}

/// As the table says it: `3 blocks, 1 function`.
fn describe(found: &Unsafe) -> String {
    let parts: Vec<String> =
        found.iter().map(|(kind, count)| format!("{count} {kind}{}", if *count > 1 { "s" } else { "" })).collect();
    parts.join(", ")
}

/// All sources of the project, from its top.
fn sources_in(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap()) {
        let (path, name) = (entry.path(), entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            let is_foreign = name == "target" || name.to_string_lossy().starts_with('.');
            if !is_foreign {
                sources_in(&path, found);
            }
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn every_unsafe_is_in_the_table() {
    let mut files = Vec::new();
    sources_in(&repository(), &mut files);
    assert!(files.len() > 300, "{}", files.len());
    let mut found: BTreeMap<String, String> = BTreeMap::new();
    for path in files {
        let name = path.strip_prefix(repository()).unwrap().to_string_lossy().into_owned();
        let counted = count_unsafe(&std::fs::read_to_string(&path).unwrap());
        if !counted.is_empty() {
            assert!(name.starts_with("firmware/src/"), "{name} is unsafe: {}", describe(&counted));
            found.insert(name, describe(&counted));
        }
    }
    // Rows of `| file | what | why |`.
    let page = std::fs::read_to_string(repository().join("docs/src/trust/unsafe.md")).unwrap();
    let mut table: BTreeMap<String, String> = BTreeMap::new();
    for line in page.lines() {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        if let ["", file, what, why, ""] = cells[..]
            && let Some(file) = file.strip_prefix('`').and_then(|file| file.strip_suffix('`'))
        {
            assert!(why.len() > 20, "{file}: why?");
            assert_eq!(table.insert(file.to_owned(), what.to_owned()), None, "{file} is there twice");
        }
    }
    assert_eq!(found, table, "docs/src/trust/unsafe.md does not say what the sources hold");
}

#[test]
fn rooms_without_a_board_forbid_it() {
    for path in [
        "core/src/lib.rs",
        "wire/src/lib.rs",
        "places/src/lib.rs",
        "controller/src/lib.rs",
        "settings/src/lib.rs",
        "lidar3d/src/lib.rs",
    ] {
        let text = std::fs::read_to_string(repository().join(path)).unwrap();
        assert!(text.lines().any(|line| line == "#![forbid(unsafe_code)]"), "{path}");
    }
    // Elsewhere it needs a permission, which is counted.
    let lints = toml("Cargo.toml");
    assert_eq!(lints["workspace"]["lints"]["rust"]["unsafe_code"].as_str(), Some("deny"));
}

#[test]
fn no_kind_of_unsafe_escapes_the_count() {
    let source = r#"
        #![allow(unsafe_code, reason = "of this test")]
        // unsafe { in_a_comment() }
        const TEXT: &str = "unsafe { in_a_string() }";
        #[unsafe(no_mangle)]
        static HANDLERS: [unsafe extern "C" fn(); 1] = [handler];
        unsafe extern "C" { fn handler(); }
        unsafe impl Sync for Cell {}
        unsafe trait Danger {}
        unsafe fn open() { unsafe { handler() } }
        unsafe extern "C" fn foreign() {}
        macro_rules! hidden { () => { unsafe { handler() } } }
        fn main() { call!(unsafe { handler() }); }
    "#;
    let expected = [
        ("attribute", 1),
        ("block", 3),
        ("foreign block", 1),
        ("function", 2),
        ("function type", 1),
        ("implementation", 1),
        ("permission", 1),
        ("trait", 1),
    ];
    assert_eq!(count_unsafe(source), Unsafe::from(expected));
}

/// Packages that may be published: each says where it is documented.
fn published() -> Vec<(PathBuf, String)> {
    let members = toml("Cargo.toml")["workspace"]["members"].as_array().unwrap().clone();
    let members = members.iter().map(|member| repository().join(member.as_str().unwrap()));
    let package = |folder: PathBuf| {
        let package = toml(folder.join("Cargo.toml").to_str().unwrap())["package"].clone();
        let is_published = package.get("publish").is_none();
        is_published.then(|| (folder, package["name"].as_str().unwrap().to_owned()))
    };
    members.filter_map(package).collect()
}

#[test]
fn crates_are_packaged_without_a_warning() {
    let published = published();
    assert!(published.len() >= 9, "{published:?}");
    let folder = tempfile::tempdir().unwrap();
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.args(["package", "--no-verify", "--offline", "--allow-dirty", "--target-dir"]).arg(folder.path());
    for (_, name) in &published {
        cargo.args(["--package", name]);
    }
    let output = cargo.current_dir(repository()).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && !said.contains("warning"), "{said}");
    for (_, name) in &published {
        assert!(folder.path().join(format!("package/{name}-0.1.0.crate")).metadata().unwrap().len() > 1000, "{name}");
    }
}

/// What is packaged reaches for no file outside: it would not be there.
#[test]
fn packages_need_no_file_of_their_neighbours() {
    fn check(folder: &Path, depth: usize) -> usize {
        let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        entries
            .map(|path| {
                if path.is_dir() {
                    return check(&path, depth + 1);
                }
                if path.extension().is_none_or(|ending| ending != "rs") {
                    return 0;
                }
                let source = std::fs::read_to_string(&path).unwrap();
                // A file in `src` reaches the package with one step up, one in a room of it with two.
                let outside = format!("\"{}", "../".repeat(depth + 1));
                let is_reached = source
                    .lines()
                    .any(|line| (line.contains("include_") || line.contains("#[path")) && line.contains(&outside));
                assert!(!is_reached, "{}", path.display());
                1
            })
            .sum()
    }
    for (folder, name) in published() {
        assert!(check(&folder.join("src"), 1) > 5, "{name}");
    }
}
