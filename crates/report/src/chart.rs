//! A figure with two axes: our look over the plotting library.
//!
//! In:  series of points, in the units of the axes.
//! Out: an [`Svg`]. Each series has its own ink, dash and marker, so that nobody needs to see colors.

use std::sync::Arc;

use kuva::{
    plot::{BoxPlot, LinePlot, ScatterPlot, StripPlot, line::LineStyle, scatter::MarkerShape},
    render::{
        annotations::{ReferenceLine, TextAnnotation},
        layout::{Layout, TickFormat},
        plots::Plot,
        render::{Primitive, Scene, TextAnchor, render_multiple},
        theme::Theme,
    },
};

use crate::{
    legend::{self, Entry, Sample},
    look::{Dash, Look},
    number,
    svg::Svg,
    theme::Ink,
};

/// x and y, in the units of the axes.
pub type Point = (f64, f64);

/// Between two points of a line, a gap: what is on its left and on its right is not joined.
pub const GAP: Point = (f64::NAN, f64::NAN);

/// x, y, and half the length of a bar, in the units of the axes.
pub type Spread = (f64, f64, f64);

/// A name and what is drawn under it.
pub type Series = (String, Vec<Spread>);

/// Turns a value into its place on an axis, or back.
type Scale = fn(f64) -> f64;

/// Below this a logarithmic axis ends: the plotting library has no ticks beyond.
const LOG_FLOOR: f64 = 1e-10;

/// More points than this are not drawn one by one beside a distribution.
const POINTS_DRAWN: usize = 200;

/// Labels of events stand in so many rows at most, one above the other.
const EVENT_ROWS: usize = 4;

/// One axis.
#[derive(Clone, Debug)]
pub struct Axis {
    label: String,
    log: bool,
    from_zero: bool,
    range: Option<(f64, f64)>,
    tick_step: Option<f64>,
    names: Vec<String>,
}

impl Axis {
    /// An axis whose label names the quantity and its unit.
    pub fn new(label: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            log: false,
            from_zero: false,
            range: None,
            tick_step: None,
            names: Vec::new(),
        }
    }

    /// Logarithmic; what is not positive is not drawn.
    pub fn log(self) -> Self {
        self.log_if(true)
    }

    /// Logarithmic, or not.
    pub fn log_if(mut self, log: bool) -> Self {
        self.log = log;
        self
    }

    /// Begins at zero.
    pub fn from_zero(mut self) -> Self {
        self.from_zero = true;
        self
    }

    /// From `low` to `high` exactly.
    pub fn range(mut self, low: f64, high: f64) -> Self {
        self.range = Some((low, high));
        self
    }

    /// A tick at each multiple of `step`.
    pub fn ticks_every(mut self, step: f64) -> Self {
        self.tick_step = Some(step);
        self
    }

    /// Names at 1, 2, 3 and so on in place of numbers.
    pub fn names(mut self, names: Vec<String>) -> Self {
        self.names = names;
        self
    }

    fn shows(&self, value: f64) -> bool {
        value.is_finite() && (!self.log || value >= LOG_FLOOR)
    }

    fn limits(&self, values: &[f64]) -> (f64, f64) {
        if let Some(range) = self.range {
            return range;
        }
        let shown = values.iter().copied().filter(|&value| self.shows(value));
        let (low, high) = shown
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        if low > high {
            return if self.log { (0.1, 1.0) } else { (0.0, 1.0) };
        }
        if self.log {
            // A tenth of a decade around a narrow span, whole decades around a wide one.
            let (low, high) = (low.log10(), high.log10());
            return match high - low {
                span if span < 2.5 => (10_f64.powf(low - 0.08), 10_f64.powf(high + 0.08)),
                _ => (10_f64.powf(low.floor()), 10_f64.powf(high.ceil())),
            };
        }
        let low = if self.from_zero { low.min(0.0) } else { low };
        let pad = match high - low {
            span if span > 0.0 => 0.05 * span,
            _ if low != 0.0 => 0.1 * low.abs(),
            _ => 1.0,
        };
        (if self.from_zero && low == 0.0 { 0.0 } else { low - pad }, high + pad)
    }
}

/// Something that happened at some x.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// Where.
    pub x: f64,
    /// Short text beside the line.
    pub label: String,
}

/// Words in a figure.
#[derive(Clone, Debug)]
struct Label {
    text: String,
    at: Point,
    ink: Ink,
}

impl Label {
    /// The label as the plotting library places it: in black, above the point, its middle there.
    fn annotation(&self) -> TextAnnotation {
        TextAnnotation::new(self.text.clone(), self.at.0, self.at.1).with_font_size(11)
    }

    /// Gives it its ink and puts it beside the point.
    fn settle(&self, scene: &mut Scene) {
        for element in &mut scene.elements {
            match element {
                Primitive::Text { content, anchor, color, y, .. } if *content == self.text => {
                    *anchor = TextAnchor::Start;
                    *color = Some(self.ink.light().into());
                    *y += 10.0;
                }
                _ => {}
            }
        }
    }
}

/// A figure being drawn.
pub struct Chart {
    title: String,
    x: Axis,
    y: Axis,
    size: (f64, f64),
    same_scale: bool,
    grid: bool,
    plots: Vec<Plot>,
    legend: Vec<Entry>,
    events: Vec<Event>,
    labels: Vec<Label>,
    xs: Vec<f64>,
    ys: Vec<f64>,
}

impl Chart {
    /// An empty figure as wide as a column.
    pub fn new(x: Axis, y: Axis) -> Self {
        Self {
            title: String::new(),
            x,
            y,
            size: (640.0, 340.0),
            same_scale: false,
            grid: true,
            plots: Vec::new(),
            legend: Vec::new(),
            events: Vec::new(),
            labels: Vec::new(),
            xs: Vec::new(),
            ys: Vec::new(),
        }
    }

    /// An empty figure for a row of several.
    pub fn panel(x: Axis, y: Axis, title: impl Into<String>) -> Self {
        Self { title: title.into(), size: (400.0, 330.0), ..Self::new(x, y) }
    }

    /// An empty plan: a meter is as long in x as in y, and there is no grid.
    pub fn plan(x: Axis, y: Axis, title: impl Into<String>) -> Self {
        Self { size: (400.0, 410.0), same_scale: true, grid: false, ..Self::panel(x, y, title) }
    }

    /// A line through `points`, broken where one cannot be shown, as a [`GAP`]; an empty name keeps it out of the
    /// legend.
    pub fn line(&mut self, name: &str, points: &[Point], look: Look) {
        self.stroke(points, look, 1.8, false);
        self.entry(name, Sample::Line(look));
    }

    /// A line of steps: each point holds until the next.
    pub fn steps(&mut self, name: &str, points: &[Point], look: Look) {
        self.stroke(points, look, 1.8, true);
        self.entry(name, Sample::Line(look));
    }

    /// Many thin lines under one name.
    pub fn thin_lines<'a>(
        &mut self,
        name: &str,
        lines: impl IntoIterator<Item = &'a [Point]>,
        ink: Ink,
        dash: Dash,
    ) {
        let look = Look { ink, dash, marker: MarkerShape::Circle };
        for line in lines {
            self.stroke(line, look, 0.7, false);
        }
        self.entry(name, Sample::Thin(look));
    }

    /// Markers.
    pub fn dots(&mut self, name: &str, points: &[Point], look: Look, radius: f64) {
        let shown = self.shown(points);
        self.note_extent(&shown, &[]);
        self.plots.push(Plot::Scatter(
            ScatterPlot::new()
                .with_data(shown)
                .with_size(radius)
                .with_marker(look.marker)
                .with_color(look.ink.light())
                .with_marker_stroke_width(1.8),
        ));
        self.entry(name, Sample::Dot(look));
    }

    /// A line with markers and error bars: x, y and half the bar's length.
    pub fn spread(&mut self, name: &str, points: &[(f64, f64, f64)], look: Look) {
        let bars = self.bars(points, look);
        let middle: Vec<Point> = points.iter().map(|&(x, y, _)| (x, y)).collect();
        self.stroke(&middle, look, 1.6, false);
        self.plots.push(bars);
        self.entry(name, Sample::Both(look));
    }

    /// The distribution of each group, by name along x: boxes, and points where there are few.
    pub fn distributions(&mut self, groups: &[(String, Vec<f64>)], ink: Ink) {
        let mut boxes = BoxPlot::new().with_color(ink.light()).with_width(0.6);
        let mut strip = StripPlot::new().with_color(Ink::Text.light()).with_point_size(1.6).with_jitter(0.16);
        for (name, values) in groups {
            let shown: Vec<f64> = values.iter().copied().filter(|&value| self.y.shows(value)).collect();
            self.ys.extend(&shown);
            let few = if shown.len() <= POINTS_DRAWN { shown.clone() } else { Vec::new() };
            boxes = boxes.with_group(name.clone(), shown);
            strip = strip.with_group(name.clone(), few);
        }
        self.xs.extend([0.5, groups.len() as f64 + 0.5]);
        self.x = self.x.clone().names(groups.iter().map(|(name, _)| name.clone()).collect());
        self.plots.extend([Plot::Box(boxes), Plot::Strip(strip)]);
    }

    /// A closed outline.
    pub fn outline(&mut self, corners: &[Point], ink: Ink, width: f64) {
        let closed: Vec<Point> = corners.iter().chain(corners.first()).copied().collect();
        let look = Look { ink, dash: Dash::Solid, marker: MarkerShape::Circle };
        self.stroke(&closed, look, width, false);
    }

    /// Lines at the events, across the figure.
    pub fn events(&mut self, events: Vec<Event>) {
        self.events = events;
    }

    /// Words beside the point `at`, to the right of it: for lines that are named where they are drawn.
    pub fn label(&mut self, text: &str, at: Point, ink: Ink) {
        self.labels.push(Label { text: text.to_owned(), at, ink });
    }

    /// One more line of the legend, for what has been drawn without a name.
    pub fn entry(&mut self, name: &str, sample: Sample) {
        if !name.is_empty() {
            self.legend.push(Entry { name: name.to_owned(), sample });
        }
    }

    /// The figure; `about` says in words what it shows, for who cannot see it.
    pub fn draw(self, about: &str) -> Svg {
        let x = self.x.limits(&self.xs);
        let (y, events, labels) = self.placed_events(x, self.y.limits(&self.ys));
        let mut layout = Layout::new(x, y)
            .with_width(self.size.0)
            .with_height(self.size.1)
            .with_x_label(self.x.label.clone())
            .with_y_label(self.y.label.clone())
            .with_theme(theme())
            .with_show_grid(self.grid)
            .with_x_axis_min(x.0)
            .with_x_axis_max(x.1)
            .with_y_axis_min(y.0)
            .with_y_axis_max(y.1)
            .with_clamp_axis()
            .with_ticks(6)
            .with_title_size(14)
            .with_label_size(13)
            .with_tick_size(11)
            .with_x_tick_format(tick_format(&self.x))
            .with_y_tick_format(tick_format(&self.y));
        layout.show_legend = false;
        layout.data_x_range = Some(x);
        layout.data_y_range = Some(y);
        if !self.title.is_empty() {
            layout = layout.with_title(self.title.clone());
        }
        if self.same_scale {
            layout = layout.with_equal_aspect();
        }
        if self.x.log {
            layout = layout.with_log_x();
        }
        if self.y.log {
            layout = layout.with_log_y();
        }
        if !self.x.names.is_empty() {
            layout = layout.with_x_categories(self.x.names.clone());
        }
        if let Some(step) = self.x.tick_step {
            layout = layout.with_x_tick_step(step);
        }
        if let Some(step) = self.y.tick_step {
            layout = layout.with_y_tick_step(step);
        }
        for line in events {
            layout = layout.with_reference_line(line);
        }
        for label in labels.into_iter().chain(self.labels.iter().map(Label::annotation)) {
            layout = layout.with_annotation(label);
        }
        let mut scene = render_multiple(self.plots, layout);
        self.labels.iter().for_each(|label| label.settle(&mut scene));
        legend::add(&mut scene, &self.legend);
        Svg::new(&scene, about)
    }

    fn stroke(&mut self, points: &[Point], look: Look, width: f64, step: bool) {
        self.note_extent(&self.shown(points), &[]);
        let shown = points.split(|&point| !self.shows(point)).filter(|piece| !piece.is_empty());
        let draw = |piece: &[Point]| match piece {
            // A line through one point would not be seen.
            &[point] => Plot::Scatter(
                ScatterPlot::new().with_data(vec![point]).with_size(width).with_color(look.ink.light()),
            ),
            piece => {
                let line = LinePlot::new().with_data(piece.to_vec());
                let line = line.with_color(look.ink.light()).with_stroke_width(width);
                let line = match look.dash.pattern() {
                    Some(pattern) => line.with_line_style(LineStyle::Custom(pattern.into())),
                    None => line,
                };
                Plot::Line(if step { line.with_step() } else { line })
            }
        };
        let pieces: Vec<Plot> = shown.map(draw).collect();
        self.plots.extend(pieces);
    }

    fn bars(&mut self, points: &[(f64, f64, f64)], look: Look) -> Plot {
        let shown = points.iter().filter(|(x, y, _)| self.x.shows(*x) && self.y.shows(*y));
        let shown: Vec<_> = shown.copied().collect();
        // On a logarithmic axis a bar ends above the floor.
        let low = |y: f64, half: f64| if self.y.log { half.min(0.9 * y) } else { half };
        let halves: Vec<(f64, f64)> = shown.iter().map(|&(_, y, half)| (low(y, half), half)).collect();
        let ends: Vec<_> =
            shown.iter().zip(&halves).map(|(&(x, y, _), half)| (x, y - half.0, y + half.1)).collect();
        self.note_extent(&[], &ends);
        Plot::Scatter(
            ScatterPlot::new()
                .with_data(shown.iter().map(|&(x, y, _)| (x, y)).collect::<Vec<_>>())
                .with_y_err_asymmetric(halves)
                .with_size(3.6)
                .with_marker(look.marker)
                .with_color(look.ink.light())
                .with_marker_stroke_width(1.6),
        )
    }

    fn shown(&self, points: &[Point]) -> Vec<Point> {
        points.iter().copied().filter(|&point| self.shows(point)).collect()
    }

    fn shows(&self, (x, y): Point) -> bool {
        self.x.shows(x) && self.y.shows(y)
    }

    fn note_extent(&mut self, points: &[Point], spans: &[(f64, f64, f64)]) {
        self.xs.extend(points.iter().map(|point| point.0).chain(spans.iter().map(|span| span.0)));
        self.ys.extend(points.iter().map(|point| point.1));
        self.ys.extend(spans.iter().flat_map(|span| [span.1, span.2]));
    }

    /// Events get rows of their own above the data, so that labels cover neither it nor each other.
    fn placed_events(
        &self,
        x: (f64, f64),
        y: (f64, f64),
    ) -> ((f64, f64), Vec<ReferenceLine>, Vec<TextAnnotation>) {
        let (to, back): (Scale, Scale) =
            if self.y.log { (f64::log10, |value| 10_f64.powf(value)) } else { (|v| v, |v| v) };
        let mut ends = [f64::NEG_INFINITY; EVENT_ROWS];
        let mut placed = Vec::new();
        for event in self.events.iter().filter(|event| (x.0..=x.1).contains(&event.x)) {
            // Characters are about 7 wide, the plot about 540.
            let half = (7.0 * event.label.chars().count() as f64 + 8.0) / 540.0 * (x.1 - x.0) / 2.0;
            let row = (0..EVENT_ROWS).find(|&row| ends[row] <= event.x - half).unwrap_or(EVENT_ROWS - 1);
            ends[row] = event.x + half;
            placed.push((event, row));
        }
        let rows = placed.iter().map(|(_, row)| row + 1).max().unwrap_or(0) as f64;
        let (low, high) = (to(y.0), to(y.1));
        let row_height = 0.065 * (high - low);
        let top = high + rows * row_height;
        let lines = placed.iter().map(|(event, _)| {
            ReferenceLine::vertical(event.x).with_color(Ink::Mark.light()).with_dasharray("2 3")
        });
        let labels = placed.iter().map(|(event, row)| {
            let at = back(top - (*row as f64 + 0.95) * row_height);
            TextAnnotation::new(event.label.clone(), event.x, at)
                .with_color(Ink::Text.light())
                .with_font_size(11)
        });
        ((y.0, back(top)), lines.clone().collect(), labels.collect())
    }
}

fn tick_format(axis: &Axis) -> TickFormat {
    if !axis.log {
        return TickFormat::Auto;
    }
    TickFormat::Custom(Arc::new(|value| {
        let exponent = value.log10().round();
        let whole = (value / 10_f64.powf(exponent) - 1.0).abs() < 1e-6;
        match exponent as i32 {
            -2..=4 if value >= 0.01 => trimmed(value),
            exponent if whole => number::power_of_ten(exponent),
            _ => number::digits(value, 1),
        }
    }))
}

/// Without zeros at its end.
fn trimmed(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn theme() -> Theme {
    Theme {
        background: Ink::Ground.light().into(),
        axis_color: Ink::Text.light().into(),
        grid_color: Ink::Grid.light().into(),
        tick_color: Ink::Text.light().into(),
        text_color: Ink::Text.light().into(),
        legend_bg: Ink::Ground.light().into(),
        legend_border: Ink::Text.light().into(),
        pie_leader: Ink::Text.light().into(),
        box_median: Ink::Text.light().into(),
        violin_border: Ink::Text.light().into(),
        colorbar_border: Ink::Text.light().into(),
        font_family: None,
        show_grid: true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_stands_beside_its_point_in_the_ink_of_its_line() {
        let axis = |label| Axis::new(label).range(0.0, 10.0);
        let mut chart = Chart::new(axis("x"), axis("y"));
        chart.line("", &[(0.0, 0.0), (5.0, 5.0)], Look::nth(1));
        chart.label("the second", (5.0, 5.0), Ink::Vermillion);
        let svg = chart.draw("one line").file("figure");
        let label = svg.lines().find(|line| line.contains(">the second<")).expect("the label is drawn");
        assert!(label.contains("text-anchor=\"start\""), "{label}");
        assert!(label.contains(Ink::Vermillion.light()), "{label}");
    }

    #[test]
    fn a_line_is_broken_at_a_gap_and_ends_at_the_last_value() {
        let ink = Ink::Vermillion.light();
        let drawn = |points: &[Point]| {
            let axis = |label| Axis::new(label).range(0.0, 10.0);
            let mut chart = Chart::new(axis("x"), axis("y"));
            chart.line("", points, Look::nth(1));
            chart.draw("one line").file("figure").matches(ink).count()
        };
        // Its ink stands in the style of every figure as well.
        let pieces = |points: &[Point]| drawn(points) - drawn(&[]);
        let (left, right) = ([(0.0, 1.0), (1.0, 1.0)], [(5.0, 1.0), (6.0, 1.0)]);
        assert_eq!(pieces(&[&left[..], &right].concat()), 1, "one line");
        assert_eq!(pieces(&[&left[..], &[GAP], &right].concat()), 2, "two pieces");
        assert_eq!(pieces(&[&left[..], &[GAP, GAP]].concat()), 1, "nothing after the last value");
        assert!(pieces(&[GAP, left[0], GAP]) > 0, "a single value is seen");
    }
}
