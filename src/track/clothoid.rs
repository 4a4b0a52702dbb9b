//! Stretches whose curvature changes linearly.

use glam::DVec2;

/// Displacement (m) after travelling `length` (m) from a place with this heading (rad), curvature
/// (1/m) and slope of curvature (1/m^2). Gauss-Legendre with five points: for turns below half a
/// radian the error is below rounding.
pub(super) fn displacement(heading: f64, curvature: f64, slope: f64, length: f64) -> DVec2 {
    const NODES: [(f64, f64); 5] = [
        (0.046_910_077_030_668, 0.118_463_442_528_094_54),
        (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
        (0.5, 0.284_444_444_444_444_44),
        (0.769_234_655_052_841_5, 0.239_314_335_249_683_23),
        (0.953_089_922_969_332, 0.118_463_442_528_094_54),
    ];
    NODES
        .iter()
        .map(|&(node, weight)| {
            let s = node * length;
            weight * DVec2::from_angle(heading + s * (curvature + 0.5 * slope * s))
        })
        .sum::<DVec2>()
        * length
}
