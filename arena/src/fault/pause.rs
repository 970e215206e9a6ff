//! `pause`: agents are stopped, and go on later as if nothing had been.

use protocol::percept::Tick;

use super::{Act, Presence, Strike, choice::Choice, ledger::Line, luck::Luck, rule::Rule};

#[derive(Debug, Default)]
pub(super) struct Pause {
    /// Whom it has stopped.
    stopped: Vec<u32>,
}

impl Rule for Pause {
    fn begin(
        &mut self,
        tick: Tick,
        choice: &Choice,
        presences: &mut [Presence],
        strikes: &mut Vec<Strike>,
        line: &mut Line,
    ) {
        for robot in choice.robots() {
            let presence = &mut presences[robot as usize];
            if *presence == Presence::Up {
                *presence = Presence::Paused;
                self.stopped.push(robot);
                strikes.push(Strike { robot, act: Act::Pause });
                line.did(tick, "robots paused", robot);
            }
        }
    }

    fn end(&mut self, _: Luck, presences: &mut [Presence], strikes: &mut Vec<Strike>, line: &mut Line) {
        for &robot in &self.stopped {
            let presence = &mut presences[robot as usize];
            // It may have been killed meanwhile.
            if *presence == Presence::Paused {
                *presence = Presence::Up;
                strikes.push(Strike { robot, act: Act::Resume });
                line.count("robots resumed");
            }
        }
    }
}
