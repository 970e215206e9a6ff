//! Lock-step: sleep until the doorbell rings, answer, sleep.

use std::time::{Duration, Instant};

use protocol::{controller::Controller, params::Params, robot_id::RobotId};
use transport::{
    doorbell::{Doorbell, Ring},
    run_dir::{ArenaWatch, RunDir},
};

use crate::{abandoned::Abandoned, agent::Agent};

/// How long an agent sleeps before it asks whether its arena still lives.
const ALIVE_POLL: Duration = Duration::from_millis(250);
/// How long rounds may pass it by before it understands that it has been left out.
const LEFT_OUT: Duration = Duration::from_secs(2);
/// Rounds that pass by come often. After a gap like this the agent was itself away, stopped perhaps, and those
/// before it say nothing.
const AWAY: Duration = Duration::from_secs(1);

pub(crate) fn run<C: Controller, N: Fn(RobotId, &Params) -> anyhow::Result<C>>(
    agent: &mut Agent<C, N>,
    bell: &Doorbell,
    run: &RunDir,
    arena: &ArenaWatch,
) -> anyhow::Result<()> {
    let mut seen = bell.round();
    let mut passed_by = None;
    agent.announce(run)?;
    bell.answer();
    loop {
        // In a steady tick no clock of the operating system is read.
        let ring = bell.wait_for_ring(seen, ALIVE_POLL);
        agent.stopwatch.woke();
        match ring {
            Ring::Closed => return Ok(()),
            Ring::Round(round) => {
                seen = round;
                if agent.answer(run)? {
                    bell.answer();
                    passed_by = None;
                } else if passed_by.get_or_insert_with(PassedBy::begin).goes_on() > LEFT_OUT {
                    return Err(Abandoned::LeftOut { run: run.name().clone(), id: agent.id }.into());
                }
            }
            Ring::Silence if run.life_is_over(agent.id) => {
                return Err(Abandoned::LeftOut { run: run.name().clone(), id: agent.id }.into());
            }
            // The arena may be waiting for somebody else.
            Ring::Silence if arena.is_alive() => {}
            Ring::Silence => {
                return Err(Abandoned::ArenaDied { run: run.name().clone(), id: agent.id }.into());
            }
        }
    }
}

/// Rounds that have begun without a percept for this robot.
struct PassedBy {
    since: Instant,
    latest: Instant,
}

impl PassedBy {
    fn begin() -> Self {
        let now = Instant::now();
        Self { since: now, latest: now }
    }

    /// Another one: for how long now.
    fn goes_on(&mut self) -> Duration {
        let now = Instant::now();
        if now - self.latest > AWAY {
            self.since = now;
        }
        self.latest = now;
        now - self.since
    }
}
