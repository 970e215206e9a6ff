//! Faults one by one: what each kind does to packets, agents, sensors and bodies, and what the ledger says.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use arena::{
    Arena,
    channel::Reception,
    fault::{FaultPlan, Passage},
    field::Field,
    frame::{ArenaPoint, Pose},
    payloads::Payloads,
    placement,
    plan_warnings::warnings,
};
use protocol::{
    command::{Answer, Command},
    frame::BodyVector,
    packet::{Body, Packet},
    percept::{Percept, Tick},
    robot_id::RobotId,
};
use scenario::{ChannelModel, NonNegative, Positive, ProcessAction, ProcessFault, Scenario};

/// Ten robots in a row, 0.1 m apart, all in range of each other, and some faults.
fn scenario(faults: &str) -> Scenario {
    let text = format!(
        "duration_s = 100
         step_s = 0.1
         arena.size_m = [2, 1]
         robots.positions_m = [[0.1, 0.5], [0.2, 0.5], [0.3, 0.5], [0.4, 0.5], [0.5, 0.5],
                               [0.6, 0.5], [0.7, 0.5], [0.8, 0.5], [0.9, 0.5], [1.0, 0.5]]
         robots.headings_rad = [0, 0, 0, 0, 0, 0, 0, 0, 0, 0]
         field.offset = 50
         field.lamp = [{{ position_m = [0, 0.5], peak = 500, half_distance_m = 0.5 }}]
         controller.gain_per_s = 1
         channel.range_m = 2
         {faults}"
    );
    Scenario::parse("row", &text, &[]).unwrap_or_else(|error| panic!("{error}"))
}

fn packet(robot: u32) -> Packet {
    Packet::short(RobotId::first(robot), 0, Some(1.0_f32.to_le_bytes()))
}

/// A command to go nowhere and to say who one is.
fn still(robot: u32) -> Option<Answer> {
    let command = Command {
        estimated_error: Some(BodyVector::HERE),
        velocity: BodyVector::HERE,
        payload: 1.0_f32.to_le_bytes().into(),
    };
    Some(Answer { sender: RobotId::first(robot), sequence: 0, command })
}

fn everyone() -> Vec<Option<Answer>> {
    (0..10).map(still).collect()
}

/// Robots that stand still, and whose agents obey the plan. `look` sees each tick.
fn run(scenario: &Scenario, ticks: Tick, mut look: impl FnMut(&Arena, Option<&[Percept]>)) -> Arena {
    let mut arena = Arena::new(scenario).unwrap();
    let mut commands = everyone();
    for _ in 0..=ticks {
        for ProcessFault { robot, action } in arena.process_faults(&[]) {
            commands[robot as usize] = match action {
                ProcessAction::Kill | ProcessAction::Pause => None,
                ProcessAction::Restart | ProcessAction::Resume => still(robot),
            };
        }
        let percepts = arena.tick(&commands).map(<[_]>::to_vec);
        look(&arena, percepts.as_deref());
        arena.packets().check().unwrap();
    }
    arena
}

/// Whether everything of a packet is lost.
fn is_lost(passage: &Passage) -> bool {
    passage.arrivals.is_empty()
}

/// Outcome of packet `number` of robot 0 at robot 1.
fn passage(plan: &mut FaultPlan, number: u64) -> Passage {
    passage_on(plan, 0, 1, number)
}

fn passage_on(plan: &mut FaultPlan, sender: u32, receiver: u32, number: u64) -> Passage {
    let reception = Reception { sender, receiver, number, sent_s: 0.0, packet: packet(sender) };
    plan.passage(
        number,
        &reception,
        ArenaPoint::new(0.1 + 0.1 * f64::from(receiver), 0.5),
        &mut Payloads::default(),
    )
}

fn begun(faults: &str) -> FaultPlan {
    let scenario = scenario(faults);
    let poses = placement::start(&scenario).unwrap();
    let mut plan = FaultPlan::new(&scenario);
    plan.process_faults(0, &poses, &mut Field::new(&scenario), &[]);
    plan
}

fn effect(arena: &Arena, what: &str) -> u64 {
    arena.ledger().next().and_then(|line| line.effects.get(what).copied()).unwrap_or(0)
}

/// Chi-square of the lengths of runs against a geometric law with this chance to end; 8 bins.
fn chi_square_of_runs(runs: &[usize], end: f64) -> f64 {
    const BINS: usize = 8;
    let mut counts = [0.0; BINS];
    runs.iter().for_each(|&run| counts[(run - 1).min(BINS - 1)] += 1.0);
    let total = runs.len() as f64;
    let survives = |run: usize| (1.0 - end).powi(run as i32);
    (0..BINS)
        .map(|bin| {
            let share = if bin == BINS - 1 { survives(bin) } else { survives(bin) * end };
            (counts[bin] - total * share).powi(2) / (total * share)
        })
        .sum()
}

/// 99.9 % of chi-square values with 7 degrees of freedom lie below.
const CHI_SQUARE_7: f64 = 24.32;

/// Lengths of the runs of `value`, without the first and the last run, which may be cut.
fn runs_of(value: bool, all: &[bool]) -> Vec<usize> {
    let whole: Vec<(bool, usize)> = all.chunk_by(|a, b| a == b).map(|run| (run[0], run.len())).collect();
    let inner = &whole[1..whole.len() - 1];
    inner.iter().filter(|(lost, _)| *lost == value).map(|(_, length)| *length).collect()
}

/// Packets that reach so far, and no farther.
fn range(range_m: f64) -> ChannelModel {
    let range_m = Positive::new(range_m).unwrap();
    let soft_edge_m = NonNegative::new(0.0).unwrap();
    ChannelModel::Range { range_m, soft_edge_m, interference_range_m: range_m }
}

mod packets {
    use super::*;

    #[test]
    fn losses_are_independent_and_as_many_as_asked_for() {
        let mut plan = begun("[[fault]]\nkind = \"loss\"\nprobability = 0.3");
        let lost: Vec<bool> = (0..20_000).map(|number| is_lost(&passage(&mut plan, number))).collect();
        let share = lost.iter().filter(|lost| **lost).count() as f64 / 2e4;
        assert!((share - 0.3).abs() < 3.0 * (0.21_f64 / 2e4).sqrt(), "{share}");
        let chi_square = chi_square_of_runs(&runs_of(true, &lost), 0.7);
        assert!(chi_square < CHI_SQUARE_7, "{chi_square}");
    }

    #[test]
    fn bursts_are_as_frequent_and_as_long_as_gilbert_and_elliott_say() {
        let (p, r) = (0.05_f64, 0.25);
        let mut plan = begun(&format!("[[fault]]\nkind = \"burst\"\np = {p}\nr = {r}"));
        let lost: Vec<bool> = (0..60_000).map(|number| is_lost(&passage(&mut plan, number))).collect();
        let bad = lost.iter().filter(|lost| **lost).count() as f64 / 6e4;
        // Neighbors in time are alike: the variance is (2 - p - r)/(p + r) times that of free draws.
        let expected = p / (p + r);
        let error = (expected * (1.0 - expected) * (2.0 - p - r) / (p + r) / 6e4).sqrt();
        assert!((bad - expected).abs() < 3.0 * error, "{bad}");
        let bursts = runs_of(true, &lost);
        let mean = bursts.iter().sum::<usize>() as f64 / bursts.len() as f64;
        let spread = ((1.0 - r) / (r * r) / bursts.len() as f64).sqrt();
        assert!((mean - 1.0 / r).abs() < 3.0 * spread, "{mean}");
        let chi_square = chi_square_of_runs(&bursts, r);
        assert!(chi_square < CHI_SQUARE_7, "bursts: {chi_square}");
        let chi_square = chi_square_of_runs(&runs_of(false, &lost), p);
        assert!(chi_square < CHI_SQUARE_7, "gaps: {chi_square}");
    }

    #[test]
    fn a_link_that_is_silent_for_a_while_is_as_bad_as_its_chain_would_be() {
        // After k cycles a bad link is bad with π + (1 - π)(1 - p - r)^k.
        let (p, r, gap) = (0.1_f64, 0.2_f64, 3);
        let mut plan = begun(&format!("[[fault]]\nkind = \"burst\"\np = {p}\nr = {r}"));
        let lost: Vec<bool> = (0..40_000).map(|number| is_lost(&passage(&mut plan, number * gap))).collect();
        let pairs = lost.windows(2).filter(|pair| pair[0]);
        let (bad, again) =
            pairs.fold((0.0, 0.0), |(bad, again), pair| (bad + 1.0, again + f64::from(u8::from(pair[1]))));
        let stationary = p / (p + r);
        let expected = stationary + (1.0 - stationary) * (1.0 - p - r).powi(gap as i32);
        assert!((again / bad - expected).abs() < 3.0 * (0.25_f64 / bad).sqrt(), "{}", again / bad);
    }

    #[test]
    fn a_bad_link_may_let_something_through_and_a_good_one_lose_something() {
        let mut plan =
            begun("[[fault]]\nkind = \"burst\"\np = 0.5\nr = 0.5\nloss_bad = 0.8\nloss_good = 0.2");
        let lost = (0..10_000).filter(|&number| is_lost(&passage(&mut plan, number))).count();
        assert!((lost as f64 / 1e4 - 0.5).abs() < 0.02, "{lost}");
    }

    #[test]
    fn delays_have_their_length_and_jitter_reorders() {
        let mut plan = begun("[[fault]]\nkind = \"delay\"\ndelay_s = 0.3\njitter_s = 0.4");
        let mut seen = [0; 10];
        for number in 0..2000 {
            let (_, late) = passage(&mut plan, number).arrivals[0];
            seen[late as usize] += 1;
        }
        assert_eq!(seen.iter().sum::<u32>(), 2000);
        assert!(
            seen[..3].iter().all(|count| *count == 0) && seen[3..=7].iter().all(|count| *count > 0),
            "{seen:?}"
        );
    }

    #[test]
    fn a_delayed_packet_comes_when_it_is_due_and_not_to_the_dead() {
        let faults = "
            [[fault]]
            kind = \"delay\"
            links = [\"0->1\", \"0->2\"]
            delay_s = 0.5
            [[fault]]
            kind = \"kill\"
            at_s = 0.3
            robots = 2";
        let mut heard = Vec::new();
        let arena = run(&scenario(faults), 20, |arena, percepts| {
            let from_0 = |robot: usize| {
                percepts.unwrap()[robot].deliveries.iter().any(|heard| heard.packet.sender().index == 0)
            };
            heard.push((arena.current_tick(), from_0(1), from_0(3)));
        });
        let first = heard.iter().find(|(_, late, _)| *late).unwrap().0;
        assert_eq!(first, 5);
        assert!(heard[0].2, "other links are not struck");
        // Robot 2 was sent three packets before it died; none arrived. Five to robot 1 are on their way.
        assert_eq!(arena.packets().lost_fault, 3);
        assert_eq!(arena.packets().delayed, 5);
    }

    #[test]
    fn duplicates_are_heard_twice_and_counted() {
        let faults = "[[fault]]\nkind = \"duplicate\"\nprobability = 1.0\nlinks = [\"4->5\"]";
        let arena = run(&scenario(faults), 9, |_, percepts| {
            let heard = &percepts.unwrap()[5].deliveries;
            assert_eq!(heard.iter().filter(|heard| heard.packet.sender().index == 4).count(), 2);
        });
        assert_eq!(arena.packets().duplicated, 10);
        assert_eq!(effect(&arena, "packets duplicated"), 10);
    }

    #[test]
    fn an_odd_number_of_flipped_bits_never_passes_and_four_pass_as_often_as_counted() {
        const PACKETS: u64 = 1_000_000;
        let passed = |flips: u32| {
            let mut plan =
                begun(&format!("[[fault]]\nkind = \"corrupt\"\nprobability = 1.0\nflips = {flips}"));
            let passed = (0..PACKETS).filter(|&number| !is_lost(&passage(&mut plan, number))).count() as u64;
            let effects = &plan.ledger().next().unwrap().effects;
            let told = |what: &str| effects.get(what).copied().unwrap_or(0);
            assert_eq!(told("packets altered unnoticed"), passed, "{flips} flips");
            assert_eq!(told("packets corrupted and refused"), PACKETS - passed, "{flips} flips");
            passed as f64
        };
        assert_eq!([passed(3), passed(5)], [0.0, 0.0]);
        // Of 17178876 choices of four bits 561 can be read, with a reading of 1.0 (protocol/tests/flipped_bits.rs).
        let expected = PACKETS as f64 * 561.0 / 17_178_876.0;
        let four = passed(4);
        println!("{four} of a million packets with four flipped bits pass, {expected:.1} are expected");
        assert!((four - expected).abs() < 3.0 * expected.sqrt(), "{four}, not {expected}");
    }

    #[test]
    fn groups_cannot_hear_each_other() {
        let faults = "[[fault]]\nkind = \"partition\"\ngroups = [\"0-3\", \"4-7\"]";
        let mut plan = begun(faults);
        let lost = |plan: &mut FaultPlan, from, to| is_lost(&passage_on(plan, from, to, 1));
        assert!(lost(&mut plan, 0, 4) && lost(&mut plan, 4, 0));
        assert!(!lost(&mut plan, 0, 3) && !lost(&mut plan, 4, 7));
        assert!(!lost(&mut plan, 0, 8) && !lost(&mut plan, 9, 4) && !lost(&mut plan, 8, 9));
        let mut plan = begun(&format!("{faults}\none_way = true"));
        assert!(lost(&mut plan, 0, 4) && !lost(&mut plan, 4, 0));
    }

    #[test]
    fn a_region_is_parted_from_what_lies_around_it() {
        let mut plan = begun(
            "[[fault]]\nkind = \"partition\"\none_way = true\nregion = { center_m = [0, 0.5], radius_m = 0.35 }",
        );
        let lost = |plan: &mut FaultPlan, from, to| is_lost(&passage_on(plan, from, to, 1));
        assert!(lost(&mut plan, 0, 5) && !lost(&mut plan, 5, 0) && !lost(&mut plan, 0, 2));
    }

    #[test]
    fn nobody_hears_in_a_jammed_disc() {
        let mut plan =
            begun("[[fault]]\nkind = \"jam\"\nregion = { center_m = [0.2, 0.5], radius_m = 0.05 }");
        let lost = |plan: &mut FaultPlan, from, to| is_lost(&passage_on(plan, from, to, 1));
        assert!(lost(&mut plan, 5, 1) && !lost(&mut plan, 1, 5) && !lost(&mut plan, 5, 2));
    }

    #[test]
    fn a_choice_is_made_when_a_fault_begins_and_only_the_disc_of_a_jam_is_asked_again() {
        let disc = "region = { center_m = [0.1, 0.5], radius_m = 0.05 }";
        // Robot 0 stands in the disc when the fault begins, and robot 9 a tick later.
        let begun = |fault: &str| {
            let scenario = scenario(&format!("[[fault]]\n{fault}\n{disc}"));
            let mut poses = placement::start(&scenario).unwrap();
            let (mut plan, mut field) = (FaultPlan::new(&scenario), Field::new(&scenario));
            plan.process_faults(0, &poses, &mut field, &[]);
            poses.swap(0, 9);
            plan.process_faults(1, &poses, &mut field, &[]);
            plan
        };
        let lost = |plan: &mut FaultPlan, sender: u32, receiver: u32| {
            let packet = packet(sender);
            let reception = Reception { sender, receiver, number: 1, sent_s: 0.0, packet };
            let moved = if receiver == 0 { ArenaPoint::new(1.0, 0.5) } else { ArenaPoint::new(0.1, 0.5) };
            is_lost(&plan.passage(1, &reception, moved, &mut Payloads::default()))
        };
        let mut chosen = begun("kind = \"loss\"\nprobability = 1.0\ndirection = \"in\"");
        assert!(lost(&mut chosen, 5, 0) && !lost(&mut chosen, 5, 9), "whoever was in the disc stays chosen");
        let mut parted = begun("kind = \"partition\"");
        assert!(lost(&mut parted, 5, 0) && !lost(&mut parted, 5, 9), "and stays parted");
        let mut jammed = begun("kind = \"jam\"");
        assert!(!lost(&mut jammed, 5, 0) && lost(&mut jammed, 5, 9), "whoever leaves a jam hears again");
    }

    #[test]
    fn a_fault_lasts_from_the_start_to_the_end_unless_its_window_is_given() {
        let loss = "[[fault]]\nkind = \"loss\"\nprobability = 1.0\n";
        let window = |times: &str| {
            let arena = run(&scenario(&format!("{loss}{times}")), 20, |_, _| {});
            let line = arena.ledger().next().unwrap().clone();
            (line.planned_tick, line.until_tick, line.fired_tick, line.last_tick)
        };
        assert_eq!(window(""), (0, None, Some(0), Some(20)));
        assert_eq!(window("from_s = 0.5\nuntil_s = 1.0"), (5, Some(10), Some(5), Some(9)));
    }

    #[test]
    fn what_the_channel_loses_never_meets_a_fault_and_is_counted_apart() {
        let isis = "channel.profile = \"isis\"\nchannel.airtime_s = 0.02\nchannel.loss = 0.3\n";
        let fault = "[[fault]]\nkind = \"loss\"\nprobability = 1.0";
        let played = |faults: &str| {
            let mut scenario = scenario(&format!("{isis}{faults}"));
            scenario.channel.model = range(0.45);
            run(&scenario, 100, |_, _| {})
        };
        let (healthy, faulty) = (played("").packets(), played(fault));
        let dropped = effect(&faulty, "packets dropped");
        let faulty = faulty.packets();
        assert!(faulty.collided > 0 && faulty.lost_loss > 0 && faulty.lost_range > 0, "{faulty:?}");
        assert_eq!((faulty.heard, faulty.lost_fault, dropped), (0, healthy.heard, healthy.heard));
        let by_the_channel =
            |packets: arena::packets::Packets| (packets.collided, packets.lost_loss, packets.lost_range);
        assert_eq!(by_the_channel(faulty), by_the_channel(healthy));
    }

    #[test]
    fn every_link_and_direction_is_bad_by_itself() {
        let mut plan = begun("[[fault]]\nkind = \"burst\"\np = 0.2\nr = 0.2");
        let mut lost = |sender, receiver| -> Vec<bool> {
            (0..4000).map(|number| is_lost(&passage_on(&mut plan, sender, receiver, number))).collect()
        };
        let there = lost(0, 1);
        for (sender, receiver) in [(1, 0), (0, 2), (2, 1)] {
            let other = lost(sender, receiver);
            let alike = there.iter().zip(&other).filter(|(a, b)| a == b).count() as f64 / 4000.0;
            assert!((alike - 0.5).abs() < 0.05, "{sender}->{receiver} is as 0->1 in {alike} of all cycles");
        }
    }

    #[test]
    fn directions_and_links_say_which_packets_are_struck() {
        let lost = |choice: &str| {
            let mut plan = begun(&format!("[[fault]]\nkind = \"loss\"\nprobability = 1.0\n{choice}"));
            [(3, 5), (5, 3), (5, 6)].map(|(from, to)| is_lost(&passage_on(&mut plan, from, to, 1)))
        };
        assert_eq!(lost("robots = 3"), [true, true, false]);
        assert_eq!(lost("robots = 3\ndirection = \"out\""), [true, false, false]);
        assert_eq!(lost("robots = 3\ndirection = \"in\""), [false, true, false]);
        assert_eq!(lost("links = [\"3->5\"]"), [true, false, false]);
        assert_eq!(lost("links = [\"5<->3\"]"), [true, true, false]);
    }

    #[test]
    fn faults_compose_in_the_order_of_the_plan() {
        let faults = "
            [[fault]]
            kind = \"delay\"
            delay_s = 0.2
            [[fault]]
            kind = \"duplicate\"
            probability = 1.0
            delay_s = 0.1
            [[fault]]
            kind = \"loss\"
            probability = 1.0
            robots = 5
            [[fault]]
            kind = \"jam\"
            region = { center_m = [0.6, 0.5], radius_m = 0.05 }";
        let mut plan = begun(faults);
        let late: Vec<Tick> = passage(&mut plan, 1).arrivals.iter().map(|(_, late)| *late).collect();
        assert_eq!(late, [2, 3]);
        let both = passage_on(&mut plan, 0, 5, 1);
        assert_eq!((is_lost(&both), both.lost), (true, 2));
        let fired: Vec<bool> = plan.ledger().map(|line| line.fired_tick.is_some()).collect();
        assert_eq!(fired, [true, true, true, false], "what is lost already cannot be jammed");
    }
}

mod agents {
    use super::*;

    fn process_faults(faults: &str, ticks: impl IntoIterator<Item = Tick>) -> Vec<(Tick, ProcessFault)> {
        let scenario = scenario(faults);
        let poses = placement::start(&scenario).unwrap();
        let (mut plan, mut field) = (FaultPlan::new(&scenario), Field::new(&scenario));
        ticks
            .into_iter()
            .flat_map(|tick| {
                plan.process_faults(tick, &poses, &mut field, &[])
                    .into_iter()
                    .map(move |process_fault| (tick, process_fault))
            })
            .collect()
    }

    #[test]
    fn agents_are_killed_and_half_of_them_restarted_at_the_planned_ticks() {
        let faults =
            "[[fault]]\nkind = \"kill\"\nat_s = 1\nrestart_at_s = 2\nrestart_share = 0.5\nrobots = \"2-5\"";
        let all = process_faults(faults, 0..100);
        let killed: Vec<_> =
            all.iter().filter(|(_, process_fault)| process_fault.action == ProcessAction::Kill).collect();
        assert_eq!(killed.len(), 4);
        assert!(
            killed.iter().all(|(tick, process_fault)| *tick == 10 && (2..=5).contains(&process_fault.robot))
        );
        let restarted: Vec<_> =
            all.iter().filter(|(_, process_fault)| process_fault.action == ProcessAction::Restart).collect();
        assert_eq!(restarted.len(), 2);
        assert!(restarted.iter().all(|(tick, _)| *tick == 20));
    }

    #[test]
    fn who_is_dead_is_neither_stopped_nor_killed_again() {
        let faults = "
            [[fault]]
            kind = \"pause\"
            from_s = 1
            until_s = 3
            robots = 1
            [[fault]]
            kind = \"kill\"
            at_s = 2
            robots = 1
            [[fault]]
            kind = \"kill\"
            at_s = 4
            share = 1.0";
        let all = process_faults(faults, 0..100);
        let of_1: Vec<_> = all
            .iter()
            .filter(|(_, process_fault)| process_fault.robot == 1)
            .map(|(tick, process_fault)| (*tick, process_fault.action))
            .collect();
        assert_eq!(of_1, [(10, ProcessAction::Pause), (20, ProcessAction::Kill)]);
        assert_eq!(all.len(), 2 + 9);
    }

    #[test]
    fn a_share_is_drawn_at_random_or_nearest_to_the_lamps() {
        let killed = |pick: &str| -> Vec<u32> {
            let faults = format!("[[fault]]\nkind = \"kill\"\nat_s = 1\nshare = 0.3\n{pick}");
            process_faults(&faults, 0..20).iter().map(|(_, process_fault)| process_fault.robot).collect()
        };
        assert_eq!(killed("pick = \"nearest-lamps\""), [0, 1, 2]);
        assert_eq!(killed("").len(), 3);
        assert_eq!(
            killed("region = { center_m = [1, 0.5], radius_m = 0.25 }").len(),
            1,
            "0.3 of three robots"
        );
    }

    #[test]
    fn the_silent_are_not_heard_and_hear_nothing() {
        let faults = "[[fault]]\nkind = \"pause\"\nfrom_s = 0.5\nuntil_s = 1.0\nrobots = \"0-1\"";
        let arena = run(&scenario(faults), 20, |arena, percepts| {
            let paused = (5..10).contains(&arena.current_tick());
            assert_eq!(percepts.unwrap()[9].deliveries.len(), if paused { 7 } else { 9 });
            assert_eq!(percepts.unwrap()[0].deliveries.len(), if paused { 0 } else { 9 });
        });
        assert_eq!(effect(&arena, "robots paused"), 2);
        assert_eq!(effect(&arena, "robots resumed"), 2);
    }

    #[test]
    fn slow_answers_come_into_force_late() {
        let faults = "[[fault]]\nkind = \"slow\"\nrobots = 1\nfrom_s = 1\ndelay_s = 0.5";
        let mut arena = Arena::new(&scenario(faults)).unwrap();
        let mut moved = [0, 0];
        for tick in 0..40_u64 {
            arena.process_faults(&[]);
            let mut commands = everyone();
            if tick > 20 {
                // Up, so that nobody is in the way.
                for answer in commands.iter_mut().flatten() {
                    answer.command.velocity = BodyVector::new(0.0, 0.1);
                }
            }
            arena.tick(&commands);
            for (robot, moved) in moved.iter_mut().enumerate() {
                let is_moving = arena.poses()[robot].position.y > 0.5;
                *moved = if is_moving && *moved == 0 { tick } else { *moved };
            }
        }
        assert_eq!(moved, [21, 26]);
    }

    #[test]
    fn a_late_velocity_counts_in_the_body_frame_of_when_it_comes_into_force() {
        let faults = "robots.drive = \"differential\"\n[[fault]]\nkind = \"slow\"\nrobots = 1\ndelay_s = 0.5";
        let mut arena = Arena::new(&scenario(faults)).unwrap();
        for tick in 0..20_u64 {
            arena.process_faults(&[]);
            let mut commands = everyone();
            // To the left, said in six ticks before the first of them comes into force.
            if (1..=6).contains(&tick) {
                commands[1].as_mut().unwrap().command.velocity = BodyVector::new(0.0, 1e-6);
            }
            arena.tick(&commands);
        }
        // .3 rad in each of six ticks; in the frame of when it was said, it would stop at a quarter turn.
        assert!((arena.poses()[1].heading - 6.0 * 0.3).abs() < 1e-12, "{}", arena.poses()[1].heading);
    }
}

mod bodies {
    use super::*;

    #[test]
    fn sensors_are_biased_noisy_or_stuck_and_only_those_chosen() {
        let readings = |faults: &str, robot: usize| -> Vec<f64> {
            let mut readings = Vec::new();
            run(&scenario(faults), 30, |_, percepts| readings.push(percepts.unwrap()[robot].light.value));
            readings
        };
        let healthy = readings("", 2)[0];
        let biased = readings("[[fault]]\nkind = \"sensor\"\nrobots = 2\nbias_counts = -20\nfrom_s = 1", 2);
        assert_eq!((biased[9], biased[10]), (healthy, healthy - 20.0));
        let noisy = "[[fault]]\nkind = \"sensor\"\nrobots = 2\nnoise_counts = 5";
        let spread = readings(noisy, 2).iter().map(|value| (value - healthy).powi(2)).sum::<f64>() / 31.0;
        assert!((2.0..8.0).contains(&spread.sqrt()), "{spread}");
        assert!(readings(noisy, 3).iter().all(|value| *value == readings("", 3)[0]));
    }

    #[test]
    fn a_stuck_sensor_reads_what_it_read_first() {
        let faults = "[[fault]]\nkind = \"sensor\"\nrobots = 0\nstuck = true\nfrom_s = 0.5";
        let mut arena = Arena::new(&scenario(faults)).unwrap();
        let mut readings = Vec::new();
        for _ in 0..12 {
            arena.process_faults(&[]);
            let mut commands = everyone();
            commands[0].as_mut().unwrap().command.velocity = BodyVector::new(0.0, 0.1);
            readings.push(arena.tick(&commands).unwrap()[0].light);
        }
        assert_ne!(readings[3], readings[4]);
        assert!(readings[5..].iter().all(|light| *light == readings[5]));
    }

    #[test]
    fn stuck_bodies_stay_and_drifting_ones_leave() {
        let faults = "
            [[fault]]
            kind = \"motion\"
            robots = 0
            stuck = true
            [[fault]]
            kind = \"motion\"
            robots = 1
            drift_m_per_s = [0.0, 0.1]";
        let scenario = scenario(faults);
        let mut arena = Arena::new(&scenario).unwrap();
        let mut commands = everyone();
        commands[0].as_mut().unwrap().command.velocity = BodyVector::new(0.0, 0.1);
        for _ in 0..=10 {
            arena.process_faults(&[]);
            arena.tick(&commands);
        }
        assert_eq!(arena.poses()[0].position, ArenaPoint::new(0.1, 0.5));
        assert!((arena.poses()[1].position - ArenaPoint::new(0.2, 0.6)).norm() < 1e-12);
        assert_eq!(arena.poses()[2], Pose::unturned(ArenaPoint::new(0.3, 0.5)));
    }

    #[test]
    fn drifts_are_ahead_and_to_the_left_of_a_body_and_count_before_its_speed_limit() {
        let fault = "[[fault]]\nkind = \"motion\"\nrobots = 1\ndrift_m_per_s = [0.6, 0.3]";
        let scenario = scenario(&format!("robots.speed_limit_m_per_s = 0.15\n{fault}"));
        let ends = |mut scenario: Scenario, heading: f64| {
            scenario.robots.headings_rad = Some(vec![scenario::Finite::new(heading).unwrap(); 10]);
            let mut arena = Arena::new(&scenario).unwrap();
            let mut commands = everyone();
            commands[1].as_mut().unwrap().command.velocity = BodyVector::new(0.2, 0.3);
            for _ in 0..=1 {
                arena.process_faults(&[]);
                arena.tick(&commands);
            }
            arena.poses()[1].position - ArenaPoint::new(0.2, 0.5)
        };
        // Together [0.8, 0.6] m/s, cut to 0.15 m/s, for a tick of 0.1 s.
        let ahead = ends(scenario.clone(), 0.0);
        assert!((ahead.x - 0.012).abs() < 1e-12 && (ahead.y - 0.009).abs() < 1e-12, "{ahead}");
        let turned = ends(scenario, std::f64::consts::FRAC_PI_2);
        assert!((turned.x + 0.009).abs() < 1e-12 && (turned.y - 0.012).abs() < 1e-12, "{turned}");
    }

    #[test]
    fn whoever_is_killed_paused_silent_or_stuck_is_in_the_way_and_takes_no_share_of_a_push() {
        let pushed = |fault: &str, silent: bool| {
            let text = format!(
                "duration_s = 10
                 step_s = 0.1
                 arena.size_m = [2, 1]
                 robots = {{ positions_m = [[0.5, 0.5], [0.7, 0.5]], headings_rad = [0, 0], radius_m = 0.1 }}
                 controller.gain_per_s = 1
                 channel.range_m = 2
                 {fault}"
            );
            let scenario = Scenario::parse("push", &text, &[]).unwrap_or_else(|error| panic!("{error}"));
            let mut arena = Arena::new(&scenario).unwrap();
            let mut commands = vec![still(0), still(1).filter(|_| !silent)];
            commands[0].as_mut().unwrap().command.velocity = BodyVector::new(0.2, 0.0);
            for _ in 0..=20 {
                for ProcessFault { robot, .. } in arena.process_faults(&[]) {
                    commands[robot as usize] = None;
                }
                arena.tick(&commands);
            }
            [0, 1].map(|robot: usize| arena.poses()[robot].position.x)
        };
        let [pusher, other] = pushed("", false);
        assert!((pusher - 0.7).abs() < 1e-6 && (other - 0.9).abs() < 1e-6, "{pusher} {other}: half each");
        for (fault, silent) in [
            ("[[fault]]\nkind = \"kill\"\nat_s = 0\nrobots = 1", false),
            ("[[fault]]\nkind = \"pause\"\nrobots = 1", false),
            ("[[fault]]\nkind = \"motion\"\nrobots = 1\nstuck = true", false),
            ("", true),
        ] {
            let [pusher, other] = pushed(fault, silent);
            assert!((pusher - 0.5).abs() < 1e-6, "{fault}: the pusher is at {pusher}");
            assert_eq!(other, 0.7, "{fault}");
        }
    }

    #[test]
    fn a_sensor_may_be_stuck_and_biased_and_noisy_at_once() {
        let fault =
            "[[fault]]\nkind = \"sensor\"\nrobots = 0\nstuck = true\nbias_counts = 100\nnoise_counts = 5";
        let mut readings = Vec::new();
        let mut arena = Arena::new(&scenario(fault)).unwrap();
        let healthy = Arena::new(&scenario("")).unwrap().tick(&everyone()).unwrap()[0].light.value;
        for _ in 0..100 {
            arena.process_faults(&[]);
            let mut commands = everyone();
            commands[0].as_mut().unwrap().command.velocity = BodyVector::new(0.0, 0.03);
            readings.push(arena.tick(&commands).unwrap()[0].light.value - healthy - 100.0);
        }
        let mean = readings.iter().sum::<f64>() / 100.0;
        let spread = (readings.iter().map(|off| (off - mean).powi(2)).sum::<f64>() / 99.0).sqrt();
        assert!(mean.abs() < 1.5 && (spread - 5.0).abs() < 1.2, "{mean} ± {spread}");
    }

    #[test]
    fn liars_say_what_they_are_told_to() {
        let faults = "[[fault]]\nkind = \"liar\"\nrobots = 4\nidentity = 8\nlight_counts = 1e6";
        let arena = run(&scenario(faults), 5, |_, percepts| {
            let heard = &percepts.unwrap()[0].deliveries;
            let as_8: Vec<_> = heard.iter().filter(|heard| heard.packet.sender().index == 8).collect();
            assert_eq!(as_8.len(), 2, "one is true");
            assert!(as_8.iter().any(|heard| heard.packet.body() == Body::Inline(&1e6_f32.to_le_bytes())
                && heard.range.get() < 0.41));
        });
        assert_eq!(effect(&arena, "packets falsified"), 6, "once per packet, not per listener");
    }

    #[test]
    fn liars_replace_bytes_of_payloads_that_are_long_enough() {
        let lie = |lie: &str| scenario(&format!("[[fault]]\nkind = \"liar\"\nrobots = 4\n{lie}"));
        let of_4 = |percepts: Option<&[Percept]>| {
            let percept = &percepts.unwrap()[3];
            let heard = percept.deliveries.iter().find(|heard| heard.packet.sender().index == 4).unwrap();
            percept.payload(heard).to_vec()
        };
        let truth = 1.0_f32.to_le_bytes();
        let cases = [
            ("payload_hex = \"abCD\"", [0xab, 0xcd, truth[2], truth[3]], 6),
            ("payload_hex = \"abcd\"\npayload_offset = 2", [truth[0], truth[1], 0xab, 0xcd], 6),
            ("payload_hex = \"abcd\"\npayload_offset = 3", truth, 0),
            ("payload_hex = \"ab\"\nlight_counts = 2.0", [0xab, 0, 0, 0x40], 6),
        ];
        for (keys, said, falsified) in cases {
            let arena = run(&lie(keys), 5, |_, percepts| assert_eq!(of_4(percepts), said, "{keys}"));
            assert_eq!(effect(&arena, "packets falsified"), falsified, "{keys}");
        }
    }
}

mod plans {
    use super::*;

    #[test]
    fn what_is_planned_in_vain_is_told_with_its_line() {
        let faults = "
            [[fault]]
            kind = \"loss\"
            probability = 0.5
            links = [\"0->9\"]
            [[fault]]
            kind = \"jam\"
            from_s = 200
            region = { center_m = [1, 0.5], radius_m = 1 }
            [[fault]]
            kind = \"kill\"
            at_s = 50
            restart_at_s = 150
            robots = 1";
        let mut scenario = scenario(faults);
        scenario.channel.model = range(0.85);
        let poses = placement::start(&scenario).unwrap();
        assert_eq!(
            warnings(&scenario, &poses),
            [
                "row:13: fault 0 (loss): link 0->9 is beyond range at the start: 0.90 m, channel.range_m is 0.85",
                "row:17: fault 1 (jam): begins at 200 s, after the end of the run (100 s)",
                "row:21: fault 2 (kill): nobody is restarted before the end of the run (100 s)",
            ]
        );
    }

    #[test]
    fn what_comes_later_than_neighbors_are_remembered_is_told_with_the_numbers() {
        let faults = "
            [[fault]]
            kind = \"delay\"
            delay_s = 0.2
            jitter_s = 0.4
            [[fault]]
            kind = \"slow\"
            delay_s = 0.5
            [[fault]]
            kind = \"delay\"
            delay_s = 0.4
            [[fault]]
            kind = \"duplicate\"
            probability = 1.0
            delay_s = 9.0";
        let told = |cycles: &str| {
            let scenario = scenario(&format!("{cycles}{faults}"));
            warnings(&scenario, &placement::start(&scenario).unwrap())
        };
        assert_eq!(
            told(""),
            [
                "row:13: fault 0 (delay): packets come up to 0.6 s late, and a neighbor is forgotten after 0.4 s, \
                 controller.neighbor_timeout_cycles = 4; with 7 it is remembered until then",
                "row:17: fault 1 (slow): answers come 0.5 s late, and a neighbor is forgotten after 0.4 s, \
                 controller.neighbor_timeout_cycles = 4; with 6 it is remembered until then",
                "row:20: fault 2 (delay): packets come up to 0.4 s late, and a neighbor is forgotten after 0.4 s, \
                 controller.neighbor_timeout_cycles = 4; with 5 it is remembered until then",
            ]
        );
        assert_eq!(told("controller.neighbor_timeout_cycles = 7"), [""; 0]);
    }

    #[test]
    fn what_ends_makes_room_for_what_begins_in_whichever_order_it_is_planned() {
        let faults = "
            [[fault]]
            kind = \"pause\"
            robots = 3
            from_s = 10
            until_s = 15
            [[fault]]
            kind = \"pause\"
            robots = 3
            from_s = 5
            until_s = 10";
        let mut silent = Vec::new();
        run(&scenario(faults), 200, |arena, percepts| {
            if percepts.unwrap()[3].deliveries.is_empty() {
                silent.push(arena.current_tick());
            }
        });
        assert_eq!(silent, (50..150).collect::<Vec<_>>());
    }

    #[test]
    fn a_pause_of_an_earlier_life_or_of_another_fault_ends_nobodys_pause() {
        let faults = "
            [[fault]]
            kind = \"pause\"
            robots = 3
            from_s = 2
            until_s = 8
            [[fault]]
            kind = \"kill\"
            robots = 3
            at_s = 4
            restart_at_s = 5
            [[fault]]
            kind = \"pause\"
            share = 1.0
            from_s = 6
            until_s = 12
            [[fault]]
            kind = \"pause\"
            share = 1.0
            from_s = 7
            until_s = 10";
        let mut silent = Vec::new();
        run(&scenario(faults), 150, |arena, _| {
            if arena.packets().sent == silent.last().map_or(u64::MAX, |(_, sent)| *sent) {
                silent.last_mut().unwrap().0 = arena.current_tick();
            } else {
                silent.push((arena.current_tick(), arena.packets().sent));
            }
        });
        // Nobody sends from 6 s to 12 s.
        assert!(silent.iter().any(|(last, _)| *last == 119), "{silent:?}");
    }

    #[test]
    fn slow_answers_are_slow_after_a_pause_too() {
        let faults = "
            [[fault]]
            kind = \"slow\"
            robots = 1
            delay_s = 0.5
            [[fault]]
            kind = \"pause\"
            robots = 1
            from_s = 2
            until_s = 3";
        let mut heard = Vec::new();
        run(&scenario(faults), 60, |arena, percepts| {
            if percepts.unwrap()[0].deliveries.iter().any(|heard| heard.packet.sender().index == 1) {
                heard.push(arena.current_tick());
            }
        });
        assert!(heard.contains(&19) && !heard.contains(&20));
        // This harness answers at the tick of the strike, and the answer is half a second late.
        assert_eq!(heard.iter().find(|tick| **tick > 20), Some(&35), "{heard:?}");
    }

    #[test]
    fn copies_meet_later_faults_on_their_own_and_are_bounded() {
        let twice = "[[fault]]\nkind = \"duplicate\"\nprobability = 1.0\n";
        let mut plan = begun(&format!("{twice}[[fault]]\nkind = \"loss\"\nprobability = 0.5"));
        let one = (0..1000).filter(|&number| passage(&mut plan, number).arrivals.len() == 1).count();
        assert!((400..600).contains(&one), "{one} of 1000 lost one of two");
        let mut plan = begun(&twice.repeat(6));
        assert_eq!(passage(&mut plan, 1).arrivals.len(), 16);
        let last = plan.ledger().last().unwrap();
        assert_eq!(last.effects["packets not duplicated, too many copies"], 16);
    }

    #[test]
    fn a_fault_has_luck_of_its_own_and_keeps_it_when_robots_are_added() {
        let faults =
            "[[fault]]\nkind = \"loss\"\nprobability = 0.5\n[[fault]]\nkind = \"loss\"\nprobability = 0.5";
        let mut plan = begun(faults);
        let lost = (0..10_000).filter(|&number| is_lost(&passage(&mut plan, number))).count();
        assert!((lost as f64 / 1e4 - 0.75).abs() < 0.015, "{lost}");
    }
}

mod field {
    use arena::metrics::Attendance;
    use protocol::percept::{FieldComponent, Stimulus};

    use super::*;

    const MOVE: &str = "[[fault]]\nkind = \"field\"\nat_s = 1\nlamp = 0\nposition_m = [1.1, 0.5]\n";

    /// Value of the field of [`scenario`] so far from its lamp, with this offset, peak and half distance.
    fn lit(offset: f64, peak: f64, half_m: f64, away_m: f64) -> f64 {
        offset + peak / (1.0 + (away_m / half_m).powi(2))
    }

    /// Readings of a robot, tick by tick.
    fn readings(faults: &str, robot: usize) -> Vec<f64> {
        let mut readings = Vec::new();
        run(&scenario(faults), 20, |_, percepts| readings.push(percepts.unwrap()[robot].light.value));
        readings
    }

    fn is_near(value: f64, expected: f64) -> bool {
        (value - expected).abs() < 1e-9 * expected.abs()
    }

    #[test]
    fn every_key_of_a_term_changes_what_is_sensed_from_its_tick_on() {
        let before = lit(50.0, 500.0, 0.5, 0.3);
        for (change, after) in [
            ("lamp = 0\nposition_m = [1.1, 0.5]", lit(50.0, 500.0, 0.5, 0.8)),
            ("lamp = 0\npeak = -20", lit(50.0, -20.0, 0.5, 0.3)),
            ("lamp = 0\nhalf_distance_m = 0.1", lit(50.0, 500.0, 0.1, 0.3)),
            ("lamp = 0\nposition_m = [-1, 0.5]\npeak = 90", lit(50.0, 90.0, 0.5, 1.3)),
            ("offset = -7", lit(-7.0, 500.0, 0.5, 0.3)),
        ] {
            let read = readings(&format!("[[fault]]\nkind = \"field\"\nat_s = 1\n{change}"), 2);
            assert!(read[..10].iter().all(|value| is_near(*value, before)), "{change}: {read:?}");
            assert!(read[10..].iter().all(|value| is_near(*value, after)), "{change}: {read:?}");
        }
        let gaussian = |sigma_m: f64, gamma: f64, away_m: f64| {
            let height = gamma / (sigma_m * (2.0 * std::f64::consts::PI).sqrt());
            before + height * libm::exp(-away_m * away_m / (2.0 * sigma_m * sigma_m))
        };
        for (change, after) in [
            ("center_m = [0.5, 0.5]", gaussian(0.5, 40.0, 0.2)),
            ("sigma_m = 0.25", gaussian(0.25, 40.0, 0.7)),
            ("gamma = 80", gaussian(0.5, 80.0, 0.7)),
        ] {
            let peak = "field.gaussian = [{ center_m = [1, 0.5], sigma_m = 0.5, gamma = 40 }]\n";
            let fault = format!("[[fault]]\nkind = \"field\"\nat_s = 1\ngaussian = 0\n{change}");
            let read = readings(&format!("{peak}{fault}"), 2);
            assert!(is_near(read[9], gaussian(0.5, 40.0, 0.7)), "{change}: {read:?}");
            assert!(is_near(read[10], after) && is_near(read[20], after), "{change}: {read:?}");
        }
    }

    #[test]
    fn a_ring_of_diodes_sees_the_lamps_that_are_there_by_now_and_its_converter_stays() {
        let ring = "light = { sensor = \"ring\", adc_max_counts = 1000 }
                    controller.gradient = \"fixed\"
                    controller.gradient_magnitude_per_m = 100\n";
        let first = |faults: &str| {
            let mut light = Vec::new();
            run(&scenario(&format!("{ring}{faults}")), 20, |_, percepts| {
                light.push(percepts.unwrap()[2].light)
            });
            light
        };
        let light = first(MOVE);
        let Stimulus::Bearing(bearing) = light[9].stimulus else { panic!("it is dark") };
        assert!((bearing.get().abs() - std::f64::consts::PI).abs() < 1e-2, "behind it, {bearing:?}");
        let Stimulus::Bearing(bearing) = light[10].stimulus else { panic!("it is dark") };
        assert!(bearing.get().abs() < 1e-2, "ahead of it, {bearing:?}");
        let brighter = "[[fault]]\nkind = \"field\"\nat_s = 1\n";
        let [lamp, offset] =
            ["lamp = 0\npeak = 1e9", "offset = 60"].map(|it| first(&format!("{brighter}{it}")));
        // Diodes at 0, 45 and 90 degrees to the light are at the end of their converter, those behind are dark.
        let most = 50.0 + 0.5 * 1000.0 * (1.0 + 2_f64.sqrt());
        assert!(lamp[9].value < 0.5 * most && is_near(lamp[10].value, most), "{lamp:?}");
        assert!((offset[10].value - offset[9].value - 10.0).abs() < 1e-9, "robots add the new Φ");
    }

    #[test]
    fn metrics_and_the_shown_field_are_those_of_the_changed_one() {
        let exact = "controller.law = \"exact\"\narena.boundary_sensing = true\n";
        let scenario = scenario(&format!("{exact}{MOVE}"));
        let (mut costs, mut distances, mut shown) = (Vec::new(), Vec::new(), Vec::new());
        let arena = run(&scenario, 20, |arena, percepts| {
            let metrics = arena.metrics(&everyone(), Attendance { alive: 10, paused: 0 });
            assert_eq!(arena.disturbance(&everyone())[1].is_some(), metrics.cost_h.is_some());
            costs.push(metrics.cost_h.unwrap());
            distances.push(metrics.mean_lamp_distance_m.unwrap());
            let lamp = percepts.unwrap()[0].field.iter().find_map(|term| match term {
                FieldComponent::Lamp { position, .. } => Some(position.0.x),
                _ => None,
            });
            shown.push(lamp.unwrap());
        });
        assert!((distances[9] - 0.55).abs() < 1e-12 && (distances[10] - 0.55).abs() < 1e-12, "{distances:?}");
        assert!(costs[9] == costs[0] && costs[10] != costs[9] && costs[20] == costs[10], "{costs:?}");
        assert!((shown[9] + 0.1).abs() < 1e-12 && (shown[10] - 1.0).abs() < 1e-12, "{shown:?}");
        // What is measured is what a scenario with the lamp there measures.
        let mut there = scenario.clone();
        there.field = scenario.field_at(10);
        there.fault.clear();
        let metrics = |arena: &Arena| arena.metrics(&everyone(), Attendance { alive: 10, paused: 0 });
        let fresh = run(&there, 20, |_, _| {});
        assert_eq!(metrics(&fresh), metrics(&arena));
        assert_eq!((arena.field_spec(), scenario.field_at(9)), (&there.field, scenario.field.clone()));
    }

    #[test]
    fn who_is_nearest_to_the_lamps_is_asked_of_the_lamps_that_are_there_by_then() {
        let kill = "[[fault]]\nkind = \"kill\"\nat_s = 1\nshare = 0.3\npick = \"nearest-lamps\"\n";
        let killed = |faults: &str| {
            let mut arena = Arena::new(&scenario(faults)).unwrap();
            let mut killed = Vec::new();
            for _ in 0..20 {
                killed.extend(arena.process_faults(&[]).into_iter().map(|fault| fault.robot));
                arena.tick(&everyone());
            }
            killed
        };
        assert_eq!(killed(kill), [0, 1, 2]);
        assert_eq!(killed(&format!("{MOVE}{kill}")), [7, 8, 9], "before it in the file, at the same tick");
        assert_eq!(killed(&format!("{kill}{MOVE}")), [0, 1, 2], "after it in the file");
    }

    #[test]
    fn of_two_changes_at_one_tick_the_later_in_the_file_stands() {
        let change = |at_s: f64, offset: f64| {
            format!("[[fault]]\nkind = \"field\"\nat_s = {at_s}\noffset = {offset}\n")
        };
        let plan = [change(1.0, 10.0), change(1.0, 20.0), change(0.5, 30.0)].concat();
        let read = readings(&plan, 2);
        let dark = lit(0.0, 500.0, 0.5, 0.3);
        assert!(is_near(read[4], dark + 50.0) && is_near(read[5], dark + 30.0), "{read:?}");
        assert!(is_near(read[10], dark + 20.0), "{read:?}");
        let scenario = scenario(&plan);
        let offsets = [4, 5, 9, 10, 99].map(|tick| scenario.field_at(tick).offset.get());
        assert_eq!(offsets, [50.0, 30.0, 30.0, 20.0, 20.0]);
    }

    #[test]
    fn a_change_of_the_field_is_counted_and_strikes_no_robot() {
        let arena = run(&scenario(MOVE), 20, |_, _| {});
        let line = arena.ledger().next().unwrap();
        assert_eq!(line.told(), "1 field changes");
        assert_eq!(
            (line.robots, line.fired_tick, line.last_tick, line.until_tick),
            (0, Some(10), Some(10), None)
        );
        assert_eq!(arena.packets().lost_fault, 0);
        let same = run(&scenario(&MOVE.replace("[1.1, 0.5]", "[0, 0.5]")), 20, |_, _| {});
        assert_eq!(same.ledger().next().unwrap().fired_tick, None, "the lamp is there already");
    }

    #[test]
    fn a_change_of_the_plan_is_the_same_as_one_that_was_planned() {
        let planned = scenario(MOVE);
        let digest_of_planned = run(&planned, 20, |_, _| {}).digest();
        let mut arena = Arena::new(&scenario("")).unwrap();
        for tick in 0..=20 {
            if tick == 10 {
                arena.change_plan(&planned);
            }
            arena.process_faults(&[]);
            arena.tick(&everyone());
        }
        assert_eq!(arena.digest(), digest_of_planned);
    }
}
