//! What no single crate can show: the command as people run it, replay, real data.
