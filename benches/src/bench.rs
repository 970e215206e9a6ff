//! The measurement itself: round by round, size by size, all peers in turn.

use std::collections::BTreeMap;

use anyhow::ensure;
use squad::stop::StopFlag;

use crate::{
    floor,
    lamplight::Lamplight,
    peer::Peer,
    results::{Round, Size},
};

/// Measurements to make, and how often.
#[derive(Debug)]
pub(crate) struct Plan {
    /// Peers, in this order.
    pub(crate) peers: Vec<Peer>,
    /// Swarm sizes.
    pub(crate) robots: Vec<u32>,
    /// How often each.
    pub(crate) rounds: u32,
    /// Ticks whose median is one measurement.
    pub(crate) ticks: u32,
}

/// Measures all of `plan`. What fails at one size is missing there and not tried again. Once `stop` is raised,
/// returns what there is by then.
///
/// An error if the engines disagree: then nothing that was measured is to be believed.
pub(crate) fn measure(
    plan: &Plan,
    lamplight: Option<&Lamplight>,
    stop: &StopFlag,
) -> anyhow::Result<Vec<Size>> {
    let mut sizes: Vec<Size> = plan.robots.iter().map(|&robots| Size::of(robots)).collect();
    for number in 1..=plan.rounds {
        for size in &mut sizes {
            eprintln!("round {number} of {}: {} robots", plan.rounds, size.robots);
            let round = measure_round(plan, size, lamplight, stop)?;
            size.rounds.push(round);
            if stop.is_raised() {
                return Ok(sizes);
            }
        }
    }
    Ok(sizes)
}

fn measure_round(
    plan: &Plan,
    size: &mut Size,
    lamplight: Option<&Lamplight>,
    stop: &StopFlag,
) -> anyhow::Result<Round> {
    let (mut round, mut digests) = (Round::default(), BTreeMap::new());
    for &peer in &plan.peers {
        if size.missing.contains_key(&peer) {
            continue;
        }
        let measured = measure_peer(plan, peer, size.robots, lamplight, stop);
        if stop.is_raised() {
            break;
        }
        match measured {
            Err(error) => {
                eprintln!("{} at {} robots is left out: {error:#}", peer.name(), size.robots);
                size.missing.insert(peer, format!("{error:#}"));
            }
            Ok(measured) => {
                round.tick_us.insert(peer, measured.tick_us);
                if let Some((heard, digest)) = measured.run {
                    round.heard = Some(heard);
                    digests.insert(digest, peer.name());
                }
            }
        }
    }
    ensure!(digests.len() <= 1, "the engines disagree at {} robots: {digests:?}", size.robots);
    Ok(round)
}

struct Measured {
    tick_us: f64,
    /// Packets heard per robot and tick, and the digest.
    run: Option<(f64, String)>,
}

fn measure_peer(
    plan: &Plan,
    peer: Peer,
    robots: u32,
    lamplight: Option<&Lamplight>,
    stop: &StopFlag,
) -> anyhow::Result<Measured> {
    match peer.engine().zip(lamplight) {
        Some((engine, lamplight)) => {
            let summary = lamplight.run(engine, robots, plan.ticks, stop)?;
            let run = Some((summary.heard_per_robot_and_tick(), summary.digest));
            Ok(Measured { tick_us: summary.tick_us.p50, run })
        }
        None => {
            let median = floor::median_tick(&mut *peer.raise(robots)?, plan.ticks, stop)?;
            Ok(Measured { tick_us: median.as_secs_f64() * 1e6, run: None })
        }
    }
}
