//! The peers that are measured.

use anyhow::bail;
use clap::ValueEnum;

use crate::{
    floor::{Floor, futex::Futex, idle::Idle, pipes, sockets},
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
    /// A ZeroMQ ROUTER, and a DEALER per process
    Zeromq,
    /// Our lock-step with an empty controller and no arena
    Idle,
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
            Self::Zeromq => "zeromq",
            Self::Idle => "idle",
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
            #[cfg(feature = "zeromq")]
            Self::Zeromq => Box::new(crate::floor::zeromq::Zeromq::raise(robots)?),
            #[cfg(not(feature = "zeromq"))]
            Self::Zeromq => bail!(NO_ZEROMQ),
            Self::Idle => Box::new(Idle::raise(robots)?),
            Self::Lockstep | Self::InProcess => bail!("`lamplight` plays the ticks of {}", self.name()),
        })
    }

    /// Why it cannot be measured by this build, if so.
    pub(crate) fn lacking(self) -> Option<&'static str> {
        (self == Self::Zeromq && !cfg!(feature = "zeromq")).then_some(NO_ZEROMQ)
    }
}

const NO_ZEROMQ: &str = "this build cannot speak ZeroMQ (cargo feature `zeromq` of the package `benches`)";
