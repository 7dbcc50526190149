//! Scenarios, and kinds of faults, that come with the program: commands take them by their names, wherever they run.

use std::io;
use std::path::Path;

/// The standard hall: reflectors everywhere.
pub const HALL: &str = include_str!("../../scenarios/warehouse_hall.toml");

/// A drive into the standard block storage.
pub const BLOCK_STORAGE: &str = include_str!("../../scenarios/block_storage_p1.toml");

/// The drive from which a block storage is mapped.
pub const MAPPING: &str = include_str!("../../scenarios/block_storage_mapping.toml");

/// Names and texts.
const ALL: [(&str, &str); 9] = [
    ("block_storage_mapping", MAPPING),
    ("block_storage_p1", BLOCK_STORAGE),
    ("block_storage_p2", include_str!("../../scenarios/block_storage_p2.toml")),
    ("block_storage_p3", include_str!("../../scenarios/block_storage_p3.toml")),
    ("block_storage_p4", include_str!("../../scenarios/block_storage_p4.toml")),
    ("faults", include_str!("../../scenarios/faults.toml")),
    ("people", include_str!("../../scenarios/people.toml")),
    ("trust", include_str!("../../scenarios/trust.toml")),
    ("warehouse_hall", HALL),
];

/// The text of a file; where there is none of that name, the text that comes with the program under that name, with or without
/// `.toml`.
///
/// # Errors
/// There is neither, or the file cannot be read.
pub fn read_to_string(path: &Path) -> io::Result<String> {
    let problem = match std::fs::read_to_string(path) {
        Err(problem) if problem.kind() == io::ErrorKind::NotFound => problem,
        outcome => return outcome,
    };
    by_name(path).map(str::to_owned).ok_or_else(|| {
        let names = ALL.map(|(name, _)| name).join(", ");
        io::Error::new(problem.kind(), format!("there is no such file; with the program come {names}"))
    })
}

fn by_name(path: &Path) -> Option<&'static str> {
    let name = path.to_str()?;
    let name = name.strip_suffix(".toml").unwrap_or(name);
    ALL.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{ALL, read_to_string};

    #[test]
    fn every_file_of_the_folder_comes_with_the_program() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
        let mut names: Vec<String> = std::fs::read_dir(&folder)
            .unwrap()
            .map(|entry| entry.unwrap().path().file_stem().unwrap().to_str().unwrap().to_owned())
            .collect();
        names.sort_unstable();
        assert_eq!(names, ALL.map(|(name, _)| name));
        for (name, text) in ALL {
            assert_eq!(std::fs::read_to_string(folder.join(name).with_extension("toml")).unwrap(), text);
        }
    }

    #[test]
    fn a_file_comes_before_a_name_and_a_folder_is_no_name() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("people");
        assert_eq!(read_to_string(&file).unwrap_err().kind(), std::io::ErrorKind::NotFound);
        crate::output_file::write(&file, "seed = 3").unwrap();
        assert_eq!(read_to_string(&file).unwrap(), "seed = 3");
        assert!(read_to_string(Path::new("people")).unwrap().contains("people"));
        assert!(read_to_string(Path::new("faults.toml")).unwrap().contains("[[fault]]"));
        let problem = read_to_string(Path::new("wherehouse_hall")).unwrap_err();
        assert!(problem.to_string().contains("trust, warehouse_hall"), "{problem}");
    }
}
