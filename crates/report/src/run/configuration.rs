//! Where robots were at the start, where they went, and where they ended.

use crate::{
    page::{Block, Figure},
    plan::plan,
    run::Run,
    svg::Svg,
};

/// The start, with the cells.
pub fn initial_plan(run: &Run, title: &str) -> Svg {
    plan(&run.scenario, title, &run.start)
}

/// The end, with the cells.
pub fn final_plan(run: &Run, title: &str) -> Svg {
    plan(&run.at_end(), title, &run.end)
}

/// Where robots went; `None` if that was not recorded.
pub fn trajectory_plan(run: &Run, title: &str) -> Option<Svg> {
    let trajectories = run.trajectories();
    (!trajectories.is_empty()).then(|| crate::plan::paths(&run.at_end(), title, &run.end, &trajectories))
}

/// All of them under one caption.
pub(super) fn figures(run: &Run) -> Vec<Block> {
    let mut panels = vec![initial_plan(run, "initial configuration")];
    panels.extend(trajectory_plan(run, "trajectories"));
    let mut caption = "Robots and their global cells (Voronoi cells in the arena): at the start".to_owned();
    if panels.len() > 1 {
        caption.push_str(", on their way");
    }
    if run.end.is_empty() {
        caption.push_str(". Where the run ended is not known: there is neither robots.csv nor poses.csv.");
    } else {
        panels.push(final_plan(run, "final configuration"));
        caption.push_str(" and at the end.");
    }
    if panels.len() < 3 && !run.end.is_empty() {
        caption.push_str(" Trajectories are drawn where the scenario sets output.poses_every_s.");
    }
    if run.end.iter().any(|body| !body.present) {
        caption.push_str(" Robots that are down or paused (gray squares) have no cell.");
    }
    vec![Block::Figure(Figure { name: "configuration".into(), caption, panels })]
}
