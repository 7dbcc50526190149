//! How the tests ended, as their programs say it.

use std::collections::BTreeSet;

/// How the tests ended.
#[derive(Debug)]
pub struct Outcome {
    pub is_ok: bool,
    passed: usize,
    ignored: usize,
    pub failed: Vec<String>,
    /// A line for each thing that a test was skipped for: the name of the test stands before a comma.
    pub skipped: Vec<String>,
}

impl Outcome {
    /// That of no tests.
    pub fn new() -> Self {
        Self { is_ok: true, passed: 0, ignored: 0, failed: Vec::new(), skipped: Vec::new() }
    }

    /// Takes one line of what a program of tests prints.
    pub fn take(&mut self, line: &str) {
        let Some(rest) = line.strip_prefix("test ") else { return };
        if let Some(counts) = rest.strip_prefix("result: ") {
            let words = counts.split([' ', ';']).collect::<Vec<_>>();
            let count = |what: &str| {
                let pair = words.windows(2).find(|pair| pair[1] == what);
                pair.and_then(|pair| pair[0].parse::<usize>().ok()).unwrap_or(0)
            };
            self.passed += count("passed");
            self.ignored += count("ignored");
        } else if let Some(name) = rest.strip_suffix(" ... FAILED") {
            self.failed.push(name.to_owned());
        }
    }

    /// The tests that were skipped: the test harness counts them as passed.
    fn skipped_tests(&self) -> BTreeSet<&str> {
        let named = self.skipped.iter().filter_map(|line| line.strip_prefix("skipped: ")?.split(", because ").next());
        named.collect()
    }

    /// The counts, and the verdict.
    pub fn last_line(&self) -> String {
        let skipped = self.skipped_tests();
        let passed = self.passed.saturating_sub(skipped.len());
        let counts = format!("{passed} passed, {} failed, {} skipped", self.failed.len(), skipped.len());
        let left = match self.ignored {
            0 => String::new(),
            ignored => format!("; {ignored} are left for --long"),
        };
        let verdict = match (self.is_ok, skipped.is_empty()) {
            (false, _) => "FAILED".to_owned(),
            (true, true) => "all tests passed".to_owned(),
            (true, false) => {
                let names: Vec<&str> = skipped.into_iter().collect();
                format!("passed, but {} skipped: {}", names.len(), names.join(", "))
            }
        };
        format!("{counts}{left}\n{verdict}")
    }
}

#[cfg(test)]
mod tests {
    use super::Outcome;

    fn outcome() -> Outcome {
        let mut outcome = Outcome::new();
        for line in [
            "running 3 tests",
            "test a::b ... ok",
            "test result: ok. 12 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.01s",
            "test result: ok. 5 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.01s",
        ] {
            outcome.take(line);
        }
        outcome
    }

    #[test]
    fn results_are_counted() {
        let mut outcome = outcome();
        assert_eq!((outcome.passed, outcome.ignored), (17, 1));
        assert_eq!(outcome.last_line(), "17 passed, 0 failed, 0 skipped; 1 are left for --long\nall tests passed");
        outcome.take("test a::c ... FAILED");
        outcome.is_ok = false;
        assert_eq!(outcome.failed, ["a::c"]);
        assert!(outcome.last_line().ends_with("\nFAILED"));
    }

    #[test]
    fn what_was_skipped_did_not_pass() {
        let mut outcome = outcome();
        for why in ["there is no a", "there is no b"] {
            outcome.skipped.push(format!("skipped: d, because {why}"));
        }
        outcome.skipped.push("skipped: e, because there is no a".to_owned());
        let line = outcome.last_line();
        assert!(line.starts_with("15 passed, 0 failed, 2 skipped"), "{line}");
        assert!(line.ends_with("\npassed, but 2 skipped: d, e"), "{line}");
    }
}
