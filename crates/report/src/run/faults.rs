//! `ledger.csv`: what the fault plan did, and incidents nobody planned.

use serde_json::Value;

use crate::{
    chart::Event,
    error::ReportError,
    page::{Block, Cell, Table},
    run::Run,
};

/// Where faults begin in the figures over time: those of one tick share a mark.
pub(super) fn events(run: &Run) -> Result<Vec<Event>, ReportError> {
    let Some(ledger) = &run.ledger else { return Ok(Vec::new()) };
    let step_s = run.scenario.step_s.get();
    let mut events: Vec<(f64, Vec<&str>)> = Vec::new();
    for (number, tick) in ledger.words("fault")?.into_iter().zip(ledger.numbers("fired_tick")?) {
        let Some(tick) = tick else { continue };
        match events.iter_mut().find(|(other, _)| *other == tick) {
            Some((_, numbers)) => numbers.push(number),
            None => events.push((tick, vec![number])),
        }
    }
    events.sort_by(|a, b| a.0.total_cmp(&b.0));
    let event = |(tick, numbers): (f64, Vec<&str>)| Event { x: tick * step_s, label: numbers.join(", ") };
    Ok(events.into_iter().map(event).collect())
}

/// The ledger and the incidents; `None` if there was neither.
pub(super) fn blocks(run: &Run) -> Result<Option<Vec<Block>>, ReportError> {
    let mut blocks = Vec::new();
    if let Some(ledger) = run.ledger.as_ref().filter(|ledger| !ledger.is_empty()) {
        let columns: Vec<(&str, &str)> =
            COLUMNS.into_iter().filter(|(column, _)| ledger.has(column)).collect();
        let mut rows = vec![Vec::new(); ledger.len()];
        for (column, _) in &columns {
            for (row, text) in rows.iter_mut().zip(ledger.words(column)?) {
                row.push(match (text.is_empty(), text.parse::<f64>()) {
                    (true, _) if *column == "fired_tick" => Cell::words("never"),
                    (true, _) => Cell::number("–"),
                    (_, Ok(_)) => Cell::number(text),
                    _ => Cell::words(text),
                });
            }
        }
        blocks.push(Block::Table(Table {
            caption: "The fault ledger: what was planned, and what it did. A tick is the scenario's step_s; \
                      recovery is the ticks until the value was back within 10 % of what it was before."
                .into(),
            columns: columns.into_iter().map(|(_, name)| name.to_owned()).collect(),
            rows,
        }));
    }
    let incidents = run.summary.as_ref().and_then(|summary| summary.get("incidents")?.as_array());
    if let Some(incidents) = incidents.filter(|incidents| !incidents.is_empty()) {
        let text = |incident: &Value| match incident {
            Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        blocks.push(Block::Table(Table {
            caption: "Incidents that nobody planned".into(),
            columns: vec!["incident".into()],
            rows: incidents.iter().map(|incident| vec![Cell::Words(text(incident))]).collect(),
        }));
    }
    Ok((!blocks.is_empty()).then_some(blocks))
}

const COLUMNS: [(&str, &str); 10] = [
    ("fault", "number"),
    ("kind", "kind"),
    ("planned_tick", "planned at tick"),
    ("until_tick", "until tick"),
    ("fired_tick", "fired at tick"),
    ("last_tick", "last at tick"),
    ("robots", "robots"),
    ("effects", "what it did"),
    ("mean_error_back_ticks", "recovery of ‖ê‖ (ticks)"),
    ("cost_h_back_ticks", "recovery of H (ticks)"),
];
