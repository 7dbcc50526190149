//! Puts the memory layout of the chosen board where the linker finds it.

use std::path::PathBuf;
use std::{env, fs};

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    let has = |feature: &str| env::var_os(format!("CARGO_FEATURE_{feature}")).is_some();
    let is_emulated = has("AN500");
    let layout = match (is_emulated, has("H723")) {
        (true, _) => "src/board/an500/memory.x",
        (_, true) => "src/board/h723/memory.x",
        _ => "../memory.x",
    };
    println!("cargo:rerun-if-changed={layout}");
    let folder = PathBuf::from(env::var_os("OUT_DIR").expect("cargo names the folder of outputs"));
    fs::copy(layout, folder.join("memory.x")).expect("the memory layout can be copied");
    if is_emulated {
        // The interrupt vectors are in the program itself.
        fs::write(folder.join("device.x"), "").expect("the folder of outputs can be written");
    }
    println!("cargo:rustc-link-search={}", folder.display());
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rustc-link-arg-bins=--nmagic");
    println!("cargo:rustc-link-arg-bin=vehicle=-Tdefmt.x");
    println!("cargo:rustc-link-arg-bin=latency=-Tdefmt.x");
    println!("cargo:rustc-link-arg-bin=restart=-Tdefmt.x");
    // Its panic handler calls a function that is not there: without this it does not link, which is what it is to show.
    println!("cargo:rustc-link-arg-bin=deliberate_panic=--unresolved-symbols=ignore-all");
}
