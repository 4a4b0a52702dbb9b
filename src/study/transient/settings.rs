//! Settings of a drive.

use super::HEADING_GAINS;
use crate::config::kinds::{
    Kind, NameOrFile, choice, count, file, files, name_or_file, number, numbers, optional, text, texts,
};
use crate::config::settings::settings;
use crate::config::{Document, Table, folder_of, read_text};
use crate::error::{Error, Result};
use crate::evaluate::BackendChoice;
use crate::files::run_folder::SETTINGS;
use crate::line::energy::Mode;
use crate::study::framework::memory::{ANSWER, MemoryItem};
use crate::study::framework::setups::{FreeParameter, MOST_SETUPS, check_parameters, free_parameters};
use crate::study::framework::shared_settings::{adapter, envelope, seed, share, steering_rate_deg_s};
use crate::study::raceline::RacelineSettings;
use crate::vehicle::Car;
use std::path::{Path, PathBuf};

settings! {
    /// Settings of a drive.
    pub struct TransientSettings {
        line: Vec<PathBuf> ["-"] = Vec::new(), files().example("[\"line_fastest.csv\"]"),
            "The lines to drive, at least one: tables that raceline wrote, or any with columns x_m and y_m";
        track: Option<String> ["-"] = None, optional(name_or_file()).example("\"silverstone_gp\""),
            "The circuit, for its edges: a bundled name, a shape, or a file; without it that of the run in whose folder the line lies";
        car: String ["-"] = "gt".to_owned(), name_or_file(),
            "The car: a bundled name (gt) or a TOML file";
        envelope: Option<PathBuf> = envelope;
        car_width_m: Option<f64> ["m"] = None, optional(number(0.0, 10.0)).example("1.3"),
            "Width of the car, all of which stays within the edges; without it 2 m, or that of the run in whose folder the line lies where it is less";
        steering_rate_deg_s: Option<f64> = steering_rate_deg_s;
        grip_shares: Option<Vec<f64>> ["-"] = None, optional(numbers(0.05, 1.0)).example("[0.7, 0.8, 0.9]"),
            "Shares of the envelope's grip to drive with; without it from 0.3 on for one line alone and from 0.8 on for a population";
        deployment: Option<PathBuf> ["-"] = None, optional(file()).example("\"lap_swarm.csv\""),
            "A lap of the study hybrid on this line: its motor works there in the driven lap, which has accounts of energy";
        deployment_mode: Mode ["-"] = Mode::Additional, choice(),
            "Whether that motor adds to the engine or takes its place";
        setups: Option<usize> ["-"] = None, optional(count(0, MOST_SETUPS as u64)).example("63"),
            "Set-ups of the car to drive beside the car as it is";
        parameters: Vec<String> ["-"] = ["front_roll_moment_share", "aero_balance_front"].map(str::to_owned).to_vec(), texts(),
            "Parameters that set-ups move";
        share: f64 = share;
        seed: u64 = seed;
        backend: BackendChoice ["-"] = BackendChoice::Auto, choice().place(),
            "Where set-ups and several lines are driven; one line alone is driven in f64";
        adapter: Option<String> = adapter;
    }

    fn consistent(&self) -> Result<()> {
        let refuse = |place: &str, found: String, expected: &str| {
            Err(Error::input("the study", place, found, expected))
        };
        check_parameters(self.setups, &self.parameters)?;
        if self.grip_shares.as_ref().is_some_and(Vec::is_empty) {
            return refuse("grip_shares", "none".to_owned(), "at least one share");
        }
        Ok(())
    }
}

impl TransientSettings {
    /// Whether all set-ups on all lines are driven at once, and not one line alone.
    pub fn is_population(&self) -> bool {
        self.setups.is_some() || self.line.len() > 1
    }

    /// Shares of the envelope's grip to drive with, rising.
    pub fn shares(&self) -> Vec<f64> {
        let mut shares = self.grip_shares.clone().unwrap_or_else(|| {
            if self.is_population() {
                (0..21).map(|i| 0.8 + 0.01 * f64::from(i)).collect()
            } else {
                (0..71).map(|i| 1.0 - 0.01 * f64::from(i)).collect()
            }
        });
        shares.sort_by(f64::total_cmp);
        shares.dedup();
        shares
    }

    /// Laps to drive, at the most.
    pub fn laps(&self) -> usize {
        let drivers = if self.is_population() {
            1
        } else {
            HEADING_GAINS.len()
        };
        (self.setups.unwrap_or(0) + 1) * self.line.len().max(1) * self.shares().len() * drivers
    }

    /// What a population keeps in memory.
    pub(super) fn memory_items(&self) -> Vec<MemoryItem> {
        if !self.is_population() {
            return Vec::new();
        }
        let [lines, shares] = [self.line.len(), self.shares().len()].map(|n| n as u64);
        let variables = self.parameters.len() as u64 + 2;
        let each = (lines * shares).saturating_mul(ANSWER) + lines * 3 * 8 * variables;
        vec![MemoryItem::new("setups", self.setups.unwrap_or(0) + 1, each)]
    }

    /// Checks that there is a line, that one line alone is driven where it can be, and that there are set-ups for what is said of
    /// them.
    ///
    /// # Errors
    /// [`Error::Input`] naming the setting.
    pub(super) fn complete(&self) -> Result<()> {
        let refuse =
            |place: &str, found: &str, expected: &str| Err(Error::input("the study", place, found, expected));
        if self.line.is_empty() {
            return refuse("line", "none", "a line to drive");
        }
        let usual = Self::default();
        if self.setups.is_none() && (&self.parameters, self.share) != (&usual.parameters, usual.share) {
            return refuse("setups", "none", "how many set-ups move the parameters");
        }
        if self.is_population() && self.deployment.is_some() {
            let found = "several lines or set-ups";
            return refuse("deployment", found, "one line alone for a hybrid's lap");
        }
        let elsewhere = matches!(self.backend, BackendChoice::Simd | BackendChoice::Gpu);
        if !self.is_population() && (elsewhere || self.adapter.is_some()) {
            let expected = "cpu, or set-ups or several lines: one line is driven in f64 alone";
            return refuse("backend", "another one for one line and no set-ups", expected);
        }
        Ok(())
    }

    /// Reads the car, whose wheels turn as fast as is asked for.
    ///
    /// # Errors
    /// Those of [`Car::load`].
    pub fn read_car(&self) -> Result<Car> {
        let mut car = Car::load(&self.car)?;
        if let Some(rate_deg_s) = self.steering_rate_deg_s {
            car.max_steer_rate_radps = rate_deg_s.to_radians();
        }
        Ok(car)
    }

    /// What the circuit and the limits are set up from.
    ///
    /// # Errors
    /// Those of [`TransientSettings::track_of_lines`].
    pub(super) fn raceline(&self) -> Result<RacelineSettings> {
        Ok(RacelineSettings {
            track: match &self.track {
                Some(track) => track.clone(),
                None => self.track_of_lines()?,
            },
            car: self.car.clone(),
            envelope: self.envelope.clone(),
            car_width_m: self.width_m()?,
            steering_rate_deg_s: self.steering_rate_deg_s,
            ..RacelineSettings::default()
        })
    }

    /// The width of the car (m): where it is not given, the greatest of those that the lines were found for. A line that was found for
    /// more than the usual width is one with room for the driver.
    fn width_m(&self) -> Result<f64> {
        if let Some(width_m) = self.car_width_m {
            return Ok(width_m);
        }
        let widths = self.of_runs(|table, _| table.number("car_width_m", 0.0, 10.0, "m"))?;
        let unsaid = RacelineSettings::default().car_width_m;
        let known = widths.into_iter().map(|width| width.unwrap_or(unsaid));
        Ok(known.reduce(f64::max).map_or(unsaid, |width| width.min(unsaid)))
    }

    /// A setting of the runs that found the lines, line by line; nothing where none lies beside a line, or does not say.
    fn of_runs<T>(&self, read: impl Fn(&Table<'_>, &Path) -> Result<Option<T>>) -> Result<Vec<Option<T>>> {
        let of_run = |line: &PathBuf| {
            let folder = folder_of(line);
            let study = folder.join(SETTINGS);
            if !study.is_file() {
                return Ok(None);
            }
            let text = read_text(&study)?;
            let document = Document::parse(&study, &text)?;
            read(&document.root(), folder)
        };
        self.line.iter().map(of_run).collect()
    }

    /// The circuit of the runs that found the lines, by the settings beside them.
    ///
    /// # Errors
    /// [`Error::Input`] where a line has none, or two have different ones.
    fn track_of_lines(&self) -> Result<String> {
        let found = self.of_runs(|table, folder| NameOrFile.read(table, "track", "-", folder))?;
        let mut tracks = Vec::new();
        for (line, track) in self.line.iter().zip(found) {
            tracks.push(track.ok_or_else(|| {
                let found = format!("none, and no run beside {} that tells of one", line.display());
                Error::input("the study", "track", found, "the circuit that the lines are on")
            })?);
        }
        tracks.dedup();
        match &tracks[..] {
            [track] => Ok(track.clone()),
            _ => {
                let found = format!("lines of different circuits: {}", tracks.join(", "));
                Err(Error::input(
                    "the study",
                    "track",
                    found,
                    "the circuit that all lines are on",
                ))
            }
        }
    }

    /// Free parameters of `car` with their bounds; none without set-ups.
    ///
    /// # Errors
    /// [`Error::Input`] naming the parameter.
    pub(super) fn free(&self, car: &Car) -> Result<Vec<FreeParameter>> {
        if self.setups.unwrap_or(0) == 0 {
            return Ok(Vec::new());
        }
        free_parameters(car, &self.parameters, self.share)
    }
}
