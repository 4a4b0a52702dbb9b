//! Pictures of a car or of tyres: figures, a table of each, and one page.

use super::{CAR, Kind, TYRE, car, guess, tyres};
use lapswarm::files::write_together;
use lapswarm::report::{Curves, HtmlReport, Panel, Table};
use lapswarm::vehicle::Car;
use lapswarm::{Error, Result};
use std::path::{Path, PathBuf};

/// What is drawn.
pub enum Subject<'a> {
    /// The car of a file.
    Car(&'a Path),
    /// The tyres of one file or two.
    Tyres(&'a [PathBuf]),
}

impl<'a> Subject<'a> {
    /// What these files are, of the kind given or guessed.
    pub fn of(files: &'a [PathBuf], kind: Option<Kind>) -> Result<Self> {
        let kinds = files.iter().map(|path| kind.map_or_else(|| guess(path), Ok));
        let kinds = kinds.collect::<Result<Vec<Kind>>>()?;
        match kinds.as_slice() {
            [one] if one.is(&CAR) => Ok(Self::Car(&files[0])),
            all if all.len() <= 2 && all.iter().all(|one| one.is(&TYRE)) => Ok(Self::Tyres(files)),
            _ => {
                let found: Vec<String> = kinds.iter().map(|kind| kind.name()).collect();
                let expected = "one car, or one or two tyres, to draw";
                Err(Error::input(
                    "the command line",
                    "--draw",
                    found.join(", "),
                    expected,
                ))
            }
        }
    }

    /// Draws it into a folder, all or nothing, and says in words what is there.
    pub fn draw(&self, folder: &Path) -> Result<String> {
        let (mut page, charts, more) = match self {
            Self::Car(path) => car::drawn(path)?,
            Self::Tyres(files) => {
                let (page, charts) = tyres::drawn(files)?;
                (page, charts, None)
            }
        };
        write_together(folder, |within| {
            for chart in &charts {
                chart.write(&mut page, within)?;
            }
            if let Some(more) = &more {
                more.write(&mut page, within)?;
            }
            page.write(within.join("report.html"))
        })?;
        let told = more.map_or(String::new(), |more| more.told() + "\n");
        Ok(format!(
            "{told}pictures: {}",
            folder.join("report.html").display()
        ))
    }
}

/// Draws a bundled car into a folder, or its tyres, whose files are then there, too.
pub fn draw_bundled(name: &str, of_tyres: bool, folder: &Path) -> Result<()> {
    if !of_tyres {
        return Subject::Car(name.as_ref()).draw(folder).map(drop);
    }
    let car = Car::load(name)?;
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))?;
    car.write(folder, name)?;
    let names = car.files(name).into_iter().map(|(name, _)| folder.join(name));
    let tyres: Vec<PathBuf> = names
        .filter(|path| path.extension().is_some_and(|e| e == "tir"))
        .collect();
    Subject::Tyres(&tyres).draw(folder).map(drop)
}

/// How a line is drawn.
#[derive(Clone, Copy)]
pub enum Look {
    /// In a colour of its own.
    Own,
    /// One of a family, at a place from 0 to 1 among them.
    Family(f64),
    /// Points that nothing joins.
    Dots,
}

/// A line of a chart.
pub struct Line {
    name: String,
    /// Whether the legend has it.
    named: bool,
    look: Look,
    points: Vec<(f64, f64)>,
}

impl Line {
    /// A line through points.
    pub fn new(name: impl Into<String>, look: Look, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self {
            name: name.into(),
            named: true,
            look,
            points: points.into_iter().collect(),
        }
    }

    /// The same, which the table names and the legend does not.
    pub fn unlisted(self) -> Self {
        Self { named: false, ..self }
    }
}

/// Lines over one quantity, in panels beside each other that share a vertical range: a figure, and the same as a table.
pub struct Chart {
    /// Names of its files, without the ending.
    pub file: &'static str,
    /// Its heading.
    pub title: &'static str,
    /// What is to be seen in it.
    pub about: String,
    /// The horizontal and the vertical quantity, with their units.
    pub axes: [(&'static str, &'static str); 2],
    /// What the table calls panels and lines.
    pub of: [&'static str; 2],
    /// The panels.
    pub panels: Vec<(String, Vec<Line>)>,
}

impl Chart {
    fn figure(&self) -> Curves {
        let lines = self.panels.iter().flat_map(|(_, lines)| lines);
        let heights = lines.flat_map(|line| line.points.iter().map(|p| p.1));
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| {
            (low.min(y), high.max(y))
        });
        // Ends of a fifth of a decade: few digits on the axis.
        let unit = 0.2 * 10f64.powf((high - low).log10().floor());
        let (low, high) = ((low / unit).floor() * unit, (high / unit).ceil() * unit);
        let panels = self.panels.iter().map(|(title, lines)| {
            // A unit as axes write it.
            let raised = |unit: &str| unit.replace("^2", "\u{b2}");
            let [(x, x_unit), (y, y_unit)] = self.axes;
            let panel = Panel::new(title).x(x, &raised(x_unit)).y(y, &raised(y_unit));
            let panel = match self.panels.len() {
                1 => panel,
                _ => panel.shown(low, high),
            };
            lines.iter().fold(panel, |panel, line| {
                let label = if line.named { line.name.as_str() } else { "" };
                let points = line.points.iter().copied();
                match line.look {
                    Look::Own => panel.points(label, points),
                    Look::Family(place) => {
                        let (x, y): (Vec<f64>, Vec<f64>) = points.unzip();
                        // The last of the scale's colours are too faint for a line.
                        panel.shaded(0.85 * place, label, &x, &y)
                    }
                    Look::Dots => panel.dots(label, points),
                }
            })
        });
        Curves::new(self.title, panels)
    }

    fn table(&self) -> Table<'static> {
        let rows = self.panels.iter().flat_map(|(panel, lines)| {
            let of_line = move |line| (panel, line);
            let points = |(panel, line): (_, &'_ Line)| -> Vec<(String, String, f64, f64)> {
                let row = |&(x, y): &(f64, f64)| (String::clone(panel), line.name.clone(), x, y);
                line.points.iter().map(row).collect()
            };
            lines.iter().map(of_line).flat_map(points)
        });
        let [(x, x_unit), (y, y_unit)] = self.axes;
        Table::rows(rows)
            .text(self.of[0], |row| row.0.clone())
            .text(self.of[1], |row| row.1.clone())
            .number(x, x_unit, |row| row.2)
            .number(y, y_unit, |row| row.3)
            .table()
    }

    /// Writes its files into a folder, and places it on a page.
    fn write(&self, page: &mut HtmlReport, folder: &Path) -> Result<()> {
        page.section(self.title, &self.about);
        page.figure(folder.join(format!("{}.svg", self.file)), &self.figure())?;
        self.table().write_csv(folder.join(format!("{}.csv", self.file)))
    }
}
