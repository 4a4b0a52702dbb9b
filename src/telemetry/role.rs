//! The roles of channels, and the usual names of loggers for them.

use serde::{Deserialize, Serialize};

use super::units::Quantity;

/// Usual names of the speed of a wheel, whose place is called so.
macro_rules! wheel_speeds {
    ($($place:literal),+) => {
        &[$(
            concat!("wheelspeed", $place, "radps"),
            concat!("wheelspeed", $place),
            concat!($place, "wheelspeed"),
            concat!("wheelspd", $place),
            concat!($place, "wheelspd"),
            concat!("whlspd", $place),
            concat!("wspeed", $place),
            concat!("wspd", $place),
            concat!("speed", $place),
            concat!($place, "speed"),
            concat!("ws", $place),
        )+]
    };
}

/// Names of a wheel, whose place is called so.
macro_rules! wheels {
    ($($place:literal),+) => {
        &[$(
            concat!("wheel", $place),
            concat!($place, "wheel"),
            concat!("omega", $place),
            concat!("v", $place),
        )+]
    };
}

/// The role of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Speed of the front left wheel.
    WheelSpeedFl,
    /// Speed of the front right wheel.
    WheelSpeedFr,
    /// Speed of the rear left wheel.
    WheelSpeedRl,
    /// Speed of the rear right wheel.
    WheelSpeedRr,
    /// Steering angle, at the road wheels or at the steering wheel.
    Steer,
    /// Speed over ground.
    Vx,
    /// Longitudinal acceleration.
    Ax,
    /// Lateral acceleration.
    Ay,
    /// Yaw rate.
    YawRate,
    /// Direction over ground, clockwise as a compass has it: what stands in for a yaw rate that is not logged.
    Heading,
    /// Distance travelled.
    Distance,
    /// Lap number.
    Lap,
    /// 1 where the lap was driven from line to line, 0 elsewhere (native files).
    LapComplete,
    /// Throttle position.
    Throttle,
    /// Brake pressure or position.
    Brake,
    /// How far the DRS is open, from 0 to 1.
    Drs,
    /// Latitude.
    Latitude,
    /// Longitude.
    Longitude,
    /// Position along one axis of a plane.
    X,
    /// Position along the other.
    Y,
}

impl Role {
    /// All roles.
    pub const ALL: [Self; 20] = [
        Self::WheelSpeedFl,
        Self::WheelSpeedFr,
        Self::WheelSpeedRl,
        Self::WheelSpeedRr,
        Self::Steer,
        Self::Vx,
        Self::Ax,
        Self::Ay,
        Self::YawRate,
        Self::Heading,
        Self::Distance,
        Self::Lap,
        Self::LapComplete,
        Self::Throttle,
        Self::Brake,
        Self::Drs,
        Self::Latitude,
        Self::Longitude,
        Self::X,
        Self::Y,
    ];
    /// The wheels' roles, FL FR RL RR.
    pub const WHEELS: [Self; 4] = [
        Self::WheelSpeedFl,
        Self::WheelSpeedFr,
        Self::WheelSpeedRl,
        Self::WheelSpeedRr,
    ];

    /// The role's key in a channel map.
    pub fn key(self) -> &'static str {
        match self {
            Self::WheelSpeedFl => "wheel_speed_fl",
            Self::WheelSpeedFr => "wheel_speed_fr",
            Self::WheelSpeedRl => "wheel_speed_rl",
            Self::WheelSpeedRr => "wheel_speed_rr",
            Self::Steer => "steer",
            Self::Vx => "vx",
            Self::Ax => "ax",
            Self::Ay => "ay",
            Self::YawRate => "yaw_rate",
            Self::Heading => "heading",
            Self::Distance => "distance",
            Self::Lap => "lap",
            Self::LapComplete => "lap_complete",
            Self::Throttle => "throttle",
            Self::Brake => "brake",
            Self::Drs => "drs",
            Self::Latitude => "latitude",
            Self::Longitude => "longitude",
            Self::X => "x",
            Self::Y => "y",
        }
    }

    /// The unit of its values in a log.
    pub(super) fn si_unit(self) -> &'static str {
        match self {
            Self::WheelSpeedFl
            | Self::WheelSpeedFr
            | Self::WheelSpeedRl
            | Self::WheelSpeedRr
            | Self::YawRate => "rad/s",
            Self::Steer | Self::Heading => "rad",
            Self::Vx => "m/s",
            Self::Ax | Self::Ay => "m/s^2",
            Self::Distance | Self::X | Self::Y => "m",
            Self::Lap
            | Self::LapComplete
            | Self::Throttle
            | Self::Brake
            | Self::Drs
            | Self::Latitude
            | Self::Longitude => "",
        }
    }

    /// Whether a log cannot do without it. Ground speed can be made of wheel speeds or positions and wheel speeds of ground speed,
    /// accelerations of speed and yaw rate, and that of the heading or of positions.
    pub fn required(self) -> bool {
        matches!(self, Self::Steer | Self::YawRate)
    }

    /// Whether it is part of the car's motion: what drives the model, or what the model is compared with.
    pub(super) fn of_motion(self) -> bool {
        !matches!(
            self,
            Self::Distance | Self::Lap | Self::LapComplete | Self::Throttle | Self::Brake | Self::Drs
        ) && !self.of_place()
    }

    /// Whether it is part of the car's place: what laps are found from where nothing tells of them.
    pub(super) fn of_place(self) -> bool {
        matches!(self, Self::Latitude | Self::Longitude | Self::X | Self::Y)
    }

    /// The quantities its channel may have; none where it is a plain number.
    pub fn quantities(self) -> &'static [Quantity] {
        match self {
            Self::WheelSpeedFl | Self::WheelSpeedFr | Self::WheelSpeedRl | Self::WheelSpeedRr => {
                &[Quantity::AngularSpeed, Quantity::Speed]
            }
            Self::Steer | Self::Heading => &[Quantity::Angle],
            Self::Vx => &[Quantity::Speed],
            Self::Ax | Self::Ay => &[Quantity::Acceleration],
            Self::YawRate => &[Quantity::AngularSpeed],
            Self::Distance => &[Quantity::Distance],
            Self::Throttle | Self::Brake => &[Quantity::Ratio, Quantity::Pressure],
            Self::Drs => &[Quantity::Ratio],
            Self::Lap | Self::LapComplete | Self::Latitude | Self::Longitude | Self::X | Self::Y => &[],
        }
    }

    /// Usual names, best first, in lower case and without anything but letters and digits: ours, then those of
    /// MoTeC, AiM, Racelogic, RaceChrono and iRacing.
    pub(super) fn usual_names(self) -> &'static [&'static str] {
        match self {
            Self::WheelSpeedFl => wheel_speeds!("fl", "lf", "frontleft", "leftfront"),
            Self::WheelSpeedFr => wheel_speeds!("fr", "rf", "frontright", "rightfront"),
            Self::WheelSpeedRl => wheel_speeds!("rl", "lr", "rearleft", "leftrear"),
            Self::WheelSpeedRr => wheel_speeds!("rr", "rearright", "rightrear"),
            Self::Steer => &[
                "steerrad",
                "steeredangle",
                "steerangle",
                "steeringangle",
                "steeringwheelangle",
                "steering",
                "steeringpos",
                "steerpos",
                "steeringposition",
                "steer",
                "steerwheelangle",
                "steeringwheel",
                "steeringtireangle",
                "steerwheel",
                "handwheelangle",
                "swa",
            ],
            Self::Vx => &[
                "vxmps",
                "groundspeed",
                "corrspeed",
                "vehiclespeed",
                "speedoverground",
                "velocitykmh",
                "velocity",
                "gpsspeed",
                "speed",
                "vx",
                "vcar",
                "carspeed",
            ],
            Self::Ax => &[
                "axmps2",
                "gforcelong",
                "gforcelongitudinal",
                "longacc",
                "longaccel",
                "longitudinalacceleration",
                "accelerationx",
                "inlineacc",
                "lonacc",
                "longitudinalacc",
                "accelerometerx",
                "gpslonacc",
                "glong",
                "ax",
                "longg",
                "glon",
                "accx",
                "accelx",
                "inlineg",
            ],
            Self::Ay => &[
                "aymps2",
                "gforcelat",
                "gforcelateral",
                "latacc",
                "lataccel",
                "lateralacceleration",
                "accelerationy",
                "lateralacc",
                "accelerometery",
                "gpslatacc",
                "glat",
                "ay",
                "latg",
                "accy",
                "accely",
                "lateralg",
            ],
            Self::YawRate => &[
                "yawrateradps",
                "gyroyawvelocity",
                "yawrate",
                "gyroyaw",
                "yawvelocity",
                "gyrozaxis",
                "rategyroz",
                "zrate",
                "zrateofrotation",
                "gpsgyro",
                "gyroz",
                "yawspeed",
            ],
            Self::Heading => &[
                "gpsheading",
                "heading",
                "gpscourse",
                "course",
                "courseoverground",
                "gpsbearing",
                "bearing",
                "cog",
            ],
            Self::Distance => &[
                "distancem",
                "lapdistance",
                "distance",
                "correcteddistance",
                "lapdist",
                "distanceonvehiclespeed",
                "distanceongpsspeed",
                "distancetraveled",
            ],
            Self::Lap => &["lap", "lapnumber", "lapnum", "lapno"],
            Self::LapComplete => &["lapcomplete"],
            Self::Throttle => &[
                "throttle",
                "throttlepos",
                "throttleposition",
                "throttlepedal",
                "pps",
                "tps",
            ],
            Self::Brake => &[
                "brake",
                "brakepos",
                "brakepresfront",
                "brakepressurefront",
                "brakepress",
                "brakepressure",
            ],
            Self::Drs => &["drs", "drsopen", "drsactive", "drsposition", "rearflap"],
            Self::Latitude => &["latitudedeg", "gpslatitude", "latitude", "gpslat", "lat"],
            Self::Longitude => &[
                "longitudedeg",
                "gpslongitude",
                "longitude",
                "gpslong",
                "gpslon",
                "long",
                "lon",
            ],
            Self::X => &["xm", "posx", "positionx", "xposition", "carposx", "x"],
            Self::Y => &["ym", "posy", "positiony", "yposition", "carposy", "y"],
        }
    }

    /// Names that are also given to other quantities, written as the usual ones: a channel of such a name plays the role only if
    /// its unit is one of the role's.
    pub(super) fn names_with_unit(self) -> &'static [&'static str] {
        match self {
            Self::WheelSpeedFl => wheels!("fl", "lf", "frontleft", "leftfront"),
            Self::WheelSpeedFr => wheels!("fr", "rf", "frontright", "rightfront"),
            Self::WheelSpeedRl => wheels!("rl", "lr", "rearleft", "leftrear"),
            Self::WheelSpeedRr => wheels!("rr", "rearright", "rightrear"),
            Self::Steer => &["handwheel", "roadwheelangle", "swangle"],
            Self::Vx => &[
                "vel",
                "velocityx",
                "longitudinalvelocity",
                "gpsvelocity",
                "v",
                "linearx",
            ],
            Self::Ax => &["longitudinal", "inline", "linearaccelerationx"],
            Self::Ay => &["lateral", "linearaccelerationy"],
            Self::YawRate => &[
                "yaw",
                "rotationz",
                "angularvelocityz",
                "omegaz",
                "wz",
                "angularz",
                "headingrate",
            ],
            _ => &[],
        }
    }

    /// A part of its names: a channel that has it in its name is found if the unit fits and there is no second one.
    pub(super) fn part_of_names(self) -> Option<&'static str> {
        match self {
            Self::Steer => Some("steer"),
            Self::YawRate => Some("yaw"),
            _ => None,
        }
    }
}
