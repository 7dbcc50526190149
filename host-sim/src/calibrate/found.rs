//! A drive's parameters, by one of the methods.

use agv_core::calibration::{Conditioning, MountingSide, Offsets, Problem, Unobservable, outliers};
use agv_core::measurement::Time;
use nalgebra::Vector3;

use super::closed_form::{self, ClosedForm};
use super::drive::Drive;
use super::joint::{self, Free, disturbances};
use super::model::{PARAMETERS, VehicleModel};
use super::noise::NoiseModel;
use super::propagation::closed_form_deviations;
use super::refusal::Refusal;
use super::window::Window;

/// How parameters are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Closed form (K 2.2, 2.3).
    ClosedForm,
    /// Nonlinear fit of everything at once.
    Joint,
}

/// What is asked of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Question {
    /// How.
    pub method: Method,
    /// One steering offset, or one for each sense of travel.
    pub offsets: Offsets,
    /// Whether the wheelbase is found too.
    pub is_wheelbase_free: bool,
    /// Whether the steering ratio is found too.
    pub is_steering_ratio_free: bool,
    /// On which side of R the laser is.
    pub side: Option<MountingSide>,
}

/// One window against the parameters found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residual {
    /// Begin.
    pub start: Time,
    /// End.
    pub end: Time,
    /// Whether the vehicle goes backward.
    pub is_backward: bool,
    /// Motion of S as measured minus as modelled: x, y (m), rotation (rad).
    pub motion: Vector3<f64>,
    /// From one down to zero for a window that counts for nothing.
    pub weight: f64,
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The parameters.
    pub model: VehicleModel,
    /// Standard deviations in the order of [`VehicleModel::vector`], zero for what was held.
    pub deviations: [f64; PARAMETERS],
    /// How well the windows tell the intrinsic parameters apart.
    pub conditioning: Conditioning,
    /// Wheelbase that the laser's motion suggests, and its standard deviation, m.
    pub suggested_wheelbase: [f64; 2],
    /// Noise that the residuals imply.
    pub noise: NoiseModel,
    /// The windows.
    pub residuals: Vec<Residual>,
}

/// Between which factors of the nominal steering scale the true one is searched.
const STEERING_RATIOS: [f64; 2] = [0.05, 20.0];
/// Windows among which the closed forms look for outliers.
const MOST_WINDOWS: usize = 256;
/// Share of windows that may contradict the others.
const LARGEST_OUTLIER_SHARE: f64 = 0.25;
/// Slip (share of a metre, over a metre) and steering error (rad) that no wheel that rolls has.
const LARGEST_SLIP: f64 = 6e-3;
const LARGEST_STEERING_ERROR: f64 = 0.01;

/// Finds the parameters.
///
/// # Errors
/// [`Refusal`].
pub fn find(drive: &Drive, question: &Question) -> Result<Found, Refusal> {
    let windows = &drive.windows;
    if windows.len() < 2 {
        return Err(Refusal::TooFewSegments { found: windows.len(), needed: 2 });
    }
    let form =
        ClosedForm { offsets: question.offsets, is_wheelbase_free: question.is_wheelbase_free, side: question.side };
    let closed = solve_closed(drive, &form, question.is_steering_ratio_free)?;
    let found = if question.method == Method::Joint {
        let free = Free {
            offsets_differ: question.offsets == Offsets::ForEachSense,
            wheelbase: question.is_wheelbase_free,
            steering_ratio: question.is_steering_ratio_free,
        };
        let fit = joint::fit(windows, &closed.model, free, &expected_noise(&closed.noise))?;
        let residuals = residuals(windows, &fit.model, |index| fit.weights[index]);
        Found { model: fit.model, deviations: fit.deviations, noise: fit.noise, residuals, ..closed }
    } else {
        closed
    };
    let overlap = (drive.overlap as f64).sqrt();
    let found = Found { deviations: found.deviations.map(|deviation| deviation * overlap), ..found };
    found.check()?;
    Ok(found)
}

/// Finds the parameters of a drive by the first of several questions that it answers; where it has too few stops, by what happens
/// between them.
///
/// # Errors
/// Why the first question has no answer.
pub fn find_any(drive: Drive, questions: &[Question]) -> Result<(Found, Drive), Refusal> {
    let mut reason = None;
    let drive =
        if drive.is_from_stops() && drive.windows.len() < FEWEST_STOPS_APART { drive.without_stops() } else { drive };
    for question in questions {
        match find(&drive, question) {
            Ok(found) => return Ok((found, drive)),
            Err(refusal) => reason = reason.or(Some(refusal)),
        }
    }
    Err(reason.unwrap_or(Refusal::TooFewSegments { found: 0, needed: 2 }))
}

/// Ways from stop to stop that say enough without what happens between the stops.
const FEWEST_STOPS_APART: usize = 6;

/// Where the fit's estimate of the noise begins: the usual noise, unless the closed form has left much more or much less.
fn expected_noise(left: &NoiseModel) -> NoiseModel {
    let usual = NoiseModel::default();
    let is_near = |left: f64, usual: f64| (left / usual).ln().abs() <= 1.5;
    if is_near(left.slip, usual.slip) && is_near(left.steering, usual.steering) { usual } else { *left }
}

fn residuals(windows: &[Window], model: &VehicleModel, weight: impl Fn(usize) -> f64) -> Vec<Residual> {
    let residual = |(index, window): (usize, &Window)| Residual {
        start: window.start,
        end: window.end,
        is_backward: window.is_backward(),
        motion: disturbances(window, model).residual,
        weight: weight(index),
    };
    windows.iter().enumerate().map(residual).collect()
}

fn solve_closed(drive: &Drive, form: &ClosedForm, is_ratio_free: bool) -> Result<Found, Refusal> {
    let nominal = &drive.tricycle;
    let ratio_of = |windows: &[Window]| {
        if is_ratio_free { closed_form::steering_ratio(windows, nominal, form, STEERING_RATIOS) } else { Ok(1.0) }
    };
    let ratio = ratio_of(&drive.windows)?;
    let first = closed_form::solve(&drive.windows, nominal, form, ratio)?;
    let problem = Problem {
        offsets: form.offsets,
        wheelbase: first.wheelbase,
        is_wheelbase_free: form.is_wheelbase_free,
        side: form.side,
    };
    let vehicle = closed_form::model(&first, 1.0).apply(nominal);
    let segments = closed_form::segments(&drive.windows, &vehicle, ratio);
    let flags = outliers::<MOST_WINDOWS>(&segments, &problem).map_or_else(|_| Default::default(), |(_, flags)| flags);
    let is_outlier = |index: usize| flags.get(index).copied().unwrap_or(false);
    let kept: Vec<Window> =
        (0..).zip(&drive.windows).filter(|(index, _)| !is_outlier(*index)).map(|(_, window)| window.clone()).collect();
    let ratio = ratio_of(&kept)?;
    let calibration = closed_form::solve(&kept, nominal, form, ratio)?;
    let model = closed_form::model(&calibration, ratio);
    let disturbed: Vec<_> = kept.iter().map(|window| disturbances(window, &model)).collect();
    let noise = NoiseModel::default().estimated(&disturbed, PARAMETERS);
    let vehicle = closed_form::model(&calibration, 1.0).apply(nominal);
    let segments = closed_form::segments(&kept, &vehicle, ratio);
    let [forward, backward, scale, wheelbase, x, y, heading, suggested] =
        closed_form_deviations(&kept, &segments, &problem, &disturbed, &noise)?;
    let wheelbase = if form.is_wheelbase_free { wheelbase } else { 0.0 };
    let deviations = [forward, backward, scale, wheelbase, 0.0, x, y, heading];
    if !deviations.iter().chain(&model.vector()).all(|value| value.is_finite()) {
        return Err(Unobservable::NotFinite.into());
    }
    Ok(Found {
        model,
        deviations,
        conditioning: calibration.conditioning,
        suggested_wheelbase: [calibration.extrinsic.wheelbase, suggested],
        noise,
        residuals: residuals(&drive.windows, &model, |index| if is_outlier(index) { 0.0 } else { 1.0 }),
    })
}

/// How good a drive was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grade {
    /// As good as a calibration drive is expected to be.
    Good,
    /// Better than nothing: more or longer segments, or more steering angles, are advised.
    Fair,
}

/// Names of the parameters, in the order of [`VehicleModel::vector`].
pub const PARAMETER_NAMES: [&str; PARAMETERS] = [
    "steering offset forward",
    "steering offset backward",
    "drive scale",
    "wheelbase",
    "steering ratio",
    "laser x",
    "laser y",
    "laser heading",
];

impl Found {
    /// Deviations that a good drive stays below, and beyond which a result is of no use: rad, share, m, share, m, m, rad.
    fn limits(&self) -> [[f64; 2]; PARAMETERS] {
        let (offset, share, place) = ([5e-4, 0.02], [1.5e-3, 0.03], [5e-3, 0.1]);
        let scale = share.map(|share| share * self.model.drive_scale.abs());
        let ratio = share.map(|share| share * self.model.steering_ratio.abs());
        let base = share.map(|share| share * self.model.wheelbase.abs());
        [offset, offset, scale, base, ratio, place, place, [1e-3, 0.05]]
    }

    /// Whether the drive was good enough.
    #[must_use]
    pub fn grade(&self) -> Grade {
        let is_good = self.deviations.iter().zip(self.limits()).all(|(deviation, [good, _])| *deviation <= good);
        if is_good { Grade::Good } else { Grade::Fair }
    }

    /// Windows that count for nothing.
    pub fn outliers(&self) -> impl Iterator<Item = &Residual> {
        self.residuals.iter().filter(|residual| residual.weight == 0.0)
    }

    fn check(&self) -> Result<(), Refusal> {
        let (bad, all) = (self.outliers().count(), self.residuals.len());
        if let Some(first) = self.outliers().next().filter(|_| bad as f64 > LARGEST_OUTLIER_SHARE * all as f64) {
            return Err(Refusal::Contradiction { bad, all, first: first.start.seconds() });
        }
        let NoiseModel { slip, steering, .. } = self.noise;
        if slip > LARGEST_SLIP || steering > LARGEST_STEERING_ERROR {
            return Err(Refusal::Slip { slip_percent: 100.0 * slip, steering_deg: steering.to_degrees() });
        }
        for (index, (deviation, [_, useless])) in self.deviations.iter().zip(self.limits()).enumerate() {
            if deviation.is_nan() || *deviation > useless {
                let deviation = match index {
                    0 | 1 | 7 => format!("{:.2} deg", deviation.to_degrees()),
                    2 => format!("{:.1} % of it", 100.0 * deviation / self.model.drive_scale.abs()),
                    4 => format!("{:.1} % of it", 100.0 * deviation / self.model.steering_ratio.abs()),
                    _ => format!("{:.0} mm", 1e3 * deviation),
                };
                return Err(Refusal::Uncertain { parameter: PARAMETER_NAMES[index], deviation });
            }
        }
        Ok(())
    }
}
