//! A circuit from above, coloured by a quantity along the lap.

use std::path::Path;

use glam::DVec2;
use plotters::style::RGBColor;

use super::axis::{Axis, extent};
use super::canvas::{Align, Canvas, Type, draw_to_file};
use super::style::{FAINT_INK, FRAME, GREYED, INK, LABEL_PX, TICK_PX, TITLE_PX, viridis, with_unit};
#[cfg(feature = "vehicle")]
use crate::track::{Circuit, CrossSections, Section};
use crate::{Error, Result};

/// A road from above.
#[derive(Debug, Clone, Default)]
pub struct Road {
    /// Left edge (m); may be empty.
    pub left_edge_m: Vec<DVec2>,
    /// Right edge (m); may be empty.
    pub right_edge_m: Vec<DVec2>,
    /// Whether the ends join.
    pub closed: bool,
    /// Names and the places they belong to (m).
    pub names: Vec<(String, DVec2)>,
}

#[cfg(feature = "vehicle")]
impl Road {
    /// A circuit with the names of its sections.
    pub fn of(circuit: &Circuit) -> Self {
        let middle = |s: &Section| circuit.position_at(0.5 * (s.start_m + s.end_m));
        let names = circuit.sections.iter().map(|s| (s.name.clone(), middle(s)));
        Self {
            left_edge_m: circuit.left_edge(),
            right_edge_m: circuit.right_edge(),
            closed: circuit.closed,
            names: names.collect(),
        }
    }

    /// The road of these cross-sections between edges (m, right and left), with the names of its corners, or of its sections
    /// where corners have none.
    pub fn across(road: &CrossSections, edges_m: &[Vec<DVec2>; 2]) -> Self {
        let at = |station: f64| {
            let i = road.station_m.partition_point(|s| *s < station);
            let i = i.min(road.len() - 1);
            0.5 * (road.left_m[i] + road.right_m[i])
        };
        let corners = road.corners.iter().map(|c| (c.name.clone(), at(c.station_m)));
        let sections = road.sections.iter();
        let sections = sections.map(|s| (s.name.clone(), at(0.5 * (s.start_m + s.end_m))));
        Self {
            left_edge_m: edges_m[1].clone(),
            right_edge_m: edges_m[0].clone(),
            closed: road.closed,
            names: if road.corners.is_empty() {
                sections.collect()
            } else {
                corners.collect()
            },
        }
    }
}

/// A line on a road, coloured by a quantity.
#[derive(Debug, Clone, Default)]
pub struct TrackMap {
    /// Title of the figure.
    pub title: String,
    /// The road under the line.
    pub road: Road,
    /// The line to colour (m), from the start line on.
    pub line_m: Vec<DVec2>,
    /// One value per point of the line; grey where not finite.
    pub values: Vec<f64>,
    /// The quantity, as in `speed`.
    pub value_label: String,
    /// Its unit, as in `m/s`.
    pub value_unit: String,
}

/// Room around the circuit for names (px).
const ROOM: (f64, f64) = (120.0, 40.0);
const TOP: f64 = 52.0;
const BAR_ROOM: f64 = 120.0;
const LINE_PX: f64 = 3.4;
const ROAD: RGBColor = RGBColor(232, 232, 232);
const EDGE: RGBColor = RGBColor(120, 120, 120);
/// Steps of colour: finer ones cannot be told apart and only make the file longer.
const SHADES: f64 = 64.0;

/// Metres to pixels, alike in both directions.
struct View {
    corner: DVec2,
    px_per_m: f64,
    bottom: f64,
    left: f64,
}

impl View {
    fn at(&self, p: DVec2) -> DVec2 {
        let from_corner = (p - self.corner) * self.px_per_m;
        DVec2::new(self.left + from_corner.x, self.bottom - from_corner.y)
    }
}

impl TrackMap {
    /// Draws the circuit to an SVG file, the same scale both ways.
    ///
    /// # Errors
    /// [`Error::Input`] when there are fewer than two different finite points, or values of another
    /// number than points; [`Error::Io`] when the file cannot be written.
    pub fn write_svg(&self, path: impl AsRef<Path>) -> Result<()> {
        let (path, map) = (path.as_ref(), self);
        if map.values.len() != map.line_m.len() {
            return Err(Error::input(
                path,
                "values",
                format!("{} values", map.values.len()),
                format!("{}, one per point of the line", map.line_m.len()),
            ));
        }
        let all: Vec<DVec2> = [&map.line_m[..], &map.road.left_edge_m, &map.road.right_edge_m]
            .concat()
            .into_iter()
            .filter(|p| p.is_finite())
            .collect();
        let low = all.iter().copied().reduce(DVec2::min).unwrap_or_default();
        let high = all.iter().copied().reduce(DVec2::max).unwrap_or_default();
        let size = high - low;
        if map.line_m.len() < 2 || size.max_element() <= 0.0 {
            return Err(Error::input(
                path,
                "line",
                format!("{} points without any extent", map.line_m.len()),
                "at least two different finite points",
            ));
        }
        let room = DVec2::new(1200.0 - BAR_ROOM - 2.0 * ROOM.0, 900.0 - TOP - 2.0 * ROOM.1);
        let px_per_m = (room.x / size.x.max(1e-9)).min(room.y / size.y.max(1e-9));
        let drawn = size * px_per_m;
        let title = Type::new(TITLE_PX, INK, Align::Left).bold().width(&map.title);
        let width = (drawn.x + 2.0 * ROOM.0 + BAR_ROOM)
            .max(title + 48.0)
            .max(640.0)
            .ceil();
        let height = (TOP + drawn.y + 2.0 * ROOM.1).max(420.0).ceil();
        let view = View {
            corner: low,
            px_per_m,
            bottom: 0.5 * (height + TOP + drawn.y),
            left: 0.5 * (width - BAR_ROOM - drawn.x),
        };
        let range = extent(&map.values);
        draw_to_file(path, (width, height), &map.title, |canvas| {
            draw_road(canvas, map, &view);
            draw_line(canvas, map, &view, range);
            let start = draw_start(canvas, map, &view);
            draw_names(canvas, map, &view, start, DVec2::new(width - BAR_ROOM, height));
            draw_scale(canvas, &view, size.max_element(), height);
            if let Some(range) = range {
                let bar = (width - BAR_ROOM + 24.0, height);
                draw_colour_bar(canvas, map, range, bar);
            }
        })
    }
}

/// Points far enough apart to be seen apart; runs end where a point is not finite.
fn runs(points: &[DVec2], view: &View, closed: bool) -> Vec<Vec<(f64, f64)>> {
    let joined = points.iter().chain(points.first().filter(|_| closed));
    let mut all: Vec<Vec<(f64, f64)>> = vec![Vec::new()];
    let mut last = DVec2::NAN;
    let count = points.len() + usize::from(closed);
    for (i, &point) in joined.enumerate() {
        let at = view.at(point);
        if !at.is_finite() {
            all.push(Vec::new());
            last = DVec2::NAN;
        } else if last.is_nan() || at.distance(last) >= 0.8 || i + 1 == count {
            if let Some(run) = all.last_mut() {
                run.push((at.x, at.y));
            }
            last = at;
        }
    }
    all.retain(|run| run.len() > 1);
    all
}

fn draw_road(canvas: &mut Canvas<'_>, map: &TrackMap, view: &View) {
    let left = runs(&map.road.left_edge_m, view, map.road.closed);
    let right = runs(&map.road.right_edge_m, view, map.road.closed);
    if let ([left], [right]) = (left.as_slice(), right.as_slice()) {
        let around = left.iter().chain(right.iter().rev()).copied();
        canvas.polygon(around, ROAD, 1.0);
    }
    for edge in left.iter().chain(&right) {
        canvas.path(edge.iter().copied(), EDGE, 0.9);
    }
}

fn draw_line(canvas: &mut Canvas<'_>, map: &TrackMap, view: &View, range: Option<(f64, f64)>) {
    let shade = |value: f64| -> Option<u32> {
        let (low, high) = range?;
        let share = if high > low {
            (value - low) / (high - low)
        } else {
            0.5
        };
        value.is_finite().then(|| (share * SHADES).round() as u32)
    };
    let n = map.line_m.len();
    let steps = if map.road.closed { n } else { n - 1 };
    let mut run: Vec<(f64, f64)> = Vec::new();
    let mut colour = None;
    let flush = |canvas: &mut Canvas<'_>, run: &mut Vec<(f64, f64)>, shade: Option<u32>| {
        let colour = shade.map_or(GREYED, |s| viridis(f64::from(s) / SHADES));
        if run.len() > 1 {
            canvas.path(run.iter().copied(), colour, LINE_PX);
        }
        run.clear();
    };
    for i in 0..steps {
        let (a, b) = (view.at(map.line_m[i]), view.at(map.line_m[(i + 1) % n]));
        let next = shade(map.values[i]);
        if next != colour || !a.is_finite() || !b.is_finite() {
            // A thinned run ends short of the next one's start.
            if a.is_finite() && !run.is_empty() {
                run.push((a.x, a.y));
            }
            flush(canvas, &mut run, colour);
            colour = next;
        }
        if !a.is_finite() || !b.is_finite() {
            continue;
        }
        if run.is_empty() {
            run.push((a.x, a.y));
        }
        let far = run.last().is_some_and(|l| b.distance(DVec2::from(*l)) >= 0.8);
        if far || i + 1 == steps {
            run.push((b.x, b.y));
        }
    }
    flush(canvas, &mut run, colour);
}

/// The start line and an arrow the way the lap goes; returns where they stand (px).
fn draw_start(canvas: &mut Canvas<'_>, map: &TrackMap, view: &View) -> Option<[DVec2; 2]> {
    let start = view.at(*map.line_m.first()?);
    // Neighbouring points may lie closer than rounding can tell a direction from.
    let ahead = map
        .line_m
        .iter()
        .map(|&p| view.at(p))
        .find(|p| p.distance(start) > 2.0)?;
    let along = (ahead - start).normalize_or_zero();
    let across = along.perp();
    let half = match (map.road.left_edge_m.first(), map.road.right_edge_m.first()) {
        (Some(&l), Some(&r)) => (0.5 * l.distance(r) * view.px_per_m).clamp(5.0, 30.0),
        _ => 5.0,
    } + 5.0;
    let pair = |p: DVec2| (p.x, p.y);
    let (a, b) = (start - across * half, start + across * half);
    canvas.line(pair(a), pair(b), INK, 3.0);
    let tail = start + across * (half + 7.0) - along * 4.0;
    let tip = tail + along * 26.0;
    canvas.line(pair(tail), pair(tip - along * 6.0), INK, 1.6);
    let barb = |side: f64| pair(tip - along * 9.0 + across * (side * 4.5));
    canvas.polygon([pair(tip), barb(1.0), barb(-1.0)], INK, 1.0);
    Some([start, 0.5 * (tail + tip)])
}

/// A text's box (px).
#[derive(Clone, Copy)]
struct Block {
    centre: DVec2,
    half: DVec2,
}

impl Block {
    fn gap(&self, point: DVec2) -> f64 {
        ((point - self.centre).abs() - self.half)
            .max(DVec2::ZERO)
            .length()
    }

    fn overlaps(&self, other: &Block) -> bool {
        let apart = (self.centre - other.centre).abs();
        apart.cmplt(self.half + other.half + 3.0).all()
    }
}

/// Puts each name beside its place where it covers neither the road nor another name.
fn draw_names(
    canvas: &mut Canvas<'_>,
    map: &TrackMap,
    view: &View,
    start: Option<[DVec2; 2]>,
    limits: DVec2,
) {
    let road: Vec<DVec2> = runs(&map.line_m, view, map.road.closed)
        .concat()
        .into_iter()
        .step_by(3)
        .map(DVec2::from)
        .collect();
    let arrow = start.map(|[_, arrow]| Block {
        centre: arrow,
        half: DVec2::splat(14.0),
    });
    let mut taken: Vec<Block> = arrow.into_iter().collect();
    let look = Type::new(LABEL_PX, INK, Align::Centre);
    let named = map
        .road
        .names
        .iter()
        .map(|(name, place)| (name.as_str(), view.at(*place)));
    let first = start.map(|[at, _]| ("start", at));
    let all: Vec<(&str, DVec2)> = first.into_iter().chain(named).collect();
    let places: Vec<DVec2> = all.iter().map(|(_, place)| *place).collect();
    for (name, place) in all {
        if !place.is_finite() || name.is_empty() {
            continue;
        }
        let half = 0.5 * DVec2::new(look.width(name), LABEL_PX + 2.0);
        let Some(block) = best_place(place, half, &road, &places, &taken, limits) else {
            continue;
        };
        let near = place.clamp(block.centre - block.half, block.centre + block.half);
        if near.distance(place) > 26.0 {
            let way = (near - place).normalize_or_zero();
            let (from, to) = (place + way * 8.0, near - way * 3.0);
            canvas.line((from.x, from.y), (to.x, to.y), FRAME, 0.8);
        }
        canvas.text(name, (block.centre.x, block.centre.y), look);
        taken.push(block);
    }
}

fn best_place(
    place: DVec2,
    half: DVec2,
    road: &[DVec2],
    places: &[DVec2],
    taken: &[Block],
    limits: DVec2,
) -> Option<Block> {
    const CLEAR: f64 = 10.0;
    let candidates = [12.0, 20.0, 30.0, 45.0, 65.0, 90.0].into_iter().flat_map(|far| {
        (0..24).map(move |turn| {
            let way = DVec2::from_angle(f64::from(turn) * std::f64::consts::TAU / 24.0);
            // The nearest side of the box, not its centre, keeps the distance.
            let reach = far + (way.x * half.x).abs().max((way.y * half.y).abs());
            let centre = place + way * reach;
            (far, Block { centre, half })
        })
    });
    candidates
        .filter(|(_, block)| {
            let (a, b) = (block.centre - block.half, block.centre + block.half);
            a.x > 4.0 && a.y > TOP - 8.0 && b.x < limits.x && b.y < limits.y - 34.0
        })
        .map(|(far, block)| {
            let covered = road.iter().filter(|&&p| block.gap(p) < CLEAR).count();
            let clashes = taken.iter().filter(|t| t.overlaps(&block)).count();
            // A name nearer to another part of the lap would be read as that part's.
            let own = block.gap(place);
            let nearer = |p: &&DVec2| p.distance(place) > 60.0 && block.gap(**p) < own;
            let astray = places.iter().chain(road).any(|p| nearer(&p));
            let cost =
                far + 20.0 * covered as f64 + if astray { 25.0 } else { 0.0 } + 1000.0 * clashes as f64;
            (cost, block)
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(cost, _)| *cost < 1000.0)
        .map(|(_, block)| block)
}

/// A bar of a round length, for judging distances.
fn draw_scale(canvas: &mut Canvas<'_>, view: &View, extent_m: f64, height: f64) {
    let most = 0.3 * extent_m;
    let decade = 10f64.powf(most.log10().floor());
    let length = [5.0, 2.0, 1.0]
        .into_iter()
        .map(|m| m * decade)
        .find(|&l| l <= most)
        .unwrap_or(decade);
    let (left, y) = (28.0, height - 18.0);
    let right = left + length * view.px_per_m;
    canvas.line((left, y), (right, y), INK, 1.6);
    for end in [left, right] {
        canvas.line((end, y - 5.0), (end, y + 5.0), INK, 1.6);
    }
    let text = format!("{length} m");
    canvas.text(
        &text,
        (right + 10.0, y),
        Type::new(TICK_PX, FAINT_INK, Align::Left),
    );
}

fn draw_colour_bar(canvas: &mut Canvas<'_>, map: &TrackMap, range: (f64, f64), (left, height): (f64, f64)) {
    let (top, bottom) = (TOP + 40.0, height - 50.0);
    let right = left + 16.0;
    let axis = Axis::linear(range, (bottom, top));
    let slices = 2 * SHADES as u32;
    for i in 0..slices {
        let edge = |k: u32| bottom + (top - bottom) * f64::from(k) / f64::from(slices);
        let colour = viridis((f64::from(i) + 0.5) / f64::from(slices));
        // Each slice reaches under the next, or viewers show seams of white.
        let upper = (edge(i + 1) - 1.0).max(top);
        canvas.rect((left, upper), (right, edge(i)), colour, 1.0);
    }
    canvas.frame((left, top), (right, bottom), FRAME, 0.8);
    for (value, label) in axis.ticks(8) {
        let y = axis.at(value);
        canvas.line((right, y), (right + 4.0, y), INK, 0.8);
        canvas.text(&label, (right + 8.0, y), Type::new(TICK_PX, INK, Align::Left));
    }
    let text = with_unit(&map.value_label, &map.value_unit);
    let look = Type::new(LABEL_PX, INK, Align::Centre);
    let middle = left + 24.0;
    canvas.text(&text, (middle, top - 18.0), look);
}
