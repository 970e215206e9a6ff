//! Lock-step: sleep until the doorbell rings, answer, sleep.

use std::time::{Duration, Instant};

use protocol::{
    doorbell::{Doorbell, Ring},
    run_dir::RunDir,
};

use crate::{Abandoned, agent::Agent};

/// How long an agent sleeps before it asks whether its arena still lives.
const ALIVE_POLL: Duration = Duration::from_millis(250);
/// How long rounds may pass it by before it understands that it has been left out.
const LEFT_OUT: Duration = Duration::from_secs(2);

pub(crate) fn run(mut agent: Agent, bell: &Doorbell, run: &RunDir) -> anyhow::Result<()> {
    let mut seen = bell.round();
    let mut answered = Instant::now();
    agent.announce()?;
    bell.answer();
    loop {
        match bell.wait_for_ring(seen, ALIVE_POLL) {
            Ring::Closed => return Ok(()),
            Ring::Round(round) => {
                seen = round;
                if agent.answer()? {
                    bell.answer();
                    answered = Instant::now();
                } else if answered.elapsed() > LEFT_OUT {
                    return Err(Abandoned::LeftOut { run: run.name().clone(), id: agent.id }.into());
                }
            }
            // The arena may be waiting for somebody else, or be gone.
            Ring::Silence if run.is_alive() => answered = Instant::now(),
            Ring::Silence => {
                return Err(Abandoned::ArenaDied { run: run.name().clone(), id: agent.id }.into());
            }
        }
    }
}
