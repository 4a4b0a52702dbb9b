//! GPX 1.0 and 1.1, and KML 2.2.

use super::super::relief::HEIGHTS_M;
use super::csv_columns::bounded;
use super::geographic::{self, Fix};
use super::{MOST_POINTS, Raw};
use crate::{Error, Place, Result};
use roxmltree::{Document, Node, ParsingOptions};
use std::path::Path;

/// Nodes of a document: a point with height, time and extensions has about twenty.
const MOST_NODES: u32 = 24 * MOST_POINTS as u32;

struct Reader<'a> {
    path: &'a Path,
    text: &'a str,
    fixes: Vec<Fix>,
    /// Heights (m) of the points that have one.
    heights: Vec<f64>,
    /// Byte of the text where each point stands.
    offsets: Vec<usize>,
}

/// Reads the one track, route or line of a document.
pub(super) fn read(text: &str, path: &Path) -> Result<Raw> {
    let options = ParsingOptions {
        allow_dtd: false,
        nodes_limit: MOST_NODES,
        ..ParsingOptions::default()
    };
    let document = Document::parse_with_options(text, options).map_err(|error| {
        let place = Place::line(error.pos().row as usize);
        Error::input(path, place, error.to_string(), "a GPX or KML document")
    })?;
    let mut reader = Reader {
        path,
        text,
        fixes: Vec::new(),
        heights: Vec::new(),
        offsets: Vec::new(),
    };
    let root = document.root_element();
    let name = match root.tag_name().name() {
        "gpx" => reader.gpx(root)?,
        "kml" => reader.kml(root)?,
        other => {
            return Err(Error::input(
                path,
                reader.place(root),
                format!("an element <{}>", other.escape_debug()),
                "<gpx> or <kml>",
            ));
        }
    };
    reader.finish(name)
}

/// Elements of a name in any namespace: real files declare many.
fn children<'a, 'i>(node: Node<'a, 'i>, name: &'static str) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(move |n| n.tag_name().name() == name)
}

fn name_of(node: Node<'_, '_>) -> Option<String> {
    let name = children(node, "name").next()?.text()?.trim();
    (!name.is_empty()).then(|| name.chars().take(80).collect())
}

impl Reader<'_> {
    fn line(&self, offset: usize) -> usize {
        let before = &self.text.as_bytes()[..offset.min(self.text.len())];
        1 + before.iter().filter(|&&b| b == b'\n').count()
    }

    fn place(&self, node: Node<'_, '_>) -> Place {
        Place::line(self.line(node.range().start))
    }

    fn push(&mut self, node: Node<'_, '_>, offset: usize, latitude: &str, longitude: &str) -> Result<()> {
        bounded(self.path, || self.place(node), self.fixes.len())?;
        let degrees = |text: &str, most: f64| {
            let parsed = text.trim().parse::<f64>();
            parsed.ok().filter(|x| x.abs() <= most).ok_or_else(|| {
                Error::input(
                    self.path,
                    Place::line(self.line(offset)),
                    format!("`{}`", text.chars().take(40).collect::<String>().escape_debug()),
                    format!("degrees from -{most} to {most}"),
                )
            })
        };
        self.fixes.push(Fix {
            latitude_deg: degrees(latitude, 90.0)?,
            longitude_deg: degrees(longitude, 180.0)?,
        });
        self.offsets.push(offset);
        Ok(())
    }

    /// The only element of a list, or an error if there is none or several.
    fn only<'a, 'i>(&self, mut found: Vec<Node<'a, 'i>>, what: &str) -> Result<Node<'a, 'i>> {
        match (found.pop(), found.len()) {
            (Some(one), 0) => Ok(one),
            (second, others) => {
                let place = second.map_or_else(|| "whole file".into(), |n| self.place(n));
                let count = others + usize::from(second.is_some());
                Err(Error::input(
                    self.path,
                    place,
                    format!("{count} of them"),
                    format!("exactly one {what} with points"),
                ))
            }
        }
    }

    fn gpx(&mut self, root: Node<'_, '_>) -> Result<Option<String>> {
        let points_of =
            |track: Node<'_, '_>| children(track, "trkseg").any(|s| children(s, "trkpt").next().is_some());
        let tracks: Vec<Node<'_, '_>> = children(root, "trk").filter(|t| points_of(*t)).collect();
        let routes = || children(root, "rte").filter(|r| children(*r, "rtept").next().is_some());
        if tracks.is_empty() {
            let route = self.only(routes().collect(), "trk or rte")?;
            children(route, "rtept").try_for_each(|p| self.gpx_point(p))?;
            return Ok(name_of(route));
        }
        let track = self.only(tracks, "trk")?;
        for segment in children(track, "trkseg") {
            children(segment, "trkpt").try_for_each(|p| self.gpx_point(p))?;
        }
        Ok(name_of(track))
    }

    fn gpx_point(&mut self, point: Node<'_, '_>) -> Result<()> {
        let degrees = |name: &str| point.attribute(name).unwrap_or_default();
        self.push(point, point.range().start, degrees("lat"), degrees("lon"))?;
        let height = children(point, "ele").next().and_then(|e| e.text());
        self.height(height.unwrap_or_default());
        Ok(())
    }

    fn kml(&mut self, root: Node<'_, '_>) -> Result<Option<String>> {
        let is_line = |n: &Node<'_, '_>| match n.tag_name().name() {
            "LineString" | "LinearRing" => children(*n, "coordinates").next().is_some(),
            "Track" => children(*n, "coord").next().is_some(),
            _ => false,
        };
        let line = self.only(
            root.descendants().filter(is_line).collect(),
            "LineString, LinearRing or gx:Track",
        )?;
        for node in children(line, "coordinates").chain(children(line, "coord")) {
            let tuples_have_commas = node.tag_name().name() == "coordinates";
            for inner in node.children().filter(|c| c.is_text()) {
                let start = inner.range().start;
                let text = inner.text().unwrap_or_default();
                if tuples_have_commas {
                    for tuple in text.split_ascii_whitespace() {
                        // Character references in the text shift this by their length, mostly within the same line.
                        let offset = start + (tuple.as_ptr() as usize).saturating_sub(text.as_ptr() as usize);
                        self.tuple(node, offset, tuple.split(','))?;
                    }
                } else {
                    self.tuple(node, start, text.split_ascii_whitespace())?;
                }
            }
        }
        let placemark = line.ancestors().find(|a| a.tag_name().name() == "Placemark");
        Ok(placemark.and_then(name_of))
    }

    fn tuple<'t>(
        &mut self,
        node: Node<'_, '_>,
        offset: usize,
        mut parts: impl Iterator<Item = &'t str>,
    ) -> Result<()> {
        let longitude = parts.next().unwrap_or_default();
        let latitude = parts.next().unwrap_or_default();
        self.push(node, offset, latitude, longitude)?;
        self.height(parts.next().unwrap_or_default());
        Ok(())
    }

    /// The height of the point that was read last, if it has one. Others cannot do without it.
    fn height(&mut self, text: &str) {
        let height = text.trim().parse::<f64>().ok();
        let (low, high) = HEIGHTS_M;
        self.heights
            .extend(height.filter(|height| (low..=high).contains(height)));
    }

    fn finish(self, name: Option<String>) -> Result<Raw> {
        // Points come in the order of the text, so lines are counted in one pass.
        let bytes = self.text.as_bytes();
        let (mut line, mut counted) = (1, 0);
        let lines: Vec<usize> = self
            .offsets
            .iter()
            .map(|&offset| {
                let to = offset.clamp(counted, bytes.len());
                line += bytes[counted..to].iter().filter(|&&b| b == b'\n').count();
                counted = to;
                line
            })
            .collect();
        let points = geographic::project(&self.fixes, self.path, &|i| super::place(&lines, i))?;
        Ok(Raw {
            points,
            lines,
            widths: None,
            name,
            z_m: if self.heights.len() == self.fixes.len() {
                self.heights
            } else {
                Vec::new()
            },
            bank_deg: Vec::new(),
            friction: Vec::new(),
        })
    }
}
