//! A car as its file has it: TOML with units in the keys, and `.tir` files for the tyres.

use super::chassis::Chassis;
use super::facts::CarFacts;
use super::hybrid::Hybrid;
use super::model::CarModel;
use super::parameters::ParameterInfo;
use super::powertrain::Powertrain;
use super::reached::Reached;
use super::tyre::{AxleTyre, LinearTyre, MagicFormula, TyreCoefficients, TyreFile, TyreModel};
use crate::config::settings::Settings;
use crate::config::{Document, Table, folder_of, read_text};
use crate::error::{Error, Result};
use crate::files::write_whole;
use std::path::Path;

/// The tyres of both axles.
#[derive(Clone, Debug, PartialEq)]
pub enum Tyres {
    /// Magic Formula 5.2 tyres, front and rear.
    MagicFormula {
        /// The front tyre's file.
        front: Box<TyreFile>,
        /// The rear tyre's file.
        rear: Box<TyreFile>,
    },
    /// Linear tyres, front and rear.
    Linear {
        /// The front tyre.
        front: LinearTyre<f64>,
        /// The rear tyre.
        rear: LinearTyre<f64>,
    },
}

impl Tyres {
    /// Whether the right tyres are the mirror image of the left ones. Tyres that do not say on which side they were measured run as
    /// measured on both.
    pub fn are_mirrored(&self) -> bool {
        match self {
            Self::MagicFormula { front, rear } => [front, rear]
                .iter()
                .all(|tyre| tyre.coefficients.tyre_side != 0.0),
            Self::Linear { .. } => true,
        }
    }
}

/// Greatest steering rate at the road wheels of a car whose file says nothing of it (rad/s): 40 deg/s, which are 560 deg/s at a steering
/// wheel with a ratio of 14.
pub(super) const USUAL_STEER_RATE_RADPS: f64 = 0.698_131_700_797_731_8;

/// A car.
#[derive(Clone, Debug, PartialEq)]
pub struct Car {
    /// Its name.
    pub name: String,
    /// Body, wheels and air.
    pub chassis: Chassis<f64>,
    /// Tyres.
    pub tyres: Tyres,
    /// Steering-wheel angle per road-wheel angle.
    pub steering_ratio: f64,
    /// The greatest road-wheel angle, rad.
    pub max_steer_rad: f64,
    /// Greatest steering rate at the road wheels (rad/s).
    pub max_steer_rate_radps: f64,
    /// Engine and gears, if the car has them.
    pub powertrain: Option<Powertrain>,
    /// Motor-generators and store, where there are any.
    pub hybrid: Option<Hybrid>,
    /// What the log reached that it was fitted to, if it was.
    pub reached: Option<Reached>,
}

/// A parameter that an identification may free: its name, and where it stands in the car's flat form.
#[derive(Clone, Debug, PartialEq)]
pub struct CarParameter {
    /// The name: a chassis key, a tyre coefficient of both axles (`rBx1`), or of one (`front.rBx1`).
    pub name: String,
    /// Unit, bounds and meaning.
    pub info: ParameterInfo,
    /// The places in the flat form that it sets.
    pub slots: Vec<usize>,
}

/// Names that the literature uses for two chassis parameters.
const ALIASES: [(&str, &str); 2] = [
    ("K", "roll_stiffness_nm_per_rad"),
    ("C", "roll_damping_nms_per_rad"),
];

/// Likeness (Jaro-Winkler, 1 for equal names) above which a name is suggested. One wrong letter in four gives 0.85. The same few
/// letters in another order give less than 0.8.
const LIKE: f64 = 0.8;
/// Most names that are suggested.
const SUGGESTED: usize = 3;

const BUNDLED_HYBRID: &str = include_str!("../../data/cars/gt_hybrid.toml");

impl Car {
    /// The bundled GT car's file.
    pub const BUNDLED_TOML: &str = include_str!("../../data/cars/gt.toml");
    /// The tyre file that it names.
    pub const BUNDLED_TYRE: &str = include_str!("../../data/cars/gt_slick.tir");

    /// The bundled GT car (the book, chapter Model, section 8).
    ///
    /// # Errors
    /// None in practice: those of [`Car::parse`] for a file that is part of the program.
    pub fn bundled() -> Result<Self> {
        Self::parse(Path::new("the bundled car gt.toml"), Self::BUNDLED_TOML, |name| {
            TyreFile::parse(Path::new(name), Self::BUNDLED_TYRE)
        })
    }

    /// The bundled GT car with its engine map and a hybrid drive.
    ///
    /// # Errors
    /// None in practice: those of [`Car::parse`] for a file that is part of the program.
    pub fn bundled_hybrid() -> Result<Self> {
        Self::parse(
            Path::new("the bundled car gt_hybrid.toml"),
            BUNDLED_HYBRID,
            |name| TyreFile::parse(Path::new(name), Self::BUNDLED_TYRE),
        )
    }

    /// A bundled car by name (`gt`, `gt_hybrid`), or a car file; tyre files are looked for beside it.
    ///
    /// # Errors
    /// [`Error::Io`] if a file cannot be read; [`Error::Input`] naming file and key for what it must not hold.
    pub fn load(name_or_path: &str) -> Result<Self> {
        match name_or_path {
            "gt" => return Self::bundled(),
            "gt_hybrid" => return Self::bundled_hybrid(),
            _ => {}
        }
        let path = Path::new(name_or_path);
        if path.extension().is_none() && !path.exists() {
            let expected = "a bundled car (gt, gt_hybrid) or a file";
            return Err(Error::input(name_or_path, "car", "no such file", expected));
        }
        let text = read_text(path)?;
        let folder = folder_of(path);
        Self::parse(path, &text, |name| TyreFile::read(&folder.join(name)))
    }

    /// Parses a car's TOML; `tyre` reads a tyre file that it names.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and field for anything missing, unknown or out of its range.
    pub fn parse(file: &Path, text: &str, tyre: impl Fn(&str) -> Result<TyreFile>) -> Result<Self> {
        let document = Document::parse(file, text)?;
        let root = document.root();
        let chassis_table = root.required_table("chassis")?;
        let flat = read_parameters(&chassis_table, Chassis::<f64>::PARAMETERS)?;
        let chassis = Chassis::from_flat(&flat);
        if chassis.drs_lift / 100.0 > 1.0 - chassis.pressure_centre {
            return Err(chassis_table.refuse(
                "drs_downforce_percent",
                "at most the rear axle's share of the downforce, 100 (1 - aero_balance_front)",
            ));
        }
        chassis_table.finish()?;

        let tyre_table = root.required_table("tyres")?;
        let tyres = read_tyres(&tyre_table, tyre)?;
        tyre_table.finish()?;

        let steering = root.required_table("steering")?;
        let powertrain = match root.table("powertrain")? {
            Some(table) => {
                let powertrain = Powertrain::from_table(&table)?;
                table.finish()?;
                Some(powertrain)
            }
            None => None,
        };
        let hybrid = match root.table("hybrid")? {
            Some(table) => {
                let hybrid = Hybrid::from_table(&table)?;
                table.finish()?;
                Some(hybrid)
            }
            None => None,
        };
        let reached = match root.table("reached")? {
            Some(table) => {
                let reached = Reached::read(&table)?;
                table.finish()?;
                Some(reached)
            }
            None => None,
        };
        if let Some(table) = root.table("asked")? {
            let facts = CarFacts::read_table(table, Path::new(""))?;
            facts.validate().map_err(|error| error.of_file(file))?;
        }
        let car = Self {
            name: root.name("name")?.unwrap_or("unnamed car").to_owned(),
            chassis,
            tyres,
            steering_ratio: steering.number("ratio", 0.1, 100.0, "")?.unwrap_or(1.0),
            max_steer_rad: steering
                .number("max_road_wheel_angle_rad", 0.01, 1.5, "rad")?
                .unwrap_or(0.5),
            max_steer_rate_radps: steering
                .number("max_road_wheel_rate_radps", 1e-3, 1e3, "rad/s")?
                .unwrap_or(USUAL_STEER_RATE_RADPS),
            powertrain,
            hybrid,
            reached,
        };
        steering.finish()?;
        root.finish()?;
        Ok(car)
    }

    /// Deceleration by rolling resistance (m/s^2).
    pub fn rolling_mps2(&self) -> f64 {
        let coefficient = self.powertrain.as_ref().map_or(0.0, |p| p.rolling_resistance);
        coefficient * self.chassis.gravity
    }

    /// Force of a hybrid's MGU-K at the wheels (N) at a speed (m/s) above zero, at its greatest power in the gear that the engine is in;
    /// none without the machine, and beyond the last engine speed.
    pub fn motor_n(&self, speed_mps: f64) -> Option<f64> {
        let (hybrid, powertrain) = self.hybrid.as_ref().zip(self.powertrain.as_ref())?;
        let gear = powertrain.gear(speed_mps, self.chassis.radius_rear)?;
        Some(hybrid.mgu_k.power_at(gear.engine_speed_rpm) * powertrain.efficiency / speed_mps)
    }

    /// Mass that the engine accelerates over that of the car; 1 without a powertrain.
    pub fn rotating_mass_factor(&self) -> f64 {
        self.powertrain.as_ref().map_or(1.0, |p| p.rotating_mass_factor)
    }

    /// Writes `<stem>.toml` and the tyre files it names into `folder`.
    ///
    /// # Errors
    /// [`Error::Io`] if a file cannot be written.
    pub fn write(&self, folder: &Path, stem: &str) -> Result<()> {
        self.write_with(folder, stem, "")
    }

    /// As [`Car::write`], with a comment of some lines at the head of the car's file.
    ///
    /// # Errors
    /// [`Error::Io`] if a file cannot be written.
    pub fn write_with(&self, folder: &Path, stem: &str, comment: &str) -> Result<()> {
        let comment: String = comment.lines().map(|line| format!("# {line}\n")).collect();
        let mut files = self.files(stem);
        if let Some((_, text)) = files.last_mut() {
            text.insert_str(0, &comment);
        }
        let mut files = files.into_iter();
        files.try_for_each(|(name, text)| write_whole(folder.join(name), text.as_bytes()))
    }

    /// The names and texts of the tyre files and, last, of `<stem>.toml`, which names them.
    pub fn files(&self, stem: &str) -> Vec<(String, String)> {
        let mut files = Vec::new();
        let mut text = format!("name = {}\n\n[chassis]\n", toml_string(&self.name));
        push_parameters(&mut text, Chassis::<f64>::PARAMETERS, &self.chassis.to_flat());
        match &self.tyres {
            Tyres::MagicFormula { front, rear } if front == rear => {
                let name = format!("{stem}.tir");
                text.push_str(&format!("\n[tyres]\nboth = \"{name}\"\n"));
                files.push((name, front.to_text()));
            }
            Tyres::MagicFormula { front, rear } => {
                text.push_str("\n[tyres]\n");
                for (axle, tyre) in [("front", front), ("rear", rear)] {
                    let name = format!("{stem}_{axle}.tir");
                    text.push_str(&format!("{axle} = \"{name}\"\n"));
                    files.push((name, tyre.to_text()));
                }
            }
            Tyres::Linear { front, rear } => {
                for (axle, tyre) in [("front", front), ("rear", rear)] {
                    text.push_str(&format!("\n[tyres.{axle}]\n"));
                    push_parameters(&mut text, LinearTyre::<f64>::PARAMETERS, &tyre.to_flat());
                }
            }
        }
        text.push_str(&format!(
            "\n[steering]\nratio = {:?}\nmax_road_wheel_angle_rad = {:?}\nmax_road_wheel_rate_radps = {:?}\n",
            self.steering_ratio, self.max_steer_rad, self.max_steer_rate_radps
        ));
        if let Some(powertrain) = &self.powertrain {
            text.push('\n');
            text.push_str(&powertrain.to_toml());
        }
        if let Some(hybrid) = &self.hybrid {
            text.push('\n');
            text.push_str(&hybrid.to_toml());
        }
        if let Some(reached) = &self.reached {
            text.push('\n');
            text.push_str(&reached.to_toml());
        }
        files.push((format!("{stem}.toml"), text));
        files
    }

    /// Which tyre model the car has.
    pub fn tyre_model(&self) -> TyreModel {
        match self.tyres {
            Tyres::MagicFormula { .. } => TyreModel::MagicFormula,
            Tyres::Linear { .. } => TyreModel::Linear,
        }
    }

    /// The left tyres of the front and the rear axle, with their camber.
    pub fn axle_tyres(&self) -> [AxleTyre; 2] {
        let flat = self.to_flat();
        match self.tyre_model() {
            TyreModel::MagicFormula => {
                let car = CarModel::<f64, MagicFormula<f64>>::from_parameters(&flat);
                car.tyres.map(|tyre| AxleTyre::MagicFormula(Box::new(tyre), 1.0))
            }
            TyreModel::Linear => {
                let car = CarModel::<f64, LinearTyre<f64>>::from_parameters(&flat);
                car.tyres.map(AxleTyre::Linear)
            }
        }
    }

    /// All parameters in a row: chassis, front tyre, rear tyre. Kernels read cars in this form.
    pub fn to_flat(&self) -> Vec<f64> {
        let (front, rear) = match &self.tyres {
            Tyres::MagicFormula { front, rear } => {
                (front.coefficients.to_flat(), rear.coefficients.to_flat())
            }
            Tyres::Linear { front, rear } => (front.to_flat(), rear.to_flat()),
        };
        [self.chassis.to_flat(), front, rear].concat()
    }

    /// This car with the parameters of a flat form; `flat` is as long as [`Car::to_flat`] gives.
    pub fn with_flat(&self, flat: &[f64]) -> Self {
        let chassis_count = Chassis::<f64>::PARAMETERS.len();
        let tyre_count = self.tyre_model().parameters().len();
        let (chassis, tyres) = flat.split_at(chassis_count);
        let (front_flat, rear_flat) = tyres.split_at(tyre_count);
        let mut car = self.clone();
        car.chassis = Chassis::from_flat(chassis);
        match &mut car.tyres {
            Tyres::MagicFormula { front, rear } => {
                front.coefficients = TyreCoefficients::from_flat(front_flat);
                rear.coefficients = TyreCoefficients::from_flat(rear_flat);
            }
            Tyres::Linear { front, rear } => {
                *front = LinearTyre::from_flat(front_flat);
                *rear = LinearTyre::from_flat(rear_flat);
            }
        }
        car
    }

    /// As [`Car::parameter`], for a name at `place` in `file`.
    ///
    /// # Errors
    /// [`Error::Input`] for an unknown name, with the most similar ones.
    pub fn known_parameter(&self, file: &str, place: &str, name: &str) -> Result<CarParameter> {
        self.parameter(name).ok_or_else(|| {
            let like = self.parameters_like(name);
            let expected = if like.is_empty() {
                "a chassis key, a tyre coefficient, or one axle's as in front.rBx1".to_owned()
            } else {
                format!(
                    "a chassis key or a tyre coefficient; perhaps {}",
                    like.join(" or ")
                )
            };
            Error::input(file, place, format!("the parameter `{name}`"), expected)
        })
    }

    /// Names of parameters that resemble `name`, the most similar first.
    fn parameters_like(&self, name: &str) -> Vec<String> {
        let (axle, key) = match name.split_once('.') {
            Some((axle @ ("front" | "rear"), key)) => (format!("{axle}."), key),
            _ => (String::new(), name),
        };
        let key = key.to_lowercase();
        let likeness = |known: &str| {
            let known = known.to_lowercase();
            let part = key.len() > 2 && (known.contains(&key) || known.len() > 2 && key.contains(&known));
            strsim::jaro_winkler(&key, &known) + if part { 1.0 } else { 0.0 }
        };
        let tyre = self.tyre_model().parameters().iter();
        let tyre = tyre.map(|p| (likeness(p.name), format!("{axle}{}", p.name)));
        let chassis = Chassis::<f64>::PARAMETERS.iter().map(|p| p.name);
        let whole = chassis.chain(ALIASES.iter().map(|(alias, _)| *alias));
        let mut like: Vec<(f64, String)> = whole
            .map(|name| (likeness(name), name.to_owned()))
            .chain(tyre)
            .filter(|(likeness, _)| *likeness > LIKE)
            .collect();
        like.sort_by(|a, b| b.0.total_cmp(&a.0));
        like.truncate(SUGGESTED);
        like.into_iter().map(|(_, name)| name).collect()
    }

    /// Looks a parameter up by name, regardless of case.
    ///
    /// A tyre parameter without axle (`rBx1`) sets both axles; `front.rBx1` and `rear.rBx1` set one.
    pub fn parameter(&self, name: &str) -> Option<CarParameter> {
        let chassis = Chassis::<f64>::PARAMETERS;
        let tyre = self.tyre_model().parameters();
        let wanted = ALIASES
            .iter()
            .find(|(alias, _)| *alias == name)
            .map_or(name, |(_, key)| key);
        let find = |table: &'static [ParameterInfo], key: &str| {
            table.iter().position(|p| p.name.eq_ignore_ascii_case(key))
        };
        if let Some(i) = find(chassis, wanted) {
            return Some(CarParameter {
                name: chassis[i].name.to_owned(),
                info: chassis[i],
                slots: vec![i],
            });
        }
        let (axle, key) = wanted.split_once('.').unwrap_or(("", wanted));
        let i = find(tyre, key)?;
        let front = chassis.len() + i;
        let rear = front + tyre.len();
        let (prefix, slots) = match axle {
            "" => ("", vec![front, rear]),
            "front" => ("front.", vec![front]),
            "rear" => ("rear.", vec![rear]),
            _ => return None,
        };
        Some(CarParameter {
            name: format!("{prefix}{}", tyre[i].name),
            info: tyre[i],
            slots,
        })
    }
}

fn read_parameters(table: &Table<'_>, parameters: &[ParameterInfo]) -> Result<Vec<f64>> {
    parameters
        .iter()
        .map(|p| match p.default {
            Some(default) => Ok(table
                .number(p.name, p.minimum, p.maximum, p.unit)?
                .unwrap_or(default)),
            None => table.required_number(p.name, p.minimum, p.maximum, p.unit),
        })
        .collect()
}

fn push_parameters(text: &mut String, parameters: &[ParameterInfo], values: &[f64]) {
    for (p, value) in parameters.iter().zip(values) {
        text.push_str(&format!("{} = {value:?} # {}\n", p.name, p.meaning));
    }
}

fn read_tyres(table: &Table<'_>, tyre: impl Fn(&str) -> Result<TyreFile>) -> Result<Tyres> {
    if let Some(name) = table.string("both")? {
        let file = Box::new(tyre(name)?);
        return Ok(Tyres::MagicFormula {
            front: file.clone(),
            rear: file,
        });
    }
    let linear = |axle: &str| -> Result<LinearTyre<f64>> {
        let axle_table = table.required_table(axle)?;
        let flat = read_parameters(&axle_table, LinearTyre::<f64>::PARAMETERS)?;
        axle_table.finish()?;
        Ok(LinearTyre::from_flat(&flat))
    };
    match (table.string("front"), table.string("rear")) {
        (Ok(Some(front)), Ok(Some(rear))) => Ok(Tyres::MagicFormula {
            front: Box::new(tyre(front)?),
            rear: Box::new(tyre(rear)?),
        }),
        (Err(_), Err(_)) => Ok(Tyres::Linear {
            front: linear("front")?,
            rear: linear("rear")?,
        }),
        _ => Err(table.refuse(
            "both",
            "`both = \"x.tir\"`, or `front` and `rear` as .tir files, or tables [tyres.front] and [tyres.rear] of linear tyres",
        )),
    }
}

fn toml_string(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}
