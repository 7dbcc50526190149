//! What threads of different priorities share: a lock and a queue, at which none of them waits for one that has a lower priority than
//! itself.

pub mod lock;
pub mod queue;
