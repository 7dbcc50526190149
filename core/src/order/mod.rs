//! Sorting that cannot panic, whatever the compiler makes of it, and choosing some of many.
//!
//! The sorting of `core::slice` panics where an order contradicts itself. The orders here do not, but no compiler proves
//! that, and then the panic is in the program.

mod evenly;
mod heap_sort;
mod insertion_sort;

pub use evenly::Evenly;
pub use heap_sort::heap_sort;
pub use insertion_sort::insertion_sort_by;
