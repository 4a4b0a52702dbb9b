//! The car: parameters, tyres, aero, loads, body, and all of it together.
//!
//! Axes are ISO 8855: x forward, y left, z up; yaw and steering positive to the left. Wheels are FL, FR, RL,
//! RR. Units are SI unless a name says otherwise.

pub mod aero;
pub mod brakes;
pub mod car;
pub mod chassis;
pub mod envelope;
pub mod facts;
pub mod hybrid;
pub mod limits;
pub mod loads;
pub mod masses;
pub mod model;
pub mod modes;
pub mod parameters;
pub mod powertrain;
pub mod reached;
pub mod steady;
pub mod traction;
pub mod tyre;
pub mod wheels;

pub use car::{Car, CarParameter, Tyres};
pub use chassis::Chassis;
pub use envelope::{BendTraction, Envelope, EnvelopeRow};
pub use facts::CarFacts;
pub use hybrid::Hybrid;
pub use masses::MassLimits;
pub use model::{CarInput, CarModel, CarRate, CarState};
pub use parameters::ParameterInfo;
pub use powertrain::Powertrain;
pub use reached::Reached;
pub use steady::{BendDrive, SteadyCar, Trim, Turn, steady_car};
pub use traction::Traction;
pub use tyre::{LinearTyre, MagicFormula, TyreCoefficients, TyreModel};
