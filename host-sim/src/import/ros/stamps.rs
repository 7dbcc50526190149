//! Stamps of a recording that cannot be: single ones that were never filled in, those of another clock, and those of a clock that
//! was started again. When the messages were received is at hand.

use std::collections::BTreeMap;

use crate::account::Account;

/// A message by its times, ns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stamped<'a> {
    /// Its topic.
    pub(super) topic: &'a str,
    /// When the recorder received it.
    pub(super) received: i64,
    /// When it was true, as it says; mended where that cannot be.
    pub(super) stamp: i64,
}

const SECOND: i64 = 1_000_000_000;
/// A message that says it is by so much older or younger than those beside it was stamped wrongly, ns.
const WRONG: i64 = SECOND;
/// Messages beside one, on each side, to which its stamp is compared.
const BESIDE: usize = 5;
/// A clock that goes back by more was set or started again, ns.
const RESTART: i64 = SECOND / 2;
/// Two sensors with one clock are received within this time of their stamps, one from the other, ns.
const ONE_CLOCK: i64 = SECOND;

/// Mends the stamps, and says what was mended. The messages are in the order of the recording. `leading` is the topic whose clock
/// counts. Returns the times, as the recorder saw them, at which the clock started again.
pub(super) fn settle(messages: &mut [Stamped], leading: &str, account: &mut Account) -> Vec<i64> {
    let topics: Vec<&str> = messages.iter().fold(Vec::new(), |mut topics, message| {
        if !topics.contains(&message.topic) {
            topics.push(message.topic);
        }
        topics
    });
    for topic in &topics {
        mend_single(messages, topic, account);
    }
    let restarts = go_on(messages, leading, account);
    let offset = usual_offset(messages, leading);
    for topic in topics.into_iter().filter(|topic| *topic != leading) {
        if let Some(offset) = offset {
            join(messages, topic, offset, account);
        }
    }
    restarts
}

fn of<'a, 'b>(messages: &'b mut [Stamped<'a>], topic: &str) -> Vec<&'b mut Stamped<'a>> {
    messages.iter_mut().filter(|message| message.topic == topic).collect()
}

fn offset(message: &Stamped) -> i64 {
    message.received.saturating_sub(message.stamp)
}

fn median(mut values: Vec<i64>) -> Option<i64> {
    values.sort_unstable();
    values.get(values.len() / 2).copied()
}

/// Single stamps far from those of the messages beside them, and topics that stamp nothing, get the time at which they were received.
fn mend_single(messages: &mut [Stamped], topic: &str, account: &mut Account) {
    let mut own = of(messages, topic);
    let are_all_one = own.len() > 2 && own.windows(2).all(|pair| pair[0].stamp == pair[1].stamp);
    if are_all_one || own.iter().all(|message| message.stamp <= 0) {
        let count = own.len();
        own.iter_mut().for_each(|message| message.stamp = message.received);
        account.warn(format!(
            "the {count} messages of {topic} are not stamped: their times are those at which they were received"
        ));
        return;
    }
    let offsets: Vec<i64> = own.iter().map(|message| offset(message)).collect();
    // Where the clock of a simulation runs slower than the recorder's, offsets grow all the time.
    let growth = median(offsets.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect()).unwrap_or_default();
    let wrong = WRONG.max(growth.saturating_mul(2 * BESIDE as i64));
    let mut mended = 0;
    for (index, message) in own.iter_mut().enumerate() {
        let beside = &offsets[index.saturating_sub(BESIDE)..(index + BESIDE + 1).min(offsets.len())];
        // Two messages say nothing of each other, unless one has no stamp at all.
        let usual = if beside.len() > 2 { median(beside.to_vec()) } else { None };
        let is_empty = message.stamp <= 0;
        if let Some(usual) = usual.filter(|usual| is_empty || (offset(message) - usual).abs() > wrong) {
            message.stamp = message.received.saturating_sub(usual);
            mended += 1;
        } else if is_empty {
            message.stamp = message.received;
            mended += 1;
        }
    }
    if mended > 0 {
        account.warn(format!(
            "the stamps of {mended} of the {} messages of {topic} cannot be: their times were made of those at which they were received",
            offsets.len()
        ));
    }
}

/// Where the clock of the leading topic was started again, its times go on by what passed for the recorder, and so do those of the
/// other topics.
fn go_on(messages: &mut [Stamped], leading: &str, account: &mut Account) -> Vec<i64> {
    let mut shifts: Vec<i64> = vec![0];
    let mut restarts = Vec::new();
    let mut before: Option<(i64, i64)> = None;
    for message in of(messages, leading) {
        if let Some((stamp, received)) = before
            && message.stamp < stamp - RESTART
        {
            let passed = (message.received - received).max(0);
            let shift = shifts.last().copied().unwrap_or_default();
            shifts.push(shift + stamp + passed - message.stamp);
            restarts.push(message.received);
            let back = (stamp - message.stamp) as f64 / SECOND as f64;
            account.warn(format!(
                "the clock of {leading} goes back by {back:.3} s, as of a second run: the times behind it go on from there"
            ));
        }
        before = Some((message.stamp, message.received));
    }
    if restarts.is_empty() {
        return restarts;
    }
    let mut seen: BTreeMap<&str, (usize, i64)> = BTreeMap::new();
    for message in messages {
        let (run, latest) = seen.entry(message.topic).or_insert((0, i64::MIN));
        if message.stamp < latest.saturating_sub(RESTART) {
            *run += 1;
        }
        *latest = message.stamp;
        message.stamp += shifts.get(*run).or(shifts.last()).copied().unwrap_or_default();
    }
    restarts
}

/// Time from stamp to receipt of a topic, ns.
fn usual_offset(messages: &mut [Stamped], topic: &str) -> Option<i64> {
    median(of(messages, topic).iter().map(|message| offset(message)).collect())
}

/// A topic whose stamps are of another clock is stamped by the clock of the leading topic, as it was received.
fn join(messages: &mut [Stamped], topic: &str, leading: i64, account: &mut Account) {
    let Some(own) = usual_offset(messages, topic) else { return };
    let apart = own - leading;
    if apart.abs() <= ONE_CLOCK {
        return;
    }
    of(messages, topic).iter_mut().for_each(|message| message.stamp += apart);
    account.warn(format!(
        "the stamps of {topic} are of another clock, {:.3} s from that of the odometry: they were moved by that, so that both agree with the \
         times at which they were received",
        apart as f64 / SECOND as f64
    ));
}

#[cfg(test)]
mod tests {
    use super::*;

    const MILLI: i64 = 1_000_000;
    const EPOCH: i64 = 1_700_000_000 * SECOND;

    /// Odometry every 50 ms and a scan every 100 ms, 3 ms behind their stamps.
    fn drive() -> Vec<Stamped<'static>> {
        let message = |topic, at: i64| Stamped { topic, received: at + 3 * MILLI, stamp: at };
        let both = (0..100).flat_map(|step| {
            let at = EPOCH + 50 * MILLI * step;
            let scan = (step % 2 == 0).then(|| message("/scan", at));
            std::iter::once(message("/odom", at)).chain(scan)
        });
        both.collect()
    }

    fn settled(mut messages: Vec<Stamped>) -> (Vec<i64>, Vec<String>) {
        let mut account = Account::default();
        settle(&mut messages, "/odom", &mut account);
        (messages.iter().map(|message| message.stamp).collect(), account.warnings())
    }

    fn right() -> Vec<i64> {
        drive().iter().map(|message| message.stamp).collect()
    }

    #[test]
    fn good_stamps_stay() {
        assert_eq!(settled(drive()), (right(), Vec::new()));
    }

    #[test]
    fn single_stamps_that_cannot_be_are_mended() {
        for wrong in [0, -SECOND, EPOCH + 1000 * SECOND, 1] {
            for place in [0, 1, 70, 149] {
                let mut messages = drive();
                messages[place].stamp = wrong;
                let (stamps, warnings) = settled(messages);
                assert_eq!((stamps, warnings.len()), (right(), 1), "{wrong} {place}");
            }
        }
    }

    #[test]
    fn another_clock_and_none_agree_with_the_times_of_receipt() {
        for change in [|stamp: i64| stamp - EPOCH + 31 * SECOND, |stamp: i64| stamp + 2 * SECOND, |_| 0] {
            let mut messages = drive();
            messages.iter_mut().filter(|one| one.topic == "/scan").for_each(|one| one.stamp = change(one.stamp));
            let (stamps, warnings) = settled(messages);
            assert!(stamps.iter().zip(right()).all(|(found, right)| (found - right).abs() <= 3 * MILLI));
            assert!(!warnings.is_empty());
        }
    }

    #[test]
    fn a_clock_that_starts_again_goes_on() {
        let mut messages = drive();
        let start = messages[0].stamp;
        messages[75..].iter_mut().for_each(|message| message.stamp -= 2 * SECOND);
        messages[120..].iter_mut().for_each(|message| message.stamp -= SECOND);
        let mut account = Account::default();
        let restarts = settle(&mut messages, "/odom", &mut account);
        assert_eq!(restarts.len(), 2);
        let stamps: Vec<i64> = messages.iter().map(|message| message.stamp).collect();
        assert_eq!((stamps, start), (right(), EPOCH));
    }

    #[test]
    fn the_clock_of_a_slow_simulation_is_no_fault() {
        let mut messages = drive();
        // Ten seconds pass for the recorder in one of the simulation.
        for message in &mut messages {
            message.received = EPOCH + 10 * (message.received - EPOCH);
        }
        assert_eq!(settled(messages), (right(), Vec::new()));
    }
}
