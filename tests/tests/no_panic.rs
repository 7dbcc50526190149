//! No panic can be reached from the control loop: the images say so themselves.
//!
//! The images are those of `cargo xtask firmware build`, which `cargo xtask test` runs first.

use std::fs;
use std::path::Path;

use agv_tests::image;
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags};

/// Symbols of what a panic goes through: the functions of `core::panicking`, the panic handler, and what the handler of the
/// image calls, which is nowhere.
fn panics(symbols: &[String]) -> Vec<&str> {
    let parts = ["9panicking", "rust_begin_unwind", "control_loop_can_panic"];
    symbols.iter().map(String::as_str).filter(|symbol| parts.iter().any(|part| symbol.contains(part))).collect()
}

/// All symbols of an image, as they are written there.
fn symbols(path: &Path) -> Vec<String> {
    let bytes = fs::read(path).unwrap();
    let file = object::File::parse(&*bytes).unwrap();
    file.symbols().map(|symbol| symbol.name().unwrap().to_owned()).collect()
}

/// What handles input: if one of these is not in the image, it shows nothing.
const WORK: [&str; 14] = [
    "8timeline",
    "7machine",
    "5falko",
    "12PoseAndSlots",
    "17motion_correction",
    "12start_finder",
    "11relocalizer",
    "13encoder_group",
    "15controller_node",
    "5slcan",
    "7session",
    "6record",
    "6leaves6LEAVES",
    "14authentication4code",
];

#[test]
fn the_control_loop_has_no_panic() {
    let Some(path) = image("the_control_loop_has_no_panic", "an500", "no_panic") else { return };
    let symbols = symbols(&path);
    assert_eq!(panics(&symbols), Vec::<&str>::new());
    for work in WORK {
        assert!(symbols.iter().any(|symbol| symbol.contains(work)), "nothing of {work} is in the image");
    }
}

#[test]
fn a_panic_in_the_control_loop_is_found() {
    let Some(path) = image("a_panic_in_the_control_loop_is_found", "an500", "deliberate_panic") else { return };
    let symbols = symbols(&path);
    let found = panics(&symbols);
    for part in ["9panicking", "rust_begin_unwind", "control_loop_can_panic"] {
        assert!(found.iter().any(|symbol| symbol.contains(part)), "{part} is not among {found:?}");
    }
    // The linker was told to leave it; else it refuses.
    let bytes = fs::read(&path).unwrap();
    let file = object::File::parse(&*bytes).unwrap();
    assert!(file.symbols().any(|symbol| symbol.name() == Ok("control_loop_can_panic") && symbol.is_undefined()));
}

/// What is loaded of an image, without what is there for debuggers.
fn loaded(path: &Path) -> Vec<u8> {
    let bytes = fs::read(path).unwrap();
    let file = object::File::parse(&*bytes).unwrap();
    let is_loaded =
        |flags| matches!(flags, SectionFlags::Elf { sh_flags } if sh_flags & u64::from(object::elf::SHF_ALLOC) != 0);
    let sections = file.sections().filter(|section| is_loaded(section.flags()));
    sections.flat_map(|section| section.data().unwrap().to_vec()).collect()
}

/// A panic says where it was, so the name of its source file is in the image.
fn names(image: &[u8], name: &str) -> bool {
    image.windows(name.len()).any(|window| window == name.as_bytes())
}

/// The same for the sources of a crate; the compiler's own library has a folder of that name too, under `library`.
fn names_of_crate(image: &[u8], sources: &str) -> bool {
    let mut places = image.windows(sources.len()).enumerate().filter(|(_, window)| *window == sources.as_bytes());
    places.any(|(place, _)| !image[..place].ends_with(b"library/"))
}

#[test]
fn no_panic_of_the_vehicle_is_in_what_it_computes() {
    for board in ["an500", "h743", "h723"] {
        let Some(path) = image("no_panic_of_the_vehicle_is_in_what_it_computes", board, "vehicle") else { return };
        let image = loaded(&path);
        for folder in ["controller", "core", "places", "wire"] {
            assert!(!names_of_crate(&image, &format!("{folder}/src/")), "{board}: {folder}");
        }
        for library in ["nalgebra-", "libm-", "postcard-", "/crc-", "sha2-", "hmac-"] {
            assert!(!names(&image, library), "{board}: {library}");
        }
        // So names are found where there are panics.
        for name in ["smoltcp-", "sequential-storage-", "firmware/src/bin/vehicle.rs"] {
            assert!(names(&image, name), "{board}: {name}");
        }
    }
}
