//! The processes of a floor.

use std::{
    os::unix::process::CommandExt,
    process::{Child, Command},
};

use anyhow::Context;

/// Processes of this program, ended when this is dropped.
#[derive(Debug, Default)]
pub(super) struct Agents(Vec<Child>);

impl Agents {
    /// Starts one more: this program with the hidden subcommand `kind`, as `told`.
    pub(super) fn start(&mut self, kind: &str, told: impl FnOnce(&mut Command)) -> anyhow::Result<()> {
        let mut command = Command::new(std::env::current_exe().context("cannot find our own program")?);
        // In a group of its own: Ctrl-C reaches us alone, and we end the agents between two ticks.
        command.arg(kind).process_group(0);
        told(&mut command);
        let number = self.0.len();
        self.0.push(command.spawn().with_context(|| format!("cannot start {kind} {number}"))?);
        Ok(())
    }

    /// How many have been started.
    pub(super) fn count(&self) -> u32 {
        self.0.len() as u32
    }
}

impl Drop for Agents {
    /// They keep nothing that would have to be put away, so they need no time to leave.
    fn drop(&mut self) {
        for agent in &mut self.0 {
            let _ = agent.kill();
        }
        for agent in &mut self.0 {
            let _ = agent.wait();
        }
    }
}
