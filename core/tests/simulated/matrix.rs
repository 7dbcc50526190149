//! The matrix of drives: every kind of vehicle, with and without a gyro, at every rate and tick, in every way of driving, with times that
//! jitter, silences of the odometry, and errors of one deviation.
//!
//! Each kind drives in each way at one rate here, and at all rates with `AGV_LONG=1`; what else there is, is drawn. `AGV_MATRIX=FILE` writes the
//! table.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use agv_core::geometry::Pose;
use agv_core::integrity::separation::AssumedDeviations;
use agv_core::odometry::OdometryNoise;

use super::kind::Kind;
use super::run::{Course, course};
use super::simulator::{Drive, Errors, Motion, Outage, ramp, ring};
use crate::support::walls::Noise;

const RATES: [f64; 6] = [20.0, 50.0, 100.0, 250.0, 500.0, 1000.0];
const TICKS: [f64; 3] = [5e-5, 1e-3, 6e-3];
const SILENCES: [f64; 4] = [0.0, 0.1, 0.3, 1.0];
/// When it drives off, s.
const OFF: f64 = 6.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Way {
    Straight,
    Bend,
    Circle18,
    Circle40,
    Circle80,
    Spot,
    Sideways,
    Reversing,
    StopAndGo,
    Standing,
}

impl Way {
    const ALL: [Self; 10] = [
        Self::Straight,
        Self::Bend,
        Self::Circle18,
        Self::Circle40,
        Self::Circle80,
        Self::Spot,
        Self::Sideways,
        Self::Reversing,
        Self::StopAndGo,
        Self::Standing,
    ];

    fn is_driven_by(self, kind: Kind) -> bool {
        match self {
            Self::Spot => kind.turns_on_the_spot(),
            Self::Sideways => kind.moves_sideways(),
            _ => true,
        }
    }

    fn motion(self) -> Motion {
        let circle = |radius: f64| -> Motion {
            Box::new(move |time| {
                let speed = 0.8 * ramp(time, OFF, 1.5);
                (speed, 0.0, speed / radius)
            })
        };
        match self {
            Self::Straight => Box::new(|time| (0.8 * ramp(time, OFF, 1.5), 0.0, 0.0)),
            Self::Bend => Box::new(|time| (0.8 * ramp(time, OFF, 1.5), 0.0, 0.4 * ramp(time, OFF + 4.0, 0.5))),
            Self::Circle18 => circle(1.8),
            Self::Circle40 => circle(4.0),
            Self::Circle80 => circle(8.0),
            Self::Spot => Box::new(|time| (0.0, 0.0, 0.5 * ramp(time, OFF, 1.0))),
            Self::Sideways => Box::new(|time| {
                let speed = 0.6 * ramp(time, OFF, 1.0);
                if time < OFF + 5.0 { (speed, 0.0, 0.0) } else { (0.0, speed, 0.0) }
            }),
            Self::Reversing => Box::new(|time| (-0.8 * ramp(time, OFF, 1.5), 0.0, 0.1 * ramp(time, OFF, 1.5))),
            Self::StopAndGo => Box::new(|time| {
                let phase = (time - OFF).max(0.0) % 4.0;
                (0.8 * (ramp(phase, 0.0, 1.0) - ramp(phase, 2.0, 1.0)), 0.0, 0.0)
            }),
            Self::Standing => Box::new(|_| (0.0, 0.0, 0.0)),
        }
    }
}

/// One drive of the matrix.
#[derive(Clone, Copy, Debug)]
struct Cell {
    kind: Kind,
    way: Way,
    rate: f64,
    tick: f64,
    gyro: bool,
    jitters: bool,
    silence: f64,
    errs: bool,
    seed: u64,
}

fn sign(noise: &mut Noise) -> f64 {
    if noise.uniform() < 0.5 { -1.0 } else { 1.0 }
}

impl Cell {
    /// What is not given is drawn by the seed.
    fn drawn(kind: Kind, way: Way, rate: f64, seed: u64) -> Self {
        let mut noise = Noise(0x51af_d7ed_558c_cd00 ^ seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        (0..16).for_each(|_| _ = noise.uniform());
        let mut one_of = |count: usize| (noise.uniform() * count as f64) as usize;
        Self {
            kind,
            way,
            rate,
            tick: TICKS[one_of(TICKS.len())],
            gyro: one_of(2) == 1,
            jitters: one_of(2) == 1,
            silence: SILENCES[one_of(SILENCES.len())],
            errs: one_of(2) == 1,
            seed,
        }
    }

    /// One deviation of each error, to a side that is drawn; the slip and the walk that are stated.
    fn errors(&self) -> Errors {
        if !self.errs {
            return Errors::SMALL;
        }
        let AssumedDeviations { mounting, mounting_yaw, clock, scale, steering, turn } = AssumedDeviations::default();
        let OdometryNoise { slip, yaw, .. } = OdometryNoise::default();
        let mut noise = Noise(0x2545_f491_4f6c_dd1d ^ self.seed.wrapping_mul(0xd1b5_4a32_d192_ed03) | 1);
        (0..16).for_each(|_| _ = noise.uniform());
        let share = scale * sign(&mut noise);
        Errors {
            wheels: [share; 4],
            steering: steering * sign(&mut noise),
            turn: turn * sign(&mut noise),
            laser: Pose::new(mounting * sign(&mut noise), mounting * sign(&mut noise), mounting_yaw * sign(&mut noise)),
            clock: clock * sign(&mut noise),
            slip,
            yaw,
        }
    }

    fn drive(&self, seconds: f64) -> Course {
        let outage = (self.silence > 0.0).then_some((Outage::Silence, OFF + 6.0, self.silence));
        course(&Drive {
            tick: self.tick,
            rate: self.rate,
            jitter: if self.jitters { 0.45 } else { 0.0 },
            gyro: self.gyro.then_some(100.0),
            motion: self.way.motion(),
            seconds,
            outage,
            reflectors: ring(12, 4.0, 2.0, 16.0, self.seed),
            errors: self.errors(),
            seed: self.seed,
            ..Drive::new(self.kind)
        })
    }
}

/// What drives of one kind have in common.
#[derive(Default)]
struct Row {
    drives: usize,
    lost: usize,
    outputs: usize,
    above: usize,
    above_predicted: usize,
    travel: usize,
    worst: f64,
    worst_cell: String,
    /// Of drives whose times do not jitter: a pose that is stamped wrongly is elsewhere.
    errors: Vec<f64>,
}

impl Row {
    fn add(&mut self, cell: &Cell, course: &Course) {
        self.drives += 1;
        self.lost += usize::from(course.lost.is_some());
        self.outputs += course.outputs;
        self.above += course.above;
        self.above_predicted += course.above_predicted;
        self.travel += course.travel;
        if course.ratio > self.worst {
            self.worst = course.ratio;
            let Cell { kind, way, rate, tick, gyro, jitters, silence, errs, seed } = cell;
            self.worst_cell = format!(
                "{kind:?}, {way:?}, {rate} Hz, {} mm{}{}{}{}, seed {seed}",
                1e3 * tick,
                if *gyro { ", gyro" } else { "" },
                if *jitters { ", jitter" } else { "" },
                if *silence > 0.0 { format!(", silent {silence} s") } else { String::new() },
                if *errs { ", errors" } else { "" }
            );
        }
        if !cell.jitters {
            self.errors.extend(&course.errors);
        }
    }

    fn mark(&self) -> f64 {
        let mut errors = self.errors.clone();
        errors.sort_by(f64::total_cmp);
        errors.get(errors.len() * 95 / 100).copied().unwrap_or(f64::NAN)
    }
}

fn table(rows: &BTreeMap<String, Row>) -> String {
    let mut table = String::from(
        "| | drives | lost | outputs | above level | within the limits of travel, % | 95 % error without jitter, mm | largest error over level | in |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    for (name, row) in rows {
        let travel = 100.0 * row.travel as f64 / row.outputs.max(1) as f64;
        writeln!(
            table,
            "| {name} | {} | {} | {} | {} | {travel:.2} | {:.1} | {:.2} | {} |",
            row.drives,
            row.lost,
            row.outputs,
            row.above,
            1e3 * row.mark(),
            row.worst,
            row.worst_cell
        )
        .unwrap();
    }
    table
}

#[test]
fn the_matrix_of_drives_is_held() {
    let is_long = std::env::var_os("AGV_LONG").is_some();
    let mut rows: BTreeMap<String, Row> = BTreeMap::new();
    let (mut wrong, mut number) = (Vec::new(), 0_u64);
    for kind in Kind::ALL {
        for way in Way::ALL.into_iter().filter(|way| way.is_driven_by(kind)) {
            number += 1;
            let rates: Vec<f64> =
                if is_long { RATES.to_vec() } else { vec![RATES[(number as usize * 5) % RATES.len()]] };
            let seeds = if is_long { 3 } else { 1 };
            for (rate, draw) in rates.iter().flat_map(|rate| (0..seeds).map(move |draw| (*rate, draw))) {
                let cell = Cell::drawn(kind, way, rate, 100 * number + 10 * draw + (rate as u64) % 7);
                let seconds = if way == Way::Standing && is_long && draw == 0 { 600.0 } else { 20.0 };
                let course = cell.drive(seconds);
                for name in [format!("{kind:?}"), format!("{way:?}"), format!("{rate:4} Hz")] {
                    rows.entry(name).or_default().add(&cell, &course);
                }
                if course.lost.is_some() || course.above > 0 || course.above_predicted > 0 {
                    wrong.push(format!(
                        "{cell:?}: lost {:?}, above {} and {} of {}, {:.2}",
                        course.lost, course.above, course.above_predicted, course.outputs, course.ratio
                    ));
                }
            }
        }
    }
    let table = table(&rows);
    if let Some(file) = std::env::var_os("AGV_MATRIX") {
        std::fs::write(file, &table).unwrap();
    }
    if is_long {
        // Of all that is drawn, times that are off by half a period of 20 Hz are more than the noise allows for.
        let all = |of: fn(&Row) -> usize| RATES.iter().map(|rate| of(&rows[&format!("{rate:4} Hz")])).sum::<usize>();
        let (drives, lost) = (all(|row| row.drives), all(|row| row.lost));
        let (outputs, above) = (all(|row| row.outputs), all(|row| row.above));
        println!("{lost} of {drives} drives lost, {above} of {outputs} outputs above the level: {wrong:#?}\n{table}");
        assert!(100 * lost <= drives && 100_000 * above <= outputs, "{lost} of {drives}, {above} of {outputs}");
    } else {
        assert!(wrong.is_empty(), "{}: {wrong:#?}\n{table}", wrong.len());
    }
    let travel = |row: &Row| row.travel as f64 / row.outputs as f64;
    let least = rows.iter().min_by(|(_, one), (_, other)| travel(one).total_cmp(&travel(other))).unwrap();
    assert!(travel(least.1) > 0.9, "{}: {}\n{table}", least.0, travel(least.1));
    if is_long {
        let mark = |rate: f64| rows[&format!("{rate:4} Hz")].mark();
        for rate in RATES {
            assert!(mark(rate) <= 1.2 * mark(100.0), "{rate} Hz: {} m, 100 Hz: {} m\n{table}", mark(rate), mark(100.0));
        }
    }
}
