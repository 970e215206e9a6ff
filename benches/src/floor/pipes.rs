//! Two pipes for each agent: its standard input and output.

use std::{fs::File, io, os::fd::OwnedFd};

use super::streams::{AgentEnds, Ends, Streams};

/// Starts `robots` agents on pipes.
pub(crate) fn raise(robots: u32) -> anyhow::Result<Streams> {
    Streams::raise(robots, connect)
}

fn connect() -> io::Result<(Ends, AgentEnds)> {
    let (input, grants) = io::pipe()?;
    let (answers, output) = io::pipe()?;
    let (grants, answers) = (File::from(OwnedFd::from(grants)), File::from(OwnedFd::from(answers)));
    Ok((Ends { grants, answers: Some(answers) }, (input.into(), output.into())))
}
