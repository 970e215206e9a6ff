//! Text that `lamplight run` ends with, for a person.

use std::fmt::{self, Write};

use arena::packets::Packets;
use engine::{
    properties::{Always, First, Properties, Sometimes},
    summary::{Delivered, Fault, Summary},
};
use profile::{Processes, Spread, StagesUs, Totals};
use protocol::percept::Tick;

/// A few lines about a run.
pub(crate) fn lines(summary: &Summary) -> String {
    let mut text = String::new();
    write_lines(&mut text, summary).expect("a string takes all that is written to it");
    text
}

fn write_lines(text: &mut String, summary: &Summary) -> fmt::Result {
    let end = &summary.end;
    write!(
        text,
        "{}: {} after {:.1} s of virtual time in {:.1} s ({}x real time), {} of {} robots alive",
        summary.scenario,
        summary.ended,
        summary.virtual_time_s,
        summary.wall_time_s,
        known(summary.real_time_factor, |factor| format!("{factor:.1}")),
        end.robots_alive,
        summary.robots,
    )?;
    if end.robots_paused != 0 {
        write!(text, ", {} of them paused", end.robots_paused)?;
    }
    if end.robots_silent != 0 {
        write!(text, ", {} of them silent", end.robots_silent)?;
    }
    writeln!(text)?;
    write!(text, "mean error {}", known(end.mean_error_m, |error_m| format!("{error_m:.3e} m")))?;
    if end.robots_without_error != 0 {
        write!(text, " (robots that estimate none: {})", end.robots_without_error)?;
    }
    write!(text, ", cost H {}", known(end.cost_h, |cost| format!("{cost:.6e}")))?;
    if let Some(distance_m) = end.mean_lamp_distance_m {
        write!(text, ", mean distance to the lamps {distance_m:.3} m")?;
    }
    match summary.converged_at_s {
        Some(time_s) => writeln!(text, ", converged at {time_s:.2} s")?,
        None => writeln!(text, ", not converged")?,
    }
    write_open_cells(text, end.robots_with_open_cell)?;
    write_packets(text, &end.packets)?;
    if summary.commands_refused > 0 {
        let refused = summary.commands_refused;
        writeln!(text, "commands refused: {refused}; `commands_refused` in robots.csv says whose")?;
    }
    write_contacts(text, summary.contacts_unsolved, summary.contacts_coarse)?;
    if let Some(delivered) = &summary.delivered {
        write_delivered(text, delivered)?;
    }
    write_ledger(text, &summary.faults)?;
    write_properties(text, &summary.properties)?;
    if let Some(tick) = summary.tick_us {
        writeln!(text, "tick: {}", median_and_p99(tick.p50, tick.p99, 0))?;
    }
    if let Some(agents) = &summary.agents {
        write_agents(text, agents)?;
    }
    writeln!(text, "digest {}", summary.digest)
}

/// Robots that head for somewhere far outside, and the keys that keep them from it.
fn write_open_cells(text: &mut String, robots: u32) -> fmt::Result {
    match robots {
        0 => Ok(()),
        _ => writeln!(
            text,
            "open cells: {robots}, with goals farther away than the arena's diagonal; controller.cell_cap_m or \
             arena.boundary_sensing = true closes them"
        ),
    }
}

/// Writes what became of packets.
fn write_packets(text: &mut String, packets: &Packets) -> fmt::Result {
    write!(text, "packets: {} sent, {} heard", packets.sent, packets.heard)?;
    let unheard = [
        (packets.collided, "collided"),
        (packets.half_duplex, "missed while transmitting"),
        (packets.lost_edge, "faded out"),
        (packets.occluded, "blocked by bodies"),
        (packets.lost_loss, "lost by chance"),
        (packets.lost_fault, "lost to faults"),
        (packets.over_bound, "over the bound of a percept"),
        (packets.delayed, "still delayed"),
    ];
    for (count, what) in unheard.into_iter().filter(|&(count, _)| count > 0) {
        write!(text, ", {count} {what}")?;
    }
    writeln!(text)
}

/// Writes what controllers have stated.
fn write_properties(text: &mut String, properties: &Properties) -> fmt::Result {
    for (name, property) in &properties.always {
        match property.first {
            Some(_) => writeln!(text, "{}", broken((name, property)))?,
            None => writeln!(text, "always \"{name}\": held, stated by {}", robots(property.robots))?,
        }
    }
    for (name, Sometimes { robots: all, reached_by, first }) in &properties.sometimes {
        match first {
            Some(first) => writeln!(
                text,
                "sometimes \"{name}\": reached by {reached_by} of {}, first by {}",
                robots(*all),
                at(first)
            )?,
            None => writeln!(text, "sometimes \"{name}\": not reached, stated by {}", robots(*all))?,
        }
    }
    Ok(())
}

/// Words about a property that must always hold and did not.
pub(crate) fn broken((name, property): (&str, &Always)) -> String {
    let first = property.first.as_ref().map_or(String::new(), |first| format!(", first by {}", at(first)));
    let Always { robots: all, broken_by, .. } = property;
    format!("always \"{name}\": broken by {broken_by} of {}{first}", robots(*all))
}

fn robots(count: u32) -> String {
    if count == 1 { "1 robot".into() } else { format!("{count} robots") }
}

/// `robot 3 (life 2) at tick 41`.
fn at(First { robot, life, tick }: &First) -> String {
    let life = if *life > 1 { format!(" (life {life})") } else { String::new() };
    let tick = tick.map_or("at the beginning of its life".into(), |tick| format!("at tick {tick}"));
    format!("robot {robot}{life} {tick}")
}

/// Bounds that the solver of contacts met; nothing if it met none.
fn write_contacts(text: &mut String, unsolved: u64, coarse: u64) -> fmt::Result {
    if unsolved > 0 {
        writeln!(
            text,
            "contacts: bodies that stayed where they were, because no solution was found for them, counted tick by tick: \
             {unsolved}"
        )?;
    }
    if coarse > 0 {
        writeln!(
            text,
            "contacts: groups of bodies that moved in steps longer than they should be, counted tick by tick: {coarse}; where \
             they end is less certain; a smaller step_s helps, unless they are jammed"
        )?;
    }
    Ok(())
}

/// Writes the agents' times.
fn write_agents(text: &mut String, agents: &Totals) -> fmt::Result {
    let StagesUs { wake, receive, neighbors, cell, truncation, centroid, step, publish } = agents.stages_us;
    let stages = [
        ("receive", receive),
        ("neighbors", neighbors),
        ("cell", cell),
        ("truncation", truncation),
        ("centroid", centroid),
        ("step", step),
        ("publish", publish),
    ];
    write!(text, "agents: cycle {}", of_spread(agents.cycle_us))?;
    let median = |(stage, spread): (&str, Option<Spread>)| Some(format!("{stage} {:.2}", spread?.p50));
    let medians: Vec<String> = stages.into_iter().filter_map(median).collect();
    match medians.is_empty() {
        true => writeln!(text)?,
        false => writeln!(text, " (medians: {})", medians.join(", "))?,
    }
    let packets = agents.packet_latency_us;
    let beyond = if packets.is_some() { ", beyond what is modeled" } else { "" };
    writeln!(text, "agents: wake-up {}; packets {}{beyond}", of_spread(wake), of_spread(packets))?;
    if let jitter @ Some(_) = agents.period_jitter_us {
        let (jitter, missed) = (of_spread(jitter), agents.missed_deadlines);
        writeln!(text, "agents: period jitter {jitter}; {missed} deadlines missed")?;
    }
    writeln!(
        text,
        "agents: {}; clock {}; hardware counters: {}",
        usage(&agents.processes),
        agents.clock.source,
        agents.hardware_counters,
    )
}

/// Use of the agents' processes, as far as `/proc` shows them: not if they live in another namespace of processes.
fn usage(processes: &Processes) -> String {
    let &Processes {
        cpu_ms: Some(cpu_ms),
        switches_voluntary: Some(voluntary),
        switches_involuntary: Some(involuntary),
        pss_kb,
        ..
    } = processes
    else {
        return "CPU and memory cannot be read".into();
    };
    let pss = pss_kb.map_or("cannot be read".into(), |kb| format!("{:.1} MB", kb as f64 / 1e3));
    format!("CPU {cpu_ms:.0} ms; switches {voluntary} voluntary, {involuntary} involuntary; PSS {pss}")
}

/// Share of packets that got through the crowd, beside the closed form.
fn write_delivered(text: &mut String, delivered: &Delivered) -> fmt::Result {
    let predicted = |share: Option<f64>| share.map_or("-".into(), |share| format!("{share:.4}"));
    writeln!(
        text,
        "delivered in the crowd: {:.4}, closed form {}",
        delivered.share,
        predicted(delivered.predicted)
    )?;
    if delivered.by_disturbers.is_empty() {
        return Ok(());
    }
    writeln!(text, "\n  disturbers   packets   measured  predicted")?;
    for row in &delivered.by_disturbers {
        let (disturbers, packets, share) = (row.disturbers, row.packets, row.share);
        let predicted = predicted(row.predicted);
        writeln!(text, "  {disturbers:>10}  {packets:>8}     {share:.4}     {predicted:>6}")?;
    }
    writeln!(text)
}

/// Writes what each fault did, and how the swarm took it.
fn write_ledger(text: &mut String, faults: &[Fault]) -> fmt::Result {
    let back = |ticks: Option<Tick>| match ticks {
        Some(ticks) => format!("back after {ticks} ticks"),
        None => "not recovered".into(),
    };
    for (index, Fault { line, recovered }) in faults.iter().enumerate() {
        write!(text, "fault {index} ({}): ", line.kind.name())?;
        match line.fired_tick {
            None => writeln!(text, "never fired (planned for tick {})", line.planned_tick)?,
            Some(fired) => writeln!(
                text,
                "fired at tick {fired}, {}; mean error {}, cost H {}",
                line.told(),
                back(recovered.mean_error_ticks),
                back(recovered.cost_h_ticks)
            )?,
        }
    }
    Ok(())
}

/// `505.2 us median, 1521.0 us p99`, or that there is nothing to tell.
fn of_spread(us: Option<Spread>) -> String {
    us.map_or_else(|| "not measured".into(), |Spread { p50, p99, .. }| median_and_p99(p50, p99, 1))
}

/// `505 us median, 1521 us p99` of times in microseconds, with so many `decimals`.
fn median_and_p99(p50: f64, p99: f64, decimals: usize) -> String {
    format!("{p50:.decimals$} us median, {p99:.decimals$} us p99")
}

/// A number as `show` writes it, or that there is none.
fn known(value: Option<f64>, show: impl FnOnce(f64) -> String) -> String {
    value.map_or_else(|| "none".into(), show)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_of_contacts_are_told_where_they_are_met() {
        let told = |unsolved: u64, coarse: u64| {
            let mut text = String::new();
            write_contacts(&mut text, unsolved, coarse).unwrap();
            text
        };
        assert_eq!(told(0, 0), "");
        assert!(
            told(3, 0).starts_with("contacts: bodies that stayed")
                && told(3, 0).ends_with("tick by tick: 3\n")
        );
        assert!(told(0, 7).contains("counted tick by tick: 7; where they end is less certain"));
    }

    #[test]
    fn what_processes_used_is_told_as_far_as_it_can_be_read() {
        let mut processes = Processes {
            cpu_ms: Some(575.4),
            switches_voluntary: Some(60),
            switches_involuntary: Some(3),
            pss_kb: Some(14_800),
            ..Processes::default()
        };
        assert_eq!(usage(&processes), "CPU 575 ms; switches 60 voluntary, 3 involuntary; PSS 14.8 MB");
        processes.pss_kb = None;
        assert!(usage(&processes).ends_with("; PSS cannot be read"));
        processes.cpu_ms = None;
        assert_eq!(usage(&processes), "CPU and memory cannot be read");
    }
}
