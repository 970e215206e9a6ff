//! Messages to the page about a swarm.

use engine::Participation;
use scenario::{
    ChannelModel, FieldSpec, Mind,
    fault::{Kind, Target},
};
use squad::Awaited;

use crate::{
    swarm::Swarm,
    wire::{
        Agent, ControllerOf, Fault, Field, Gaussian, Hello, Lamp, Metrics, Packets, Quantiles, Region, State,
        SummaryText, Told, Waited, Waiting,
    },
};

pub(crate) fn hello(swarm: &Swarm) -> Told<'_> {
    let (about, scenario) = (&swarm.about, &swarm.scenario);
    let [width_m, height_m] = scenario.arena.size_m.get();
    let controllers = scenario.controllers.iter().map(|controller| ControllerOf {
        name: name_of(&controller.mind),
        robots: controller.robots.to_string(),
        has_cells: controller.law().is_some(),
    });
    Told::Hello(Box::new(Hello {
        run: &about.run,
        scenario: &scenario.name,
        engine: &about.engine,
        mode: &about.mode,
        source: if about.is_recording { "recording" } else { "live" },
        can_act: !about.is_recording,
        robots: scenario.robot_count(),
        width_m,
        height_m,
        step_s: scenario.step_s.get(),
        cycle_s: scenario.cycle_s(),
        duration_s: scenario.time_of(scenario.ticks()),
        radius_m: scenario.robots.radius_m.get(),
        range_m: match scenario.channel.model {
            ChannelModel::Range { range_m, .. } => Some(range_m.get()),
            _ => None,
        },
        field: field(&swarm.field),
        controllers: controllers.collect(),
        faults: faults(swarm),
    }))
}

pub(crate) fn field(spec: &FieldSpec) -> Field {
    let gaussian = |peak: &scenario::GaussianSpec| {
        let sigma_m = peak.sigma_m.get();
        let amplitude = peak.gamma.get() / (sigma_m * std::f64::consts::TAU.sqrt());
        Gaussian { center_m: peak.center_m.get(), amplitude, sigma_m }
    };
    let lamp = |lamp: &scenario::LampSpec| Lamp {
        position_m: lamp.position_m.get(),
        peak: lamp.peak.get(),
        half_distance_m: lamp.half_distance_m.get(),
    };
    Field {
        offset: spec.offset.get(),
        gaussians: spec.gaussian.iter().map(gaussian).collect(),
        lamps: spec.lamp.iter().map(lamp).collect(),
    }
}

pub(crate) fn faults(swarm: &Swarm) -> Vec<Fault> {
    let fault = |(index, fault): (usize, &scenario::Fault)| Fault {
        index,
        kind: fault.name(),
        from_s: fault.begins_s(),
        until_s: fault.ends_s(),
        whom: whom(&fault.target),
        region: region(fault),
        robots: named(&fault.target),
        fired_tick: swarm.struck.get(&(index as u32)).copied(),
    };
    swarm.scenario.fault.iter().enumerate().map(fault).collect()
}

/// The disc that jams, or in which robots are chosen.
fn region(fault: &scenario::Fault) -> Option<Region> {
    let disc = match &fault.kind {
        Kind::Jam(jam) => jam.region,
        _ => fault.target.choice()?.region?,
    };
    Some(Region { center_m: disc.center_m.get(), radius_m: disc.radius_m.get() })
}

/// Robots or links that a fault strikes, in words.
fn whom(target: &Target) -> String {
    let choice = match target {
        Target::Links(links) => {
            let links: Vec<String> = links.iter().map(ToString::to_string).collect();
            return format!("links {}", links.join(", "));
        }
        Target::ByItsKeys => return String::new(),
        Target::Robots(choice) | Target::Packets(choice, _) => choice,
    };
    let mut words = match &choice.robots {
        Some(robots) => format!("robots {robots}"),
        None => "all robots".into(),
    };
    if let Some(disc) = &choice.region {
        let [x, y] = disc.center_m.get();
        words += &format!(" within {} m of ({x}, {y})", disc.radius_m.get());
    }
    if let Some(share) = &choice.share {
        words += &format!(", {} % of them", share.share.get() * 100.0);
    }
    words
}

/// The robots that a fault names by their numbers alone.
fn named(target: &Target) -> Option<Vec<u32>> {
    let choice = target.choice().filter(|choice| choice.region.is_none() && choice.share.is_none())?;
    Some(choice.robots.as_ref()?.iter().collect())
}

fn name_of(mind: &Mind) -> String {
    match mind {
        Mind::Law(law) => {
            let name = serde_json::to_value(law.law).ok();
            name.as_ref().and_then(|name| name.as_str()).unwrap_or("law").to_owned()
        }
        Mind::Program(program) => last_part(&program.command.join(" ")),
        Mind::Python(python) => {
            let class = python.class.as_deref().map(|class| format!(":{class}")).unwrap_or_default();
            last_part(&python.file) + &class
        }
    }
}

/// A command without the folder of its program.
fn last_part(command: &str) -> String {
    let (program, words) = command.split_once(' ').unwrap_or((command, ""));
    let program = program.rsplit('/').next().unwrap_or(program);
    format!("{program} {words}").trim().to_owned()
}

pub(crate) fn state(swarm: &Swarm) -> Told<'_> {
    let (scenario, snapshot) = (&swarm.scenario, swarm.snapshot.as_ref());
    let robots = scenario.robot_count();
    let waiting = snapshot.and_then(|snapshot| snapshot.waiting.as_ref());
    let joins = waiting.filter(|waiting| waiting.what == Awaited::Join);
    let has_begun = swarm.number > 0;
    let phase = match (swarm.is_over, has_begun) {
        (true, _) => "over",
        (false, true) => "running",
        (false, false) => "gathering",
    };
    let joined = match (has_begun, joins) {
        (true, _) => robots,
        (false, Some(waiting)) => robots.saturating_sub(waiting.count as u32),
        (false, None) => 0,
    };
    // Before the snapshot, which comes a few times a second, messages of ticks have come.
    let told = swarm.metrics.as_ref();
    let count = |participation| snapshot.map(|snapshot| snapshot.count(participation) as u32);
    let alive = count(Participation::Present).zip(count(Participation::Paused)).map(|(a, b)| a + b);
    Told::State(Box::new(State {
        phase,
        joined,
        robots,
        tick: swarm.tick,
        ticks: scenario.ticks(),
        time_s: swarm.time_s,
        wall_s: snapshot.map(|snapshot| snapshot.wall_s),
        real_time_factor: snapshot.and_then(observe::live::Snapshot::real_time_factor),
        paused: snapshot.map_or(swarm.is_held, |snapshot| snapshot.is_held),
        speed: snapshot.map_or(swarm.speed, |snapshot| snapshot.speed),
        metrics: Metrics {
            mean_error_m: match snapshot {
                Some(snapshot) => snapshot.mean_error_m,
                None => told.and_then(|told| told.mean_error_m),
            },
            max_error_m: told.and_then(|told| told.max_error_m),
            cost_h: told.and_then(|told| told.cost_h),
            robots_alive: alive.or(told.map(|told| told.robots_alive)),
            robots_paused: count(Participation::Paused).or(told.map(|told| told.robots_paused)),
        },
        packets: packets(swarm),
        waiting: waiting.map(|waiting| Waiting {
            what: match waiting.what {
                Awaited::Join => "join",
                Awaited::Answer => "answer",
                Awaited::Sign => "sign",
            },
            count: waiting.count,
            longest_s: waiting.longest_s(),
            robots: (waiting.robots.iter())
                .map(|it| Waited {
                    robot: it.id.index,
                    life: it.id.incarnation,
                    for_s: it.for_s,
                    state: it.state.as_deref(),
                })
                .collect(),
        }),
        frames_dropped: snapshot.map_or(0, |snapshot| snapshot.dropped.ticks),
        tick_us: snapshot
            .and_then(|snapshot| snapshot.tick_time)
            .map(|time| Quantiles { p50: time.p50_us, p99: time.p99_us }),
        summary: swarm.summary.as_deref().map(|text| SummaryText { text }),
    }))
}

fn packets(swarm: &Swarm) -> Option<Packets> {
    if let Some(snapshot) = &swarm.snapshot {
        let it = snapshot.packets;
        return Some(Packets {
            sent: it.sent,
            heard: it.heard,
            collided: it.collided,
            half_duplex: it.half_duplex,
            lost_range: it.lost_range,
            lost_edge: it.lost_edge,
            occluded: it.occluded,
            lost_loss: it.lost_loss,
            lost_fault: it.lost_fault,
            over_bound: it.over_bound,
            delayed: it.delayed,
        });
    }
    let it = swarm.metrics.as_ref()?;
    Some(Packets {
        sent: it.packets_sent,
        heard: it.packets_heard,
        collided: it.packets_collided,
        half_duplex: it.packets_half_duplex,
        lost_range: it.packets_lost_range,
        lost_edge: it.packets_lost_edge,
        occluded: it.packets_occluded,
        lost_loss: it.packets_lost.saturating_sub(it.packets_lost_fault),
        lost_fault: it.packets_lost_fault,
        over_bound: it.packets_over_bound,
        delayed: it.packets_delayed,
    })
}

/// Names of the controllers, by entry of the scenario.
pub(crate) fn names(swarm: &Swarm) -> Vec<String> {
    swarm.scenario.controllers.iter().map(|controller| name_of(&controller.mind)).collect()
}

/// One agent. `names` are those of the controllers.
pub(crate) fn agent<'a>(swarm: &Swarm, names: &'a [String], robot: u32) -> Agent<'a> {
    let at = robot as usize;
    let told = swarm.snapshot.as_ref().and_then(|snapshot| snapshot.robots.get(at));
    let cycles = told.and_then(|told| told.cycles);
    let entries = swarm.scenario.controllers.iter();
    let entry = entries.zip(names).find(|(controller, _)| controller.robots.contains(robot));
    Agent {
        robot,
        life: told.map_or(swarm.lives[at].incarnation, |told| told.id.incarnation),
        controller: entry.map_or("", |(_, name)| name),
        pid: told.and_then(|told| told.pid),
        state: state_name(swarm.participation(at)),
        cycle_last_us: cycles.map(|cycles| cycles.last_us),
        cycle_p99_us: cycles.map(|cycles| cycles.p99_us),
        wake_us: cycles.map(|cycles| cycles.wake_us),
        cpu: swarm.cpu.get(&robot).copied(),
        refused: told.map_or(0, |told| told.refused),
        missed_deadlines: told.and_then(|told| told.missed_deadlines),
    }
}

pub(crate) fn agents<'a>(swarm: &Swarm, names: &'a [String]) -> Told<'a> {
    Told::Agents {
        agents: (0..swarm.scenario.robot_count()).map(|robot| agent(swarm, names, robot)).collect(),
    }
}

fn state_name(participation: Participation) -> &'static str {
    match participation {
        Participation::Present => "present",
        Participation::Paused => "paused",
        Participation::Down => "down",
        Participation::Out => "left-out",
        Participation::Expected => "not-joined",
    }
}
