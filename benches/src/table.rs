//! The result as a Markdown table.

use crate::spread::{Spread, figures};

/// One measurement of each kind, taken one after the other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Round {
    pub(crate) floor_us: f64,
    pub(crate) lockstep_us: f64,
    pub(crate) in_process_us: f64,
    /// Packets a robot heard per tick.
    pub(crate) heard: f64,
}

/// All rounds of one swarm size.
#[derive(Clone, Debug)]
pub(crate) struct Measurements {
    pub(crate) robots: u32,
    pub(crate) rounds: Vec<Round>,
}

impl Measurements {
    /// None yet.
    pub(crate) fn of(robots: u32) -> Self {
        Self { robots, rounds: Vec::new() }
    }

    fn spread(&self, of: impl Fn(&Round) -> f64) -> Spread {
        Spread::of(self.rounds.iter().map(of))
    }
}

const LEGEND: &str = "\
Median tick in µs; median of the rounds, in parentheses the least and the greatest. The floor is the
bare mechanism: a futex broadcast to N processes and a shared page, 8 × 96 B in and 96 B out for each;
no channel, no controller. Lock-step is a whole tick of ours: motion, the infrared channel, a checked
message to each robot's process, the real controller in it, and the answer; only metrics and outputs are
off the tick. In-process is the same tick in one loop. Ratios are formed within a round, then the median.";

const HEADER: &str = "\
| N | heard per robot | floor | lock-step | lock-step / floor | in-process | lock-step / in-process |
|--:|--:|--:|--:|--:|--:|--:|
";

/// Legend and table.
pub(crate) fn markdown(sizes: &[Measurements]) -> String {
    let rows: String = sizes.iter().map(row).collect();
    format!("{LEGEND}\n\n{HEADER}{rows}")
}

fn row(size: &Measurements) -> String {
    let robots = size.robots;
    let heard = figures(size.spread(|round| round.heard).median(), 3);
    let floor = size.spread(|round| round.floor_us);
    let lockstep = size.spread(|round| round.lockstep_us);
    let over_floor = size.spread(|round| round.lockstep_us / round.floor_us);
    let in_process = size.spread(|round| round.in_process_us);
    let over_in_process = size.spread(|round| round.lockstep_us / round.in_process_us);
    format!(
        "| {robots} | {heard} | {floor} | {lockstep} | {over_floor} | {in_process} | {over_in_process} |\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_compare_what_was_measured_together() {
        let round = |floor_us, lockstep_us| Round {
            floor_us,
            lockstep_us,
            in_process_us: lockstep_us / 4.0,
            heard: 8.0,
        };
        // The machine slowed down tenfold in the second round.
        let rounds = vec![round(100.0, 150.0), round(1000.0, 1500.0)];
        assert_eq!(
            row(&Measurements { robots: 10, rounds }),
            "| 10 | 8.00 | 550 (100–1000) | 825 (150–1500) | 1.50 (1.5–1.5) | 206 (38–375) | 4.00 (4.0–4.0) |\n"
        );
    }
}
