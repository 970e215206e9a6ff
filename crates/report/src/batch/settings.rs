//! How trials ended, setting by setting.

use std::collections::BTreeMap;

use crate::{
    batch::Batch,
    error::ReportError,
    number,
    page::{Block, Cell, Table},
    stats::Stats,
};

/// Columns of `trials.csv` and their names.
const MEASURES: [(&str, &str); 10] = [
    ("mean_error_m", "mean ‖ê‖ (m)"),
    ("mean_true_error_m", "mean ‖C − p‖ (m)"),
    ("cost_h", "H"),
    ("exact_cost_h", "H, exact controller"),
    ("cell_agreement", "cells that agree"),
    ("mean_peak_distance_m", "distance to the peak (m)"),
    ("mean_lamp_distance_m", "distance to the lamps (m)"),
    ("robots_alive", "robots alive"),
    ("robots_with_open_cell", "robots with an open cell"),
    ("virtual_time_s", "virtual time (s)"),
];

pub(super) fn blocks(batch: &Batch) -> Result<Vec<Block>, ReportError> {
    let mut columns = vec!["setting".to_owned(), "robots".into()];
    columns.extend(batch.meta.sweeps.iter().map(|sweep| sweep.key.clone()));
    columns.extend(["trials".to_owned(), "ended".into()]);
    let mut shown = Vec::new();
    for (column, name) in MEASURES {
        if batch.trials.numbers_if_there(column)?.iter().any(Option::is_some) {
            shown.push(column);
            columns.push(name.to_owned());
        }
    }
    let ended = batch.trials.words("ended")?;
    let mut rows = Vec::new();
    for setting in &batch.settings {
        let mut row =
            vec![Cell::number(setting.number.to_string()), Cell::number(setting.robots.to_string())];
        row.extend(setting.values.iter().map(|value| match value.parse::<f64>() {
            Ok(_) => Cell::number(value),
            Err(_) => Cell::Code(value.clone()),
        }));
        row.push(Cell::number(setting.rows.len().to_string()));
        let mut ways: BTreeMap<&str, usize> = BTreeMap::new();
        setting.rows.iter().for_each(|&trial| *ways.entry(ended[trial]).or_default() += 1);
        let ways: Vec<String> = ways.into_iter().map(|(way, count)| format!("{count} {way}")).collect();
        row.push(Cell::Words(ways.join(", ")));
        for column in &shown {
            let (stats, all) = (Stats::of(&batch.measure(setting, column)?), setting.rows.len());
            let text = stats.map(|stats| match number::mean_and_spread(stats.mean, stats.sd) {
                spread if stats.count == all => spread,
                spread => format!("{spread} ({} of {all})", stats.count),
            });
            row.push(Cell::Number(text.unwrap_or_else(|| "–".into())));
        }
        rows.push(row);
    }
    let caption =
        "At the end of the trials: mean ± standard deviation over the trials of a setting, or over \
                   those that have a value (how many of all)"
            .into();
    Ok(vec![Block::Table(Table { caption, columns, rows })])
}
