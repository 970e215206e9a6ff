//! Messages between the page and its server as JSON; frames are in [`frame`](crate::frame).

use engine::act::Act;
use serde::{Deserialize, Serialize};

/// From the server.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub(crate) enum Told<'a> {
    /// Facts that do not change; first of all.
    Hello(Box<Hello<'a>>),
    /// The field has changed.
    Field { field: Field },
    /// How the run goes.
    State(Box<State<'a>>),
    /// More points of the plots, or all of them.
    Series { points: &'a [Point], replace: bool },
    /// All agents.
    Agents { agents: Vec<Agent<'a>> },
    /// Events since the last ones.
    Events { events: &'a [Event] },
    /// The fault plan, and when each fault struck first.
    Faults { faults: Vec<Fault> },
    /// One robot.
    Robot(Box<Robot<'a>>),
    /// Outcome of an act.
    Done(Done),
}

/// From the page.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub(crate) enum Said {
    /// A frame is drawn.
    Drawn,
    /// Sections that are wanted from now on.
    Show { cells: bool, global: bool, edges: bool },
    /// A robot that is looked at, or none.
    Select { robot: Option<u32> },
    /// An act that is asked for; `id` is in the answer.
    Act { id: u64, act: PageAct },
}

/// An act of the page.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub(crate) enum PageAct {
    /// Upon a recording: go to another time.
    Seek(Seek),
    /// Upon a run.
    Run(Act),
}

/// Another time of a recording.
#[derive(Clone, Copy, Debug, Deserialize)]
pub(crate) struct Seek {
    #[serde(rename = "do")]
    _do: SeekWord,
    pub(crate) time_s: f64,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum SeekWord {
    Seek,
}

#[derive(Clone, Debug, Serialize)]
pub(crate) struct Hello<'a> {
    pub(crate) run: &'a str,
    pub(crate) scenario: &'a str,
    pub(crate) engine: &'a str,
    pub(crate) mode: &'a str,
    pub(crate) source: &'static str,
    pub(crate) can_act: bool,
    pub(crate) robots: u32,
    pub(crate) width_m: f64,
    pub(crate) height_m: f64,
    pub(crate) step_s: f64,
    pub(crate) cycle_s: f64,
    pub(crate) duration_s: f64,
    pub(crate) radius_m: f64,
    /// How far packets reach, if that is a distance.
    pub(crate) range_m: Option<f64>,
    pub(crate) field: Field,
    pub(crate) controllers: Vec<ControllerOf>,
    pub(crate) faults: Vec<Fault>,
}

#[derive(Clone, Debug, Serialize)]
pub(crate) struct ControllerOf {
    pub(crate) name: String,
    pub(crate) robots: String,
    pub(crate) has_cells: bool,
}

/// φ at q: offset + Σ amplitude·exp(−|q−c|²/2σ²) + Σ peak/(1+|q−p|²/h²).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Field {
    pub(crate) offset: f64,
    pub(crate) gaussians: Vec<Gaussian>,
    pub(crate) lamps: Vec<Lamp>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Gaussian {
    pub(crate) center_m: [f64; 2],
    pub(crate) amplitude: f64,
    pub(crate) sigma_m: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Lamp {
    pub(crate) position_m: [f64; 2],
    pub(crate) peak: f64,
    pub(crate) half_distance_m: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Fault {
    pub(crate) index: usize,
    pub(crate) kind: &'static str,
    pub(crate) from_s: f64,
    pub(crate) until_s: Option<f64>,
    pub(crate) whom: String,
    /// The disc that it is about, if it is.
    pub(crate) region: Option<Region>,
    /// Robots that it names; `None` if it is not by their numbers.
    pub(crate) robots: Option<Vec<u32>>,
    pub(crate) fired_tick: Option<u64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Region {
    pub(crate) center_m: [f64; 2],
    pub(crate) radius_m: f64,
}

#[derive(Clone, Debug, Serialize)]
pub(crate) struct State<'a> {
    pub(crate) phase: &'static str,
    pub(crate) joined: u32,
    pub(crate) robots: u32,
    pub(crate) tick: u64,
    pub(crate) ticks: u64,
    pub(crate) time_s: f64,
    pub(crate) wall_s: Option<f64>,
    pub(crate) real_time_factor: Option<f64>,
    pub(crate) paused: bool,
    pub(crate) speed: Option<f64>,
    pub(crate) metrics: Metrics,
    pub(crate) packets: Option<Packets>,
    pub(crate) waiting: Option<Waiting<'a>>,
    pub(crate) frames_dropped: u64,
    pub(crate) tick_us: Option<Quantiles>,
    pub(crate) summary: Option<SummaryText<'a>>,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Metrics {
    pub(crate) mean_error_m: Option<f64>,
    pub(crate) max_error_m: Option<f64>,
    pub(crate) cost_h: Option<f64>,
    pub(crate) robots_alive: Option<u32>,
    pub(crate) robots_paused: Option<u32>,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Packets {
    pub(crate) sent: u64,
    pub(crate) heard: u64,
    pub(crate) collided: u64,
    pub(crate) half_duplex: u64,
    pub(crate) lost_range: u64,
    pub(crate) lost_edge: u64,
    pub(crate) occluded: u64,
    pub(crate) lost_loss: u64,
    pub(crate) lost_fault: u64,
    pub(crate) over_bound: u64,
    pub(crate) delayed: u64,
}

#[derive(Clone, Debug, Serialize)]
pub(crate) struct Waiting<'a> {
    pub(crate) what: &'static str,
    pub(crate) count: usize,
    pub(crate) longest_s: f64,
    pub(crate) robots: Vec<Waited<'a>>,
}

#[derive(Clone, Debug, Serialize)]
pub(crate) struct Waited<'a> {
    pub(crate) robot: u32,
    pub(crate) life: u16,
    pub(crate) for_s: f64,
    pub(crate) state: Option<&'a str>,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Quantiles {
    pub(crate) p50: f64,
    pub(crate) p99: f64,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct SummaryText<'a> {
    pub(crate) text: &'a str,
}

/// A moment of the plots.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Point {
    pub(crate) time_s: f64,
    pub(crate) mean_error_m: Option<f64>,
    pub(crate) cost_h: Option<f64>,
    pub(crate) alive: u32,
}

#[derive(Clone, Debug, Serialize)]
pub(crate) struct Agent<'a> {
    pub(crate) robot: u32,
    pub(crate) life: u16,
    pub(crate) controller: &'a str,
    pub(crate) pid: Option<u32>,
    pub(crate) state: &'static str,
    pub(crate) cycle_last_us: Option<f64>,
    pub(crate) cycle_p99_us: Option<f64>,
    pub(crate) wake_us: Option<f64>,
    pub(crate) cpu: Option<f64>,
    pub(crate) refused: u64,
    pub(crate) missed_deadlines: Option<u64>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Event {
    pub(crate) time_s: f64,
    pub(crate) tick: u64,
    pub(crate) kind: EventKind,
    pub(crate) text: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum EventKind {
    Fault,
    Incident,
    Act,
    End,
}

#[derive(Clone, Debug, Serialize)]
pub(crate) struct Robot<'a> {
    #[serde(flatten)]
    pub(crate) agent: Agent<'a>,
    pub(crate) pose: PoseOf,
    pub(crate) light: Option<f64>,
    pub(crate) bump: bool,
    pub(crate) command: Option<CommandOf>,
    pub(crate) neighbors: Vec<NeighborOf>,
    pub(crate) cell: Option<CellOf>,
    pub(crate) notes: Vec<Note<'a>>,
    pub(crate) cycles: Option<CyclesOf>,
}

/// Cycles of one robot that were seen, a few each second.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct CyclesOf {
    pub(crate) last_us: f64,
    pub(crate) p99_us: f64,
    pub(crate) histogram: Vec<Bin>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Bin {
    pub(crate) up_to_us: f64,
    pub(crate) count: u32,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct PoseOf {
    pub(crate) x_m: f64,
    pub(crate) y_m: f64,
    pub(crate) heading_rad: f64,
}

#[derive(Clone, Debug, Serialize)]
pub(crate) struct CommandOf {
    pub(crate) velocity_m_per_s: [f64; 2],
    pub(crate) estimated_error_m: Option<f64>,
    pub(crate) payload_hex: String,
}

#[derive(Clone, Debug, Serialize)]
pub(crate) struct NeighborOf {
    pub(crate) robot: u32,
    pub(crate) range_m: f64,
    pub(crate) bearing_rad: f64,
    pub(crate) orientation_rad: f64,
    pub(crate) age_cycles: u64,
    pub(crate) payload_hex: String,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct CellOf {
    pub(crate) area_m2: f64,
    pub(crate) positive_area_m2: f64,
    pub(crate) centroid_m: Option<[f64; 2]>,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Note<'a> {
    pub(crate) name: &'a str,
    pub(crate) value: f64,
}

#[derive(Clone, Debug, Serialize)]
pub(crate) struct Done {
    pub(crate) id: u64,
    pub(crate) ok: bool,
    pub(crate) tick: Option<u64>,
    pub(crate) fault: Option<usize>,
    pub(crate) text: Option<String>,
    pub(crate) error: Option<String>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_page_says_is_read() {
        let said = |text: &str| serde_json::from_str::<Said>(text);
        assert!(matches!(said(r#"{"type":"drawn"}"#), Ok(Said::Drawn)));
        assert!(matches!(
            said(r#"{"type":"act","id":3,"act":{"do":"seek","time_s":2.5}}"#),
            Ok(Said::Act { id: 3, act: PageAct::Seek(Seek { time_s: 2.5, .. }) })
        ));
        assert!(matches!(
            said(r#"{"type":"act","id":4,"act":{"do":"pause"}}"#),
            Ok(Said::Act { act: PageAct::Run(Act::Pause), .. })
        ));
        assert!(said(r#"{"type":"act","id":4,"act":{"do":"fly"}}"#).is_err());
        assert!(said("{").is_err());
    }
}
