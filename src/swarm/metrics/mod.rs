//! How good a set of solutions is, all objectives minimised.
//!
//! A set is a slice of rows, one row of objectives per solution. Hypervolume takes its reference point from the
//! caller, always. The indicators that compare with a true front ([`igd_plus`], [`spread`], [`epsilon`]) mean
//! something only if the objectives are on one scale; [`Scale`] brings them there.
//!
//! References:
//! 1. Beume, Fonseca, López-Ibáñez, Paquete, Vahrenhold, *On the complexity of computing the hypervolume
//!    indicator*, IEEE TEC 13 (2009) (the sweep in three dimensions).
//! 2. Ishibuchi, Masuda, Tanigaki, Nojima, *Modified distance calculation in generational distance and inverted
//!    generational distance*, EMO 2015 (IGD+).
//! 3. Zhou, Jin, Zhang, Sendhoff, Tsang, *Combining model-based and genetics-based offspring generation for
//!    multi-objective optimization using a convergence criterion*, CEC 2006 (spread in any number of objectives).
//! 4. Zitzler, Thiele, Laumanns, Fonseca, Grunert da Fonseca, *Performance assessment of multiobjective
//!    optimizers*, IEEE TEC 7 (2003) (epsilon).
//! 5. Kung, Luccio, Preparata, *On finding the maxima of a set of vectors*, J. ACM 22 (1975).
//! 6. Zhang, Tian, Cheng, Jin, *An efficient approach to nondominated sorting for evolutionary multiobjective
//!    optimization*, IEEE TEC 19 (2015) (fronts by bisection).
//! 7. While, Bradstreet, Barone, *A fast way of calculating exact hypervolumes*, IEEE TEC 16 (2012) (four objectives and more).

mod boxes;
mod columns;
mod contribution;
mod hypervolume;
mod indicators;
mod non_dominated;
mod ranks;
mod significance;
mod staircase;
mod three;
mod within;

pub(super) use columns::Columns;
pub use contribution::contributions;
pub use hypervolume::{MOST_OBJECTIVES, hypervolume};
pub use indicators::{Scale, epsilon, igd_plus, nearest_to_ideal, spread};
pub(super) use non_dominated::dominates;
pub use non_dominated::non_dominated;
pub use ranks::ranks;
pub use significance::signed_rank;
pub(super) use staircase::Staircase;
pub(super) use within::{Asked, Within};
