//! Bodies, cells, walls and lamps as markers, which RViz draws.
//!
//! Each message has the whole scene: a marker that RViz is not told again stays as it was, and a bag may be played from
//! anywhere. An entity of the recording is a namespace. Its solids are numbered from 0, so that a body has the number of its robot;
//! its lines are one marker behind them, so that a cell that goes is gone without a word about it.

use std::collections::BTreeMap;

use recording::foxglove::{
    Color as RecordedColor, LinePrimitive, SceneEntity, SceneUpdate, line_primitive::Type,
};

use crate::{
    messages::{Color, Header, Marker, MarkerArray, Point, Pose},
    poses::{pose, vector},
};

/// Lines that are so many pixels wide are drawn as if the scene were as many pixels large: markers know meters alone.
const SCENE_PX: f64 = 500.0;

/// All that a recording has drawn so far.
#[derive(Debug, Default)]
pub(crate) struct Scene {
    /// The latest state of each entity, and the most markers that it has had.
    entities: BTreeMap<String, (SceneEntity, usize)>,
}

impl Scene {
    /// Takes an update in and returns the scene that it leads to.
    pub(crate) fn updated(&mut self, update: SceneUpdate, header: &Header) -> MarkerArray {
        for entity in update.entities {
            let most = self.entities.get(&entity.id).map_or(0, |(_, most)| *most);
            self.entities.insert(entity.id.clone(), (entity, most));
        }
        let pixel_m = self.size_m() / SCENE_PX;
        let mut markers = Vec::new();
        for (ns, (entity, most)) in &mut self.entities {
            let mut shown = solids(entity);
            shown.extend(lines(&entity.lines, pixel_m));
            *most = shown.len().max(*most);
            shown.resize(*most, Marker { action: Marker::DELETE, ..Marker::default() });
            markers.extend((0..).zip(shown).map(|(id, marker)| Marker {
                header: header.clone(),
                ns: ns.clone(),
                id,
                ..marker
            }));
        }
        MarkerArray { markers }
    }

    /// The largest coordinate of a line, meters: the walls' usually.
    fn size_m(&self) -> f64 {
        let lines = self.entities.values().flat_map(|(entity, _)| &entity.lines);
        lines
            .flat_map(|line| &line.points)
            .fold(0.0, |size, point| point.x.abs().max(point.y.abs()).max(size))
    }
}

/// Cylinders and balls of an entity.
fn solids(entity: &SceneEntity) -> Vec<Marker> {
    let solid = |r#type, at: Option<_>, size: Option<_>, color| Marker {
        r#type,
        action: Marker::ADD,
        pose: at.as_ref().map(pose).unwrap_or_default(),
        scale: size.as_ref().map(vector).unwrap_or_default(),
        color: tint(color),
        ..Marker::default()
    };
    let cylinders = entity.cylinders.iter().map(|it| solid(Marker::CYLINDER, it.pose, it.size, it.color));
    let spheres = entity.spheres.iter().map(|it| solid(Marker::SPHERE, it.pose, it.size, it.color));
    cylinders.chain(spheres).collect()
}

/// All lines of an entity as one marker, if it has any. Recordings have their points in the arena, without poses of their own.
fn lines(lines: &[LinePrimitive], pixel_m: f64) -> Option<Marker> {
    let first = lines.first()?;
    let (mut points, mut colors) = (Vec::new(), Vec::new());
    for line in lines {
        points.extend(ends(line));
        colors.resize(points.len(), tint(line.color));
    }
    if points.is_empty() {
        return None;
    }
    let color = tint(first.color);
    if colors.iter().all(|it| *it == color) {
        colors.clear();
    }
    let width_m = if first.scale_invariant { first.thickness * pixel_m } else { first.thickness };
    Some(Marker {
        r#type: Marker::LINE_LIST,
        action: Marker::ADD,
        pose: Pose::default(),
        scale: Point { x: width_m, ..Point::default() },
        color,
        points,
        colors,
        ..Marker::default()
    })
}

/// The ends of each stretch of a line, in pairs.
fn ends(line: &LinePrimitive) -> Vec<Point> {
    let points: Vec<Point> = line.points.iter().map(|it| Point { x: it.x, y: it.y, z: it.z }).collect();
    let Some(&first) = points.first() else { return points };
    match line.r#type() {
        Type::LineList => points,
        Type::LineStrip => points.windows(2).flatten().copied().collect(),
        Type::LineLoop => {
            let next = points.iter().skip(1).copied().chain([first]);
            points.iter().copied().zip(next).flat_map(|(from, to)| [from, to]).collect()
        }
    }
}

/// A recorded color, single precision being all that is drawn.
fn tint(color: Option<RecordedColor>) -> Color {
    let color = color.unwrap_or_default();
    Color { r: color.r as f32, g: color.g as f32, b: color.b as f32, a: color.a as f32 }
}

#[cfg(test)]
mod tests {
    use recording::foxglove::{CylinderPrimitive, Point3, SpherePrimitive, Vector3};

    use super::*;

    fn outline(side_m: f64, r#type: Type) -> LinePrimitive {
        let points = [[0.0, 0.0], [side_m, 0.0], [side_m, side_m]];
        LinePrimitive {
            r#type: r#type.into(),
            thickness: 1.0,
            scale_invariant: true,
            points: points.map(|[x, y]| Point3 { x, y, z: 0.0 }).into(),
            color: Some(RecordedColor { g: 0.5, a: 1.0, ..RecordedColor::default() }),
            ..LinePrimitive::default()
        }
    }

    fn entity(id: &str, cylinders: usize, lines: &[LinePrimitive]) -> SceneUpdate {
        let entity = SceneEntity {
            id: id.into(),
            cylinders: vec![CylinderPrimitive::default(); cylinders],
            lines: lines.into(),
            ..SceneEntity::default()
        };
        SceneUpdate { deletions: vec![], entities: vec![entity] }
    }

    /// Namespace, number, type, action and number of points of each marker.
    fn told(markers: &MarkerArray) -> Vec<(&str, i32, i32, i32, usize)> {
        let of = |it: &Marker| (it.r#type, it.action, it.points.len());
        let told = markers.markers.iter().map(|it| (it, of(it)));
        told.map(|(it, (r#type, action, points))| (&*it.ns, it.id, r#type, action, points)).collect()
    }

    #[test]
    fn each_message_has_the_whole_scene_and_takes_back_what_is_gone() {
        let mut scene = Scene::default();
        let header = Header::default();
        scene.updated(entity("walls", 0, &[outline(5.0, Type::LineLoop)]), &header);
        scene.updated(entity("bodies", 2, &[]), &header);
        let cells = [outline(1.0, Type::LineLoop), outline(2.0, Type::LineLoop)];
        let both = [("bodies", 0, 3, 0, 0), ("bodies", 1, 3, 0, 0)];
        let walls = ("walls", 0, 5, 0, 6);
        let (cells_of_two, cell_of_one) = (("cells", 0, 5, 0, 12), ("cells", 0, 5, 0, 6));
        let told_then = |update, scene: &mut Scene| scene.updated(update, &header);
        let two = told_then(entity("cells", 0, &cells), &mut scene);
        assert_eq!(told(&two), [both[0], both[1], cells_of_two, walls]);
        let one = told_then(entity("cells", 0, &cells[..1]), &mut scene);
        assert_eq!(told(&one), [both[0], both[1], cell_of_one, walls]);
        let none = told_then(entity("cells", 0, &[]), &mut scene);
        let gone = ("cells", 0, 0, 2, 0);
        assert_eq!(told(&none), [both[0], both[1], gone, walls]);
        // Told as long as it is gone: a bag may be played from here.
        let fewer = told_then(entity("bodies", 1, &[]), &mut scene);
        assert_eq!(told(&fewer), [both[0], ("bodies", 1, 0, 2, 0), gone, walls]);
    }

    #[test]
    fn lines_are_pairs_of_points_whatever_they_were() {
        let ends_of = |r#type| -> Vec<[f64; 2]> {
            ends(&outline(1.0, r#type)).into_iter().map(|point| [point.x, point.y]).collect()
        };
        let [a, b, c] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
        assert_eq!(ends_of(Type::LineStrip), [a, b, b, c]);
        assert_eq!(ends_of(Type::LineLoop), [a, b, b, c, c, a]);
        assert_eq!(ends_of(Type::LineList), [a, b, c]);
        assert!(ends(&LinePrimitive::default()).is_empty());
    }

    #[test]
    fn a_line_of_one_pixel_is_a_500th_of_the_scene_wide() {
        let mut scene = Scene::default();
        let markers = scene.updated(entity("walls", 0, &[outline(5.0, Type::LineLoop)]), &Header::default());
        let [walls] = &markers.markers[..] else { panic!("{markers:?}") };
        assert_eq!((walls.scale.x, walls.color.g, walls.colors.len()), (0.01, 0.5, 0));
        let other = LinePrimitive { color: None, ..outline(5.0, Type::LineStrip) };
        let both = [outline(5.0, Type::LineStrip), other];
        let markers = scene.updated(entity("walls", 0, &both), &Header::default());
        let greens: Vec<f32> = markers.markers[0].colors.iter().map(|color| color.g).collect();
        assert_eq!(greens, [0.5, 0.5, 0.5, 0.5, 0.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn a_lamp_is_a_ball_of_its_size() {
        let size = Some(Vector3 { x: 0.1, y: 0.1, z: 0.1 });
        let lamps = SceneEntity {
            id: "lamps".into(),
            spheres: vec![SpherePrimitive { size, ..SpherePrimitive::default() }],
            ..SceneEntity::default()
        };
        let update = SceneUpdate { deletions: vec![], entities: vec![lamps] };
        let markers = Scene::default().updated(update, &Header::default());
        assert_eq!((markers.markers[0].r#type, markers.markers[0].scale.x), (Marker::SPHERE, 0.1));
        assert_eq!(markers.markers[0].pose, Pose::default());
    }
}
