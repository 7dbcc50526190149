//! Discrete lines: what wires say of the pose, and what the controller is told by them.
//!
//! | concept | module |
//! |---|---|
//! | what each output means, and its safe state | [`DiscreteOutputs`] |
//! | a level that holds | `debounce` |
//! | the pins | [`DiscreteLines`] |

mod debounce;
mod lines;
mod outputs;

pub use debounce::DEBOUNCE;
pub use lines::{DiscreteInputs, DiscreteLines, Line, LineSet};
pub use outputs::{DiscreteOutputs, DiscreteReport};
