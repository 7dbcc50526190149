//! What is packed, from the program that the tests have built.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use agv_tests::{agv, image, is_on_path, skip};

use super::{Parts, pack};

/// The command as the tests are built with it. None, and a word about it, if it or a program that packs is not there.
fn built(test: &str) -> Option<PathBuf> {
    let missing = ["dpkg", "dpkg-deb", "strip", "objdump"].into_iter().find(|name| !is_on_path(name));
    if let Some(name) = missing {
        skip(test, &format!("there is no {name}"));
        return None;
    }
    agv(test)
}

fn said(command: &mut Command) -> String {
    let Output { status, stdout, stderr } = command.output().unwrap();
    assert!(status.success(), "{command:?}: {}", String::from_utf8_lossy(&stderr));
    String::from_utf8(stdout).unwrap()
}

/// What every archive holds.
const FILES: [&str; 17] = [
    "bin/agv",
    "lib/systemd/system/agv.service",
    "lib/sysusers.d/agv.conf",
    "share/agv/agv.dbc",
    "share/agv/agv.eds",
    "share/agv/vehicle.toml",
    "share/bash-completion/completions/agv",
    "share/doc/agv/CHANGELOG.md",
    "share/doc/agv/LICENSE-APACHE",
    "share/doc/agv/LICENSE-MIT",
    "share/doc/agv/LICENSES-OF-OTHERS",
    "share/doc/agv/book/index.html",
    "share/doc/agv/book/troubleshooting.html",
    "share/fish/vendor_completions.d/agv.fish",
    "share/man/man1/agv.1",
    "share/man/man1/agv-replay.1",
    "share/zsh/vendor-completions/_agv",
];

/// Beside that, with images.
const FIRMWARE: [&str; 4] = ["an500/vehicle.elf", "an500/memory.x", "h743/vehicle.elf", "h743/memory.x"];

#[test]
fn the_same_parts_make_the_same_bytes_and_they_install() {
    const TEST: &str = "the_same_parts_make_the_same_bytes_and_they_install";
    let Some(agv) = built(TEST) else { return };
    let has_firmware = ["an500", "h743"].into_iter().all(|board| image(TEST, board, "vehicle").is_some());
    let parts = Parts { agv, has_firmware, texts: "licences of others\n".to_owned() };
    let folder = tempfile::tempdir().unwrap();
    let folders = ["first", "second"].map(|name| folder.path().join(name));
    let packed = folders.each_ref().map(|folder| pack(folder, &parts, "1700000000").unwrap());
    for (first, second) in packed[0].iter().zip(&packed[1]) {
        assert!(std::fs::read(first).unwrap() == std::fs::read(second).unwrap(), "{}", first.display());
    }
    let sums = said(Command::new("sha256sum").args(["--check", "--strict", "SHA256SUMS"]).current_dir(&folders[0]));
    assert_eq!(sums.lines().count(), 2, "{sums}");
    let [archive, package] = &packed[0];
    let unpacked = folder.path().join("unpacked");
    std::fs::create_dir(&unpacked).unwrap();
    said(Command::new("tar").arg("--extract").arg("--file").arg(archive).arg("--directory").arg(&unpacked));
    check_tree(&unpacked.join("agv-0.1.0"), has_firmware);
    check_package(package, &unpacked.join("agv-0.1.0"));
    install(TEST, package, &folder.path().join("root"));
}

/// The tree holds what it should, whole.
fn check_tree(root: &Path, has_firmware: bool) {
    let firmware = FIRMWARE.iter().map(|name| format!("share/agv/firmware/{name}")).filter(|_| has_firmware);
    for name in FILES.iter().map(|name| (*name).to_owned()).chain(firmware) {
        assert!(root.join(&name).metadata().unwrap().len() > 10, "{name}");
    }
    let sums = said(Command::new("sha256sum").args(["--check", "--strict", "SHA256SUMS"]).current_dir(root));
    let summed = sums.lines().count();
    let all = said(Command::new("find").arg(".").args(["-type", "f"]).current_dir(root)).lines().count();
    assert_eq!(summed + 1, all);
    // Nothing of this machine is in it.
    let modes = said(Command::new("find").arg(".").args(["-printf", "%m %y\n"]).current_dir(root));
    let modes: BTreeSet<&str> = modes.lines().collect();
    assert!(modes.is_subset(&BTreeSet::from(["755 d", "755 f", "644 f"])), "{modes:?}");
    check_links(&root.join("share/doc/agv/book"));
    let page = std::fs::read_to_string(root.join("share/man/man1/agv.1")).unwrap();
    assert!(page.contains(".TH agv 1"), "{page}");
    assert!(said(Command::new(root.join("bin/agv")).arg("--version")).starts_with("agv 0.1.0"));
}

/// Every page of the book leads to what is there.
fn check_links(book: &Path) {
    let mut count = 0;
    for entry in std::fs::read_dir(book).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|ending| ending != "html") {
            continue;
        }
        let page = std::fs::read_to_string(&path).unwrap();
        let targets = ["href=\"", "src=\""].into_iter().flat_map(|word| page.split(word).skip(1));
        let targets = targets.map(|rest| rest.split(['"', '#']).next().unwrap());
        for target in targets.filter(|target| !target.is_empty() && !target.contains("://")) {
            assert!(book.join(target).exists(), "{}: {target}", path.display());
            count += 1;
        }
    }
    assert!(count > 100, "{count}");
    // The first page begins with the archive.
    let first = std::fs::read_to_string(book.join("index.html")).unwrap();
    let begin = first.split("<main>").nth(1).unwrap().chars().take(400).collect::<String>();
    assert!(begin.contains("archive"), "{begin}");
}

/// The package says what it is and needs, and holds what the archive does.
fn check_package(package: &Path, root: &Path) {
    let fields = said(Command::new("dpkg-deb").arg("--info").arg(package));
    for field in ["Package: agv", "Version: 0.1.0", "Depends: libc6 (>= 2.", "Description: "] {
        assert!(fields.contains(field), "{field}: {fields}");
    }
    let contents = said(Command::new("dpkg-deb").arg("--contents").arg(package));
    let listed = |line: &str| {
        Some(line.split_once(" ./usr/")?.1.to_owned()).filter(|name| !name.ends_with('/') && !name.is_empty())
    };
    let listed: BTreeSet<String> = contents.lines().filter_map(listed).collect();
    let files = said(Command::new("find").arg(".").args(["-type", "f", "-printf", "%P\n"]).current_dir(root));
    let packed = |name: &str| if name.starts_with("share/man/") { format!("{name}.gz") } else { name.to_owned() };
    let mut expected: BTreeSet<String> = files.lines().map(packed).collect();
    expected.insert("share/lintian/overrides/agv".to_owned());
    expected.remove("SHA256SUMS");
    expected.extend(["copyright", "changelog.gz"].map(|name| format!("share/doc/agv/{name}")));
    assert_eq!(listed, expected);
    assert!(contents.lines().all(|line| line.contains(" root/root ")), "{contents}");
    // What the program loads is in the packages that this one depends on.
    let loaded = said(Command::new("objdump").arg("--private-headers").arg(root.join("bin/agv")));
    let needed = loaded.lines().filter_map(|line| line.trim().strip_prefix("NEEDED"));
    for library in needed.map(str::trim) {
        let of = ["libc.so.6", "libm.so.6", "libgcc_s.so.1", "ld-linux-x86-64.so.2", "ld-linux-aarch64.so.1"];
        assert!(of.contains(&library), "{library}");
    }
}

/// It installs into a root that has nothing but the libraries, and runs there.
fn install(test: &str, package: &Path, root: &Path) {
    let state = root.join("var/lib/dpkg");
    for name in ["var/lib/dpkg/info", "var/lib/dpkg/updates", "etc"] {
        std::fs::create_dir_all(root.join(name)).unwrap();
    }
    for file in ["passwd", "group", "shadow", "gshadow"] {
        std::fs::write(root.join("etc").join(file), "").unwrap();
    }
    std::fs::write(state.join("status"), "").unwrap();
    let dpkg = || {
        let mut dpkg = Command::new("dpkg");
        // The libraries are put there below, without their packages; there is no shell, so that scripts run outside.
        dpkg.arg("--root").arg(root).args(["--force-not-root", "--force-depends", "--force-bad-path"]);
        dpkg.args(["--force-script-chrootless", "--log=/dev/null"]);
        dpkg
    };
    said(dpkg().arg("--install").arg(package));
    let user = std::fs::read_to_string(root.join("etc/passwd")).unwrap();
    assert!(user.starts_with("agv:") && user.contains(":/var/lib/agv:"), "{user}");
    let agv = root.join("usr/bin/agv");
    for line in said(Command::new("ldd").arg(&agv)).lines() {
        let Some(library) = line.split_whitespace().find(|word| word.starts_with('/')) else { continue };
        let place = root.join(library.trim_start_matches('/'));
        std::fs::create_dir_all(place.parent().unwrap()).unwrap();
        std::fs::copy(library, place).unwrap();
    }
    // The scenario is the program's own: nothing of the repository is there.
    for (arguments, said) in
        [(["settings", "vehicle.wheelbase"], "vehicle.wheelbase"), (["simulate", "warehouse_hall"], "[reflectors]")]
    {
        let show = (arguments[0] == "simulate").then_some("--show");
        let inside = Command::new("chroot").arg(root).arg("/usr/bin/agv").args(arguments).args(show).output();
        match inside {
            Ok(run) if run.status.success() => {
                let told = String::from_utf8(run.stdout).unwrap();
                assert!(told.contains(said), "{arguments:?}: {told}");
            }
            Ok(run) if String::from_utf8_lossy(&run.stderr).contains("not permitted") => {
                skip(test, "only root may try the package in a root of its own");
            }
            other => panic!("{arguments:?}: {other:?}"),
        }
    }
    // The store stays with the package's configuration, and goes with it.
    let store = root.join("var/lib/agv/flash.bin");
    std::fs::create_dir_all(store.parent().unwrap()).unwrap();
    std::fs::write(&store, "").unwrap();
    said(dpkg().args(["--remove", "agv"]));
    assert!(store.exists() && !root.join("usr/bin/agv").exists());
    said(dpkg().args(["--purge", "agv"]));
    assert!(!store.exists());
}
