//! A bounded queue from one thread to another. The one that sends never waits for room. Nobody is woken while the queue is
//! locked: the channels of the standard library do so, and then who is woken waits at once for who wakes it.

use std::collections::VecDeque;
use std::sync::Arc;
use std::thread::Thread;
use std::time::Instant;

use super::lock::Lock;

struct State<T> {
    items: VecDeque<T>,
    /// Who waits for an item.
    waiting: Option<Thread>,
    has_sender: bool,
}

struct Shared<T> {
    state: Lock<State<T>>,
    capacity: usize,
}

/// The end at which items are sent.
pub struct Sender<T>(Arc<Shared<T>>);

/// The end at which they are received.
pub struct Receiver<T>(Arc<Shared<T>>);

/// Nothing comes any more: the other end is gone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Closed;

/// A queue of at most so many items.
#[must_use]
pub fn queue<T>(capacity: usize) -> (Sender<T>, Receiver<T>) {
    let state = State { items: VecDeque::with_capacity(capacity), waiting: None, has_sender: true };
    let shared = Arc::new(Shared { state: Lock::new(state), capacity });
    (Sender(Arc::clone(&shared)), Receiver(shared))
}

impl<T> Sender<T> {
    /// Sends an item, and wakes who waits for it.
    ///
    /// # Errors
    /// The item, if there is no room for it.
    pub fn send(&self, item: T) -> Result<(), T> {
        let mut state = self.0.state.lock();
        if state.items.len() >= self.0.capacity {
            return Err(item);
        }
        state.items.push_back(item);
        let waiting = state.waiting.take();
        drop(state);
        if let Some(thread) = waiting {
            thread.unpark();
        }
        Ok(())
    }
}

impl<T> Drop for Sender<T> {
    fn drop(&mut self) {
        let mut state = self.0.state.lock();
        state.has_sender = false;
        let waiting = state.waiting.take();
        drop(state);
        if let Some(thread) = waiting {
            thread.unpark();
        }
    }
}

impl<T> Receiver<T> {
    /// The next item, if there is one.
    #[must_use]
    pub fn receive(&self) -> Option<T> {
        self.0.state.lock().items.pop_front()
    }

    /// The next item. None if none has come until `deadline`.
    ///
    /// # Errors
    /// [`Closed`] if there is none, and none will come.
    pub fn wait(&self, deadline: Instant) -> Result<Option<T>, Closed> {
        loop {
            let mut state = self.0.state.lock();
            if let Some(item) = state.items.pop_front() {
                return Ok(Some(item));
            }
            if !state.has_sender {
                return Err(Closed);
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                state.waiting = None;
                return Ok(None);
            }
            state.waiting = Some(std::thread::current());
            drop(state);
            std::thread::park_timeout(left);
        }
    }
}

impl<T> std::fmt::Debug for Sender<T> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        formatter.debug_struct("Sender").finish_non_exhaustive()
    }
}

impl<T> std::fmt::Debug for Receiver<T> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        formatter.debug_struct("Receiver").finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::{Closed, queue};

    #[test]
    fn items_come_in_order_and_what_does_not_fit_comes_back() {
        let (sender, receiver) = queue(2);
        assert_eq!([sender.send(1), sender.send(2), sender.send(3)], [Ok(()), Ok(()), Err(3)]);
        assert_eq!(receiver.receive(), Some(1));
        assert_eq!(sender.send(4), Ok(()));
        let past = Instant::now();
        assert_eq!(
            [receiver.wait(past), receiver.wait(past), receiver.wait(past)],
            [Ok(Some(2)), Ok(Some(4)), Ok(None)]
        );
        assert_eq!(sender.send(5), Ok(()));
        drop(sender);
        assert_eq!([receiver.wait(past), receiver.wait(past)], [Ok(Some(5)), Err(Closed)]);
    }

    /// Who waits is woken by an item, and by the end: neither wait would end else within the test.
    #[test]
    fn who_waits_is_woken() {
        let ((sender, receiver), (answers, answered)) = (queue(1), queue(1));
        let later = Instant::now() + Duration::from_secs(3600);
        std::thread::scope(|scope| {
            scope.spawn(move || {
                while let Ok(Some(item)) = receiver.wait(later) {
                    assert_eq!(answers.send(2 * item), Ok(()));
                }
            });
            for item in 0..1000 {
                assert_eq!(sender.send(item), Ok(()));
                assert_eq!(answered.wait(later), Ok(Some(2 * item)));
            }
            drop(sender);
            assert_eq!(answered.wait(later), Err(Closed));
        });
    }
}
