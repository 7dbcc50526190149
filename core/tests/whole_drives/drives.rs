//! The drives: each shows a source, a fault or a vehicle.

use agv_core::geometry::{Point, Pose};

use super::vehicle::{Drive, Equipment, Kind, Wrong};

/// A part of a drive.
pub struct Phase {
    pub seconds: f64,
    /// m/s.
    pub speed: f64,
    /// rad/s.
    pub turn: f64,
    pub change: fn(&mut Drive),
}

pub struct Recorded {
    pub name: &'static str,
    pub equipment: Equipment,
    pub seed: u64,
    pub phases: &'static [Phase],
}

const fn go(seconds: f64, speed: f64, turn: f64) -> Phase {
    Phase { seconds, speed, turn, change: |_| () }
}

const fn from(change: fn(&mut Drive), seconds: f64, speed: f64, turn: f64) -> Phase {
    Phase { seconds, speed, turn, change }
}

const fn recorded(name: &'static str, seed: u64, equipment: Equipment, phases: &'static [Phase]) -> Recorded {
    Recorded { name, equipment, seed, phases }
}

/// A drive between the pillars and back to where it began, with a bend each way.
const BENDS: &[Phase] = &[
    go(1.2, 0.0, 0.0),
    go(4.8, 0.9, 0.0),
    go(2.4, 0.7, 0.5),
    go(2.4, 0.7, -0.5),
    go(2.4, -0.8, 0.2),
    go(2.4, -0.8, 0.0),
];

const STANDARD: Equipment = Equipment::STANDARD;

pub const DRIVES: [Recorded; 44] = [
    recorded("tricycle", 1, STANDARD, BENDS),
    recorded("differential", 2, Equipment { kind: Kind::Differential, ..STANDARD }, BENDS),
    recorded("two steered axles", 3, Equipment { kind: Kind::BiSteerable, ..STANDARD }, BENDS),
    recorded("increments", 4, Equipment { kind: Kind::Increments, ..STANDARD }, BENDS),
    recorded(
        "reflectors alone, then dead reckoning",
        5,
        STANDARD,
        &[
            from(|drive| drive.wrong = Wrong::REFLECTORS, 4.8, 0.8, 0.1),
            from(|drive| drive.wrong = Wrong::BLIND, 7.2, 0.8, -0.1),
            from(|drive| drive.wrong = Wrong::REFLECTORS, 3.6, 0.5, -0.4),
        ],
    ),
    recorded(
        "walls alone",
        6,
        STANDARD,
        &[go(2.4, 0.6, 0.0), from(|drive| drive.wrong = Wrong { sees: |_| false, ..Wrong::NOTHING }, 9.6, 0.6, 0.15)],
    ),
    recorded(
        "start not told",
        7,
        Equipment { is_told: false, ..STANDARD },
        &[go(2.4, 0.0, 0.0), go(6.0, 0.7, 0.1), go(2.4, 0.7, -0.4)],
    ),
    recorded(
        "gyro, one wheel slips in a bend",
        8,
        Equipment { gyro: true, kind: Kind::Differential, ..STANDARD },
        &[
            go(3.6, 0.0, 0.0),
            from(|drive| drive.wrong = Wrong::REFLECTORS, 3.6, 0.8, 0.1),
            from(|drive| drive.wrong.scale = 0.1, 2.4, 0.6, 0.4),
            from(|drive| drive.wrong = Wrong::REFLECTORS, 3.6, 0.6, -0.4),
            go(2.4, 0.0, 0.0),
        ],
    ),
    recorded(
        "gyro, blind, its bias jumps",
        9,
        Equipment { gyro: true, ..STANDARD },
        &[
            go(4.8, 0.0, 0.0),
            from(|drive| drive.wrong = Wrong::REFLECTORS, 3.6, 0.8, -0.2),
            from(|drive| drive.wrong = Wrong { gyro: 0.01, ..Wrong::BLIND }, 3.6, 0.8, 0.2),
            go(2.4, 0.0, 0.0),
            from(|drive| drive.wrong = Wrong { gyro: 0.01, ..Wrong::REFLECTORS }, 3.6, 0.7, 0.2),
        ],
    ),
    recorded(
        "gyro freezes",
        10,
        Equipment { gyro: true, kind: Kind::BiSteerable, ..STANDARD },
        &[
            from(|drive| drive.wrong = Wrong::REFLECTORS, 2.4, 0.0, 0.0),
            go(2.4, 0.8, 0.1),
            from(|drive| drive.wrong.is_frozen = true, 3.6, 0.7, 0.3),
            from(|drive| drive.wrong.is_frozen = false, 3.6, 0.7, -0.3),
        ],
    ),
    recorded(
        "laser is pushed aside",
        11,
        STANDARD,
        &[
            from(|drive| drive.wrong = Wrong::REFLECTORS, 3.6, 0.8, 0.1),
            from(|drive| drive.wrong.laser = Pose::new(0.1, 0.1, 0.0), 4.8, 0.8, 0.2),
            go(4.8, 0.6, -0.5),
        ],
    ),
    recorded(
        "laser turned while off",
        12,
        STANDARD,
        &[
            from(|drive| drive.wrong.laser = Pose::new(0.0, 0.0, 0.03), 3.6, 0.0, 0.0),
            go(4.8, 0.7, 0.2),
            go(4.8, 0.6, -0.4),
        ],
    ),
    recorded(
        "late laser",
        13,
        STANDARD,
        &[
            from(|drive| drive.wrong = Wrong { late: 0.06, ..Wrong::REFLECTORS }, 3.6, 0.9, 0.0),
            go(3.6, 0.6, 0.4),
            go(3.6, 0.6, -0.4),
        ],
    ),
    recorded(
        "wheel tells too much",
        14,
        STANDARD,
        &[
            from(|drive| drive.wrong = Wrong { scale: 0.04, ..Wrong::REFLECTORS }, 4.8, 0.9, 0.05),
            go(4.8, -0.9, 0.05),
            from(|drive| drive.wrong = Wrong { scale: 0.04, ..Wrong::BLIND }, 2.4, 0.7, 0.1),
        ],
    ),
    recorded(
        "steering is off",
        15,
        STANDARD,
        &[
            from(|drive| drive.wrong = Wrong { steering: 0.02, ..Wrong::REFLECTORS }, 4.8, 0.8, 0.05),
            go(4.8, -0.8, 0.05),
        ],
    ),
    recorded(
        "slips in bends",
        16,
        STANDARD,
        &[
            from(|drive| drive.wrong = Wrong { drift: 0.15, ..Wrong::REFLECTORS }, 3.6, 0.8, 0.2),
            go(3.6, 0.6, -0.5),
            go(3.6, 0.6, 0.5),
        ],
    ),
    recorded(
        "one reflector moved",
        17,
        STANDARD,
        &[
            from(
                |drive| {
                    let moved = |id, place: Point| if id == 3 { place + Point::new(0.3, 0.0) } else { place };
                    drive.wrong = Wrong { moved, ..Wrong::REFLECTORS };
                },
                4.8,
                0.8,
                0.1,
            ),
            go(4.8, 0.6, -0.3),
        ],
    ),
    recorded(
        "map is stretched",
        18,
        Equipment { stretch: 0.004, ..STANDARD },
        &[go(4.8, 0.8, 0.1), go(4.8, 0.6, -0.3)],
    ),
    recorded(
        "few reflectors",
        19,
        STANDARD,
        &[
            from(|drive| drive.wrong = Wrong { sees: |id| id < 2, ..Wrong::REFLECTORS }, 4.8, 0.8, 0.1),
            from(|drive| drive.wrong.sees = |id| id == 7, 3.6, 0.6, -0.3),
            from(|drive| drive.wrong.sees = |id| id % 3 == 0, 3.6, 0.6, 0.2),
        ],
    ),
    recorded(
        "carried while standing",
        20,
        STANDARD,
        &[
            from(|drive| drive.wrong = Wrong::REFLECTORS, 2.4, 0.7, 0.0),
            go(2.4, 0.0, 0.0),
            from(|drive| drive.truth = Pose::new(2.0, -0.5, 1.2), 2.4, 0.0, 0.0),
            go(6.0, 0.6, 0.2),
        ],
    ),
    recorded(
        "odometry is silent",
        21,
        STANDARD,
        &[
            from(|drive| drive.wrong = Wrong::REFLECTORS, 2.4, 0.7, 0.0),
            from(|drive| drive.wrong.is_silent = true, 0.96, 0.7, 0.0),
            from(|drive| drive.wrong.is_silent = false, 4.8, 0.7, 0.2),
        ],
    ),
    recorded(
        "map while driving",
        22,
        Equipment { landmarks: false, set: |parameters| parameters.maps.slam = true, ..STANDARD },
        &[go(4.8, 0.7, 0.1), go(3.6, 0.6, -0.4), from(|drive| drive.wrong = Wrong::BLIND, 1.2, 0.5, 0.2)],
    ),
    recorded(
        "contours of the walls",
        23,
        Equipment { landmarks: false, contours: true, ..STANDARD },
        &[
            from(|drive| drive.wrong.sees = |_| false, 1.2, 0.0, 0.0),
            go(4.8, 0.8, 0.0),
            go(3.6, 0.6, 0.5),
            go(2.4, -0.6, -0.3),
        ],
    ),
    recorded(
        "told in the past, told wrongly",
        24,
        Equipment { contours: true, ..STANDARD },
        &[
            go(2.4, 0.8, 0.1),
            from(
                |drive| {
                    let (time, truth) = (drive.time().offset(-0.3), drive.truth);
                    drive.tell(time, truth.compose(&Pose::new(-0.24, 0.0, -0.03)), 0.02, 0.01);
                },
                2.4,
                0.8,
                0.1,
            ),
            from(
                |drive| {
                    let (time, truth) = (drive.time(), drive.truth);
                    drive.tell(time, truth.compose(&Pose::new(1.5, 0.6, 0.3)), 0.05, 0.02);
                },
                4.8,
                0.5,
                0.1,
            ),
        ],
    ),
    recorded("car with counters", 25, Equipment { kind: Kind::Car, ..STANDARD }, BENDS),
    recorded("car that tells its speed", 26, Equipment { kind: Kind::Speeds, ..STANDARD }, BENDS),
    recorded(
        "noisy encoders",
        27,
        Equipment {
            kind: Kind::BiSteerable,
            set: |parameters| {
                parameters.odometry_noise.speed = 0.01;
                parameters.odometry_noise.turn = 0.01;
            },
            ..STANDARD
        },
        &[from(|drive| drive.wrong = Wrong::REFLECTORS, 3.6, 0.8, 0.2), go(2.4, 0.7, -0.5), go(1.2, 0.0, 0.0)],
    ),
    recorded(
        "two steered axles, one wheel slips",
        28,
        Equipment { kind: Kind::BiSteerable, ..STANDARD },
        &[
            from(|drive| drive.wrong = Wrong::REFLECTORS, 2.4, 0.8, 0.2),
            from(|drive| drive.wrong.scale = 0.05, 2.4, 0.7, -0.3),
        ],
    ),
    recorded(
        "gyro, blind, one wheel slips",
        29,
        Equipment { gyro: true, kind: Kind::Differential, ..STANDARD },
        &[
            go(3.6, 0.0, 0.0),
            from(|drive| drive.wrong = Wrong::REFLECTORS, 3.6, 0.8, 0.2),
            from(|drive| drive.wrong = Wrong { scale: 0.2, ..Wrong::BLIND }, 2.4, 0.8, 0.0),
            from(|drive| drive.wrong = Wrong::REFLECTORS, 3.6, 0.8, -0.2),
        ],
    ),
    recorded(
        "gyro is mute for a while",
        30,
        Equipment { gyro: true, ..STANDARD },
        &[
            go(2.4, 0.0, 0.0),
            from(|drive| drive.wrong = Wrong::REFLECTORS, 2.4, 0.8, 0.3),
            from(|drive| drive.wrong.is_mute = true, 1.2, 0.7, 0.3),
            from(|drive| drive.wrong.is_mute = false, 2.4, 0.7, -0.3),
        ],
    ),
    recorded(
        "gyro, turned by hand",
        31,
        Equipment { gyro: true, ..STANDARD },
        &[
            go(2.4, 0.0, 0.0),
            from(|drive| drive.wrong = Wrong { spin: 0.2, ..Wrong::BLIND }, 1.2, 0.0, 0.0),
            from(|drive| drive.wrong = Wrong::BLIND, 1.2, 0.0, 0.0),
            from(|drive| drive.wrong = Wrong::REFLECTORS, 3.6, 0.7, 0.1),
        ],
    ),
    recorded(
        "gyro that is late",
        32,
        Equipment {
            gyro: true,
            set: |parameters| {
                parameters.gyro.latency = 0.004;
                parameters.gyro.noise = 3e-4;
            },
            ..STANDARD
        },
        &[
            go(1.2, 0.0, 0.0),
            go(2.4, 0.8, 0.4),
            from(|drive| drive.wrong = Wrong::BLIND, 2.4, 0.8, -0.4),
            go(1.2, 0.0, 0.0),
            from(|drive| drive.wrong = Wrong::REFLECTORS, 2.4, -0.8, 0.4),
        ],
    ),
    recorded(
        "contours, told beside",
        33,
        Equipment { landmarks: false, contours: true, is_told: false, ..STANDARD },
        &[
            from(
                |drive| {
                    drive.wrong.sees = |_| false;
                    let (time, truth) = (drive.time(), drive.truth);
                    drive.tell(time, truth.compose(&Pose::new(0.3, -0.2, 0.08)), 0.2, 0.05);
                },
                2.4,
                0.0,
                0.0,
            ),
            go(3.6, 0.7, 0.1),
            from(
                |drive| {
                    let (time, truth) = (drive.time(), drive.truth);
                    drive.tell(time, truth.compose(&Pose::new(0.4, 0.3, -0.05)), 0.01, 0.003);
                },
                3.6,
                0.6,
                -0.3,
            ),
        ],
    ),
    recorded(
        "contours and a map while driving",
        34,
        Equipment { landmarks: false, contours: true, set: |parameters| parameters.maps.slam = true, ..STANDARD },
        &[go(3.6, 0.7, 0.1), go(2.4, 0.6, -0.4)],
    ),
    recorded(
        "laser is pushed forward, then lost and told again",
        35,
        STANDARD,
        &[
            from(|drive| drive.wrong = Wrong::REFLECTORS, 3.6, 0.8, 0.1),
            from(|drive| drive.wrong.laser = Pose::new(0.05, 0.0, 0.01), 3.6, 0.8, 0.2),
            from(
                |drive| {
                    let (time, truth) = (drive.time(), drive.truth);
                    drive.wrong.laser = Pose::new(0.0, 0.0, 0.0);
                    drive.tell(time, truth, 0.05, 0.02);
                },
                4.8,
                0.6,
                -0.5,
            ),
        ],
    ),
    recorded(
        "laser creeps",
        36,
        STANDARD,
        &[
            from(|drive| drive.wrong = Wrong::REFLECTORS, 3.6, 0.8, 0.1),
            from(|drive| drive.wrong.laser = Pose::new(0.01, 0.02, 0.002), 1.2, 0.8, 0.1),
            from(|drive| drive.wrong.laser = Pose::new(0.02, 0.04, 0.004), 1.2, 0.6, -0.4),
            from(|drive| drive.wrong.laser = Pose::new(0.03, 0.06, 0.006), 1.2, 0.6, -0.4),
            from(|drive| drive.wrong.laser = Pose::new(0.04, 0.08, 0.008), 3.6, 0.6, 0.2),
        ],
    ),
    recorded(
        "scans and few reflectors, turning",
        37,
        STANDARD,
        &[
            from(|drive| drive.wrong.sees = |id| id % 4 == 1, 2.4, 0.4, 0.6),
            go(2.4, 0.4, -0.6),
            from(|drive| drive.wrong = Wrong::BLIND, 1.2, 0.8, 0.0),
            from(|drive| drive.wrong = Wrong::NOTHING, 1.2, -0.4, 0.3),
        ],
    ),
    recorded(
        "round and round, the laser is pushed in between",
        38,
        STANDARD,
        &[
            from(|drive| drive.wrong = Wrong::REFLECTORS, 1.2, 0.0, 0.0),
            go(12.0, 0.8, 0.4),
            from(|drive| drive.wrong.laser = Pose::new(0.0, 0.08, 0.01), 12.0, 0.8, -0.4),
            go(9.6, 0.8, 0.4),
        ],
    ),
    recorded(
        "gyro, map while driving",
        39,
        Equipment { gyro: true, landmarks: false, set: |parameters| parameters.maps.slam = true, ..STANDARD },
        &[
            go(2.4, 0.0, 0.0),
            go(3.6, 0.7, 0.2),
            from(|drive| drive.wrong.gyro = 0.01, 2.4, 0.6, -0.4),
            go(1.2, 0.0, 0.0),
        ],
    ),
    recorded(
        "car, gyro, its scale is learned in turns",
        40,
        Equipment { gyro: true, kind: Kind::Car, set: |parameters| parameters.gyro.scale = 0.02, ..STANDARD },
        &[
            from(|drive| drive.wrong = Wrong::REFLECTORS, 2.4, 0.0, 0.0),
            go(7.2, 0.6, 0.6),
            go(7.2, 0.6, -0.6),
            from(|drive| drive.wrong = Wrong::BLIND, 4.8, 0.6, 0.6),
            from(|drive| drive.wrong = Wrong::REFLECTORS, 2.4, -0.6, 0.0),
        ],
    ),
    recorded(
        "increments, blind, then reflectors on one side",
        41,
        Equipment { kind: Kind::Increments, ..STANDARD },
        &[
            from(|drive| drive.wrong = Wrong::BLIND, 6.0, 0.8, 0.2),
            from(|drive| drive.wrong = Wrong { sees: |id| id < 4, ..Wrong::REFLECTORS }, 4.8, -0.8, 0.2),
            from(|drive| drive.wrong = Wrong { scale: 0.05, ..Wrong::REFLECTORS }, 4.8, 0.7, -0.3),
        ],
    ),
    recorded(
        "two steered axles, map while driving, told anew",
        42,
        Equipment {
            kind: Kind::BiSteerable,
            landmarks: false,
            set: |parameters| parameters.maps.slam = true,
            ..STANDARD
        },
        &[
            go(3.6, 0.7, 0.3),
            from(
                |drive| {
                    let (time, truth) = (drive.time().offset(-0.1), drive.truth);
                    drive.tell(time, truth.compose(&Pose::new(-0.07, 0.01, -0.03)), 0.02, 0.01);
                },
                2.4,
                -0.7,
                0.3,
            ),
            from(|drive| drive.wrong.drift = 0.1, 2.4, 0.6, -0.5),
        ],
    ),
    recorded(
        "half of the reflectors moved alike",
        43,
        STANDARD,
        &[
            from(|drive| drive.wrong = Wrong::REFLECTORS, 3.6, 0.8, 0.1),
            from(
                |drive| {
                    let moved = |id, place: Point| if id % 2 == 0 { place + Point::new(0.06, 0.04) } else { place };
                    drive.wrong.moved = moved;
                },
                6.0,
                0.7,
                0.3,
            ),
            go(4.8, 0.7, -0.4),
        ],
    ),
    recorded(
        "late laser of a vehicle that turns about itself, then one whose clock is put right",
        44,
        Equipment { kind: Kind::Differential, ..STANDARD },
        &[
            from(|drive| drive.wrong = Wrong { late: 0.03, ..Wrong::REFLECTORS }, 3.6, 0.02, 0.5),
            from(|drive| drive.wrong.late = 0.0, 3.6, 0.02, -0.5),
            go(3.6, 0.9, 0.0),
        ],
    ),
];
