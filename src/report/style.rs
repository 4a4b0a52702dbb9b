//! The common look: colours, type sizes and number formats.

use plotters::style::RGBColor;

/// Fonts every viewer has one of, all of much the same width.
pub(super) const FONT: &str = "Helvetica, Arial, sans-serif";

pub(super) const TITLE_PX: f64 = 20.0;
pub(super) const LABEL_PX: f64 = 14.0;
pub(super) const TICK_PX: f64 = 12.0;

pub(super) const INK: RGBColor = RGBColor(34, 34, 34);
pub(super) const FAINT_INK: RGBColor = RGBColor(110, 110, 110);
pub(super) const GREYED: RGBColor = RGBColor(165, 165, 165);
pub(super) const GRID: RGBColor = RGBColor(228, 228, 228);
pub(super) const MINOR_GRID: RGBColor = RGBColor(243, 243, 243);
pub(super) const FRAME: RGBColor = RGBColor(150, 150, 150);
pub(super) const SHADE: RGBColor = RGBColor(238, 243, 248);
pub(super) const WHITE: RGBColor = RGBColor(255, 255, 255);

/// Okabe and Ito's palette, readable with any colour vision; yellow is left out, being too faint
/// for a line on white.
pub(super) const BLUE: RGBColor = RGBColor(0, 114, 178);
pub(super) const VERMILLION: RGBColor = RGBColor(213, 94, 0);
pub(super) const GREEN: RGBColor = RGBColor(0, 158, 115);
const ORANGE: RGBColor = RGBColor(230, 159, 0);
const PURPLE: RGBColor = RGBColor(204, 121, 167);
const SKY: RGBColor = RGBColor(86, 180, 233);
const BLACK: RGBColor = RGBColor(0, 0, 0);

/// The colour of the n-th series.
pub(super) fn series_colour(n: usize) -> RGBColor {
    const ORDER: [RGBColor; 7] = [BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY, BLACK];
    ORDER[n % ORDER.len()]
}

/// Viridis at a share of its range: even steps of the number look like even steps of the colour.
pub(super) fn viridis(share: f64) -> RGBColor {
    const STOPS: [[f64; 3]; 9] = [
        [68.0, 1.0, 84.0],
        [71.0, 44.0, 122.0],
        [59.0, 81.0, 139.0],
        [44.0, 113.0, 142.0],
        [33.0, 144.0, 141.0],
        [39.0, 173.0, 129.0],
        [92.0, 200.0, 99.0],
        [170.0, 220.0, 50.0],
        [253.0, 231.0, 37.0],
    ];
    let place = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let low = (place as usize).min(STOPS.len() - 2);
    let part = place - low as f64;
    let mix = |c: usize| (STOPS[low][c] + part * (STOPS[low + 1][c] - STOPS[low][c])) as u8;
    RGBColor(mix(0), mix(1), mix(2))
}

/// A number to so many significant figures, with a true minus sign and powers of ten where plain
/// digits would be long.
pub fn significant(x: f64, figures: usize) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    if !x.is_finite() {
        return "\u{2013}".to_owned();
    }
    // Formatting first settles which decade a number rounds into.
    let short = format!("{x:.*e}", figures.saturating_sub(1));
    let (digits, exponent) = match short.split_once('e') {
        Some((digits, e)) => (digits.to_owned(), e.parse::<i32>().unwrap_or(0)),
        None => (short, 0),
    };
    let text = if (-4..6).contains(&exponent) {
        let decimals = (figures as i32 - 1 - exponent).max(0) as usize;
        format!("{x:.decimals$}")
    } else {
        format!("{digits}\u{00d7}{}", power_of_ten(exponent))
    };
    text.replace('-', "\u{2212}")
}

/// As [`significant`], without zeros that only fill up the figures.
pub(super) fn trimmed(x: f64, figures: usize) -> String {
    let text = significant(x, figures);
    if text.contains('.') && !text.contains('\u{00d7}') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// A power of ten with a raised exponent.
pub(super) fn power_of_ten(exponent: i32) -> String {
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let raised: String = exponent
        .to_string()
        .chars()
        .map(|c| c.to_digit(10).map_or('⁻', |d| RAISED[d as usize]))
        .collect();
    format!("10{raised}")
}

/// A name with its unit in brackets, as axes carry it; quantities without a unit say `1`.
pub fn with_unit(name: &str, unit: &str) -> String {
    if unit.is_empty() {
        name.to_owned()
    } else {
        format!("{name} ({unit})")
    }
}

/// A positive number in as few characters as say it: `2000`, `0.05`, `20k`, `1.5M`.
pub(super) fn significant_short(x: f64) -> String {
    let (scaled, suffix) = match x {
        x if x >= 1e9 => (x / 1e9, "G"),
        x if x >= 1e6 => (x / 1e6, "M"),
        x if x >= 1e4 => (x / 1e3, "k"),
        x if x < 1e-3 => return significant(x, 2),
        x => (x, ""),
    };
    let digits = format!("{scaled:.4}");
    let digits = digits.trim_end_matches('0').trim_end_matches('.');
    format!("{digits}{suffix}")
}
