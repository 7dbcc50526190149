//! Seen reflectors in groups of which only the members are paired.

/// In no group.
const NONE: u8 = u8::MAX;

/// Costs of pairing one reflector with another.
pub(super) type Costs<const SEEN: usize> = [[f32; SEEN]; SEEN];

/// The group of each seen reflector.
#[derive(Clone, Debug)]
pub(super) struct Groups<const SEEN: usize> {
    of: [u8; SEEN],
}

impl<const SEEN: usize> Groups<SEEN> {
    /// Splits `count` reflectors into at most `groups` groups so that pairs within groups cost little: the cheapest
    /// disjoint pairs open them, the others join where they cost least.
    pub(super) fn new(costs: &Costs<SEEN>, count: usize, groups: usize) -> Self {
        let mut grouping = Self { of: [NONE; SEEN] };
        let mut opened = 0;
        while opened < groups {
            let Some((first, second)) = grouping.cheapest_free_pair(costs, count) else { break };
            grouping.put(first, opened);
            grouping.put(second, opened);
            opened += 1;
        }
        for number in 0..count {
            if grouping.group(number) != NONE {
                continue;
            }
            if opened < groups {
                grouping.put(number, opened);
                opened += 1;
            } else {
                let group = grouping.cheapest_group(costs, number, opened);
                grouping.put(number, group);
            }
        }
        grouping
    }

    /// Whether two reflectors are of one group.
    pub(super) fn are_together(&self, first: usize, second: usize) -> bool {
        self.group(first) == self.group(second)
    }

    fn group(&self, number: usize) -> u8 {
        self.of.get(number).copied().unwrap_or(NONE)
    }

    fn put(&mut self, number: usize, group: usize) {
        if let Some(of) = self.of.get_mut(number) {
            *of = group as u8;
        }
    }

    fn cheapest_free_pair(&self, costs: &Costs<SEEN>, count: usize) -> Option<(usize, usize)> {
        let mut cheapest = None;
        let mut least = f32::INFINITY;
        for (second, row) in costs.iter().enumerate().take(count) {
            if self.group(second) != NONE {
                continue;
            }
            for (first, cost) in row.iter().enumerate().take(second) {
                if *cost < least && self.group(first) == NONE {
                    (least, cheapest) = (*cost, Some((first, second)));
                }
            }
        }
        cheapest
    }

    fn cheapest_group(&self, costs: &Costs<SEEN>, number: usize, opened: usize) -> usize {
        let mut sums = [0.0; SEEN];
        let Some(row) = costs.get(number) else { return 0 };
        for (of, cost) in self.of.iter().zip(row) {
            if let Some(sum) = sums.get_mut(usize::from(*of)) {
                *sum += cost;
            }
        }
        let mut cheapest = 0;
        let mut least = f32::INFINITY;
        for (group, sum) in sums.iter().enumerate().take(opened) {
            if *sum < least {
                (least, cheapest) = (*sum, group);
            }
        }
        cheapest
    }
}
