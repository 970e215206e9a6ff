//! A random fault plan, and perhaps a random channel, from one seed.
//!
//! In:  a sound scenario with the bounds of its `[fuzz]` table, and a seed.
//! Out: the same scenario with that seed, a plan drawn from it, and in half of the cases another channel;
//!      always one that parsing accepts.
//!
//! Every fault has a stream of draws of its own. Bounds hold as follows: no chance exceeds
//! `probability_max`, but for how soon a bad link recovers; no fault names more than `share_max` of the robots, nor
//! spans a disc larger than that share of the arena; nothing is later than `delay_max_s`, or one tick where that
//! is less. One robot, drawn for the whole plan, is never killed, so that somebody is always left.

use std::num::NonZeroU32;

use arena::random::{Draws, Purpose};
use scenario::{
    Capture, ChannelModel, ChannelSpec, Fault, FaultKind, Medium, NonNegative, Positive, Probability,
    Profile, Scenario, Seed,
    fault::{Pick, ShareOf, Target},
    file::{AccessKey, ChannelKeys},
};

/// Longest cycle of control times gain that a scenario may have.
const GAIN_CYCLE_MAX: f64 = scenario::MAX_GAIN_STEP;

/// `base` with this seed and what is drawn from it.
pub(crate) fn drawn(base: &Scenario, seed: Seed) -> Scenario {
    let mut scenario = Scenario { seed, fault: Vec::new(), ..base.clone() };
    let mut draws = Draws::of(seed.get(), Purpose::FuzzChannel, 0, 0, 0);
    if let ChannelModel::Range { range_m, .. } = base.channel.model
        && chance(&mut draws, 0.5)
    {
        scenario.channel = channel(base, range_m, &mut draws);
        // A hundred times worse than quartz, so that short runs feel it.
        if chance(&mut draws, 0.3) {
            let drift_ppm = nonnegative(short(draws.between(0.0, 5000.0)));
            scenario.processes.clock_drift_ppm = drift_ppm.unwrap_or(scenario.processes.clock_drift_ppm);
        }
    }
    scenario.fault = faults(&scenario);
    scenario
}

fn faults(scenario: &Scenario) -> Vec<Fault> {
    let mut draws = Draws::of(scenario.seed.get(), Purpose::FuzzPlan, 0, 0, 0);
    let robots = scenario.robot_count();
    let spared = below(&mut draws, robots.into()) as u32;
    // A robot alone cannot be killed: the run would have nobody left.
    let kinds = scenario.fuzz.kinds.iter().copied().filter(|kind| *kind != FaultKind::Kill || robots > 1);
    let kinds: Vec<FaultKind> = kinds.collect();
    if kinds.is_empty() {
        return Vec::new();
    }
    let count = 1 + below(&mut draws, scenario.fuzz.faults_max.get().into());
    let mut faults: Vec<Fault> = Vec::new();
    for place in 1..=count {
        let mut draws = Draws::of(scenario.seed.get(), Purpose::FuzzPlan, place, 0, 0);
        let mut fault = scenario.draw_fault(&kinds, spared, &mut || draws.unit());
        // Who a share strikes is known only when it does, so shares may overlap.
        if faults.iter().any(|earlier| earlier.excludes(&fault, robots).is_some())
            && let Target::Robots(choice) = &mut fault.target
        {
            choice.share = Some(ShareOf { share: scenario.fuzz.share_max, pick: Pick::Random });
        }
        faults.push(fault);
    }
    faults
}

/// Another channel of the same range; the cycle stays the scenario's where the profile's would not do.
fn channel(base: &Scenario, range_m: Positive, draws: &mut Draws) -> ChannelSpec {
    let accesses = [
        AccessKey::Instant,
        AccessKey::Random,
        AccessKey::Aligned,
        AccessKey::Slotted,
        AccessKey::FixedPhase,
    ];
    let profile = one_of(draws, &[Profile::Ideal, Profile::Isis, Profile::ROne]);
    let access = chance(draws, 0.6).then(|| one_of(draws, &accesses));
    let mut channel = ChannelKeys { profile, range_m: Some(range_m), access, ..Default::default() };
    if chance(draws, 0.5) {
        channel.soft_edge_m = nonnegative(short(draws.between(0.0, 0.5) * range_m.get()));
    }
    channel.occlusion = sometimes(draws);
    channel.loss = chance(draws, 0.5).then(|| Probability::new(short(draws.between(0.0, 0.5)))).flatten();
    let mut noise = |share: f64, most: f64| match chance(draws, share) {
        true => nonnegative(short(draws.between(0.0, most))),
        false => None,
    };
    channel.sigma_range = noise(0.3, 0.2);
    channel.sigma_bearing_deg = noise(0.3, 10.0);
    channel.sigma_orientation_deg = noise(0.3, 10.0);
    channel.range_step_m = noise(0.2, 0.3);
    // As many whole steps to a turn as there would be of the step that was drawn.
    let whole = |step: Option<NonNegative>| {
        step.filter(|step| step.get() > 0.0)
            .and_then(|step| nonnegative(360.0 / (360.0 / step.get()).round()))
    };
    channel.bearing_step_deg = whole(noise(0.2, 30.0));
    channel.orientation_step_deg = whole(noise(0.2, 30.0));

    let resolved = |keys: &ChannelKeys| {
        keys.clone().resolve(base.step_s).expect("all keys have a meaning beside each other")
    };
    let as_drawn = resolved(&channel);
    let highest_gain_per_s = base.laws().map(|law| law.gain_per_s.get()).fold(0.0, f64::max);
    let (own_cycle_s, longest_s) = (base.cycle_s(), GAIN_CYCLE_MAX / highest_gain_per_s);
    let its_cycle_s = as_drawn.cycle_s.get();
    let fits = base.step_s.get() <= its_cycle_s && its_cycle_s <= longest_s.min(base.duration_s.get());
    let cycle_s = if fits { its_cycle_s } else { own_cycle_s };
    channel.cycle_s = Positive::new(cycle_s).filter(|_| !fits);
    if as_drawn.medium == Medium::Instant {
        return resolved(&channel);
    }
    channel.half_duplex = sometimes(draws);
    channel.capture = one_of(draws, &[None, Some(Capture::None), Some(Capture::FirstLock)]);
    // The longest packet of any profile takes 0.03 s; eight fit into a cycle of it, or shorter ones.
    let airtime_s = (cycle_s / 8.0).min(0.03) * draws.between(0.05, 1.0);
    if !fits || chance(draws, 0.3) {
        channel.airtime_s = Positive::new(short(airtime_s));
    }
    match access {
        Some(AccessKey::FixedPhase) => {
            channel.jitter_s =
                chance(draws, 0.6).then(|| nonnegative(short(cycle_s * draws.between(0.0, 0.5)))).flatten();
        }
        Some(AccessKey::Slotted) if chance(draws, 0.5) => {
            channel.slots = NonZeroU32::new(1 + below(draws, 8) as u32);
        }
        _ => {}
    }
    // Drawn last, so that a seed's other keys stay what they were before there were these.
    if chance(draws, 0.3) {
        let farther = Positive::new(short(draws.between(1.05, 2.0) * range_m.get()));
        channel.interference_range_m = farther.filter(|farther| *farther >= range_m);
    }
    if channel.occlusion == Some(true) {
        channel.occluded_interference = sometimes(draws);
    }
    resolved(&channel)
}

fn sometimes(draws: &mut Draws) -> Option<bool> {
    one_of(draws, &[None, Some(false), Some(true)])
}

fn chance(draws: &mut Draws, probability: f64) -> bool {
    draws.unit() < probability
}

/// Uniform from 0 to `end` without it; 0 if there is nothing to choose.
fn below(draws: &mut Draws, end: u64) -> u64 {
    ((draws.unit() * end as f64) as u64).min(end.saturating_sub(1))
}

fn one_of<T: Copy>(draws: &mut Draws, choices: &[T]) -> T {
    choices[below(draws, choices.len() as u64) as usize]
}

fn nonnegative(value: f64) -> Option<NonNegative> {
    NonNegative::new(value)
}

/// Three digits: what a person can read, and nowhere zero where the value is not.
fn short(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use expect_test::expect;
    use proptest::prelude::*;
    use scenario::{
        Access, Air,
        fault::{Choice, Kind},
    };

    use super::*;

    fn drawn(base: &Scenario, seed: u32) -> Scenario {
        super::drawn(base, Seed::new(seed.into()).unwrap())
    }

    fn parsed(text: &str) -> Scenario {
        Scenario::parse("fuzzed.toml", text, &[]).unwrap_or_else(|error| panic!("{error}\n{text}"))
    }

    fn swarmbots() -> Scenario {
        let base = parsed(include_str!("../../../scenarios/swarmbots.toml"));
        Scenario { duration_s: Positive::new(20.0).unwrap(), ..base }
    }

    fn points() -> Scenario {
        parsed(include_str!("../../../scenarios/one-gaussian.toml"))
    }

    #[test]
    fn plans_have_every_kind_and_every_key() {
        let base = swarmbots();
        // A field changes only where it is asked for, and there may be a Gaussian in it.
        let mut changing = points();
        changing.field.lamp.clone_from(&base.field.lamp);
        changing.fuzz.kinds = vec![FaultKind::Field];
        let of =
            |base: &Scenario, seeds| (0..seeds).flat_map(|seed| drawn(base, seed).fault).collect::<Vec<_>>();
        let plans = of(&base, 1000);
        assert!(plans.iter().all(|fault| fault.kind.kind() != FaultKind::Field));
        let mut seen = BTreeSet::new();
        for fault in plans.into_iter().chain(of(&changing, 100)) {
            let value = serde_json::to_value(&fault).unwrap();
            for (key, _) in value.as_object().unwrap().iter().filter(|(_, value)| !value.is_null()) {
                seen.insert((fault.kind.kind(), key.clone()));
            }
        }
        for &kind in FaultKind::ALL {
            // Bytes of a payload mean nothing to who does not know the controller, and are not drawn.
            for key in kind.keys().iter().filter(|key| !key.starts_with("payload_")) {
                assert!(seen.contains(&(kind, key.clone())), "{} never has {key}", kind.name());
            }
        }
    }

    #[test]
    fn changes_of_the_field_are_drawn_only_of_what_is_there_and_plans_with_them_are_accepted() {
        let lamps = "field.lamp = [{ position_m = [1, 1], peak = 50, half_distance_m = 1 }, { position_m = [0, 1], \
                     peak = 1e12, half_distance_m = 1 }]\n";
        let gaussian = "field.gaussian = [{ center_m = [1, 1], sigma_m = 1e-6, gamma = 1e12 }]\n";
        let ring = "light.sensor = \"ring\"\ncontroller.gradient = \"fixed\"\ncontroller.gradient_magnitude_per_m = 1\n";
        for (field, terms) in [
            (String::new(), &["offset"][..]),
            (lamps.into(), &["lamp", "offset"]),
            (gaussian.into(), &["gaussian", "offset"]),
            (format!("{ring}{lamps}"), &["lamp", "offset"]),
        ] {
            let base = parsed(&format!(
                "duration_s = 10.0\nstep_s = 0.1\narena.size_m = [2, 3]\nrobots.count = 9\n\
                 controller.gain_per_s = 1.0\nchannel.range_m = 1.0\nfuzz.kinds = [\"field\"]\n{field}"
            ));
            let mut seen = BTreeSet::new();
            for seed in 0..100 {
                let scenario = drawn(&base, seed);
                assert_eq!(parsed(&scenario.to_toml()).fault, scenario.fault);
                for fault in &scenario.fault {
                    let Kind::Field(change) = &fault.kind else { panic!("{fault:?}") };
                    seen.extend(change.lamp.map(|_| "lamp"));
                    seen.extend(change.gaussian.map(|_| "gaussian"));
                    seen.extend(change.offset.map(|_| "offset"));
                    assert_eq!(fault.ends_s(), None);
                }
            }
            let expected: BTreeSet<&str> = terms.iter().copied().collect();
            assert_eq!(seen, expected, "{field}");
        }
    }

    #[test]
    fn channels_vary_in_some_runs_and_not_in_all() {
        let base = swarmbots();
        let channels: Vec<ChannelSpec> = (0..300).map(|seed| drawn(&base, seed).channel).collect();
        let same = channels.iter().filter(|channel| **channel == base.channel).count();
        assert!((100..200).contains(&same), "{same}");
        for profile in [Profile::Ideal, Profile::Isis, Profile::ROne] {
            assert!(channels.iter().any(|channel| channel.profile == profile));
        }
        let some = |is: fn(&Air) -> bool| channels.iter().filter_map(ChannelSpec::air).any(is);
        assert!(some(|air| matches!(air.access, Access::FixedPhase { .. })));
        assert!(some(|air| air.capture == Capture::FirstLock));
        let voronoi = points();
        assert!((0..50).all(|seed| drawn(&voronoi, seed).channel == voronoi.channel));
    }

    #[test]
    fn the_same_seed_draws_the_same_plan() {
        let base = swarmbots();
        assert_eq!(drawn(&base, 7), drawn(&base, 7));
        assert_ne!(drawn(&base, 7).fault, drawn(&base, 8).fault);
    }

    /// Seeds in reports and in notes shall go on to mean the plans that they were written about.
    #[test]
    fn seeds_keep_their_faults() {
        let mut plans = String::new();
        for kind in FaultKind::ALL {
            let base = with_fuzz(9, &format!("kinds = [\"{}\"]\nfaults_max = 1", kind.name()));
            for fault in (1..=3).flat_map(|seed| drawn(&base, seed).fault) {
                plans += &format!("{}\n", serde_json::to_string(&fault).unwrap());
            }
        }
        expect![[r#"
            {"kind":"loss","from_s":4.3,"until_s":6.4,"region":{"center_m":[1.41,1.22],"radius_m":0.704},"direction":"both","probability":0.0168}
            {"kind":"loss","from_s":0.0,"until_s":0.8,"links":["8->2","1<->4","3<->4","6->2","3<->2","4<->1","6->3"],"probability":0.255}
            {"kind":"loss","from_s":9.8,"region":{"center_m":[1.06,1.36],"radius_m":0.815},"share":0.446,"pick":"random","direction":"both","probability":0.436}
            {"kind":"burst","from_s":4.3,"until_s":6.4,"region":{"center_m":[1.41,1.22],"radius_m":0.704},"direction":"both","p":0.0168,"r":0.385,"loss_bad":0.485,"loss_good":0.0}
            {"kind":"burst","from_s":0.0,"until_s":0.8,"links":["8->2","1<->4","3<->4","6->2","3<->2","4<->1","6->3"],"p":0.255,"r":0.128,"loss_bad":1.0,"loss_good":0.216}
            {"kind":"burst","from_s":9.8,"region":{"center_m":[1.06,1.36],"radius_m":0.815},"share":0.446,"pick":"random","direction":"both","p":0.436,"r":0.298,"loss_bad":0.759,"loss_good":0.0}
            {"kind":"delay","from_s":4.3,"until_s":6.4,"region":{"center_m":[1.41,1.22],"radius_m":0.704},"direction":"both","delay_s":0.1,"jitter_s":0.824}
            {"kind":"delay","from_s":0.0,"until_s":0.8,"links":["8->2","1<->4","3<->4","6->2","3<->2","4<->1","6->3"],"delay_s":0.6,"jitter_s":1.29}
            {"kind":"delay","from_s":9.8,"region":{"center_m":[1.06,1.36],"radius_m":0.815},"share":0.446,"pick":"random","direction":"both","delay_s":1.0,"jitter_s":0.201}
            {"kind":"duplicate","from_s":4.3,"until_s":6.4,"region":{"center_m":[1.41,1.22],"radius_m":0.704},"direction":"both","probability":0.0168,"delay_s":0.9}
            {"kind":"duplicate","from_s":0.0,"until_s":0.8,"links":["8->2","1<->4","3<->4","6->2","3<->2","4<->1","6->3"],"probability":0.255,"delay_s":1.3}
            {"kind":"duplicate","from_s":9.8,"region":{"center_m":[1.06,1.36],"radius_m":0.815},"share":0.446,"pick":"random","direction":"both","probability":0.436,"delay_s":0.3}
            {"kind":"corrupt","from_s":4.3,"until_s":6.4,"region":{"center_m":[1.41,1.22],"radius_m":0.704},"direction":"both","probability":0.0168,"flips":60}
            {"kind":"corrupt","from_s":0.0,"until_s":0.8,"links":["8->2","1<->4","3<->4","6->2","3<->2","4<->1","6->3"],"probability":0.255,"flips":94}
            {"kind":"corrupt","from_s":9.8,"region":{"center_m":[1.06,1.36],"radius_m":0.815},"share":0.446,"pick":"random","direction":"both","probability":0.436,"flips":15}
            {"kind":"partition","from_s":4.3,"until_s":6.4,"groups":["0","2","3","5"],"one_way":false}
            {"kind":"partition","from_s":0.0,"until_s":0.8,"groups":["1,8","2"],"one_way":true}
            {"kind":"partition","from_s":9.8,"groups":["2,7","5","6"],"one_way":false}
            {"kind":"jam","from_s":4.3,"until_s":6.4,"region":{"center_m":[0.995,2.07],"radius_m":0.741}}
            {"kind":"jam","from_s":0.0,"until_s":0.8,"region":{"center_m":[1.57,3.0],"radius_m":0.33}}
            {"kind":"jam","from_s":9.8,"region":{"center_m":[1.78,2.45],"radius_m":0.933}}
            {"kind":"kill","at_s":7.3,"restart_at_s":8.1,"robots":"0-4,6-8","region":{"center_m":[1.41,1.22],"radius_m":0.704},"restart_share":0.736}
            {"kind":"kill","at_s":8.3,"restart_at_s":8.5,"robots":"0-5,7-8","region":{"center_m":[0.894,0.617],"radius_m":0.398},"share":0.16368724012702954,"pick":"random","restart_share":0.787}
            {"kind":"kill","at_s":1.6,"robots":"4-6,8","region":{"center_m":[1.38,2.66],"radius_m":0.88}}
            {"kind":"pause","from_s":4.3,"until_s":6.4,"robots":"5-6","region":{"center_m":[1.6,0.0561],"radius_m":0.457}}
            {"kind":"pause","from_s":0.0,"until_s":0.8,"robots":"5-8"}
            {"kind":"pause","from_s":9.8,"region":{"center_m":[1.63,1.59],"radius_m":0.879},"share":0.23154343126850463,"pick":"random"}
            {"kind":"slow","from_s":4.3,"until_s":6.4,"robots":"5-6","region":{"center_m":[1.6,0.0561],"radius_m":0.457},"delay_s":0.8}
            {"kind":"slow","from_s":0.0,"until_s":0.8,"robots":"5-8","delay_s":0.7}
            {"kind":"slow","from_s":9.8,"region":{"center_m":[1.63,1.59],"radius_m":0.879},"share":0.23154343126850463,"pick":"random","delay_s":1.4}
            {"kind":"sensor","from_s":4.3,"until_s":6.4,"robots":"5-6","region":{"center_m":[1.6,0.0561],"radius_m":0.457},"bias_counts":-0.176,"noise_counts":0.543}
            {"kind":"sensor","from_s":0.0,"until_s":0.8,"robots":"5-8","bias_counts":-0.106,"noise_counts":0.214}
            {"kind":"sensor","from_s":9.8,"region":{"center_m":[1.63,1.59],"radius_m":0.879},"share":0.23154343126850463,"pick":"random","bias_counts":0.773,"stuck":true}
            {"kind":"motion","from_s":4.3,"until_s":6.4,"robots":"5-6","region":{"center_m":[1.6,0.0561],"radius_m":0.457},"drift_m_per_s":[-0.0352,0.0155]}
            {"kind":"motion","from_s":0.0,"until_s":0.8,"robots":"5-8","drift_m_per_s":[-0.0211,-0.118]}
            {"kind":"motion","from_s":9.8,"region":{"center_m":[1.63,1.59],"radius_m":0.879},"share":0.23154343126850463,"pick":"random","stuck":true,"drift_m_per_s":[0.155,-0.00603]}
            {"kind":"liar","from_s":4.3,"until_s":6.4,"robots":"5-6","region":{"center_m":[1.6,0.0561],"radius_m":0.457},"identity":3}
            {"kind":"liar","from_s":0.0,"until_s":0.8,"robots":"5-8","identity":4}
            {"kind":"liar","from_s":9.8,"region":{"center_m":[1.63,1.59],"radius_m":0.879},"share":0.23154343126850463,"pick":"random","light_counts":0.773,"identity":4}
            {"kind":"field","at_s":7.3,"offset":-0.274}
            {"kind":"field","at_s":8.3,"offset":-0.473}
            {"kind":"field","at_s":1.6,"offset":0.899}
        "#]].assert_eq(&plans);
    }

    #[test]
    fn seeds_keep_their_channels() {
        let channels = (1..=8).map(|seed| {
            let scenario = drawn(&swarmbots(), seed);
            let keys = serde_json::to_string(&ChannelKeys::from(scenario.channel)).unwrap();
            format!("{} ppm, {keys}\n", scenario.processes.clock_drift_ppm.get())
        });
        expect![[r#"
            0 ppm, {"profile":"r-one","model":"range","range_m":1.0,"soft_edge_m":0.0,"interference_range_m":1.0,"occlusion":true,"occluded_interference":false,"cycle_s":0.5,"access":"random","airtime_s":0.03,"guard_s":0.03,"slots":null,"jitter_s":null,"half_duplex":true,"capture":"none","loss":0.116,"sigma_range":0.189,"sigma_bearing_deg":5.37,"sigma_orientation_deg":0.0,"range_step_m":0.288,"bearing_step_deg":21.176470588235293,"orientation_step_deg":22.5,"payload_bytes_max":9}
            0 ppm, {"profile":"ideal","model":"range","range_m":1.0,"soft_edge_m":0.0,"interference_range_m":null,"occlusion":false,"occluded_interference":null,"cycle_s":0.1,"access":"instant","airtime_s":null,"guard_s":null,"slots":null,"jitter_s":null,"half_duplex":null,"capture":null,"loss":0.367,"sigma_range":0.108,"sigma_bearing_deg":0.0,"sigma_orientation_deg":0.0,"range_step_m":0.0,"bearing_step_deg":0.0,"orientation_step_deg":0.0,"payload_bytes_max":9}
            2100 ppm, {"profile":"isis","model":"range","range_m":1.0,"soft_edge_m":0.0506,"interference_range_m":1.0,"occlusion":false,"occluded_interference":null,"cycle_s":0.25,"access":"aligned","airtime_s":0.005,"guard_s":0.005,"slots":null,"jitter_s":null,"half_duplex":true,"capture":"first-lock","loss":0.0,"sigma_range":0.0978,"sigma_bearing_deg":3.13,"sigma_orientation_deg":2.0,"range_step_m":0.0,"bearing_step_deg":0.0,"orientation_step_deg":0.0,"payload_bytes_max":9}
            0 ppm, {"profile":"ideal","model":"range","range_m":1.0,"soft_edge_m":0.0,"interference_range_m":null,"occlusion":false,"occluded_interference":null,"cycle_s":0.1,"access":"instant","airtime_s":null,"guard_s":null,"slots":null,"jitter_s":null,"half_duplex":null,"capture":null,"loss":0.0,"sigma_range":0.0,"sigma_bearing_deg":0.0,"sigma_orientation_deg":0.0,"range_step_m":0.0,"bearing_step_deg":0.0,"orientation_step_deg":0.0,"payload_bytes_max":9}
            0 ppm, {"profile":"ideal","model":"range","range_m":1.0,"soft_edge_m":0.223,"interference_range_m":null,"occlusion":true,"occluded_interference":null,"cycle_s":0.1,"access":"instant","airtime_s":null,"guard_s":null,"slots":null,"jitter_s":null,"half_duplex":null,"capture":null,"loss":0.199,"sigma_range":0.157,"sigma_bearing_deg":0.0,"sigma_orientation_deg":9.87,"range_step_m":0.0,"bearing_step_deg":0.0,"orientation_step_deg":0.0,"payload_bytes_max":9}
            0 ppm, {"profile":"ideal","model":"range","range_m":1.0,"soft_edge_m":0.0,"interference_range_m":null,"occlusion":false,"occluded_interference":null,"cycle_s":0.1,"access":"instant","airtime_s":null,"guard_s":null,"slots":null,"jitter_s":null,"half_duplex":null,"capture":null,"loss":0.0,"sigma_range":0.0,"sigma_bearing_deg":0.0,"sigma_orientation_deg":0.0,"range_step_m":0.0,"bearing_step_deg":0.0,"orientation_step_deg":0.0,"payload_bytes_max":9}
            0 ppm, {"profile":"ideal","model":"range","range_m":1.0,"soft_edge_m":0.0,"interference_range_m":null,"occlusion":false,"occluded_interference":null,"cycle_s":0.1,"access":"instant","airtime_s":null,"guard_s":null,"slots":null,"jitter_s":null,"half_duplex":null,"capture":null,"loss":0.0,"sigma_range":0.0,"sigma_bearing_deg":0.0,"sigma_orientation_deg":0.0,"range_step_m":0.0,"bearing_step_deg":0.0,"orientation_step_deg":0.0,"payload_bytes_max":9}
            0 ppm, {"profile":"ideal","model":"range","range_m":1.0,"soft_edge_m":0.0,"interference_range_m":null,"occlusion":false,"occluded_interference":null,"cycle_s":0.1,"access":"instant","airtime_s":null,"guard_s":null,"slots":null,"jitter_s":null,"half_duplex":null,"capture":null,"loss":0.0,"sigma_range":0.0,"sigma_bearing_deg":0.0,"sigma_orientation_deg":0.0,"range_step_m":0.0,"bearing_step_deg":0.0,"orientation_step_deg":0.0,"payload_bytes_max":9}
        "#]].assert_eq(&channels.collect::<String>());
    }

    #[test]
    fn somebody_is_never_killed() {
        for robots in [2, 3, 50] {
            let base = with_fuzz(robots, "kinds = [\"kill\"]\nfaults_max = 64\nshare_max = 1.0");
            for seed in 0..50 {
                let plan = drawn(&base, seed).fault;
                let named = |fault: &Fault| fault.target.choice().unwrap().robots.clone().unwrap();
                let survives = |robot| plan.iter().all(|fault| !named(fault).contains(robot));
                assert!((0..robots).any(survives), "seed {seed} of {robots} robots");
            }
        }
        assert!(drawn(&with_fuzz(1, "kinds = [\"kill\"]"), 1).fault.is_empty());
    }

    #[test]
    fn bounds_hold() {
        let base = with_fuzz(
            20,
            "faults_max = 64\nprobability_max = 0.013\nshare_max = 0.25\ndelay_max_s = 0.35\n\
             kinds = [\"loss\", \"delay\", \"pause\", \"slow\"]",
        );
        for fault in (0..200).flat_map(|seed| drawn(&base, seed).fault) {
            match &fault.kind {
                Kind::Loss(loss) => assert!(loss.probability.get() <= 0.013),
                Kind::Delay(delay) => assert!(delay.delay_s.get() <= 0.35 && delay.jitter_s.get() <= 0.35),
                Kind::Pause(_) => {}
                Kind::Slow(slow) => assert!(slow.delay_s.get() <= 0.35),
                other => panic!("{other:?}"),
            }
            let Some(Choice { robots, region, share }) = fault.target.choice() else { continue };
            assert!(share.is_none_or(|of| of.share.get() <= 0.25));
            assert!(robots.as_ref().is_none_or(|robots| robots.iter().count() <= 5));
            assert!(robots.is_some() || share.is_some() || region.is_some(), "{fault:?}");
        }
    }

    fn with_fuzz(robots: u32, fuzz: &str) -> Scenario {
        parsed(&format!(
            "duration_s = 10.0\nstep_s = 0.1\narena = {{ size_m = [2, 3] }}\nrobots = {{ count = {robots} }}\n\
             controller = {{ gain_per_s = 1.0 }}\nchannel = {{ range_m = 1.0 }}\n[fuzz]\n{fuzz}\n"
        ))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        #[test]
        fn a_plan_is_always_accepted(seed in any::<u32>(), points_instead in any::<bool>()) {
            let base = if points_instead { points() } else { swarmbots() };
            let scenario = drawn(&base, seed);
            prop_assert_eq!(&parsed(&scenario.to_toml()).fault, &scenario.fault);
        }

        #[test]
        fn a_plan_is_accepted_whatever_the_bounds_and_the_scenario(
            seed in any::<u32>(),
            robots in 1_u32..12,
            (faults_max, share_max, probability_max) in (1_u32..=64, 0.001_f64..=1.0, 0.0_f64..=1.0),
            (delay_max_s, step_s, ticks, gain) in (1e-4_f64..10.0, 0.001_f64..0.5, 1_u32..500, 0.1_f64..3.0),
            side in 0.01_f64..1e4,
        ) {
            let base = parsed(&format!(
                "duration_s = {}\nstep_s = {step_s}\narena = {{ size_m = [{side}, {}] }}\n\
                 robots = {{ count = {robots} }}\ncontroller = {{ gain_per_s = {gain} }}\n\
                 channel = {{ range_m = {} }}\n[fuzz]\nfaults_max = {faults_max}\nshare_max = {share_max}\n\
                 probability_max = {probability_max}\ndelay_max_s = {delay_max_s}\n",
                f64::from(ticks) * step_s,
                side * 1.5,
                side / 3.0,
            ));
            parsed(&drawn(&base, seed).to_toml());
        }
    }
}
