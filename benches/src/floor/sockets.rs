//! A pair of Unix sockets for each agent that keep messages apart (`SOCK_SEQPACKET`).

use std::{fs::File, io};

use rustix::net::{AddressFamily, SocketFlags, SocketType, socketpair};

use super::streams::{AgentEnds, Ends, Streams};

/// Starts `robots` agents on sockets.
pub(crate) fn raise(robots: u32) -> anyhow::Result<Streams> {
    Streams::raise(robots, connect)
}

fn connect() -> io::Result<(Ends, AgentEnds)> {
    let (ours, input) = socketpair(AddressFamily::UNIX, SocketType::SEQPACKET, SocketFlags::CLOEXEC, None)?;
    let output = input.try_clone()?;
    Ok((Ends { grants: File::from(ours), answers: None }, (input, output)))
}
