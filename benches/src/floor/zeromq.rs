//! A ROUTER in the arena and a DEALER in every agent, over ZeroMQ's `ipc` transport.
//!
//! The arena grants the tick to each agent by its identity and collects the answers as they come: so a
//! coordinator over ZeroMQ keeps the clock of vehicles in processes of their own.
//!
//! Contract: nothing is left in the file system, whatever ends us, for the address has no file: it is in
//! Linux's abstract namespace.

use std::{
    os::unix::process::parent_id,
    process::{self, Command, Stdio},
};

use anyhow::{Context, bail, ensure};
use clap::Args;

use super::{
    ALIVE_POLL, ANSWER_BYTES, ANSWER_TIMEOUT, Floor, GRANT_BYTES, agents::Agents, answer, check, grant,
};
use crate::machine::our_name;

/// The hidden subcommand.
pub(crate) const AGENT: &str = "zeromq-agent";

/// Longest identity: the digits of a number.
const IDENTITY_MAX: usize = 10;

/// The arena's side: N connected agents.
pub(crate) struct Zeromq {
    _agents: Agents,
    router: zmq::Socket,
    /// By index; an agent's identity is its index in digits.
    identities: Vec<String>,
    /// The last tick that each has answered.
    answered: Vec<u64>,
}

/// Arguments of an agent.
#[derive(Args, Debug)]
pub(crate) struct AgentArgs {
    /// Where the ROUTER listens
    address: String,
    /// Our identity
    identity: String,
    /// Our parent's process number
    arena: u32,
}

impl Zeromq {
    /// Starts `robots` agents and waits until all have said hello.
    pub(crate) fn raise(robots: u32) -> anyhow::Result<Self> {
        let router = zmq::Context::new().socket(zmq::ROUTER)?;
        router.set_router_mandatory(true)?;
        router.set_linger(0)?;
        router.set_backlog(robots as i32)?;
        router.set_rcvtimeo(ANSWER_TIMEOUT.as_millis() as i32)?;
        let address = format!("ipc://@{}", our_name());
        router.bind(&address).with_context(|| format!("cannot listen at {address}"))?;
        let identities: Vec<String> = (0..robots).map(|index| index.to_string()).collect();
        let mut agents = Agents::default();
        for identity in &identities {
            agents.start(AGENT, |command: &mut Command| {
                command.args([&address, identity, &process::id().to_string()]);
                command.stdin(Stdio::null()).stdout(Stdio::null());
            })?;
        }
        let answered = vec![0; identities.len()];
        let floor = Self { _agents: agents, router, identities, answered };
        for _ in 0..robots {
            floor.receive(&mut [0; 0]).context("the agents did not start in time")?;
        }
        Ok(floor)
    }

    /// Reads the next message into `message`, which it must fill; returns the index of its sender.
    fn receive(&self, message: &mut [u8]) -> anyhow::Result<usize> {
        let mut identity = [0; IDENTITY_MAX];
        let length = self.router.recv_into(&mut identity, 0)?.min(IDENTITY_MAX);
        let index = str::from_utf8(&identity[..length])?.parse()?;
        ensure!(self.router.get_rcvmore()?, "agent {index} sent nothing");
        let length = self.router.recv_into(message, 0)?;
        ensure!(length == message.len(), "agent {index} sent {length} bytes, not {}", message.len());
        Ok(index)
    }
}

impl Floor for Zeromq {
    fn tick(&mut self, number: u64) -> anyhow::Result<()> {
        let grant = grant(number);
        for identity in &self.identities {
            self.router.send(identity.as_str(), zmq::SNDMORE)?;
            self.router.send(&grant[..], 0)?;
        }
        for _ in 0..self.identities.len() {
            let mut answer = [0; ANSWER_BYTES];
            let index = self.receive(&mut answer)?;
            check(&answer, number).with_context(|| format!("agent {index}"))?;
            let before =
                self.answered.get_mut(index).with_context(|| format!("there is no agent {index}"))?;
            ensure!(*before < number, "agent {index} has answered twice");
            *before = number;
        }
        Ok(())
    }
}

/// An agent's life: say hello, then sleep in a receive, answer, sleep.
pub(crate) fn agent(args: &AgentArgs) -> anyhow::Result<()> {
    let dealer = zmq::Context::new().socket(zmq::DEALER)?;
    dealer.set_identity(args.identity.as_bytes())?;
    dealer.set_linger(0)?;
    dealer.set_rcvtimeo(ALIVE_POLL.as_millis() as i32)?;
    dealer.connect(&args.address)?;
    dealer.send(&[][..], 0)?;
    let mut grant = [0; GRANT_BYTES];
    loop {
        match dealer.recv_into(&mut grant, 0) {
            Ok(length) => ensure!(length == GRANT_BYTES, "a grant of {length} bytes, not {GRANT_BYTES}"),
            Err(zmq::Error::EAGAIN | zmq::Error::EINTR) if parent_id() == args.arena => continue,
            Err(zmq::Error::EAGAIN) => bail!("the arena has died; agent {} leaves", args.identity),
            Err(error) => return Err(error.into()),
        }
        dealer.send(&answer(&grant)[..], 0)?;
    }
}
