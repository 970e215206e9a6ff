//! Results of the measurements, and as CSV.

use std::{collections::BTreeMap, io};

use crate::{peer::Peer, spread::Spread};

/// One measurement of each peer, taken one after the other.
#[derive(Clone, Debug, Default)]
pub(crate) struct Round {
    /// Median tick of each, µs.
    pub(crate) tick_us: BTreeMap<Peer, f64>,
    /// Packets a robot heard per tick, where an arena was there.
    pub(crate) heard: Option<f64>,
}

/// All rounds of one swarm size.
#[derive(Clone, Debug)]
pub(crate) struct Size {
    pub(crate) robots: u32,
    pub(crate) rounds: Vec<Round>,
    /// Peers that could not be measured, and why.
    pub(crate) missing: BTreeMap<Peer, String>,
}

impl Round {
    /// Median tick of `peer`, µs.
    pub(crate) fn tick_us(&self, peer: Peer) -> Option<f64> {
        self.tick_us.get(&peer).copied()
    }

    /// How many times a tick of `base` one of `peer` takes.
    pub(crate) fn ratio(&self, peer: Peer, base: Peer) -> Option<f64> {
        Some(self.tick_us(peer)? / self.tick_us(base)?)
    }
}

impl Size {
    /// Nothing measured yet.
    pub(crate) fn of(robots: u32) -> Self {
        Self { robots, rounds: Vec::new(), missing: BTreeMap::new() }
    }

    /// Over the rounds in which there is something; `None` if there is nothing in any.
    pub(crate) fn spread(&self, of: impl Fn(&Round) -> Option<f64>) -> Option<Spread> {
        let values: Vec<f64> = self.rounds.iter().filter_map(of).collect();
        (!values.is_empty()).then(|| Spread::of(values))
    }
}

/// One row for each measurement, and for each that could not be made one that says why.
pub(crate) fn write_csv(sizes: &[Size], output: impl io::Write) -> csv::Result<()> {
    let mut rows = csv::Writer::from_writer(output);
    rows.write_record(["robots", "round", "peer", "tick_us", "missing"])?;
    for size in sizes {
        let robots = size.robots.to_string();
        for (round, number) in size.rounds.iter().zip(1..) {
            for (peer, tick_us) in &round.tick_us {
                // To the nanosecond.
                let (number, tick_us) = (i32::to_string(&number), format!("{tick_us:.3}"));
                rows.write_record([&robots, &number, peer.name(), &tick_us, ""])?;
            }
        }
        for (peer, reason) in &size.missing {
            rows.write_record([&robots, "", peer.name(), "", reason])?;
        }
    }
    rows.flush()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_measurement_and_every_reason_is_a_row() {
        let mut size = Size::of(10);
        size.rounds
            .push(Round { tick_us: [(Peer::Futex, 12.5), (Peer::Lockstep, 20.0)].into(), heard: None });
        size.rounds.push(Round { tick_us: [(Peer::Futex, 13.0)].into(), heard: None });
        size.missing.insert(Peer::Zeromq, "not built, not wanted".into());
        let mut written = Vec::new();
        write_csv(&[size], &mut written).unwrap();
        assert_eq!(
            String::from_utf8(written).unwrap(),
            "robots,round,peer,tick_us,missing\n\
             10,1,futex,12.500,\n\
             10,1,lock-step,20.000,\n\
             10,2,futex,13.000,\n\
             10,,zeromq,,\"not built, not wanted\"\n"
        );
    }
}
