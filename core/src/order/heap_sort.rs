//! For long lists.

/// Sorts a list in place, with an effort that never exceeds its length times the logarithm of that. What is equal may change
/// places.
pub fn heap_sort<T: Copy + PartialOrd>(list: &mut [T]) {
    for root in (0..list.len() / 2).rev() {
        sink(list, root);
    }
    for end in (1..list.len()).rev() {
        let Some((last, heap)) = list.get_mut(..=end).and_then(<[T]>::split_last_mut) else { return };
        if let Some(first) = heap.first_mut() {
            core::mem::swap(first, last);
        }
        sink(heap, 0);
    }
}

/// Lets the item at `root` of a heap sink until nothing below it is greater.
fn sink<T: Copy + PartialOrd>(heap: &mut [T], root: usize) {
    let Some(item) = heap.get(root).copied() else { return };
    let mut place = root;
    loop {
        let left = 2 * place + 1;
        let Some(mut greater) = heap.get(left).copied() else { break };
        let mut below = left;
        if let Some(right) = heap.get(left + 1)
            && *right > greater
        {
            (greater, below) = (*right, left + 1);
        }
        if greater <= item {
            break;
        }
        if let Some(to) = heap.get_mut(place) {
            *to = greater;
        }
        place = below;
    }
    if let Some(to) = heap.get_mut(place) {
        *to = item;
    }
}
