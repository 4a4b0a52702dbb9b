//! Axes with round ticks, and the framed plot that two of them make.

use plotters::style::RGBColor;

use super::canvas::{Align, Canvas, Type};
use super::style::{FRAME, GRID, INK, LABEL_PX, MINOR_GRID, TICK_PX, power_of_ten, significant_short};

/// A range of a quantity, laid out over a range of pixels.
#[derive(Clone, Copy)]
pub(super) struct Axis {
    low: f64,
    high: f64,
    log: bool,
    /// Distance between ticks, where it is not to follow from the range.
    step: Option<f64>,
    pixels: (f64, f64),
}

/// The least and greatest of the finite values, if there are any.
pub(super) fn extent<'a>(values: impl IntoIterator<Item = &'a f64>) -> Option<(f64, f64)> {
    values
        .into_iter()
        .filter(|v| v.is_finite())
        .fold(None, |range, &v| match range {
            None => Some((v, v)),
            Some((low, high)) => Some((f64::min(low, v), f64::max(high, v))),
        })
}

/// A step of 1, 2 or 5 times a power of ten, at least this large.
fn round_step(least: f64) -> f64 {
    let decade = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|m| m * decade)
        .find(|&step| step >= least * (1.0 - 1e-9))
        .filter(|step| step.is_finite())
        .unwrap_or(least)
}

impl Axis {
    /// A linear axis over exactly this range; one without extent is widened.
    pub(super) fn linear((low, high): (f64, f64), pixels: (f64, f64)) -> Self {
        let least = 1e-9 * low.abs().max(high.abs()).max(1e-6);
        let (low, high) = if high - low > least {
            (low, high)
        } else {
            let half = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
            (low - half, high + half)
        };
        Self {
            low,
            high,
            log: false,
            step: None,
            pixels,
        }
    }

    /// A linear axis with a margin beyond the range.
    pub(super) fn padded(range: (f64, f64), share: f64, pixels: (f64, f64)) -> Self {
        let mut axis = Self::linear(range, pixels);
        let margin = share * axis.high - share * axis.low;
        axis.low = (axis.low - margin).max(f64::MIN);
        axis.high = (axis.high + margin).min(f64::MAX);
        axis
    }

    /// An axis for errors as large as this, with ticks at zero and at a round value either way.
    pub(super) fn around_zero(largest: f64, pixels: (f64, f64)) -> Self {
        let largest = if largest > 0.0 && largest.is_finite() {
            largest
        } else {
            1.0
        };
        let decade = 10f64.powf(largest.log10().floor());
        let mut axis = Self::padded((-largest, largest), 0.1, pixels);
        // One leading digit, rounded down, is more than half of the range: three ticks and no more.
        axis.step = Some((largest / decade).floor().max(1.0) * decade);
        axis
    }

    /// A logarithmic axis with a margin beyond a positive range.
    pub(super) fn log((low, high): (f64, f64), pixels: (f64, f64)) -> Self {
        let margin = (high / low).powf(0.05).max(1.3);
        Self {
            low: low / margin,
            high: high * margin,
            log: true,
            step: None,
            pixels,
        }
    }

    /// The pixel of a value.
    pub(super) fn at(&self, value: f64) -> f64 {
        let share = if self.log {
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            // By quarters: the range of the greatest numbers is beyond them.
            (0.25 * value - 0.25 * self.low) / (0.25 * self.high - 0.25 * self.low)
        };
        self.pixels.0 + share * (self.pixels.1 - self.pixels.0)
    }

    /// Round values with their labels, about this many or fewer.
    pub(super) fn ticks(&self, most: usize) -> Vec<(f64, String)> {
        if self.log {
            return self.log_ticks(most);
        }
        let step = self.step.unwrap_or_else(|| {
            let most = most.max(1) as f64;
            round_step(self.high / most - self.low / most)
        });
        let first = (self.low / step - 1e-6).ceil() as i64;
        let last = (self.high / step + 1e-6).floor() as i64;
        let largest = self.low.abs().max(self.high.abs());
        (first..=last.min(first.saturating_add(100)))
            .map(|i| {
                let value = i as f64 * step;
                (value, tick_label(value, step, largest))
            })
            .collect()
    }

    /// The multiples of powers of ten on a logarithmic axis that is not too long to show them.
    fn minor(&self) -> Vec<f64> {
        let (first, last) = (self.low.log10().floor(), self.high.log10().ceil());
        if !self.log || last - first > 8.0 {
            return Vec::new();
        }
        (first as i32..last as i32)
            .flat_map(|d| (2..10).map(move |m| f64::from(m) * 10f64.powi(d)))
            .filter(|v| (self.low..=self.high).contains(v))
            .collect()
    }

    fn log_ticks(&self, most: usize) -> Vec<(f64, String)> {
        let (first, last) = (self.low.log10(), self.high.log10());
        let decades = (first.ceil() as i32)..=(last.floor() as i32);
        let whole = decades.clone().count();
        if whole >= 3 {
            let every = whole.div_ceil(most.max(1)).max(1);
            return decades
                .step_by(every)
                .map(|d| (10f64.powi(d), power_of_ten(d)))
                .collect();
        }
        // Under three decades, powers of ten alone say too little.
        let mantissas: &[f64] = if last - first > 1.2 {
            &[1.0, 2.0, 5.0]
        } else {
            &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0]
        };
        (first.floor() as i32..=last.floor() as i32)
            .flat_map(|d| mantissas.iter().map(move |m| m * 10f64.powi(d)))
            .filter(|v| (self.low..=self.high).contains(v))
            .map(|v| (v, significant_short(v)))
            .collect()
    }
}

/// A tick's label with as many decimals as its step needs.
fn tick_label(value: f64, step: f64, largest: f64) -> String {
    let exponent = step.log10().floor() as i32;
    let text = if largest >= 1e6 {
        let millions = (-exponent + 6).clamp(0, 3) as usize;
        format!("{:.millions$}M", value / 1e6)
    } else if largest >= 2e4 && exponent >= 2 {
        let thousands = (-exponent + 3).clamp(0, 3) as usize;
        format!("{:.thousands$}k", value / 1e3)
    } else if exponent < -5 {
        format!("{value:.1e}")
    } else {
        let decimals = (-exponent).max(0) as usize;
        format!("{value:.decimals$}")
    };
    let zero = text.trim_matches(|c: char| "-.0Mk".contains(c)).is_empty();
    if zero {
        "0".to_owned()
    } else {
        text.replace('-', "\u{2212}")
    }
}

/// A framed area with an axis each way.
pub(super) struct Plot {
    pub x: Axis,
    pub y: Axis,
}

/// Which labels a plot carries.
#[derive(Clone, Copy)]
pub(super) struct Labels<'a> {
    /// Quantity and unit under the plot; with it come the ticks' labels.
    pub x: Option<&'a str>,
    /// Quantity and unit along the left side.
    pub y: Option<&'a str>,
    /// About the most ticks across.
    pub x_ticks: usize,
    /// About the most ticks up.
    pub y_ticks: usize,
}

impl Plot {
    fn corners(&self) -> ((f64, f64), (f64, f64)) {
        let (left, right) = self.x.pixels;
        let (bottom, top) = self.y.pixels;
        ((left, top), (right, bottom))
    }

    /// Grid, frame, ticks and labels.
    pub(super) fn draw_axes(&self, canvas: &mut Canvas<'_>, labels: Labels<'_>) {
        let widest = self.draw_grid(canvas, labels, true);
        let ((left, top), (_, bottom)) = self.corners();
        if let Some(text) = labels.y {
            let place = (left - 20.0 - widest, 0.5 * (top + bottom));
            let look = Type::new(LABEL_PX, INK, Align::Centre);
            canvas.text(text, place, look.turned());
        }
    }

    /// As [`Plot::draw_axes`], for a plot that shares the vertical axis of its neighbour to the left.
    pub(super) fn draw_inner(&self, canvas: &mut Canvas<'_>, labels: Labels<'_>) {
        self.draw_grid(canvas, labels, false);
    }

    /// Between powers of ten, lines that show how far apart the steps are.
    fn draw_minor(&self, canvas: &mut Canvas<'_>) {
        let ((left, top), (right, bottom)) = self.corners();
        for x in self.x.minor() {
            let x = self.x.at(x);
            canvas.line((x, top), (x, bottom), MINOR_GRID, 0.7);
        }
        for y in self.y.minor() {
            let y = self.y.at(y);
            canvas.line((left, y), (right, y), MINOR_GRID, 0.7);
        }
    }

    /// Returns the room that the labels of the vertical axis take (px).
    fn draw_grid(&self, canvas: &mut Canvas<'_>, labels: Labels<'_>, beside: bool) -> f64 {
        let ((left, top), (right, bottom)) = self.corners();
        self.draw_minor(canvas);
        let tick = |align| Type::new(TICK_PX, INK, align);
        for (value, label) in self.x.ticks(labels.x_ticks) {
            let x = self.x.at(value);
            canvas.line((x, top), (x, bottom), GRID, 0.8);
            if labels.x.is_some() {
                canvas.text(&label, (x, bottom + 13.0), tick(Align::Centre));
            }
        }
        let mut widest: f64 = 0.0;
        for (value, label) in self.y.ticks(labels.y_ticks) {
            let y = self.y.at(value);
            canvas.line((left, y), (right, y), GRID, 0.8);
            if beside {
                canvas.text(&label, (left - 7.0, y), tick(Align::Right));
                widest = widest.max(tick(Align::Right).width(&label));
            }
        }
        canvas.frame((left, top), (right, bottom), FRAME, 0.8);
        if let Some(text) = labels.x {
            let look = Type::new(LABEL_PX, INK, Align::Centre);
            canvas.text(text, (0.5 * (left + right), bottom + 34.0), look);
        }
        widest
    }

    /// A curve through points that may lie closer than pixels; gaps where either is not finite.
    pub(super) fn curve(
        &self,
        canvas: &mut Canvas<'_>,
        points: impl Iterator<Item = (f64, f64)>,
        colour: RGBColor,
        width_px: f64,
    ) {
        let mut run: Vec<(f64, f64)> = Vec::new();
        let mut flush = |run: &mut Vec<(f64, f64)>| {
            match run.as_slice() {
                [] => {}
                &[alone] => canvas.dot(alone, (1.6 * width_px).max(1.5), colour, 1.0),
                several => canvas.path(thin_out(several), colour, width_px),
            }
            run.clear();
        };
        for (x, y) in points {
            let drawable = !self.y.log || y > 0.0;
            let at = (self.x.at(x), self.y.at(y));
            if drawable && at.0.is_finite() && at.1.is_finite() {
                run.push(at);
            } else {
                flush(&mut run);
            }
        }
        flush(&mut run);
    }
}

/// Keeps the lowest and highest point of every pixel column, and the ends: what the eye can see of
/// a long record, at a size that does not grow with it.
fn thin_out(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut kept: Vec<(f64, f64)> = points.first().copied().into_iter().collect();
    for column in points.chunk_by(|a, b| a.0.floor() == b.0.floor()) {
        if column.len() <= 2 {
            kept.extend_from_slice(column);
            continue;
        }
        let mut low = 0;
        let mut high = 0;
        for (i, point) in column.iter().enumerate() {
            if point.1 < column[low].1 {
                low = i;
            }
            if point.1 > column[high].1 {
                high = i;
            }
        }
        kept.push(column[low.min(high)]);
        if low != high {
            kept.push(column[low.max(high)]);
        }
    }
    kept.extend(points.last());
    kept.dedup();
    kept
}

/// Pixels before a legend's name for its line and the gap to the name before.
const LEGEND_LINE_PX: f64 = 48.0;

/// Entries of a legend in rows that are no wider than this, one to a row at the least.
pub(super) fn legend_rows<'a, 'b>(
    entries: &'a [(&'b str, RGBColor, f64)],
    width: f64,
) -> Vec<&'a [(&'b str, RGBColor, f64)]> {
    let look = Type::new(TICK_PX + 1.0, INK, Align::Left);
    let (mut rows, mut from, mut filled) = (Vec::new(), 0, 0.0);
    for (i, (name, ..)) in entries.iter().enumerate() {
        let wide = look.width(name) + LEGEND_LINE_PX;
        if i > from && filled + wide > width {
            rows.push(&entries[from..i]);
            (from, filled) = (i, 0.0);
        }
        filled += wide;
    }
    rows.extend((from < entries.len()).then(|| &entries[from..]));
    rows
}

/// A row of coloured names at the right of a figure's title line.
pub(super) fn draw_legend(canvas: &mut Canvas<'_>, entries: &[(&str, RGBColor, f64)], right: f64, y: f64) {
    let look = Type::new(TICK_PX + 1.0, INK, Align::Left);
    let mut x = right;
    for &(name, colour, width_px) in entries.iter().rev() {
        x -= look.width(name);
        canvas.text(name, (x, y), look);
        canvas.line((x - 30.0, y), (x - 8.0, y), colour, width_px);
        x -= LEGEND_LINE_PX;
    }
}
