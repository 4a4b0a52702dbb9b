//! Drawing on an SVG of a given size, in pixels with fractions.

use std::path::Path;

use plotters::prelude::{DrawingBackend, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontStyle, FontTransform, IntoFont, RGBColor, ShapeStyle, TextStyle};

use super::style::{FONT, INK, TITLE_PX, WHITE};
use crate::files::write_whole;
use crate::{Error, Result};

/// plotters draws on whole pixels, which makes steps of gentle curves. Drawing ten times as large
/// and letting the viewer scale down gives tenths.
const FINENESS: f64 = 10.0;

/// plotters writes type 1.24 times smaller than asked.
const TYPE_SCALE: f64 = 1.24;

/// Where a text lies from its place.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Align {
    /// Beginning there.
    Left,
    /// Centred there.
    Centre,
    /// Ending there.
    Right,
}

/// How a text looks.
#[derive(Clone, Copy)]
pub(super) struct Type {
    pub size_px: f64,
    pub colour: RGBColor,
    pub align: Align,
    pub bold: bool,
    /// Reading upwards.
    pub turned: bool,
}

impl Type {
    pub(super) fn new(size_px: f64, colour: RGBColor, align: Align) -> Self {
        Self {
            size_px,
            colour,
            align,
            bold: false,
            turned: false,
        }
    }

    pub(super) fn bold(self) -> Self {
        Self { bold: true, ..self }
    }

    pub(super) fn turned(self) -> Self {
        Self { turned: true, ..self }
    }

    /// About how wide a text comes out (px), by the widths of Helvetica. Viewers may choose another
    /// font, so this errs on the wide side.
    pub(super) fn width(&self, text: &str) -> f64 {
        let em: f64 = text
            .chars()
            .map(|c| match c {
                'i' | 'j' | 'l' | 'I' | '.' | ',' | ':' | '\'' | '|' => 0.27,
                ' ' | 'f' | 't' | 'r' | '(' | ')' | '/' | '-' => 0.31,
                'm' | 'w' | 'M' | 'W' => 0.83,
                c if c.is_ascii_uppercase() => 0.70,
                _ => 0.56,
            })
            .sum();
        em * self.size_px * if self.bold { 1.12 } else { 1.05 }
    }
}

/// An SVG being drawn. Whatever goes wrong on the way is reported when it is saved.
pub(super) struct Canvas<'a> {
    backend: SVGBackend<'a>,
    failure: Option<String>,
}

fn fine(point: (f64, f64)) -> (i32, i32) {
    // A float-to-integer cast saturates, and a point that is not a number would land at 0.
    let whole = |x: f64| (x * FINENESS).round() as i32;
    (whole(point.0), whole(point.1))
}

fn stroke(colour: RGBColor, width_px: f64) -> ShapeStyle {
    ShapeStyle::from(&colour).stroke_width((width_px * FINENESS).round() as u32)
}

/// Draws a figure with its title and writes it to a file.
pub(super) fn draw_to_file(
    path: &Path,
    (width_px, height_px): (f64, f64),
    title: &str,
    draw: impl FnOnce(&mut Canvas<'_>),
) -> Result<()> {
    let mut svg = String::new();
    let size = fine((width_px, height_px));
    let size = (size.0.unsigned_abs(), size.1.unsigned_abs());
    let mut canvas = Canvas {
        backend: SVGBackend::with_string(&mut svg, size),
        failure: None,
    };
    canvas.rect((0.0, 0.0), (width_px, height_px), WHITE, 1.0);
    canvas.text(title, (24.0, 28.0), Type::new(TITLE_PX, INK, Align::Left).bold());
    draw(&mut canvas);
    let presented = canvas.backend.present().map_err(|e| e.to_string());
    canvas.keep(presented);
    let failure = canvas.failure.take();
    drop(canvas);
    if let Some(reason) = failure {
        return Err(Error::io(path, "draw", std::io::Error::other(reason)));
    }
    let large = format!("width=\"{}\" height=\"{}\"", size.0, size.1);
    let wanted = format!(
        "width=\"{width_px}\" height=\"{height_px}\" stroke-linejoin=\"round\" stroke-linecap=\"round\""
    );
    write_whole(path, svg.replacen(&large, &wanted, 1).as_bytes())
}

impl Canvas<'_> {
    fn keep(&mut self, result: Result<(), String>) {
        if let Err(reason) = result {
            self.failure.get_or_insert(reason);
        }
    }

    /// A filled rectangle.
    pub(super) fn rect(&mut self, a: (f64, f64), b: (f64, f64), colour: RGBColor, opacity: f64) {
        let style = ShapeStyle::from(&colour.mix(opacity)).filled();
        let drawn = self.backend.draw_rect(fine(a), fine(b), &style, true);
        self.keep(drawn.map_err(|e| e.to_string()));
    }

    /// The outline of a rectangle.
    pub(super) fn frame(&mut self, a: (f64, f64), b: (f64, f64), colour: RGBColor, width_px: f64) {
        // A rectangle's outline has no width in plotters' SVG; a closed path has.
        self.path([a, (b.0, a.1), b, (a.0, b.1), a], colour, width_px);
    }

    /// A straight line.
    pub(super) fn line(&mut self, a: (f64, f64), b: (f64, f64), colour: RGBColor, width_px: f64) {
        let style = stroke(colour, width_px);
        let drawn = self.backend.draw_line(fine(a), fine(b), &style);
        self.keep(drawn.map_err(|e| e.to_string()));
    }

    /// A line through points.
    pub(super) fn path(
        &mut self,
        points: impl IntoIterator<Item = (f64, f64)>,
        colour: RGBColor,
        width_px: f64,
    ) {
        let style = stroke(colour, width_px);
        let points: Vec<(i32, i32)> = points.into_iter().map(fine).collect();
        let drawn = self.backend.draw_path(points, &style);
        self.keep(drawn.map_err(|e| e.to_string()));
    }

    /// A filled polygon.
    pub(super) fn polygon(
        &mut self,
        points: impl IntoIterator<Item = (f64, f64)>,
        colour: RGBColor,
        opacity: f64,
    ) {
        let points: Vec<(i32, i32)> = points.into_iter().map(fine).collect();
        let style = ShapeStyle::from(&colour.mix(opacity)).filled();
        let drawn = self.backend.fill_polygon(points, &style);
        self.keep(drawn.map_err(|e| e.to_string()));
    }

    /// A filled dot.
    pub(super) fn dot(&mut self, at: (f64, f64), radius_px: f64, colour: RGBColor, opacity: f64) {
        let style = ShapeStyle::from(&colour.mix(opacity)).filled();
        let radius = (radius_px * FINENESS).round() as u32;
        let drawn = self.backend.draw_circle(fine(at), radius, &style, true);
        self.keep(drawn.map_err(|e| e.to_string()));
    }

    /// A circle.
    pub(super) fn ring(&mut self, at: (f64, f64), radius_px: f64, colour: RGBColor, width_px: f64) {
        let radius = (radius_px * FINENESS).round() as u32;
        let style = stroke(colour, width_px);
        let drawn = self.backend.draw_circle(fine(at), radius, &style, false);
        self.keep(drawn.map_err(|e| e.to_string()));
    }

    /// A text, centred on the height of its place.
    pub(super) fn text(&mut self, text: &str, at: (f64, f64), look: Type) {
        // plotters escapes markup, but control characters are not allowed in XML even escaped.
        let clean: String = text
            .chars()
            .map(|c| {
                let allowed = !c.is_control() && c != '\u{fffe}' && c != '\u{ffff}';
                if allowed { c } else { ' ' }
            })
            .collect();
        let weight = if look.bold {
            FontStyle::Bold
        } else {
            FontStyle::Normal
        };
        let mut font = (FONT, look.size_px * TYPE_SCALE * FINENESS)
            .into_font()
            .style(weight);
        if look.turned {
            font = font.transform(FontTransform::Rotate270);
        }
        let across = match look.align {
            Align::Left => HPos::Left,
            Align::Centre => HPos::Center,
            Align::Right => HPos::Right,
        };
        let style = TextStyle::from(font)
            .color(&look.colour)
            .pos(Pos::new(across, VPos::Center));
        let drawn = self.backend.draw_text(&clean, &style, fine(at));
        self.keep(drawn.map_err(|e| e.to_string()));
    }
}
