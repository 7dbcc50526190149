//! What is being written does no harm to what stands there already.

use std::io::Write;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;

use agv_host_sim::output_file::{self, OutputFile};

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn an_older_file_stays_until_the_new_one_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.log");
    std::fs::write(&path, "old").unwrap();
    let mut file = OutputFile::create(&path).unwrap();
    file.write_all(b"new").unwrap();
    file.flush().unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
    drop(file);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
    assert_eq!(names(folder.path()), ["drive.log"]);
    let mut file = OutputFile::create(&path).unwrap();
    file.write_all(b"new").unwrap();
    file.finish().unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "new");
    assert_eq!(names(folder.path()), ["drive.log"]);
}

#[test]
fn rights_and_links_stay() {
    let folder = tempfile::tempdir().unwrap();
    let (path, link) = (folder.path().join("real"), folder.path().join("link"));
    std::fs::write(&path, "old").unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o640)).unwrap();
    symlink(&path, &link).unwrap();
    output_file::write(&link, "new").unwrap();
    assert!(link.symlink_metadata().unwrap().is_symlink());
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "new");
    assert_eq!(path.metadata().unwrap().permissions().mode() & 0o777, 0o640);
}

#[test]
fn a_device_is_written_as_it_is() {
    output_file::write(Path::new("/dev/null"), "nothing").unwrap();
    let full = output_file::write(Path::new("/dev/full"), "too much").unwrap_err();
    assert_eq!(full.kind(), std::io::ErrorKind::StorageFull);
    assert!(Path::new("/dev/full").exists() && !Path::new("/dev/full").is_file());
}

#[test]
fn where_nothing_can_be_written_it_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("no/such/file");
    let problem = output_file::write(&missing, "").unwrap_err().to_string();
    assert!(problem.contains("no folder") && problem.contains("no/such"), "{problem}");
    assert!(output_file::write(folder.path(), "").is_err());
}

#[test]
fn a_file_that_takes_its_name_early_sets_the_older_one_aside() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.log");
    for (before, aside) in [(None, None), (Some("one"), Some("drive.log.old")), (Some("two"), Some("drive.log.old2"))] {
        if let Some(before) = before {
            std::fs::write(&path, before).unwrap();
        }
        let mut file = OutputFile::create(&path).unwrap();
        let old = file.take_name().unwrap();
        assert_eq!(old, aside.map(|name| folder.path().canonicalize().unwrap().join(name)));
        file.write_all(b"later").unwrap();
        file.sync().unwrap();
        // Whatever happens now, what was written stays.
        drop(file);
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "later");
        if let (Some(old), Some(before)) = (old, before) {
            assert_eq!(std::fs::read_to_string(old).unwrap(), before);
        }
    }
}

#[test]
#[cfg(target_os = "linux")]
fn an_open_file_without_a_name_is_written_where_it_is() {
    use std::io::{Read, Seek, SeekFrom};
    use std::os::fd::AsRawFd;
    let mut open = tempfile::tempfile().unwrap();
    let path = std::path::PathBuf::from(format!("/dev/fd/{}", open.as_raw_fd()));
    output_file::write(&path, "result").unwrap();
    let mut text = String::new();
    open.seek(SeekFrom::Start(0)).unwrap();
    open.read_to_string(&mut text).unwrap();
    assert_eq!(text, "result");
}
