//! Sorting.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use agv_core::order::{heap_sort, insertion_sort_by};
use proptest::collection::vec;
use proptest::prelude::*;

proptest! {
    #[test]
    fn short_lists_are_sorted_and_equals_keep_their_order(mut list in vec((0_u8..20, any::<u16>()), 0..130)) {
        let mut expected = list.clone();
        expected.sort_by_key(|item| item.0);
        insertion_sort_by(&mut list, |a, b| a.0.cmp(&b.0));
        prop_assert_eq!(list, expected);
    }

    #[test]
    fn long_lists_are_sorted(mut list in vec((-3_i16..3, any::<i16>(), any::<u16>()), 0..1000)) {
        let mut expected = list.clone();
        expected.sort();
        heap_sort(&mut list);
        prop_assert_eq!(list, expected);
    }
}
