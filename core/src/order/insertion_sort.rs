//! For short lists.

use core::cmp::Ordering;

/// Sorts a short list. What compares as equal stays in the order in which it came. The effort grows with the square of the
/// length, and only with the length if the list is nearly in order.
pub fn insertion_sort_by<T: Copy>(list: &mut [T], compare: impl Fn(&T, &T) -> Ordering) {
    for end in 1..list.len() {
        let Some((item, before)) = list.get_mut(..=end).and_then(<[T]>::split_last_mut) else { return };
        let moved = *item;
        let mut hole = item;
        for other in before.iter_mut().rev() {
            if compare(other, &moved) != Ordering::Greater {
                break;
            }
            *hole = *other;
            hole = other;
        }
        *hole = moved;
    }
}
