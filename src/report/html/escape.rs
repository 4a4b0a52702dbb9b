//! Text from files on its way into a page.

use serde::{Serialize, Serializer};

/// Text as HTML shows it, between tags and in quoted attributes alike.
pub(super) fn html(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            // What HTML has no way to write, and what would end the page for some readers.
            c if c.is_control() && !matches!(c, '\n' | '\t') => safe.push(' '),
            c => safe.push(c),
        }
    }
    safe
}

/// Text with what stands between backticks as code.
pub(super) fn prose(text: &str) -> String {
    let safe = html(text);
    let parts: Vec<&str> = safe.split('`').collect();
    // An odd backtick is one.
    if parts.len().is_multiple_of(2) {
        return safe;
    }
    let told = parts.iter().enumerate().map(|(i, part)| match i % 2 {
        0 => (*part).to_owned(),
        _ => format!("<code>{part}</code>"),
    });
    told.collect()
}

/// A unit, or a label that ends in one, with its exponents raised, as in `m/s\u{b2}` for `m/s^2`; others as they are.
pub(in crate::report) fn raised(unit: &str) -> String {
    unit.replace("^2", "\u{b2}")
        .replace("^3", "\u{b3}")
        .replace("^4", "\u{2074}")
}

/// JSON that may stand inside a `<script>` element: no character in it can end the element, open a comment or break a
/// line of an old JavaScript engine. All of these stand inside strings only, where JSON lets them be written as numbers.
pub(super) fn json_in_script(json: &str) -> String {
    let mut safe = String::with_capacity(json.len());
    for c in json.chars() {
        match c {
            '<' | '>' | '&' | '\u{2028}' | '\u{2029}' => safe.push_str(&format!("\\u{:04x}", c as u32)),
            c => safe.push(c),
        }
    }
    safe
}

/// Numbers with as many digits as a chart can show; gaps are `null`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::report) struct Numbers(Vec<Option<f64>>);

/// Digits that a chart resolves, of a single number and of a range.
const DIGITS: i32 = 6;

impl Numbers {
    /// Keeps six figures of every number, and more where the range of all of them is small beside their size.
    pub fn new(values: impl IntoIterator<Item = f64>) -> Self {
        let values: Vec<f64> = values.into_iter().collect();
        let finite = || values.iter().copied().filter(|v| v.is_finite());
        let least = finite().fold(f64::INFINITY, f64::min);
        let range = finite().fold(f64::NEG_INFINITY, f64::max) - least;
        let decimals_for = |size: f64| DIGITS - 1 - size.log10().floor() as i32;
        let of_range = if range > 0.0 { decimals_for(range) } else { 0 };
        let round = |v: f64| {
            let decimals = of_range.max(if v == 0.0 { 0 } else { decimals_for(v.abs()) });
            // By way of text: products with powers of ten would leave tails of digits.
            let text = match usize::try_from(decimals) {
                Ok(decimals) if decimals < 300 => format!("{v:.decimals$}"),
                _ => format!("{v:.5e}"),
            };
            text.parse().unwrap_or(v)
        };
        let rounded = values.iter().map(|&v| v.is_finite().then(|| round(v)));
        Self(rounded.collect())
    }
}

impl Serialize for Numbers {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(|v| match v {
            // `12` is shorter than `12.0` and the same to JavaScript.
            Some(v) if v.fract() == 0.0 && v.abs() < 1e15 => serde_json::Value::from(*v as i64),
            Some(v) => serde_json::Value::from(*v),
            None => serde_json::Value::Null,
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn code_in_text_is_code_and_no_markup() {
        assert_eq!(
            prose("write `--log <F>` here"),
            "write <code>--log &lt;F&gt;</code> here"
        );
        assert_eq!(prose("a ` alone"), "a ` alone");
    }

    #[test]
    fn markup_in_text_stays_text() {
        assert_eq!(
            html("<b a=\"1\" c='2'>&\u{1b}"),
            "&lt;b a=&quot;1&quot; c=&#39;2&#39;&gt;&amp; "
        );
        let json = serde_json::to_string("</script><!-- & \u{2028}").unwrap();
        let safe = json_in_script(&json);
        assert!(!safe.contains(['<', '>', '&', '\u{2028}']), "{safe}");
        assert_eq!(
            serde_json::from_str::<String>(&safe).unwrap(),
            "</script><!-- & \u{2028}"
        );
    }

    #[test]
    fn numbers_keep_what_a_chart_can_show() {
        let json = |values: &[f64]| serde_json::to_string(&Numbers::new(values.iter().copied())).unwrap();
        assert_eq!(
            json(&[0.0, 1.0 / 3.0, f64::NAN, 2e-12]),
            "[0,0.333333,null,2e-12]"
        );
        // Eastings: a metre of range far from zero still has its micrometres.
        assert_eq!(json(&[500_000.123_456, 500_001.0]), "[500000.123456,500001]");
        assert_eq!(json(&[f64::INFINITY, 1e300]), "[null,1e+300]");
    }
}
