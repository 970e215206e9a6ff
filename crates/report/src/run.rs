//! The page of one run.

mod configuration;
mod faults;
mod folder;
mod series;

pub use configuration::{final_plan, initial_plan, trajectory_plan};
pub use folder::{Poses, Run, Timed};

use serde_json::Value;

use crate::{
    error::ReportError,
    number,
    page::{Block, Cell, Page, Section, Table},
};

/// The page of `run`.
pub fn page(run: &Run) -> Result<Page, ReportError> {
    let mut lead: Vec<Block> = run.scenario.description.iter().cloned().map(Block::Text).collect();
    lead.extend(run.notes.iter().cloned().map(Block::Note));
    lead.push(Block::Table(headline(run)?));
    lead.push(Block::Text("This run again, from the scenario it wrote down:".into()));
    lead.push(Block::Command(command(run)));
    let mut sections = vec![
        Section { blocks: series::time_series(run)?, ..Section::new("time", "Over time") },
        Section { blocks: configuration::figures(run), ..Section::new("plan", "Seen from above") },
        Section { blocks: series::packets(run)?, ..Section::new("packets", "Packets") },
    ];
    if let Some(blocks) = faults::blocks(run)? {
        sections.push(Section { blocks, ..Section::new("faults", "Faults and incidents") });
    }
    Ok(Page { title: format!("Run of {}", run.scenario.name), lead, sections })
}

/// Main results, from `summary.json`; without it, what can be known from the rest.
fn headline(run: &Run) -> Result<Table, ReportError> {
    let mut pairs = vec![
        ("seed".to_owned(), Cell::number(run.scenario.seed.to_string())),
        ("robots".to_owned(), Cell::number(run.scenario.robot_count().to_string())),
    ];
    let Some(summary) = &run.summary else {
        let last = run.metrics.numbers("time_s")?.last().copied().flatten();
        pairs.push(("last row of metrics.csv (s)".into(), Cell::number(number::or_dash(last))));
        return Ok(Table::of_pairs("The run, as far as it came", pairs));
    };
    let quantities = [
        ("engine", "engine"),
        ("mode", "mode"),
        ("how it ended", "ended"),
        ("virtual time (s)", "virtual_time_s"),
        ("ticks", "ticks"),
        ("converged at (s)", "converged_at_s"),
        ("mean estimated error ‖ê‖ (m)", "mean_error_m"),
        ("largest estimated error (m)", "max_error_m"),
        ("mean true error ‖C − p‖ (m)", "mean_true_error_m"),
        ("coverage cost H", "cost_h"),
        ("mean distance to the middle of the lamps (m)", "mean_lamp_distance_m"),
        ("share of cells that agree", "cell_agreement"),
        ("robots alive", "robots_alive"),
        ("robots among them without a command", "robots_silent"),
        ("commands refused", "commands_refused"),
        ("robots without an estimated error", "robots_without_error"),
    ];
    pairs.extend(quantities.into_iter().filter_map(|(name, key)| match summary.get(key)? {
        Value::Null if key != "converged_at_s" => None,
        Value::Null => Some((name.to_owned(), Cell::words("not within the run"))),
        Value::Number(number) => {
            let whole = number.as_u64().map(|whole| whole.to_string());
            let text = whole.or_else(|| number.as_f64().map(number::short));
            Some((name.to_owned(), Cell::Number(text.unwrap_or_default())))
        }
        Value::String(text) => Some((name.to_owned(), Cell::words(text.clone()))),
        _ => None,
    }));
    if let Some(digest) = summary.get("digest").and_then(Value::as_str) {
        pairs.push(("digest".into(), Cell::Code(digest.into())));
    }
    Ok(Table::of_pairs("The run in numbers, at its end", pairs))
}

fn command(run: &Run) -> String {
    let said = |key: &str| run.summary.as_ref().and_then(|summary| summary.get(key)?.as_str());
    let engine = said("engine").map(|engine| format!(" --engine {engine}")).unwrap_or_default();
    let mode = match said("mode") {
        Some("realtime") => " --mode realtime",
        _ => "",
    };
    format!("lamplight run scenario.toml{engine}{mode} --out DIR")
}
