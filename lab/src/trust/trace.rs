//! What the bus says at each moment of a run beside the truth, as a line of a table.

use std::fmt;

use agv_host_sim::drive::{mode_name, reason_name};

use super::judge::{Errors, Moment};

/// What the columns are: time since everything was switched on; how old what the bus says is, and what it says; where the vehicle was at the
/// time that it states, and how wrong it is; and whether no sensor of the vehicle can tell the fault yet.
pub const TRACE_HEADER: &str = "time_s,true_x_m,true_y_m,true_heading_rad,age_s,x_m,y_m,heading_rad,mode,reason,level_m,level_rad,error_m,error_rad,is_hidden";

/// One moment.
#[derive(Clone, Copy, Debug)]
pub struct TraceLine<'a> {
    /// Time since everything was switched on, s.
    pub time: f64,
    /// What was judged.
    pub moment: &'a Moment<'a>,
}

impl fmt::Display for TraceLine<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        let Self { time, moment } = self;
        write!(formatter, "{time:.2}")?;
        // There is none before the bus has said anything.
        match moment.truth {
            Some(truth) => write!(formatter, ",{:.4},{:.4},{:.5}", truth.x, truth.y, truth.theta)?,
            None => write!(formatter, ",,,")?,
        }
        let Some((said, stated)) = moment.heard else { return write!(formatter, ",,,,,,,,,,,{}", moment.is_hidden) };
        let (pose, level) = (&said.pose, &said.level);
        write!(formatter, ",{:.3},{:.4},{:.4},{:.5}", moment.now.since(stated), pose.x, pose.y, pose.theta)?;
        write!(formatter, ",{},{}", mode_name(said.mode), reason_name(said.reason))?;
        write!(formatter, ",{:.3},{:.4}", level.position, level.heading)?;
        match moment.truth {
            Some(truth) => {
                let errors = Errors::of(pose, &truth);
                write!(formatter, ",{:.4},{:.5}", errors.position, errors.heading)?;
            }
            None => write!(formatter, ",,")?,
        }
        write!(formatter, ",{}", moment.is_hidden)
    }
}
