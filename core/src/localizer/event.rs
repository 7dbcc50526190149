//! What the localiser is told: the one table of events.

use crate::measurement::{
    EncoderFaults, EncoderSample, GyroSample, LaserId, PoseFix, PoseIncrement, Reflectors, Scan, SpeedSample, Time,
    WheelSample,
};

/// Reflectors, whoever keeps them.
pub trait AsReflectors {
    /// The reflectors as the localiser takes them.
    fn as_reflectors(&self) -> Reflectors<'_>;
}

impl AsReflectors for Reflectors<'_> {
    fn as_reflectors(&self) -> Reflectors<'_> {
        *self
    }
}

/// A scan, whoever keeps it.
pub trait AsScan {
    /// The scan as the localiser takes it.
    fn as_scan(&self) -> Scan<'_>;
}

impl AsScan for Scan<'_> {
    fn as_scan(&self) -> Scan<'_> {
        *self
    }
}

/// Makes the enum of events and all that is known of every kind from one table: its number in logs, its name and content, and
/// how its time is found.
macro_rules! events {
    ($($(#[$doc:meta])* $code:literal $constant:ident $name:ident($content:ty), |$value:ident| $span:expr;)+) => {
        /// Numbers of the kinds of events in logs.
        pub mod kind {
            $($(#[$doc])* pub const $constant: u8 = $code;)+
        }

        /// One thing that a sensor or an operator said, with the time at which it was true. Reflectors and scans may be
        /// borrowed ([`Event`]), or owned by whoever keeps them.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum AnyEvent<R, S> {
            $($(#[$doc])* $name($content),)+
        }

        impl<R, S> AnyEvent<R, S> {
            /// The number of its kind in logs.
            #[must_use]
            pub const fn code(&self) -> u8 {
                match self {
                    $(Self::$name(_) => kind::$constant,)+
                }
            }
        }

        impl<R: AsReflectors, S: AsScan> AnyEvent<R, S> {
            /// When the first thing in it happened, and the last one; none for a revolution without reflectors.
            #[must_use]
            pub fn span(&self) -> Option<(Time, Time)> {
                match self {
                    $(Self::$name($value) => $span,)+
                }
            }
        }
    };
}

events! {
    /// Counters of a tricycle's encoders.
    2 ENCODERS Encoders(EncoderSample), |sample| Some((sample.time, sample.time));
    /// What is wrong with a tricycle's encoders: when it changes, and again and again while there is a fault, as
    /// nothing else tells the time then.
    14 ENCODER_FAULTS EncoderFaults(EncoderFaults), |faults| Some((faults.time, faults.time));
    /// Speed and steering angle.
    3 SPEED Speed(SpeedSample), |sample| Some((sample.time, sample.time));
    /// Motion that the vehicle has integrated itself.
    4 INCREMENT Increment(PoseIncrement), |increment| Some((increment.time, increment.time));
    /// Counters of several wheels.
    17 WHEELS Wheels(WheelSample), |sample| Some((sample.time, sample.time));
    /// Rate of a gyro.
    18 GYRO Gyro(GyroSample), |sample| Some((sample.time, sample.time));
    /// Reflectors that a laser has found.
    5 REFLECTORS Reflectors(R), |reflectors| {
        let seen = reflectors.as_reflectors().observations;
        seen.first().zip(seen.last()).map(|(first, last)| (first.time, last.time))
    };
    /// Ranges of one sweep of a laser.
    6 SCAN Scan(S), |scan| {
        let scan = scan.as_scan();
        Some((scan.start, scan.end()))
    };
    /// A pose from outside.
    7 SET_POSE SetPose(PoseFix), |fix| Some((fix.time, fix.time));
}

/// An event as the localiser takes it.
pub type Event<'a> = AnyEvent<Reflectors<'a>, Scan<'a>>;

impl<R: AsReflectors, S: AsScan> AnyEvent<R, S> {
    /// When it happened; for a revolution, when it began. None for a revolution without reflectors.
    #[must_use]
    pub fn time(&self) -> Option<Time> {
        self.span().map(|(first, _)| first)
    }

    /// The event as the localiser takes it.
    #[must_use]
    pub fn view(&self) -> Event<'_> {
        self.map(R::as_reflectors, S::as_scan)
    }

    /// The laser that has seen it, if one has.
    #[must_use]
    pub fn laser(&self) -> Option<LaserId> {
        match self {
            Self::Reflectors(reflectors) => Some(reflectors.as_reflectors().laser),
            Self::Scan(scan) => Some(scan.as_scan().laser),
            _ => None,
        }
    }

    /// When the first thing in it was seen, and the last one, if it tells what a laser has seen.
    pub(super) fn seen(&self) -> Option<(Time, Time)> {
        self.laser().and_then(|_| self.span())
    }
}

impl<R, S> AnyEvent<R, S> {
    /// Whether the vehicle has told how it moves.
    #[must_use]
    pub const fn is_odometry(&self) -> bool {
        matches!(self, Self::Encoders(_) | Self::Speed(_) | Self::Increment(_) | Self::Wheels(_))
    }

    /// Whether somebody has told where the vehicle is.
    #[must_use]
    pub const fn is_told(&self) -> bool {
        matches!(self, Self::SetPose(_))
    }

    /// The same event with what a laser has seen kept in another way.
    pub fn map<'a, R2, S2>(
        &'a self,
        reflectors: impl FnOnce(&'a R) -> R2,
        scan: impl FnOnce(&'a S) -> S2,
    ) -> AnyEvent<R2, S2> {
        match self {
            Self::Encoders(sample) => AnyEvent::Encoders(*sample),
            Self::EncoderFaults(faults) => AnyEvent::EncoderFaults(*faults),
            Self::Speed(sample) => AnyEvent::Speed(*sample),
            Self::Increment(increment) => AnyEvent::Increment(*increment),
            Self::Wheels(sample) => AnyEvent::Wheels(*sample),
            Self::Gyro(sample) => AnyEvent::Gyro(*sample),
            Self::Reflectors(seen) => AnyEvent::Reflectors(reflectors(seen)),
            Self::Scan(seen) => AnyEvent::Scan(scan(seen)),
            Self::SetPose(fix) => AnyEvent::SetPose(*fix),
        }
    }
}
