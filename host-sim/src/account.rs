//! What became of everything that an input of others held: nothing is left out or assumed without a word.

use std::fmt;

use serde::Serialize;

/// More than this share of an input left out is a warning.
pub const TOLERATED: f64 = 0.02;

/// Things that were left out for one reason.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// What they are, and why.
    pub why: String,
    /// How many.
    pub count: u64,
    /// Where the first of them stands, if that can be said.
    pub first: Option<String>,
}

impl fmt::Display for LeftOut {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        write!(formatter, "{} {}", self.count, self.why)?;
        self.first.as_ref().map_or(Ok(()), |first| write!(formatter, ", first {first}"))
    }
}

/// What was taken from an input, what was left out, and what is doubtful.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Account {
    taken: u64,
    left_out: Vec<LeftOut>,
    beside: Vec<LeftOut>,
    notes: Vec<String>,
    warnings: Vec<String>,
}

impl Account {
    /// Things that were used.
    pub fn take(&mut self, count: usize) {
        self.taken += count as u64;
    }

    /// Something that should have been used and could not be; `place` says where it stands.
    pub fn leave_out(&mut self, why: impl Into<String>, place: impl fmt::Display) {
        add(&mut self.left_out, why.into(), 1, Some(place.to_string()));
    }

    /// Several of them of which no place is known.
    pub fn leave_out_some(&mut self, why: impl Into<String>, count: usize) {
        add(&mut self.left_out, why.into(), count as u64, None);
    }

    /// Things that nobody asked for.
    pub fn set_aside(&mut self, why: impl Into<String>, count: usize) {
        add(&mut self.beside, why.into(), count as u64, None);
    }

    /// Something that was assumed, and may be right.
    pub fn note(&mut self, text: impl Into<String>) {
        push(&mut self.notes, text.into());
    }

    /// Something that is probably wrong.
    pub fn warn(&mut self, text: impl Into<String>) {
        push(&mut self.warnings, text.into());
    }

    /// Adds what another part of the same input says.
    pub fn merge(&mut self, other: Self) {
        self.taken += other.taken;
        for LeftOut { why, count, first } in other.left_out {
            add(&mut self.left_out, why, count, first);
        }
        for LeftOut { why, count, first } in other.beside {
            add(&mut self.beside, why, count, first);
        }
        other.notes.into_iter().for_each(|text| self.note(text));
        other.warnings.into_iter().for_each(|text| self.warn(text));
    }

    /// What should have been used and was not.
    #[must_use]
    pub fn left_out(&self) -> &[LeftOut] {
        &self.left_out
    }

    /// What nobody asked for.
    #[must_use]
    pub fn beside(&self) -> &[LeftOut] {
        &self.beside
    }

    /// What was assumed.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// What is probably wrong, and at the end that too much was left out.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = self.warnings.clone();
        if self.share() > TOLERATED {
            let out: u64 = self.left_out.iter().map(|one| one.count).sum();
            let why: Vec<String> = self.left_out.iter().take(MOST_REASONS).map(ToString::to_string).collect();
            warnings.push(format!("{out} of {} were left out: {}", self.taken + out, why.join("; ")));
        }
        warnings
    }

    /// Share of what was left out, 0 to 1.
    #[must_use]
    pub fn share(&self) -> f64 {
        let out: u64 = self.left_out.iter().map(|one| one.count).sum();
        if out == 0 { 0.0 } else { out as f64 / (self.taken + out) as f64 }
    }
}

/// Reasons that the last warning names.
const MOST_REASONS: usize = 3;

/// Messages of one kind that are kept; an input with more of them is told by the first ones.
const MOST_MESSAGES: usize = 50;

fn push(to: &mut Vec<String>, text: String) {
    if to.len() < MOST_MESSAGES && !to.contains(&text) {
        to.push(text);
    }
}

fn add(to: &mut Vec<LeftOut>, why: String, count: u64, first: Option<String>) {
    if count == 0 {
        return;
    }
    match to.iter_mut().find(|one| one.why == why) {
        Some(one) => one.count += count,
        None => to.push(LeftOut { why, count, first }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_over_the_tolerated_one_is_a_warning() {
        let mut account = Account::default();
        account.take(98);
        account.leave_out("frames cut short", "at line 7");
        account.leave_out("frames cut short", "at line 9");
        assert!(account.warnings().is_empty());
        assert_eq!(account.left_out()[0].to_string(), "2 frames cut short, first at line 7");
        account.leave_out_some("frames of an unknown kind", 1);
        let warnings = account.warnings();
        assert_eq!(
            warnings,
            ["3 of 101 were left out: 2 frames cut short, first at line 7; 1 frames of an unknown kind"]
        );
        // What nobody asked for is no loss.
        let mut account = Account::default();
        account.set_aside("frames of others", 1000);
        assert!(account.warnings().is_empty() && account.share() == 0.0);
    }

    #[test]
    fn parts_of_an_input_are_added() {
        let (mut one, mut other) = (Account::default(), Account::default());
        one.leave_out("lines", "at line 1");
        other.leave_out("lines", "at line 5");
        other.warn("the file ends early");
        other.warn("the file ends early");
        one.merge(other);
        assert_eq!((one.left_out()[0].count, one.left_out()[0].first.as_deref()), (2, Some("at line 1")));
        assert_eq!(one.warnings()[0], "the file ends early");
        assert_eq!(one.warnings().len(), 2);
    }
}
