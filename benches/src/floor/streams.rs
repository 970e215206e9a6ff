//! Floors whose agents read from one descriptor and write to another: pipes and sockets.
//!
//! The arena writes every grant, then sleeps in epoll and reads the answers as they come. A grant is written
//! and read by one call: it is shorter than `PIPE_BUF` (4096 bytes), and a socket keeps it a record.
//! An agent leaves at the end of its input, so none outlives us.

use std::{
    fs::File,
    io::{self, Read, Write},
    os::fd::{AsFd, OwnedFd},
    process::{Command, Stdio},
};

use anyhow::{Context, ensure};
use rustix::{
    buffer::spare_capacity,
    event::{Timespec, epoll},
    io::Errno,
};

use super::{ANSWER_BYTES, ANSWER_TIMEOUT, Floor, GRANT_BYTES, agents::Agents, answer, check, grant};

/// The hidden subcommand.
pub(crate) const AGENT: &str = "stream-agent";

/// The arena's ends to one agent.
#[derive(Debug)]
pub(super) struct Ends {
    pub(super) grants: File,
    /// `None` where one descriptor serves both ways.
    pub(super) answers: Option<File>,
}

/// An agent's standard input and output.
pub(super) type AgentEnds = (OwnedFd, OwnedFd);

/// The arena's side: N agents on descriptors.
pub(crate) struct Streams {
    // Ended before their ends are closed.
    _agents: Agents,
    ends: Vec<Ends>,
    ready: OwnedFd,
    events: Vec<epoll::Event>,
}

impl Ends {
    fn answers(&self) -> &File {
        self.answers.as_ref().unwrap_or(&self.grants)
    }
}

impl Streams {
    /// Starts `robots` agents, each on a pair of ends that `connect` makes.
    pub(super) fn raise(
        robots: u32,
        connect: impl Fn() -> io::Result<(Ends, AgentEnds)>,
    ) -> anyhow::Result<Self> {
        let ready = epoll::create(epoll::CreateFlags::CLOEXEC)?;
        let (mut agents, mut ends) = (Agents::default(), Vec::new());
        for index in 0..robots {
            let (ours, (input, output)) =
                connect().with_context(|| format!("cannot connect agent {index}"))?;
            let data = epoll::EventData::new_u64(index.into());
            epoll::add(&ready, ours.answers(), data, epoll::EventFlags::IN)?;
            agents.start(AGENT, |command: &mut Command| {
                command.stdin(Stdio::from(input)).stdout(Stdio::from(output));
            })?;
            ends.push(ours);
        }
        Ok(Self { _agents: agents, ends, ready, events: Vec::with_capacity(robots as usize) })
    }
}

impl Floor for Streams {
    fn tick(&mut self, number: u64) -> anyhow::Result<()> {
        let grant = grant(number);
        for (index, ends) in self.ends.iter().enumerate() {
            let sent = (&ends.grants).write(&grant).with_context(|| format!("agent {index} has left"))?;
            ensure!(sent == GRANT_BYTES, "agent {index} was granted {sent} bytes only");
        }
        let timeout = Timespec { tv_sec: ANSWER_TIMEOUT.as_secs() as i64, tv_nsec: 0 };
        let mut missing = self.ends.len();
        while missing > 0 {
            match epoll::wait(&self.ready, spare_capacity(&mut self.events), Some(&timeout)) {
                Err(Errno::INTR) => continue,
                outcome => ensure!(outcome? > 0, "{missing} agents do not answer tick {number}"),
            }
            for event in self.events.drain(..) {
                let index = event.data.u64() as usize;
                let mut answer = [0; ANSWER_BYTES];
                let read = self.ends[index].answers().read(&mut answer)?;
                ensure!(read == ANSWER_BYTES, "agent {index} sent {read} bytes, not {ANSWER_BYTES}");
                check(&answer, number).with_context(|| format!("agent {index}"))?;
                missing -= 1;
            }
        }
        Ok(())
    }
}

/// An agent's life: sleep in a read, answer, sleep.
pub(crate) fn agent() -> anyhow::Result<()> {
    let mut input = File::from(io::stdin().as_fd().try_clone_to_owned()?);
    let mut output = File::from(io::stdout().as_fd().try_clone_to_owned()?);
    serve(&mut input, &mut output)
}

fn serve(input: &mut impl Read, output: &mut impl Write) -> anyhow::Result<()> {
    let mut grant = [0; GRANT_BYTES];
    loop {
        match input.read(&mut grant)? {
            0 => return Ok(()),
            read => ensure!(read == GRANT_BYTES, "a grant of {read} bytes, not {GRANT_BYTES}"),
        }
        output.write_all(&answer(&grant))?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_agent_answers_every_grant_and_leaves_at_the_end_of_its_input() {
        let (grants, mut answers) = ([grant(3), grant(4)].concat(), Vec::new());
        serve(&mut &grants[..], &mut answers).unwrap();
        assert_eq!(answers, [answer(&grant(3)), answer(&grant(4))].concat());
    }

    #[test]
    fn half_a_grant_is_refused() {
        let error = serve(&mut &grant(3)[..100], &mut Vec::new()).unwrap_err();
        assert_eq!(error.to_string(), "a grant of 100 bytes, not 768");
    }
}
