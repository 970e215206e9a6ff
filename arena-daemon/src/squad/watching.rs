//! Status of a squad of processes for those who watch: how each agent is, and who is waited for.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use protocol::percept::Tick;
use transport::raw::BOOT_TICK;

use super::roster::{AgentState, Member, Roster};
use crate::{
    live::{Awaited, EVERY, Live, NAMED_MAX, Participation, Robot, SquadStatus, Waited, Waiting},
    process::State,
    profile::Recorder,
    standstill::Moment,
};

/// A robot that answers within this is not waited for.
const NOTICEABLE: Duration = Duration::from_millis(20);
/// Processes that are asked for their state when many are waited for: a look takes some 10 µs.
const LOOKED_AT_MAX: usize = 64;

impl Roster {
    /// Returns the live state, for those who watch.
    pub(super) fn live(&self) -> Option<Arc<Live>> {
        self.host.live.clone()
    }

    /// Returns the status of all agents.
    pub(super) fn status_of_robots(&mut self, watched: bool) -> SquadStatus {
        let recorder = &mut self.recorder;
        recorder.iter_mut().for_each(|recorder| recorder.watch(watched));
        let agents = recorder.as_mut().and_then(Recorder::recent_times).map(Into::into);
        let recorder = self.recorder.as_ref();
        let robot = |(index, member): (usize, &Member)| Robot {
            id: member.id,
            pid: member.process.map(|process| process.pid()),
            participation: member.state.into(),
            cycles: recorder.and_then(|recorder| recorder.recent_cycles(index)),
            missed_deadlines: recorder.map_or(0, |recorder| recorder.missed_deadlines(index)),
            refused: member.refused,
        };
        let robots = self.members.iter().enumerate().map(robot).collect();
        SquadStatus { robots, agents, waiting: None }
    }

    /// Tells those who watch that `tick` waits for `robots` since then, if that is so for long enough and they do not
    /// know yet.
    pub(super) fn wait_for(&mut self, what: Awaited, robots: &[usize], tick: Tick, since: Moment) {
        let Some(live) = &self.host.live else { return };
        let known = self.waiting_told.is_some_and(|told| told.elapsed() < EVERY);
        if known || since.elapsed() < NOTICEABLE {
            return;
        }
        live.wait_for(self.waiting(what, robots.iter().map(|&index| (index, since)), tick));
        self.waiting_told = Some(Instant::now());
    }

    /// Notes that nobody is waited for any more.
    pub(super) fn nobody_is_waited_for(&mut self) {
        if self.waiting_told.take().is_some() {
            self.host.live.iter().for_each(|live| live.wait_for(None));
        }
    }

    /// `robots`, each of which is waited for since then, with what their processes are doing. First those that will
    /// not answer by themselves.
    pub(super) fn waiting(
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

impl From<AgentState> for Participation {
    fn from(state: AgentState) -> Self {
        match state {
            AgentState::Expected { .. } => Self::Expected,
            AgentState::Present => Self::Present,
            AgentState::Paused { .. } => Self::Paused,
            AgentState::Down => Self::Down,
            AgentState::Out => Self::Out,
        }
    }
}
