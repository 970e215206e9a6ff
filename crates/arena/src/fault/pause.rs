//! `pause`: agents are stopped, and go on later as if nothing had been.

use protocol::percept::Tick;

use super::{Act, Fate, Presence, Strike, choice::Choice, ledger::Line, luck::Luck, rule::Rule};

#[derive(Debug, Default)]
pub(super) struct Pause {
    /// Whom it holds, and in which life.
    held: Vec<(u32, u32)>,
}

impl Rule for Pause {
    fn begin(
        &mut self,
        tick: Tick,
        choice: &Choice,
        fates: &mut [Fate],
        strikes: &mut Vec<Strike>,
        line: &mut Line,
    ) {
        for robot in choice.robots() {
            let Fate { life, presence } = &mut fates[robot as usize];
            match presence {
                Presence::Down => continue,
                Presence::Paused { holders } => *holders += 1,
                Presence::Up => {
                    *presence = Presence::Paused { holders: 1 };
                    strikes.push(Strike { robot, act: Act::Pause });
                }
            }
            self.held.push((robot, *life));
            line.did(tick, "robots paused", robot);
        }
    }

    /// Who is held by another fault as well stays; who was killed meanwhile is no longer held.
    fn end(&mut self, _: Luck, fates: &mut [Fate], strikes: &mut Vec<Strike>, line: &mut Line) {
        for &(robot, held_life) in &self.held {
            let Fate { life, presence } = &mut fates[robot as usize];
            match presence {
                Presence::Paused { holders } if *life == held_life => {
                    *holders -= 1;
                    if *holders == 0 {
                        *presence = Presence::Up;
                        strikes.push(Strike { robot, act: Act::Resume });
                        line.count("robots resumed");
                    }
                }
                _ => {}
            }
        }
    }
}
