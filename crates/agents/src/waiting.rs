//! Robots that are waited for, as those who watch are told.

use std::time::{Duration, Instant};

use processes::State;
use protocol::percept::Tick;
use squad::{Awaited, NAMED_MAX, Waited, Waiting, WaitingSink, moment::Moment};
use transport::raw::BOOT_TICK;

use crate::{member::Member, roster::Roster};

/// Time between two words about who is waited for.
const EVERY: Duration = Duration::from_millis(100);
/// A robot that answers within this is not waited for.
const NOTICEABLE: Duration = Duration::from_millis(20);
/// Processes that are asked for their state when many are waited for: a look takes some 10 µs.
const LOOKED_AT_MAX: usize = 64;

impl Roster {
    /// Tells `waiting` that `tick` waits for `robots` since then, if that is so for long enough and it does not know
    /// yet.
    pub(crate) fn wait_for(
        &mut self,
        what: Awaited,
        robots: &[usize],
        tick: Tick,
        since: Moment,
        waiting: &mut WaitingSink<'_>,
    ) {
        if since.elapsed() >= NOTICEABLE {
            self.tell_of(what, || robots.iter().map(|&index| (index, since)).collect(), tick, waiting);
        }
    }

    /// Tells `waiting` of robots, each since when, if it is time to; that there is nobody any more, at once.
    pub(crate) fn tell_of(
        &mut self,
        what: Awaited,
        robots: impl FnOnce() -> Vec<(usize, Moment)>,
        tick: Tick,
        waiting: &mut WaitingSink<'_>,
    ) {
        if self.waiting_told.is_some_and(|told| told.elapsed() < EVERY) {
            return;
        }
        match self.waiting(what, robots().into_iter(), tick) {
            None => self.nobody_is_waited_for(waiting),
            robots => {
                waiting(robots);
                self.waiting_told = Some(Instant::now());
            }
        }
    }

    /// Tells `waiting` that nobody is waited for any more.
    pub(crate) fn nobody_is_waited_for(&mut self, waiting: &mut WaitingSink<'_>) {
        if self.waiting_told.take().is_some() {
            waiting(None);
        }
    }

    /// `robots`, each of which is waited for since then, with what their processes are doing. First those that will
    /// not answer by themselves.
    fn waiting(
        &self,
        what: Awaited,
        robots: impl Iterator<Item = (usize, Moment)>,
        tick: Tick,
    ) -> Option<Waiting> {
        let mut robots = robots;
        let mut looked_at: Vec<(State, Waited)> = robots
            .by_ref()
            .take(LOOKED_AT_MAX)
            .map(|(index, since)| {
                let Member { id, process, .. } = &self.members[index];
                let state = process.map(|process| process.state());
                let waited = Waited {
                    id: *id,
                    pid: process.map(|process| process.pid()),
                    state: state.map(|state| state.to_string()),
                    for_s: since.elapsed().as_secs_f64(),
                };
                (state.unwrap_or(State::Running), waited)
            })
            .collect();
        let count = looked_at.len() + robots.count();
        looked_at.sort_by_key(|(state, _)| match state {
            State::Dead => 0,
            State::Stopped => 1,
            State::Blocked => 2,
            State::Sleeping | State::Running => 3,
        });
        let robots: Vec<Waited> = looked_at.into_iter().map(|(_, waited)| waited).take(NAMED_MAX).collect();
        // What happens before the first tick belongs to tick 0.
        let tick = if tick == BOOT_TICK { 0 } else { tick };
        (count > 0).then_some(Waiting { what, tick, count, robots })
    }
}
