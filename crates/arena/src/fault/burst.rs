//! `burst`: each link is good or bad, and stays so for a while (Gilbert 1960, Elliott 1963).
//!
//! A link turns from good to bad with chance p per neighbor cycle and back with chance r, so a
//! share p/(p + r) of the time is bad, in bursts of 1/r cycles on average.

use std::collections::BTreeMap;

use super::{
    rng::FaultRng,
    rule::{Flight, Rule, Verdict},
};
use crate::channel::Reception;
use crate::payloads::Payloads;
use scenario::{Scenario, fault};

#[derive(Debug)]
pub(super) struct Burst {
    p: f64,
    r: f64,
    loss_good: f64,
    loss_bad: f64,
    /// State of each link, and the sender's packet it belongs to.
    links: BTreeMap<(u32, u32), Link>,
}

#[derive(Clone, Copy, Debug)]
struct Link {
    number: u64,
    bad: bool,
}

impl Burst {
    pub(super) fn new(spec: &fault::Burst, _: &Scenario) -> Self {
        Self {
            p: spec.p.get(),
            r: spec.r.get(),
            loss_good: spec.loss_good.get(),
            loss_bad: spec.loss_bad.get(),
            links: BTreeMap::new(),
        }
    }

    /// Chance that a link is bad, `cycles` after it was known to be bad or good. A link of which
    /// nothing is known is as bad as links are on average.
    fn chance_of_bad(&self, before: Option<Link>, number: u64) -> f64 {
        let stationary = self.p / (self.p + self.r);
        let Some(link) = before else { return stationary };
        let cycles = number.saturating_sub(link.number) as f64;
        let memory = libm::pow(1.0 - self.p - self.r, cycles);
        stationary + (f64::from(u8::from(link.bad)) - stationary) * memory
    }
}

impl Rule for Burst {
    fn judge(&mut self, flight: &Flight, rng: FaultRng, _: &mut Payloads) -> Verdict {
        let Reception { sender, receiver, number, .. } = flight.reception;
        let mut draws = rng.of(&flight.reception);
        let before = self.links.get(&(sender, receiver)).copied();
        let bad = draws.chance(self.chance_of_bad(before, number));
        self.links.insert((sender, receiver), Link { number, bad });
        match draws.chance(if bad { self.loss_bad } else { self.loss_good }) {
            true => Verdict::Drop("packets dropped"),
            false => Verdict::Pass,
        }
    }
}
