//! Clouds in the files of others: literal bytes, recordings, and bytes that are none.

mod support;

use std::path::PathBuf;

use agv_lidar3d::cloud_file::{CloudFileError, read, ringed};
use support::{points_of_pcd, recordings};

const PCD: &str = "VERSION 0.7\nFIELDS x y z ring\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 3\nHEIGHT 1\n\
    VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3\nDATA ascii\n1 0 0.1 1\n0 2 -0.4 0\nnan nan nan 0\n";
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty double y\nproperty float z\n\
    property uchar intensity\nend_header\n1 2 3 7\n-1 0.5 2 9\n";

fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("agv-cloud-files-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

fn kitti(points: &[[f32; 4]]) -> Vec<u8> {
    points.iter().flatten().flat_map(|value| value.to_le_bytes()).collect()
}

#[test]
fn points_of_texts_and_of_plain_numbers_are_read() {
    let pcd = read(&file("a.pcd", PCD.as_bytes())).unwrap();
    assert_eq!(pcd.len(), 3);
    assert!((pcd[0].position[2] - 0.1).abs() < 1e-6 && !pcd[2].is_seen());
    assert_eq!(pcd[1].ring, Some(0));
    let ply = read(&file("a.ply", PLY.as_bytes())).unwrap();
    assert_eq!((ply[0].position, ply[1].position, ply[1].intensity), ([1.0, 2.0, 3.0], [-1.0, 0.5, 2.0], 9.0));
    let bin = read(&file("a.bin", &kitti(&[[1.0, 2.0, 3.0, 0.5], [4.0, 5.0, 6.0, 0.25]]))).unwrap();
    assert_eq!((bin[1].position, bin[1].intensity, bin[1].ring), ([4.0, 5.0, 6.0], 0.25, None));
}

#[test]
fn rings_are_numbered_from_below_and_columns_look_where_the_points_are() {
    let cloud = ringed(&read(&file("b.pcd", PCD.as_bytes())).unwrap());
    let places: Vec<(u8, u16)> = cloud.points.iter().map(|point| (point.ring, point.azimuth)).collect();
    // To the left is three quarters of a turn clockwise.
    assert_eq!(places, [(1, 0), (0, 27_000)]);
    assert!(cloud.lasers[0].elevation < 0.0 && cloud.lasers[1].elevation > 0.0);
    let cloud = ringed(&read(&file("b.bin", &kitti(&[[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 1.0, 0.0]]))).unwrap());
    assert_eq!((cloud.points[0].ring, cloud.points[1].ring, cloud.lasers.len()), (0, 1, 2));
}

#[test]
fn las_files_are_read() {
    let path = file("a.las", b"");
    let mut writer = las::Writer::from_path(&path, las::Builder::from((1, 2)).into_header().unwrap()).unwrap();
    let point = las::Point { x: 1.5, y: -2.25, z: 0.5, intensity: 300, user_data: 4, ..las::Point::default() };
    writer.write_point(point).unwrap();
    writer.close().unwrap();
    let found = read(&path).unwrap()[0];
    assert!(found.position.iter().zip([1.5, -2.25, 0.5]).all(|(a, b)| (a - b).abs() < 1e-3), "{found:?}");
    assert_eq!((found.intensity, found.ring), (300.0, Some(4)));
}

#[test]
fn clouds_of_other_drivers_are_read() {
    let name = "packets/vlp16/1673400472138016708.pcd";
    let Some(path) = recordings("clouds of other drivers", name) else { return };
    let cloud = read(&path).unwrap();
    let exact = points_of_pcd(&path);
    assert_eq!(cloud.len(), exact.len());
    for (found, exact) in cloud.iter().zip(&exact) {
        assert_eq!(found.position.map(|value| value as f32), *exact);
    }
    let cloud = ringed(&cloud);
    // The lowest laser of the sixteen sees nothing.
    assert_eq!(cloud.lasers.len(), 15);
    for (ring, laser) in cloud.lasers.iter().enumerate() {
        assert!((laser.elevation.to_degrees() - (2.0 * ring as f64 - 13.0)).abs() < 0.01, "{laser:?}");
    }
}

#[test]
fn what_is_no_cloud_is_refused_in_one_line() {
    let missing = read(&PathBuf::from("missing.pcd")).unwrap_err();
    assert!(matches!(missing, CloudFileError::Read { .. }));
    assert!(matches!(read(&file("a.txt", b"1 2 3")).unwrap_err(), CloudFileError::Format { .. }));
    let cut = &PCD.as_bytes()[..PCD.len() - 30];
    for (name, bytes) in [
        ("c.pcd", &b"word"[..]),
        ("d.pcd", cut),
        ("e.pcd", b""),
        ("c.bin", b"seventeen bytes!!"),
        ("d.bin", &[0x7F; 32]),
        ("e.bin", &[0; 32]),
        ("c.ply", b"word"),
        ("c.las", b"word"),
        ("d.ply", PLY.replace("float x", "float u").as_bytes()),
    ] {
        let error = read(&file(name, bytes)).unwrap_err().to_string();
        assert!(!error.contains('\n') && error.len() < 300, "{name}: {error}");
    }
}
