//! The infrared against theory: delivered shares and run lengths in closed form, at every receiver.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use arena::{
    channel::{Channel, Moment, Reception, closed_form::delivered_share},
    executor::Sequential,
    frame::{ArenaPoint, Pose},
    packets::Packets,
    random::{Draws, Purpose},
};
use protocol::{oscillator::Oscillator, packet::Packet, robot_id::RobotId};
use scenario::{Access, ChannelModel, Override, Scenario};

/// Robots that all hear each other, and a channel that only collisions disturb.
fn crowd(robots: usize, seed: u64, channel: &[String]) -> Scenario {
    let text = format!(
        "duration_s = 1000
         step_s = 1
         arena.size_m = [1, 1]
         robots.count = {robots}
         controller.gain_per_s = 1
         channel = {{ profile = \"isis\", range_m = 2, cycle_s = 1, sigma_range = 0 }}
         seed = {seed}"
    );
    let sets: Vec<Override> = channel.iter().map(|set| format!("channel.{set}").parse().unwrap()).collect();
    Scenario::parse("crowd", &text, &sets).unwrap_or_else(|error| panic!("{error}"))
}

/// Robots close to each other.
fn together(robots: usize) -> Vec<Pose> {
    (0..robots).map(|robot| Pose::unturned(ArenaPoint::new(robot as f64 / 100.0, 0.5))).collect()
}

/// Plays `cycles` neighbor cycles of one tick each; what is heard in each.
fn play(channel: &mut Channel, robots: usize, cycles: u64, heard: impl FnMut(&[Reception])) -> Packets {
    play_at(channel, &together(robots), cycles, heard)
}

/// The same with robots that stand elsewhere.
fn play_at(
    channel: &mut Channel,
    poses: &[Pose],
    cycles: u64,
    mut heard: impl FnMut(&[Reception]),
) -> Packets {
    let said: Vec<Option<Packet>> =
        (0..poses.len() as u32).map(|index| Some(Packet::short(RobotId::first(index), 0, None))).collect();
    let (mut packets, mut received) = (Packets::default(), Vec::new());
    for tick in 0..cycles {
        let moment = Moment { tick, cycle: Some(tick), time_s: tick as f64, poses, said: &said };
        channel.play(&Sequential, &moment, &mut packets, &mut |_, packet| packet, &mut received);
        heard(&received);
        packets.heard += received.len() as u64;
        packets.check().unwrap();
    }
    packets
}

/// Mean over seeds of the delivered share of a crowd with `k` disturbers, and its standard error.
fn delivered(k: usize, half_duplex: bool, settings: &[String]) -> (f64, f64) {
    delivered_among(together, k, half_duplex, settings)
}

/// The same of robots that all disturb each other, wherever they are placed.
fn delivered_among(
    place: impl Fn(usize) -> Vec<Pose>,
    k: usize,
    half_duplex: bool,
    settings: &[String],
) -> (f64, f64) {
    const SEEDS: u64 = 120;
    const CYCLES: u64 = 25;
    // A sender, a receiver (a disturber itself in half duplex), and the others.
    let robots = k + 2 - usize::from(half_duplex);
    let settings = [settings, &[format!("half_duplex={half_duplex}")]].concat();
    let poses = place(robots);
    let arrived = |packets: &Packets| packets.heard + packets.collided + packets.half_duplex;
    let shares: Vec<f64> = (1..=SEEDS)
        .map(|seed| {
            let mut channel = Channel::new(&crowd(robots, seed, &settings));
            // The first packets have nobody before them.
            let first = play_at(&mut channel, &poses, 2, |_| {});
            let mut all = Channel::new(&crowd(robots, seed, &settings));
            let all = play_at(&mut all, &poses, CYCLES, |_| {});
            (all.heard - first.heard) as f64 / (arrived(&all) - arrived(&first)) as f64
        })
        .collect();
    let mean = shares.iter().sum::<f64>() / SEEDS as f64;
    let variance = shares.iter().map(|share| (share - mean).powi(2)).sum::<f64>() / (SEEDS - 1) as f64;
    (mean, (variance / SEEDS as f64).sqrt())
}

/// Holds every scheme with these settings against its closed form, in half and full duplex.
fn check(settings_of: impl Fn(f64) -> Vec<Vec<String>>) {
    check_among(together, settings_of);
}

/// The same of robots that all disturb each other, wherever they are placed.
fn check_among(place: impl Fn(usize) -> Vec<Pose>, settings_of: impl Fn(f64) -> Vec<Vec<String>>) {
    for r in [0.02, 0.04, 0.08] {
        for settings in settings_of(r) {
            let settings = [vec![format!("airtime_s={r}")], settings].concat();
            for k in [4, 8, 16] {
                for half_duplex in [false, true] {
                    let scenario = crowd(2, 1, &settings);
                    let predicted = delivered_share(&scenario.channel, k as u32).unwrap();
                    let (mean, error) = delivered_among(&place, k, half_duplex, &settings);
                    println!(
                        "{settings:?} k = {k}, half duplex {half_duplex}: {mean:.4} ± {error:.4}, {predicted:.4}"
                    );
                    assert!(
                        (mean - predicted).abs() <= 3.0 * error,
                        "{settings:?} k = {k}, half duplex {half_duplex}: {mean} ± {error}, not {predicted}"
                    );
                }
            }
        }
    }
}

fn set(text: impl Into<String>) -> String {
    text.into()
}

#[test]
fn free_running_cycles_deliver_what_theory_says_for_every_guard() {
    // δ from r, a packet that just fits, past 2r, from where on no packet meets two of another robot.
    check(|r| {
        [1.0, 1.5, 2.0, 3.0]
            .map(|guards| vec![set("access=random"), format!("guard_s={}", guards * r)])
            .to_vec()
    });
}

#[test]
fn a_common_frame_delivers_what_theory_says() {
    check(|_| vec![vec![set("access=aligned")]]);
}

#[test]
fn slots_deliver_what_theory_says() {
    check(|r| {
        let fit = (1.0 / r + 1e-9) as u32;
        [fit, fit / 2].map(|slots| vec![set("access=slotted"), format!("slots={slots}")]).to_vec()
    });
}

#[test]
fn phases_deliver_what_theory_says_of_wrapped_time() {
    check(|_| vec![vec![set("access=fixed-phase")], vec![set("access=fixed-phase"), set("jitter_s=0.5")]]);
}

/// Two groups out of each other's range of half a meter, but not of an interference range of a meter.
fn apart(robots: usize) -> Vec<Pose> {
    let place = |robot: usize| 0.8 * (robot % 2) as f64 + robot as f64 / 200.0;
    (0..robots).map(|robot| Pose::unturned(ArenaPoint::new(place(robot), 0.5))).collect()
}

#[test]
fn packets_too_weak_to_be_read_disturb_as_theory_says() {
    let far = [set("range_m=0.5"), set("interference_range_m=1")];
    check_among(apart, |r| {
        let guards = [1.0, 3.0].map(|guards| vec![set("access=random"), format!("guard_s={}", guards * r)]);
        let slots = vec![set("access=slotted"), format!("slots={}", (1.0 / r + 1e-9) as u32)];
        let others =
            [vec![set("access=aligned")], vec![set("access=fixed-phase"), set("jitter_s=0.5")], slots];
        // The last fades at the rim of its own group, and disturbs all the same.
        let fading = [far.to_vec(), vec![set("access=random"), set("soft_edge_m=0.5")]].concat();
        let settings = guards.into_iter().chain(others).map(|settings| [far.to_vec(), settings].concat());
        settings.chain([fading]).collect()
    });
}

#[test]
fn who_is_disturbed_from_afar_is_counted_with_all_who_disturb() {
    let settings =
        [set("range_m=0.5"), set("interference_range_m=1"), set("access=random"), set("half_duplex=false")];
    let mut channel = Channel::new(&crowd(8, 1, &settings));
    play_at(&mut channel, &apart(8), 20, |_| {});
    let disturbers: Vec<u32> =
        channel.crowding().unwrap().iter().map(|(disturbers, ..)| disturbers).collect();
    assert_eq!(disturbers, [6], "of eight robots neither the sender nor the receiver");
}

/// How the packets of one robot fare at another.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    Read,
    Disturbs,
    Lost,
}

/// A channel written anew, pair by pair: the share of packets heard among those that arrive.
fn heard_by_brute_force(poses: &[Pose], channel: &scenario::ChannelSpec, seed: u64) -> f64 {
    const CYCLES: u64 = 40;
    const RADIUS_M: f64 = 0.05;
    let air = channel.air().unwrap();
    let (Access::Random { guard_s }, ChannelModel::Range { range_m, soft_edge_m, interference_range_m }) =
        (air.access, channel.model)
    else {
        panic!("{channel:?}")
    };
    let (airtime_s, window_s) = (air.airtime_s.get(), 1.0 - guard_s.get());
    let (range_m, edge_m, interference_m) = (range_m.get(), soft_edge_m.get(), interference_range_m.get());
    let mut draws = Draws::of(seed, Purpose::FuzzChannel, 0, 0, 0);
    let mut packets = Vec::new();
    for sender in 0..poses.len() {
        let phase_s = draws.unit();
        packets.extend((0..CYCLES).map(|cycle| (cycle as f64 + phase_s + window_s * draws.unit(), sender)));
    }
    packets.sort_by(|a, b| a.0.total_cmp(&b.0));
    let blocked = |from: usize, to: usize| {
        let (start, way) = (poses[from].position, poses[to].position - poses[from].position);
        poses.iter().enumerate().filter(|(body, _)| *body != from && *body != to).any(|(_, body)| {
            let offset = body.position - start;
            let along = offset.dot(&way) / way.norm_squared();
            (0.0..=1.0).contains(&along) && (offset - way * along).norm() < RADIUS_M
        })
    };
    let mut way = |sender: usize, receiver: usize| {
        let distance_m = (poses[receiver].position - poses[sender].position).norm();
        let fades = distance_m > range_m || (range_m - distance_m) / edge_m < draws.unit();
        let disturbs = if interference_m > range_m { distance_m <= interference_m } else { !fades };
        match blocked(sender, receiver) {
            true if disturbs && air.occluded_interference => Way::Disturbs,
            true => Way::Lost,
            false if !fades => Way::Read,
            false if disturbs => Way::Disturbs,
            false => Way::Lost,
        }
    };
    let (mut heard, mut arrived) = (0_u64, 0_u64);
    for receiver in 0..poses.len() {
        let here: Vec<(f64, Way)> = packets
            .iter()
            .filter(|(_, sender)| *sender != receiver)
            .map(|&(start_s, sender)| (start_s, way(sender, receiver)))
            .collect();
        let own: Vec<f64> =
            packets.iter().filter(|packet| packet.1 == receiver).map(|packet| packet.0).collect();
        let mut locked_s = f64::NEG_INFINITY;
        for (place, &(start_s, _)) in here.iter().enumerate().filter(|(_, (_, way))| *way == Way::Read) {
            arrived += 1;
            if air.half_duplex && own.iter().any(|own_s| (own_s - start_s).abs() < airtime_s) {
                continue;
            }
            let overlaps = |&&(other_s, _): &&(f64, Way)| (other_s - start_s).abs() < airtime_s;
            let before = || here[..place].iter().rev().take_while(overlaps);
            let after = || here[place + 1..].iter().take_while(overlaps);
            let gets_through = match air.capture {
                scenario::Capture::None => before().chain(after()).all(|(_, way)| *way == Way::Lost),
                scenario::Capture::FirstLock if before().any(|(_, way)| *way == Way::Disturbs) => false,
                scenario::Capture::FirstLock if locked_s > start_s => false,
                scenario::Capture::FirstLock => {
                    locked_s = start_s + airtime_s;
                    true
                }
            };
            heard += u64::from(gets_through);
        }
    }
    heard as f64 / arrived as f64
}

#[test]
fn what_bodies_hide_and_what_fades_disturbs_as_in_a_channel_written_anew() {
    const SCENES: u64 = 150;
    const ROBOTS: usize = 14;
    let mut shares = Vec::new();
    for interference in ["1", "1.4"] {
        for occluded in [false, true] {
            for capture in ["none", "first-lock"] {
                let text = format!(
                    "duration_s = 1000
                     step_s = 1
                     arena.size_m = [2, 2]
                     robots = {{ count = {ROBOTS}, radius_m = 0.05 }}
                     controller.gain_per_s = 1
                     channel = {{ profile = \"isis\", range_m = 1, soft_edge_m = 0.4, cycle_s = 1, airtime_s = 0.03,
                         capture = \"{capture}\", interference_range_m = {interference}, occlusion = true,
                         occluded_interference = {occluded} }}"
                );
                let (mut differences, mut sum) = (Vec::new(), 0.0);
                for seed in 1..=SCENES {
                    let sets = [format!("seed={seed}").parse().unwrap()];
                    let scenario =
                        Scenario::parse("scene", &text, &sets).unwrap_or_else(|error| panic!("{error}"));
                    let poses = arena::placement::start(&scenario).unwrap();
                    let packets = play_at(&mut Channel::new(&scenario), &poses, 40, |_| {});
                    let arrived = packets.heard + packets.collided + packets.half_duplex;
                    let share = packets.heard as f64 / arrived as f64;
                    differences.push(share - heard_by_brute_force(&poses, &scenario.channel, seed));
                    sum += share;
                }
                let mean = differences.iter().sum::<f64>() / SCENES as f64;
                let squares = differences.iter().map(|difference| (difference - mean).powi(2)).sum::<f64>();
                let error = (squares / (SCENES * (SCENES - 1)) as f64).sqrt();
                let share = sum / SCENES as f64;
                println!(
                    "interference {interference} m, occluded {occluded}, {capture}: {share:.4}, {mean:+.5} ± {error:.5}"
                );
                assert!(mean.abs() <= 3.0 * error, "{interference} {occluded} {capture}: {mean} ± {error}");
                shares.push(share);
            }
        }
    }
    // The more disturbs, the less is heard: none and first-lock, each without and with what bodies hide.
    for nearer in [0, 4] {
        assert!(shares[nearer] > shares[nearer + 2] && shares[nearer + 1] > shares[nearer + 3], "{shares:?}");
    }
    assert!((0..4).all(|setting| shares[setting] > shares[setting + 4] + 0.01), "{shares:?}");
}

#[test]
fn a_packet_that_cannot_be_read_never_takes_a_receiver_and_takes_none_away() {
    // Robot 0 hears robot 1; robot 2 disturbs robot 0 alone. With a lock, a packet that began before keeps it.
    let poses = [0.0, 0.4, 0.8].map(|x| Pose::unturned(ArenaPoint::new(1.0 - x, 0.5)));
    let share = |capture: &str| {
        let settings = [
            set("airtime_s=0.1"),
            set("guard_s=0.1"),
            set("access=aligned"),
            set("half_duplex=false"),
            set("range_m=0.5"),
            set("interference_range_m=0.9"),
            format!("capture={capture}"),
        ];
        let (mut from_1, mut from_2, mut packets) = (0_u64, 0_u64, 0_u64);
        for seed in 1..=200 {
            let mut channel = Channel::new(&crowd(3, seed, &settings));
            play_at(&mut channel, &poses, 40, |receptions| {
                let at_0 =
                    |sender| receptions.iter().filter(move |r| (r.receiver, r.sender) == (0, sender)).count();
                from_1 += at_0(1) as u64;
                from_2 += at_0(2) as u64;
            });
            packets += 40;
        }
        assert_eq!(from_2, 0);
        from_1 as f64 / packets as f64
    };
    let (destroyed, locked) = (share("none"), share("first-lock"));
    // In a common frame; half of those who meet came first.
    assert!((locked - (1.0 + destroyed) / 2.0).abs() < 0.01, "{destroyed} {locked}");
    assert!(
        (destroyed - (1.0_f64 - 1.0 / 9.0).powi(2)).abs() < 0.01,
        "two starts in a window of nine airtimes"
    );
}

#[test]
fn packets_longer_than_theory_likes_are_foretold_as_well() {
    for settings in [
        ["access=random", "airtime_s=0.6"],
        ["access=random", "airtime_s=0.8"],
        ["access=random", "airtime_s=1"],
        ["access=random", "airtime_s=0.4"],
        ["access=fixed-phase", "airtime_s=0.4"],
        ["access=fixed-phase", "airtime_s=0.6"],
    ] {
        let mut settings = settings.map(set).to_vec();
        if settings[0] == "access=fixed-phase" {
            settings.push(set("jitter_s=0.4"));
        }
        let predicted = delivered_share(&crowd(2, 1, &settings).channel, 1).unwrap();
        let (mean, error) = delivered(1, false, &settings);
        assert!(
            (mean - predicted).abs() <= 3.0 * error + 1e-4,
            "{settings:?}: {mean} ± {error}, not {predicted}"
        );
    }
}

#[test]
fn closed_forms_are_the_published_ones() {
    // r, k, wrap-around, aligned frame.
    for (r, k, wrapped, aligned) in [
        (0.02, 4, 0.849, 0.848),
        (0.02, 8, 0.721, 0.719),
        (0.02, 16, 0.520, 0.517),
        (0.04, 8, 0.513, 0.507),
        (0.08, 8, 0.248, 0.237),
    ] {
        let share = |access: &str| {
            let settings = [format!("airtime_s={r}"), format!("access={access}")];
            delivered_share(&crowd(2, 1, &settings).channel, k).unwrap()
        };
        assert!((share("fixed-phase") - wrapped).abs() < 6e-4, "{r} {k}: {}", share("fixed-phase"));
        assert!((share("aligned") - aligned).abs() < 6e-4, "{r} {k}: {}", share("aligned"));
    }
}

/// Share of packets on a link that end a row of four misses or more: 8 disturbers, r = 0.04.
fn four_misses(jitter: f64) -> f64 {
    const ROBOTS: usize = 10;
    const SEEDS: u64 = 1500;
    const CYCLES: usize = 24;
    let settings = [
        set("access=fixed-phase"),
        set("airtime_s=0.04"),
        set("half_duplex=false"),
        format!("jitter_s={jitter}"),
    ];
    let (mut rows, mut packets) = (0_u64, 0_u64);
    for seed in 1..=SEEDS {
        let mut channel = Channel::new(&crowd(ROBOTS, seed, &settings));
        let mut heard = vec![[false; CYCLES + 8]; ROBOTS * ROBOTS];
        play(&mut channel, ROBOTS, CYCLES as u64, |receptions| {
            for reception in receptions {
                let link = reception.sender as usize * ROBOTS + reception.receiver as usize;
                heard[link][reception.number as usize] = true;
            }
        });
        for sender in 0..ROBOTS {
            for receiver in (0..ROBOTS).filter(|&receiver| receiver != sender) {
                // The first packets and the last may be only half there.
                let link = &heard[sender * ROBOTS + receiver][3..CYCLES];
                for row in link.windows(4) {
                    rows += u64::from(row.iter().all(|heard| !heard));
                    packets += 1;
                }
            }
        }
    }
    rows as f64 / packets as f64
}

#[test]
fn fixed_phases_miss_in_rows_and_jitter_breaks_them() {
    for (jitter, published) in [(0.0, 0.48), (0.05, 0.30), (0.1, 0.18), (0.2, 0.11), (0.5, 0.062)] {
        let share = four_misses(jitter);
        println!("jitter {jitter}: {share:.4}, published {published}");
        assert!((share - published).abs() <= 0.01, "jitter {jitter}: {share}, published {published}");
    }
}

/// Numbers of the packets of robot 0 that robot 1 hears of two at fixed phases, one cycle a second.
fn heard_of_two(seed: u64, drift_ppm: f64, cycles: u64) -> Vec<u64> {
    let settings = [set("access=fixed-phase"), set("airtime_s=0.04")];
    let mut scenario = crowd(2, seed, &settings);
    scenario.processes.clock_drift_ppm = scenario::NonNegative::new(drift_ppm).unwrap();
    let mut numbers = Vec::new();
    play(&mut Channel::new(&scenario), 2, cycles, |receptions| {
        numbers.extend(receptions.iter().filter(|heard| heard.sender == 0).map(|heard| heard.number));
    });
    numbers
}

#[test]
fn fixed_phases_slide_past_each_other_where_clocks_drift() {
    const DRIFT_PPM: f64 = 2000.0;
    const CYCLES: u64 = 600;
    let mut freed = 0;
    for seed in 1..=200 {
        let phase = |robot| Draws::of(seed, Purpose::Phase, 0, robot, 0).unit();
        let drift = |robot| Oscillator::of(RobotId::first(robot), seed, DRIFT_PPM).drift();
        // Both transmit at once, so that neither ever hears the other.
        let apart = phase(1) - phase(0);
        if apart.abs() > 0.039 {
            continue;
        }
        assert!(heard_of_two(seed, 0.0, CYCLES).is_empty(), "seed {seed}: even clocks stay as they are");
        // Clocks agree a second before tick 0, where packet 1 is due but for the phase.
        let start = |robot, number: f64| (phase(robot) + number - 1.0) * (1.0 + drift(robot));
        let meets = |number: &u64| (start(1, *number as f64) - start(0, *number as f64)).abs() < 0.04;
        let first = (1..CYCLES).find(|number| !meets(number)).unwrap_or(CYCLES);
        // By how much one gains on the other in a cycle, and how far it has to.
        let slide = drift(1) - drift(0);
        let cycles = (0.04 - apart * slide.signum()) / slide.abs();
        assert!((first as f64 - 1.0 - cycles).abs() <= 2.0 || first == CYCLES, "{first} {cycles}");
        let heard = heard_of_two(seed, DRIFT_PPM, CYCLES);
        match heard.first() {
            Some(number) => assert_eq!(*number, first, "seed {seed}"),
            None => assert!(first + 2 >= CYCLES, "seed {seed}: {first}"),
        }
        freed += u32::from(!heard.is_empty());
    }
    assert!(freed >= 5, "{freed} rows of misses have ended");
}

#[test]
fn a_restarted_robot_sends_by_its_old_clock_until_the_cycle_after_its_next_packet_begins() {
    const DRIFT_PPM: f64 = 20_000.0;
    let settings = [set("access=fixed-phase"), set("airtime_s=0.01"), set("half_duplex=false")];
    for seed in 1..=50 {
        let mut scenario = crowd(2, seed, &settings);
        scenario.processes.clock_drift_ppm = scenario::NonNegative::new(DRIFT_PPM).unwrap();
        let mut channel = Channel::new(&scenario);
        let lives = [RobotId::first(0), RobotId::first(0).reborn()];
        let cycle_s = |life: usize| 1.0 + Oscillator::of(lives[life], seed, DRIFT_PPM).drift();
        let (mut packets, mut received, mut sent_s) = (Packets::default(), Vec::new(), Vec::new());
        for tick in 0..30 {
            // It is restarted before tick 10.
            let said = [lives[usize::from(tick >= 10)], RobotId::first(1)]
                .map(|sender| Some(Packet::short(sender, 0, None)));
            let moment =
                Moment { tick, cycle: Some(tick), time_s: tick as f64, poses: &together(2), said: &said };
            channel.play(&Sequential, &moment, &mut packets, &mut |_, packet| packet, &mut received);
            sent_s.extend(received.iter().filter(|heard| heard.sender == 0).map(|heard| heard.sent_s));
        }
        let gaps: Vec<f64> = sent_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let is_of = |life: usize| move |gap: &f64| (gap - cycle_s(life)).abs() < 1e-9;
        let changes = gaps.iter().position(|gap| !is_of(0)(gap)).unwrap();
        assert!(
            gaps[..changes].iter().all(is_of(0)) && gaps[changes..].iter().all(is_of(1)),
            "{seed}: {gaps:?}"
        );
        // Two packets still come when the old clock had them: the next one, and that whose cycle follows.
        assert!(sent_s[changes - 2] < 10.0 && sent_s[changes - 1] >= 10.0, "{seed}: {sent_s:?}");
    }
}

#[test]
fn who_is_in_reach_is_decided_at_the_end_of_the_tick_in_which_a_packet_starts() {
    // Packets of 3.5 ticks in cycles of 10. Robot 1 is in range at the end of one tick alone.
    const STEP_S: f64 = 0.1;
    let settings =
        [set("access=random"), set("airtime_s=0.35"), set("half_duplex=false"), set("range_m=0.5")];
    let near_at = |near: Option<u64>| {
        let mut channel = Channel::new(&crowd(2, 5, &settings));
        let said = [0, 1].map(|index| Some(Packet::short(RobotId::first(index), 0, None)));
        let (mut packets, mut received, mut heard) = (Packets::default(), Vec::new(), Vec::new());
        for tick in 0..=100 {
            let is_near = near.is_none_or(|near| near == tick);
            let poses =
                [0.1, if is_near { 0.5 } else { 0.9 }].map(|x| Pose::unturned(ArenaPoint::new(x, 0.5)));
            let moment =
                Moment { tick, cycle: None, time_s: tick as f64 * STEP_S, poses: &poses, said: &said };
            channel.play(&Sequential, &moment, &mut packets, &mut |_, packet| packet, &mut received);
            heard.extend(received.iter().filter(|heard| heard.sender == 0).map(|heard| (heard.sent_s, tick)));
        }
        heard
    };
    let always: Vec<(f64, u64)> =
        near_at(None).into_iter().filter(|(sent_s, _)| (0.0..9.0).contains(sent_s)).collect();
    assert!(always.len() >= 5, "{always:?}");
    for &(sent_s, ends) in &always {
        let starts = (sent_s / STEP_S) as u64 + 1;
        assert!(ends > starts, "it starts in one tick and ends in another");
        let when: Vec<u64> = (starts.saturating_sub(5)..=ends + 5)
            .filter(|&tick| near_at(Some(tick)).contains(&(sent_s, ends)))
            .collect();
        assert_eq!(when, [starts], "sent at {sent_s} s, heard at tick {ends}");
    }
}

#[test]
fn the_first_packet_wins_where_a_receiver_locks_to_it() {
    // Two senders: one of two overlapping packets is the first, so half of the collisions are won.
    let share = |capture: &str| {
        let settings = [
            set("airtime_s=0.2"),
            set("half_duplex=false"),
            format!("capture={capture}"),
            set("access=aligned"),
        ];
        let mut heard = 0.0;
        for seed in 1..=200 {
            let packets = play(&mut Channel::new(&crowd(3, seed, &settings)), 3, 20, |_| {});
            heard += packets.heard as f64 / packets.in_range as f64 / 200.0;
        }
        heard
    };
    let (destroyed, locked) = (share("none"), share("first-lock"));
    // In a common frame packets of one cycle never meet those of the next.
    assert!((locked - (1.0 + destroyed) / 2.0).abs() < 0.01, "{destroyed} {locked}");
}

#[test]
fn packets_meet_across_the_borders_of_cycles_and_ticks() {
    // Ticks of a fifth of a packet: the same packets, the same fates, only later known.
    let share = |step_s: f64| {
        let settings = [set("airtime_s=0.2"), set("access=random")];
        let scenario = crowd(4, 7, &settings);
        let mut channel = Channel::new(&scenario);
        let poses = vec![Pose::unturned(ArenaPoint::new(0.5, 0.5)); 4];
        let said = vec![Some(Packet::short(RobotId::first(0), 0, None)); 4];
        let (mut packets, mut heard, mut all) = (Packets::default(), Vec::new(), Vec::new());
        let ticks = (40.0 / step_s).round() as u64;
        for tick in 0..=ticks {
            let time_s = tick as f64 * step_s;
            let moment = Moment { tick, cycle: None, time_s, poses: &poses, said: &said };
            channel.play(&Sequential, &moment, &mut packets, &mut |_, packet| packet, &mut heard);
            all.extend(heard.iter().map(|heard| (heard.number, heard.sender, heard.receiver)));
        }
        all.sort_unstable();
        all
    };
    assert!(share(1.0).len() > 100);
    assert_eq!(share(1.0), share(0.04));
}

#[test]
fn the_cost_of_a_tick_grows_with_packets_heard_and_not_with_pairs() {
    for profile in ["ideal", "isis"] {
        let examined_per_reception = |robots: u32| {
            let side = (f64::from(robots) * 0.12).sqrt();
            let text = format!(
                "duration_s = 10\nstep_s = 0.25\narena.size_m = [{side}, {side}]\nrobots.count = {robots}\n\
                 controller.gain_per_s = 1\nchannel = {{ profile = \"{profile}\", range_m = 1 }}"
            );
            let scenario = Scenario::parse("wide", &text, &[]).unwrap();
            let poses = arena::placement::start(&scenario).unwrap();
            let mut channel = Channel::new(&scenario);
            let said: Vec<_> =
                (0..robots).map(|index| Some(Packet::short(RobotId::first(index), 0, None))).collect();
            let (mut packets, mut heard) = (Packets::default(), Vec::new());
            for tick in 0..4 {
                let time_s = tick as f64 * 0.25;
                let moment = Moment { tick, cycle: Some(tick), time_s, poses: &poses, said: &said };
                channel.play(&Sequential, &moment, &mut packets, &mut |_, packet| packet, &mut heard);
            }
            channel.examined() as f64 / packets.in_range as f64
        };
        let costs = [100, 1000, 10_000].map(examined_per_reception);
        println!("{profile}: pairs looked at per packet in range: {costs:?}");
        // Nine cells of the grid hold 9/π times as many as the disc, and more at the walls.
        assert!(costs.iter().all(|cost| *cost < 4.0), "{profile}: {costs:?}");
    }
}
