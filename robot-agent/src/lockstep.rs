//! Lock-step: sleep until the doorbell rings, answer, sleep.

use std::time::{Duration, Instant};

use protocol::{
    doorbell::{Doorbell, Ring},
    run_dir::{ArenaWatch, RunDir},
};

use crate::{Abandoned, agent::Agent};

/// How long an agent sleeps before it asks whether its arena still lives.
const ALIVE_POLL: Duration = Duration::from_millis(250);
/// How long rounds may pass it by before it understands that it has been left out.
const LEFT_OUT: Duration = Duration::from_secs(2);
/// An agent that runs looks around every [`ALIVE_POLL`]. After a gap like this it was itself away,
/// stopped perhaps, and rounds that passed it by until then say nothing.
const AWAY: Duration = Duration::from_secs(1);

pub(crate) fn run(mut agent: Agent, bell: &Doorbell, run: &RunDir, arena: &ArenaWatch) -> anyhow::Result<()> {
    let mut seen = bell.round();
    let mut passed_by_since = None;
    agent.announce()?;
    bell.answer();
    let mut looked = Instant::now();
    loop {
        let ring = bell.wait_for_ring(seen, ALIVE_POLL);
        if looked.elapsed() > AWAY {
            passed_by_since = None;
        }
        looked = Instant::now();
        match ring {
            Ring::Closed => return Ok(()),
            Ring::Round(round) => {
                seen = round;
                if agent.answer(run)? {
                    bell.answer();
                    passed_by_since = None;
                } else if passed_by_since.get_or_insert_with(Instant::now).elapsed() > LEFT_OUT {
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
