//! A run as shapes: what viewers draw that know nothing of robots.

use arena::{
    frame::{ArenaPoint, Pose},
    metrics::Partition,
};
use recording::foxglove::{
    Color, CylinderPrimitive, LinePrimitive, Point3, SceneEntity, SceneUpdate, SpherePrimitive, Vector3,
    line_primitive::Type,
};
use scenario::{LampSpec, Scenario};
use squad::Participation;

use super::pose::{ARENA, at, shown, single};

/// Bodies that are points are drawn so large, meters.
const POINT_RADIUS_M: f64 = 0.02;
/// How high a body is drawn, meters.
const HEIGHT_M: f64 = 0.05;
/// How large a lamp is drawn, meters.
const LAMP_M: f64 = 0.1;
/// Lines are so many pixels wide.
const LINE_PX: f64 = 1.0;

const PRESENT: Color = color(0.12, 0.47, 0.71);
const PAUSED: Color = color(0.90, 0.62, 0.0);
const GONE: Color = color(0.6, 0.6, 0.6);
const WALL: Color = color(0.3, 0.3, 0.3);
const CELL: Color = color(0.5, 0.7, 0.5);
const LAMP: Color = color(1.0, 0.85, 0.2);

/// Facts of a scenario that every scene needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stage {
    size_m: [f64; 2],
    radius_m: f64,
}

const fn color(r: f64, g: f64, b: f64) -> Color {
    Color { r, g, b, a: 1.0 }
}

impl Stage {
    pub(super) fn of(scenario: &Scenario) -> Self {
        let radius_m = scenario.robots.radius_m.get();
        let radius_m = if radius_m > 0.0 { radius_m } else { POINT_RADIUS_M };
        Self { size_m: scenario.arena.size_m.get(), radius_m }
    }

    /// Walls and lamps: what stays where it is, unless the field changes.
    pub(super) fn fixed(self, lamps: &[LampSpec], timestamp: Timestamp) -> SceneUpdate {
        let [width, height] = self.size_m;
        let corners = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]];
        let walls = SceneEntity {
            lines: vec![closed(corners.map(|[x, y]| point(x, y)).into(), WALL)],
            ..entity("walls", timestamp)
        };
        let SceneUpdate { deletions, entities } = self.lamps(lamps, timestamp);
        SceneUpdate { deletions, entities: [vec![walls], entities].concat() }
    }

    /// Lamps, in the place of those before.
    pub(super) fn lamps(self, lamps: &[LampSpec], timestamp: Timestamp) -> SceneUpdate {
        let lamp = |position_m: [f64; 2]| SpherePrimitive {
            pose: Some(at(position_m)),
            size: Some(Vector3 { x: LAMP_M, y: LAMP_M, z: LAMP_M }),
            color: Some(LAMP),
        };
        let lamps = SceneEntity {
            spheres: lamps.iter().map(|it| lamp(it.position_m.get())).collect(),
            ..entity("lamps", timestamp)
        };
        SceneUpdate { deletions: Vec::new(), entities: vec![lamps] }
    }

    /// Bodies, and the cells of those that take part.
    pub(super) fn moving(
        self,
        poses: &[Pose],
        participations: &[Participation],
        timestamp: Timestamp,
    ) -> SceneUpdate {
        let body = |(pose, participation): (&Pose, &Participation)| CylinderPrimitive {
            pose: Some(shown(pose)),
            size: Some(Vector3 { x: 2.0 * self.radius_m, y: 2.0 * self.radius_m, z: HEIGHT_M }),
            bottom_scale: 1.0,
            top_scale: 1.0,
            color: Some(match participation {
                Participation::Present => PRESENT,
                Participation::Paused => PAUSED,
                _ => GONE,
            }),
        };
        let bodies = SceneEntity {
            cylinders: poses.iter().zip(participations).map(body).collect(),
            ..entity("bodies", timestamp)
        };
        let takes_part =
            |(_, participation): &(&Pose, &Participation)| **participation == Participation::Present;
        let sites: Vec<ArenaPoint> =
            poses.iter().zip(participations).filter(takes_part).map(|(pose, _)| pose.position).collect();
        let partition = Partition::new(sites, self.size_m);
        let outlines = partition.cells().iter().map(|cell| {
            closed(cell.iter().map(|corner| point(single(corner.x), single(corner.y))).collect(), CELL)
        });
        let cells = SceneEntity { lines: outlines.collect(), ..entity("cells", timestamp) };
        SceneUpdate { deletions: Vec::new(), entities: vec![bodies, cells] }
    }
}

type Timestamp = Option<prost_types::Timestamp>;

/// An entity of which each message has all.
fn entity(id: &str, timestamp: Timestamp) -> SceneEntity {
    SceneEntity { timestamp, frame_id: ARENA.into(), id: id.into(), ..SceneEntity::default() }
}

fn closed(points: Vec<Point3>, color: Color) -> LinePrimitive {
    LinePrimitive {
        r#type: Type::LineLoop.into(),
        pose: Some(at([0.0; 2])),
        thickness: LINE_PX,
        scale_invariant: true,
        points,
        color: Some(color),
        ..LinePrimitive::default()
    }
}

fn point(x: f64, y: f64) -> Point3 {
    Point3 { x, y, z: 0.0 }
}
