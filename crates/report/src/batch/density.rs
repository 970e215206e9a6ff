//! `positions.csv`: how densely robots stand around the peak or the lamps.

use scenario::Scenario;

use crate::{
    batch::{
        Batch, ByTrial, Setting,
        panels::{PANELS_MAX, panels_note},
    },
    chart::{Axis, Chart, Point},
    density::{Ring, Rings},
    error::ReportError,
    look::Look,
    page::{Block, Figure},
    plan::{self, Body},
};

/// Rings between the center and the farthest corner.
const RINGS: usize = 20;

pub(super) fn blocks(batch: &Batch) -> Result<Vec<Block>, ReportError> {
    // Robots are where they were at the end, and so is the field.
    let field = batch.scenario.field_at(batch.scenario.ticks());
    let changes = field != batch.scenario.field;
    let at_end = Scenario { field, ..batch.scenario.clone() };
    let Some(center) = plan::center(&at_end) else { return Ok(Vec::new()) };
    let Some(positions) = batch.positions()? else { return Ok(Vec::new()) };
    let rings = Rings::new(&at_end, center, RINGS);
    // A swept field has another √φ than the scenario's own.
    let is_of_field = |key: &str| key.starts_with("field") || changes && key.starts_with("fault");
    let same_field = !batch.meta.sweeps.iter().any(|sweep| is_of_field(&sweep.key));
    let mut panels = Vec::new();
    for setting in batch.settings.iter().take(PANELS_MAX) {
        let ours = density_points(&rings, &positions, setting);
        if ours.is_empty() {
            continue;
        }
        let name = setting.name(&batch.meta, &batch.settings);
        let (x, y) = (Axis::new("distance (m)").from_zero(), Axis::new("robots per m²").from_zero());
        let mut chart = Chart::panel(x, y, name.clone());
        let means: Vec<Point> = ours.iter().map(|ring| (ring.distance_m, ring.density.mean)).collect();
        chart.steps("trials", &rings.as_steps(&means), Look::nth(0));
        if same_field {
            chart.line("√φ, as many robots", &rings.ideal(f64::from(setting.robots)), Look::nth(1));
        }
        panels.push(chart.draw(&format!("robots per square meter over distance, {name}")));
    }
    if panels.is_empty() {
        return Ok(Vec::new());
    }
    let mut blocks: Vec<Block> = panels_note(batch).into_iter().collect();
    let what = if batch.scenario.field.lamp.is_empty() { "the peak" } else { "the middle of the lamps" };
    blocks.push(Block::Figure(Figure {
        name: "density".into(),
        caption: format!(
            "Robots per m² at the end over their distance from {what}: mean over the trials, in rings cut to the \
             arena."
        ),
        panels,
    }));
    Ok(blocks)
}

/// The density of the robots alive in the trials of `setting`.
pub fn density_points(rings: &Rings, positions: &ByTrial<Vec<Body>>, setting: &Setting) -> Vec<Ring> {
    let trials: Vec<Vec<Point>> = positions
        .range((setting.number, 0)..=(setting.number, u64::MAX))
        .map(|(_, bodies)| bodies.iter().filter(|body| body.present).map(|body| body.at).collect())
        .collect();
    rings.density(&trials)
}
