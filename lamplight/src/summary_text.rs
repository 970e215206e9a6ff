//! Text that `lamplight run` ends with, for a person.

use std::fmt::{self, Write};

use serde_json::Value;

/// Fates of packets that are not heard, and how one says them.
const FATES: [(&str, &str); 8] = [
    ("collided", "collided"),
    ("half_duplex", "missed while transmitting"),
    ("lost_edge", "faded out"),
    ("occluded", "blocked by bodies"),
    ("lost_loss", "lost by chance"),
    ("lost_fault", "lost to faults"),
    ("over_bound", "over the bound of a percept"),
    ("delayed", "still delayed"),
];

/// Parts of an agent's cycle, in their order.
const STAGES: [&str; 6] = ["receive", "neighbors", "cell", "truncation", "centroid", "publish"];

/// A few lines about a run, from its `summary.json`.
pub(crate) fn lines(summary: &Value) -> String {
    let mut text = String::new();
    write_lines(&mut text, summary).expect("a string takes all that is written to it");
    text
}

fn write_lines(text: &mut String, summary: &Value) -> fmt::Result {
    let word = |key: &str| summary[key].as_str().unwrap_or_default();
    let tenths = |key: &str| known(&summary[key], |number| format!("{number:.1}"));
    write!(
        text,
        "{}: {} after {} s of virtual time in {} s ({}x real time), {} of {} robots alive",
        word("scenario"),
        word("ended"),
        tenths("virtual_time_s"),
        tenths("wall_time_s"),
        tenths("real_time_factor"),
        summary["robots_alive"],
        summary["robots"],
    )?;
    if summary["robots_paused"] != 0 {
        write!(text, ", {} of them paused", summary["robots_paused"])?;
    }
    writeln!(text)?;
    write!(text, "mean error {}", known(&summary["mean_error_m"], |error_m| format!("{error_m:.3e} m")))?;
    if summary["robots_without_error"] != 0 {
        write!(text, " (robots without a cell, or without mass in it: {})", summary["robots_without_error"])?;
    }
    write!(text, ", cost H {}", known(&summary["cost_h"], |cost| format!("{cost:.6e}")))?;
    if let Some(distance) = summary["mean_lamp_distance_m"].as_f64() {
        write!(text, ", mean distance to the lamps {distance:.3} m")?;
    }
    match summary["converged_at_s"].as_f64() {
        Some(time) => writeln!(text, ", converged at {time:.2} s")?,
        None => writeln!(text, ", not converged")?,
    }
    write_open_cells(text, &summary["robots_with_open_cell"])?;
    let packets = &summary["packets"];
    write!(text, "packets: {} sent, {} heard", packets["sent"], packets["heard"])?;
    for (key, what) in FATES {
        if packets[key] != 0 {
            write!(text, ", {} {what}", packets[key])?;
        }
    }
    writeln!(text)?;
    write_contacts(text, summary)?;
    write_delivered(text, &summary["delivered"])?;
    write_ledger(text, &summary["faults"])?;
    if let tick @ Value::Object(_) = &summary["tick_us"] {
        writeln!(text, "tick: {}", median_and_p99(tick, 0))?;
    }
    write_agents(text, &summary["agents"])?;
    writeln!(text, "digest {}", word("digest"))
}

/// Robots that head for somewhere far outside, and the keys that keep them from it.
fn write_open_cells(text: &mut String, robots: &Value) -> fmt::Result {
    match robots.as_u64() {
        None | Some(0) => Ok(()),
        Some(robots) => writeln!(
            text,
            "open cells: {robots}, with goals farther away than the arena's diagonal; controller.cell_cap_m or \
             arena.boundary_sensing = true closes them"
        ),
    }
}

/// Bounds that the solver of contacts met; nothing if it met none.
fn write_contacts(text: &mut String, summary: &Value) -> fmt::Result {
    let met = |key: &str| summary[key].as_u64().filter(|&times| times > 0);
    if let Some(bodies) = met("contacts_unsolved") {
        writeln!(
            text,
            "contacts: bodies that stayed where they were, because no solution was found for them, counted tick by tick: {bodies}"
        )?;
    }
    if let Some(groups) = met("contacts_coarse") {
        writeln!(
            text,
            "contacts: groups of bodies that moved in steps longer than they should be, counted tick by tick: {groups}; where \
             they end is less certain; a smaller step_s helps, unless they are jammed"
        )?;
    }
    Ok(())
}

/// Writes the agents' times; nothing if nobody measured.
fn write_agents(text: &mut String, agents: &Value) -> fmt::Result {
    if agents.is_null() {
        return Ok(());
    }
    let both = |spread: &Value| median_and_p99(spread, 1);
    let stages = &agents["stages_us"];
    write!(text, "agents: cycle {}", both(&agents["cycle_us"]))?;
    let median = |stage: &&str| Some(format!("{stage} {:.2}", stages[stage]["p50"].as_f64()?));
    let medians: Vec<String> = STAGES.iter().filter_map(median).collect();
    match medians.is_empty() {
        true => writeln!(text)?,
        false => writeln!(text, " (medians: {})", medians.join(", "))?,
    }
    let packets = &agents["packet_latency_us"];
    let beyond = if packets.is_null() { "" } else { ", beyond what is modeled" };
    writeln!(text, "agents: wake-up {}; packets {}{beyond}", both(&stages["wake"]), both(packets))?;
    if !agents["period_jitter_us"].is_null() {
        let (jitter, missed) = (both(&agents["period_jitter_us"]), &agents["missed_deadlines"]);
        writeln!(text, "agents: period jitter {jitter}; {missed} deadlines missed")?;
    }
    writeln!(
        text,
        "agents: {}; clock {}; hardware counters: {}",
        usage(&agents["processes"]),
        agents["clock"]["source"].as_str().unwrap_or_default(),
        agents["hardware_counters"].as_str().unwrap_or_default(),
    )
}

/// Use of the agents' processes, as far as `/proc` shows them: not if they live in another namespace of processes.
fn usage(processes: &Value) -> String {
    let Some(cpu_ms) = processes["cpu_ms"].as_f64() else { return "CPU and memory cannot be read".into() };
    let (voluntary, involuntary) = (&processes["switches_voluntary"], &processes["switches_involuntary"]);
    let pss =
        processes["pss_kb"].as_f64().map_or("cannot be read".into(), |kb| format!("{:.1} MB", kb / 1e3));
    format!("CPU {cpu_ms:.0} ms; switches {voluntary} voluntary, {involuntary} involuntary; PSS {pss}")
}

/// Share of packets that got through the crowd, beside the closed form.
fn write_delivered(text: &mut String, delivered: &Value) -> fmt::Result {
    let Some(share) = delivered["share"].as_f64() else { return Ok(()) };
    let predicted = |value: &Value| value.as_f64().map_or("-".into(), |share| format!("{share:.4}"));
    writeln!(text, "delivered in the crowd: {share:.4}, closed form {}", predicted(&delivered["predicted"]))?;
    let Some(rows) = delivered["by_disturbers"].as_array() else { return Ok(()) };
    writeln!(text, "\n  disturbers   packets   measured  predicted")?;
    for row in rows {
        let (disturbers, packets) = (number(row, "disturbers"), number(row, "packets"));
        let (share, predicted) = (number(row, "share"), predicted(&row["predicted"]));
        writeln!(text, "  {disturbers:>10}  {packets:>8}     {share:.4}     {predicted:>6}")?;
    }
    writeln!(text)
}

/// Writes what each fault did, and how the swarm took it.
fn write_ledger(text: &mut String, faults: &Value) -> fmt::Result {
    for (index, fault) in faults.as_array().into_iter().flatten().enumerate() {
        write!(text, "fault {index} ({}): ", fault["kind"].as_str().unwrap_or_default())?;
        let Some(fired) = fault["fired_tick"].as_u64() else {
            writeln!(text, "never fired (planned for tick {})", fault["planned_tick"])?;
            continue;
        };
        let effects = fault["effects"].as_object().into_iter().flatten();
        let effects: Vec<String> = effects.map(|(what, count)| format!("{count} {what}")).collect();
        let back = |key: &str| match fault["recovered"][key].as_u64() {
            Some(ticks) => format!("back after {ticks} ticks"),
            None => "not recovered".into(),
        };
        writeln!(
            text,
            "fired at tick {fired}, {}; mean error {}, cost H {}",
            effects.join(", "),
            back("mean_error_ticks"),
            back("cost_h_ticks")
        )?;
    }
    Ok(())
}

/// `505 us median, 1521 us p99` of a spread in microseconds, with so many `decimals`.
fn median_and_p99(spread: &Value, decimals: usize) -> String {
    match (spread["p50"].as_f64(), spread["p99"].as_f64()) {
        (Some(p50), Some(p99)) => format!("{p50:.decimals$} us median, {p99:.decimals$} us p99"),
        _ => "not measured".into(),
    }
}

/// A number as `show` writes it, or that there is none.
fn known(value: &Value, show: impl FnOnce(f64) -> String) -> String {
    value.as_f64().map_or_else(|| "none".into(), show)
}

fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn bounds_of_contacts_are_told_where_they_are_met() {
        let told = |unsolved: u64, coarse: u64| {
            let mut text = String::new();
            write_contacts(&mut text, &json!({ "contacts_unsolved": unsolved, "contacts_coarse": coarse }))
                .unwrap();
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
        let mut processes = json!({
            "cpu_ms": 575.4, "switches_voluntary": 60, "switches_involuntary": 3, "pss_kb": 14_800
        });
        assert_eq!(usage(&processes), "CPU 575 ms; switches 60 voluntary, 3 involuntary; PSS 14.8 MB");
        processes["pss_kb"] = Value::Null;
        assert!(usage(&processes).ends_with("; PSS cannot be read"));
        processes["cpu_ms"] = Value::Null;
        assert_eq!(usage(&processes), "CPU and memory cannot be read");
    }
}
