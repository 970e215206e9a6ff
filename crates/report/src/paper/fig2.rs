//! Fig. 2: one run under eq. 19.

use kuva::plot::scatter::MarkerShape;

use super::{chapter::Chapter, evidence::Evidence};
use crate::{
    chart::{Axis, Chart, Point},
    error::ReportError,
    look::{Dash, Look},
    number,
    page::{Block, Figure, Mark},
    plan::plan,
    run::Run,
    theme::Ink,
};

const CLAIM: &str = "Fig. 2: under eq. 19 a network spreads and comes to rest";
/// A swarm whose mean error is below this has come to rest, meters.
const AT_REST_M: f64 = 1e-3;

pub(super) fn chapter(evidence: &Evidence) -> Result<Chapter, ReportError> {
    let mut chapter = Chapter::new(
        "fig-2",
        "Fig. 2: one simulation",
        "robots under the sum of two Gaussians (eq. 19) move from a random start to a configuration that covers \
         the square; one robot's coordinates settle.",
    );
    let Some(run) = evidence.run("fig2")? else {
        chapter.missing(CLAIM, "fig2");
        return Ok(chapter);
    };
    let mut panels = vec![plan(&run.scenario, "(a) initial configuration", &run.start)];
    panels.push(crate::plan::paths(&run.scenario, "(b) trajectories", &run.end, &run.trajectories()));
    panels.push(plan(&run.scenario, "(c) final configuration", &run.end));
    panels.extend(coordinates(&run));
    chapter.add(Block::Figure(Figure {
        name: "fig-2".into(),
        caption: "Robots and their global cells at the start, on their way and at the end; x and y of robot 0 over \
                  time. The paper does not say how many robots it shows; here there are 20."
            .into(),
        panels,
    }));
    let error = run.metrics.numbers("mean_error_m")?.last().copied().flatten().unwrap_or(f64::NAN);
    let mark = if error < AT_REST_M { Mark::Yes } else { Mark::No };
    chapter.verdict(CLAIM, mark, format!("mean ‖ê‖ at the end {} m", number::short(error)));
    evidence.commands(&mut chapter, &["fig2"])?;
    Ok(chapter)
}

fn coordinates(run: &Run) -> Option<crate::svg::Svg> {
    let path = run.poses.as_ref()?.paths.get(&0)?;
    let mut chart = Chart::panel(
        Axis::new("time (s)").from_zero(),
        Axis::new("position (m)"),
        "(d) one robot's coordinates",
    );
    let line =
        |pick: fn(&Point) -> f64| path.iter().map(|(time, body)| (*time, pick(&body.at))).collect::<Vec<_>>();
    let look = |ink, dash| Look { ink, dash, marker: MarkerShape::Circle };
    chart.line("x", &line(|at| at.0), look(Ink::Blue, Dash::Solid));
    chart.line("y", &line(|at| at.1), look(Ink::Vermillion, Dash::Long));
    Some(chart.draw("x and y of robot 0 over time"))
}
