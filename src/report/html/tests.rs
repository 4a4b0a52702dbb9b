use super::*;
use crate::report::{BarPanel, Bars, Curves, Front, LapLine, LapView, Panel, Road, Scale};
use glam::DVec2;

const HOSTILE: &str = "<script>alert(1)</script><!-- & \"'\u{2028}";

/// A page with a hostile name everywhere that a name can stand.
fn hostile() -> HtmlReport {
    let mut page = HtmlReport::new(HOSTILE, HOSTILE);
    page.sentence(HOSTILE);
    page.tile(HOSTILE, HOSTILE, HOSTILE);
    page.warning(HOSTILE);
    page.section(HOSTILE, HOSTILE);
    page.paragraph(HOSTILE);
    let table = Table::new().texts(HOSTILE, [HOSTILE]);
    page.table(HOSTILE, HOSTILE, &table.numbers(HOSTILE, HOSTILE, vec![1.0]))
        .unwrap();
    let line = LapLine::new(HOSTILE, vec![0.0, 1.0])
        .trace(0, vec![1.0, 2.0])
        .at(vec![DVec2::ZERO, DVec2::X]);
    let view = LapView::new(HOSTILE)
        .note(HOSTILE)
        .x(HOSTILE, HOSTILE)
        .panel(HOSTILE, HOSTILE)
        .line(line)
        .sections([(HOSTILE.to_owned(), 0.0, 1.0)])
        .road(Road {
            names: vec![(HOSTILE.to_owned(), DVec2::ZERO)],
            ..Road::default()
        });
    page.place(&view).unwrap();
    let panel = Panel::new(HOSTILE)
        .x(HOSTILE, "")
        .y(HOSTILE, "")
        .scales(Scale::Linear, Scale::Log)
        .curve(HOSTILE, &[0.0], &[1.0]);
    page.place(&Curves::new(HOSTILE, [panel])).unwrap();
    let bars = BarPanel::new(HOSTILE, HOSTILE, [HOSTILE]).with_intervals(HOSTILE, [1.0], [[0.5, f64::NAN]]);
    page.place(&Bars::new(HOSTILE, [bars])).unwrap();
    page.provenance(HOSTILE, HOSTILE);
    page.settings(HOSTILE, HOSTILE);
    page
}

#[test]
fn no_text_from_a_file_becomes_markup() {
    let with = hostile().to_html().unwrap();
    let without = HtmlReport::new("raceline", "plain").to_html().unwrap();
    let count = |page: &str, what: &str| page.matches(what).count();
    // What a browser takes for elements is what the page itself has.
    assert_eq!(count(&with, "<script"), count(&without, "<script"));
    assert_eq!(count(&with, "</script"), count(&without, "</script"));
    assert_eq!(count(&with, "<!--"), count(&without, "<!--"));
    assert!(!with.contains("<script>alert"));
    assert!(!with.contains("\"'\u{2028}"));
    // The text is there all the same, in HTML and in the data.
    assert!(with.contains("&lt;script&gt;alert(1)&lt;/script&gt;"));
    let start = with.find("id=\"charts\">").unwrap() + "id=\"charts\">".len();
    let data = &with[start..start + with[start..].find("</script>").unwrap()];
    let data: serde_json::Value = serde_json::from_str(data).unwrap();
    assert_eq!(data[0]["lines"][0]["name"], HOSTILE);
    assert_eq!(data[1]["kind"], "curves");
    assert_eq!(data[2]["series"][0]["interval"][1], serde_json::json!([null]));
}

#[test]
fn a_page_shows_the_range_that_a_picture_shows() {
    let mut page = HtmlReport::new("check", "range");
    let panel = Panel::new("range").curve("", &[0.0, 1.0], &[2.0, 3.0]);
    page.place(&Curves::new("", [panel.clone(), panel.shown(-1.0, 4.0)]))
        .unwrap();
    assert_eq!(page.charts[0]["y_range"], serde_json::Value::Null);
    assert_eq!(page.charts[1]["y_range"], serde_json::json!([-1.0, 4.0]));
}

#[test]
fn the_page_is_whole_small_and_asks_for_nothing() {
    let mut page = HtmlReport::new("identify", "long lap");
    let n = 14_000;
    let x: Vec<f64> = (0..n).map(f64::from).collect();
    let wave: Vec<f64> = x.iter().map(|v| (v * 0.01).sin() + v * 1e-7).collect();
    let places: Vec<DVec2> = x.iter().map(|v| DVec2::new(*v, -v)).collect();
    let line = (0..8).fold(LapLine::new("measured", x).at(places), |line, k| {
        line.trace(k, &wave[..])
    });
    let view = LapView::new("Traces")
        .panels([("speed", "m/s"); 8])
        .lines(vec![line; 3])
        .road(Road::default());
    page.place(&view).unwrap();
    let html = page.to_html().unwrap();
    assert!(html.len() < 6_000_000, "{} bytes", html.len());
    assert!(html.contains("of up to 14000 samples"));
    assert!(html.contains("default-src &#39;none&#39;") || html.contains("default-src 'none'"));
    for fetched in ["src=\"http", "href=\"http://", "@import", "url(", "<link"] {
        // The library draws no such thing either; its one link is in the footer.
        let ours = html.replace(include_str!("vendor/echarts.min.js"), "");
        assert!(!ours.contains(fetched), "{fetched}");
    }
    assert_eq!(html.matches("<figure").count(), 1);
    assert!(html.ends_with("</html>\n"));
}

#[test]
fn lengths_that_differ_are_refused_by_name() {
    let mut page = HtmlReport::new("raceline", "odd");
    let line = LapLine::new("short", vec![0.0, 1.0]);
    let view = LapView::new("Odd traces");
    assert!(page.place(&view.clone().line(line.clone())).is_ok());
    let odd = view.line(line.at(vec![DVec2::ZERO]));
    let message = page.place(&odd).unwrap_err().to_string();
    assert!(message.contains("Odd traces, line short"), "{message}");
    let message = page.place(&Front::new("Odd front", &[])).unwrap_err().to_string();
    assert!(message.contains("Odd front"), "{message}");
    let bars = BarPanel::new("Odd bars", "share", [""; 0]);
    let message = page.place(&Bars::new("", [bars])).unwrap_err().to_string();
    assert!(message.contains("Odd bars"), "{message}");
}
