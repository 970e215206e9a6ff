//! The legend under a figure: samples long enough to show their dashes.

use kuva::{
    plot::scatter::MarkerShape,
    render::{
        color::Color,
        render::{PathData, Primitive, Scene, TextAnchor},
    },
};

use crate::look::Look;

/// One line of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Text beside the sample.
    pub name: String,
    /// How it looks.
    pub sample: Sample,
}

/// Sample of a line, marker or area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sample {
    /// A line.
    Line(Look),
    /// A thin line.
    Thin(Look),
    /// A marker.
    Dot(Look),
    /// A line with a marker.
    Both(Look),
}

const ROW_HEIGHT: f64 = 19.0;
const SAMPLE_WIDTH: f64 = 30.0;
const GAP: f64 = 7.0;
const FONT_SIZE: u32 = 12;
/// No font in use is wider than this on average, for letters at [`FONT_SIZE`].
const LETTER_WIDTH: f64 = 7.1;
const LEFT: f64 = 14.0;

/// Adds the legend below the scene, in as many rows as it needs.
pub fn add(scene: &mut Scene, entries: &[Entry]) {
    if entries.is_empty() {
        return;
    }
    let (mut x, mut y) = (LEFT, scene.height + ROW_HEIGHT / 2.0 - 2.0);
    for entry in entries {
        let width = SAMPLE_WIDTH + GAP + LETTER_WIDTH * entry.name.chars().count() as f64 + 2.0 * GAP;
        if x > LEFT && x + width > scene.width {
            (x, y) = (LEFT, y + ROW_HEIGHT);
        }
        sample(scene, entry.sample, x, y);
        scene.add(Primitive::Text {
            x: x + SAMPLE_WIDTH + GAP,
            y: y + 4.0,
            content: entry.name.clone(),
            size: FONT_SIZE,
            anchor: TextAnchor::Start,
            rotate: None,
            bold: false,
            color: None,
        });
        x += width;
    }
    scene.height = y + ROW_HEIGHT / 2.0 + 4.0;
}

fn sample(scene: &mut Scene, sample: Sample, x: f64, y: f64) {
    match sample {
        Sample::Line(look) => line(scene, look, 2.0, x, y),
        Sample::Thin(look) => line(scene, look, 1.0, x, y),
        Sample::Dot(look) => marker(scene, look, x + SAMPLE_WIDTH / 2.0, y),
        Sample::Both(look) => {
            line(scene, look, 1.6, x, y);
            marker(scene, look, x + SAMPLE_WIDTH / 2.0, y);
        }
    }
}

fn line(scene: &mut Scene, look: Look, width: f64, x: f64, y: f64) {
    scene.add(Primitive::Line {
        x1: x,
        y1: y,
        x2: x + SAMPLE_WIDTH,
        y2: y,
        stroke: Color::from(look.ink.light()),
        stroke_width: width,
        stroke_dasharray: look.dash.pattern().map(str::to_owned),
    });
}

fn marker(scene: &mut Scene, look: Look, x: f64, y: f64) {
    let color = Color::from(look.ink.light());
    let path = |corners: &str| {
        Primitive::Path(Box::new(PathData {
            d: corners.to_owned(),
            fill: Some(color.clone()),
            stroke: color.clone(),
            stroke_width: 1.8,
            opacity: None,
            stroke_dasharray: None,
        }))
    };
    let r = 4.0;
    let (left, right, up, down) = (x - r, x + r, y - r, y + r);
    scene.add(match look.marker {
        MarkerShape::Square => path(&format!("M{left},{up} L{right},{up} L{right},{down} L{left},{down} Z")),
        MarkerShape::Triangle => path(&format!("M{x},{up} L{right},{down} L{left},{down} Z")),
        MarkerShape::TriangleDown => path(&format!("M{x},{down} L{right},{up} L{left},{up} Z")),
        MarkerShape::Diamond => path(&format!("M{x},{up} L{right},{y} L{x},{down} L{left},{y} Z")),
        MarkerShape::Cross => path(&format!("M{left},{up} L{right},{down} M{left},{down} L{right},{up}")),
        MarkerShape::Plus => path(&format!("M{left},{y} L{right},{y} M{x},{down} L{x},{up}")),
        _ => Primitive::Circle {
            cx: x,
            cy: y,
            r,
            fill: color,
            fill_opacity: None,
            stroke: None,
            stroke_width: None,
        },
    });
}
