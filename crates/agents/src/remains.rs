//! Lives that are over for the arena, until their processes have ended too: SIGKILL takes its time.

use std::time::Duration;

use processes::{Process, State};
use protocol::robot_id::RobotId;
use squad::moment::Moment;
use transport::{
    run_dir::RunDir,
    services::{ArenaPorts, remove_dead_files},
};

use crate::supervisor_link::Lost;

/// How long the arena keeps what a life has left for the news that its process has died. Without
/// the news, a few small files stay until the run ends.
const DYING: Duration = Duration::from_secs(10);

/// Remains of ended lives: in no order, one per robot that ends, for the time its process takes to die.
#[derive(Debug, Default)]
pub(crate) struct Remains(Vec<EndedLife>);

#[derive(Debug)]
struct EndedLife {
    id: RobotId,
    process: Option<Process>,
    since: Moment,
    ports: ArenaPorts,
}

impl Remains {
    /// Keeps what life `id` has left.
    pub(crate) fn keep(&mut self, id: RobotId, process: Option<Process>, ports: ArenaPorts) {
        self.0.push(EndedLife { id, process, since: Moment::now(), ports });
    }

    /// Removes what lives have left whose processes have died: those of `lost`, or so the operating system says.
    pub(crate) fn remove_dead(&mut self, run: &RunDir, lost: &[Lost]) {
        let is_dead = |process: Process| process.state() == State::Dead;
        let is_over = |life: &mut EndedLife| {
            lost.iter().any(|lost| lost.id == life.id)
                || life.process.is_some_and(is_dead)
                || life.since.elapsed() > DYING
        };
        let over = self.0.extract_if(.., is_over).map(|life| life.ports).collect::<Vec<_>>();
        remove_dead_files(run, over);
    }

    /// Lets go of all: the run ends, and removes its files itself.
    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }
}
