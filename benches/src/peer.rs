//! Who is measured.

use anyhow::bail;
use clap::ValueEnum;

use crate::{
    floor::{Floor, futex::Futex, pipes, sockets},
    lamplight::Engine,
};

/// One way to play a tick, in the order of the columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub(crate) enum Peer {
    /// A shared page and a broadcast futex: the floor
    Futex,
    /// Two pipes per process
    Pipes,
    /// A pair of Unix sockets (SEQPACKET) per process
    Sockets,
    /// Our lock-step, whole: `lamplight run`
    Lockstep,
    /// Our tick in one process: `lamplight run --engine in-process`
    InProcess,
}

impl Peer {
    /// As tables and figures call it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Futex => "futex",
            Self::Pipes => "pipes",
            Self::Sockets => "sockets",
            Self::Lockstep => "lock-step",
            Self::InProcess => "in-process",
        }
    }

    /// The engine of `lamplight` that plays its ticks; `None` for a floor.
    pub(crate) fn engine(self) -> Option<Engine> {
        match self {
            Self::Lockstep => Some(Engine::Lockstep),
            Self::InProcess => Some(Engine::InProcess),
            _ => None,
        }
    }

    /// Starts the processes of a floor.
    pub(crate) fn raise(self, robots: u32) -> anyhow::Result<Box<dyn Floor>> {
        Ok(match self {
            Self::Futex => Box::new(Futex::raise(robots)?),
            Self::Pipes => Box::new(pipes::raise(robots)?),
            Self::Sockets => Box::new(sockets::raise(robots)?),
            Self::Lockstep | Self::InProcess => bail!("`lamplight` plays the ticks of {}", self.name()),
        })
    }
}
