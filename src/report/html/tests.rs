use super::*;
use crate::report::{BarSeries, Curve};
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
    let names = [HOSTILE.to_owned()];
    let column = |cells| Column {
        name: HOSTILE,
        unit: HOSTILE,
        cells,
    };
    page.table(
        HOSTILE,
        HOSTILE,
        &[column(Cells::Texts(&names)), column(Cells::Numbers(&[1.0]))],
    )
    .unwrap();
    let line = LapLine {
        name: HOSTILE,
        x: vec![0.0, 1.0],
        traces: vec![LapTrace {
            panel: 0,
            values: vec![1.0, 2.0],
            band: None,
        }],
        place_m: vec![DVec2::ZERO, DVec2::X],
        wide: false,
    };
    page.lap(&LapView {
        title: HOSTILE,
        note: HOSTILE,
        x_label: HOSTILE,
        x_unit: HOSTILE,
        panels: vec![LapPanel {
            label: HOSTILE,
            unit: HOSTILE,
            height: 1.0,
        }],
        lines: vec![line],
        sections: vec![crate::report::ShadedSection {
            name: HOSTILE,
            start: 0.0,
            end: 1.0,
        }],
        map: Some(LapMap {
            names: vec![(HOSTILE, DVec2::ZERO)],
            ..LapMap::default()
        }),
    })
    .unwrap();
    let panel = CurvePanel {
        title: HOSTILE,
        x_label: HOSTILE,
        y_label: HOSTILE,
        curves: vec![Curve {
            label: HOSTILE,
            x: vec![0.0],
            y: vec![1.0],
            shade: None,
        }],
    };
    page.curves(&panel, HOSTILE, [Scale::Linear, Scale::Log]).unwrap();
    let bars = BarPanel {
        title: HOSTILE,
        x_label: HOSTILE,
        names: vec![HOSTILE],
        series: vec![BarSeries {
            label: HOSTILE,
            values: vec![1.0],
            intervals: vec![[0.5, f64::NAN]],
        }],
    };
    page.bars(&bars, HOSTILE).unwrap();
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
fn the_page_is_whole_small_and_asks_for_nothing() {
    let mut page = HtmlReport::new("identify", "long lap");
    let n = 14_000;
    let x: Vec<f64> = (0..n).map(f64::from).collect();
    let trace = |panel| LapTrace {
        panel,
        values: x.iter().map(|v| (v * 0.01).sin() + v * 1e-7).collect(),
        band: None,
    };
    let line = LapLine {
        name: "measured",
        x: x.clone(),
        traces: (0..8).map(trace).collect(),
        place_m: x.iter().map(|v| DVec2::new(*v, -v)).collect(),
        wide: false,
    };
    let panel = LapPanel {
        label: "speed",
        unit: "m/s",
        height: 1.0,
    };
    page.lap(&LapView {
        title: "Traces",
        x_label: "distance",
        x_unit: "m",
        panels: vec![panel; 8],
        lines: vec![line; 3],
        map: Some(LapMap::default()),
        ..LapView::default()
    })
    .unwrap();
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
    let view = LapView {
        title: "Odd traces",
        panels: vec![],
        lines: vec![LapLine {
            name: "short",
            x: vec![0.0, 1.0],
            ..LapLine::default()
        }],
        ..LapView::default()
    };
    assert!(page.lap(&view).is_ok());
    let mut odd = view.clone();
    odd.lines[0].place_m = vec![DVec2::ZERO];
    let message = page.lap(&odd).unwrap_err().to_string();
    assert!(message.contains("Odd traces, line short"), "{message}");
    let front = Front {
        title: "Odd front",
        objectives: vec![],
        ..Front::default()
    };
    assert!(page.front(&front).unwrap_err().to_string().contains("Odd front"));
    let bars = BarPanel {
        title: "Odd bars",
        x_label: "share",
        names: vec![],
        series: vec![],
    };
    assert!(page.bars(&bars, "").unwrap_err().to_string().contains("Odd bars"));
}
