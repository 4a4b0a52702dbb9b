//! Latitudes and longitudes on a local plane.

use crate::{Error, Place, Result};
use glam::{DVec2, DVec3};
use std::path::Path;

/// A place on the WGS 84 ellipsoid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fix {
    pub latitude_deg: f64,
    pub longitude_deg: f64,
}

/// Half the great axis of the WGS 84 ellipsoid (m) and its flattening.
const GREAT_AXIS_M: f64 = 6_378_137.0;
const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// Greatest distance from the middle (m) at which a plane is an accurate map: at 20 km it is 3 cm short.
const FURTHEST_M: f64 = 100_000.0;

impl Fix {
    /// Up, as the ellipsoid's normal.
    fn normal(self) -> DVec3 {
        let (sin, cos) = self.latitude_deg.to_radians().sin_cos();
        let (east, north) = self.longitude_deg.to_radians().sin_cos();
        DVec3::new(cos * north, cos * east, sin)
    }

    /// Earth-centred coordinates (m), at height zero.
    fn earth_centred(self) -> DVec3 {
        let up = self.normal();
        let squared_eccentricity = FLATTENING * (2.0 - FLATTENING);
        let across = GREAT_AXIS_M / (1.0 - squared_eccentricity * up.z * up.z).sqrt();
        DVec3::new(up.x, up.y, (1.0 - squared_eccentricity) * up.z) * across
    }
}

/// Places as distances east and north (m) on the plane that touches the ellipsoid at their middle. Heights are left
/// out: a road's slope makes it longer than its map by half the slope squared.
pub(super) fn project(fixes: &[Fix], path: &Path, place: &dyn Fn(usize) -> Place) -> Result<Vec<DVec2>> {
    let out_of_range = |f: &Fix| !(f.latitude_deg.abs() <= 90.0 && f.longitude_deg.abs() <= 180.0);
    if let Some(i) = fixes.iter().position(out_of_range) {
        return Err(Error::input(
            path,
            place(i),
            format!(
                "latitude {}, longitude {}",
                fixes[i].latitude_deg, fixes[i].longitude_deg
            ),
            "degrees from -90 to 90 and from -180 to 180",
        ));
    }
    // The mean of normals needs no special case at the date line.
    let up = fixes
        .iter()
        .map(|f| f.normal())
        .sum::<DVec3>()
        .normalize_or(DVec3::Z);
    let middle = Fix {
        latitude_deg: up.z.clamp(-1.0, 1.0).asin().to_degrees(),
        longitude_deg: up.y.atan2(up.x).to_degrees(),
    };
    let origin = middle.earth_centred();
    let sideways = DVec2::new(up.x, up.y).normalize_or(DVec2::X).perp();
    let east = DVec3::new(sideways.x, sideways.y, 0.0);
    let north = up.cross(east);
    let mut points = Vec::with_capacity(fixes.len());
    for (i, fix) in fixes.iter().enumerate() {
        let away = fix.earth_centred() - origin;
        if away.length() > FURTHEST_M {
            return Err(Error::input(
                path,
                place(i),
                format!(
                    "latitude {}, longitude {}: {:.0} km from the middle of the line",
                    fix.latitude_deg,
                    fix.longitude_deg,
                    1e-3 * away.length()
                ),
                format!("points within {:.0} km", 1e-3 * FURTHEST_M),
            ));
        }
        points.push(DVec2::new(away.dot(east), away.dot(north)));
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_on_the_ellipsoid() {
        // Lengths of a degree at latitude 52 on WGS 84: 111267.9 m of the meridian (Bowring's series at the middle),
        // 68677.6 m of the parallel; a hundredth of each is short enough for the plane.
        let fix = |latitude_deg, longitude_deg| Fix {
            latitude_deg,
            longitude_deg,
        };
        let fixes = [
            fix(51.995, -1.0),
            fix(52.005, -1.0),
            fix(52.0, -1.005),
            fix(52.0, -0.995),
        ];
        let points = project(&fixes, Path::new("a"), &Place::point).unwrap();
        let north = points[1] - points[0];
        let east = points[3] - points[2];
        assert!(
            (north.y - 1112.68).abs() < 0.02 && north.x.abs() < 0.01,
            "{north}"
        );
        assert!((east.x - 686.78).abs() < 0.02 && east.y.abs() < 0.01, "{east}");
    }

    #[test]
    fn the_date_line_is_no_gap_and_far_points_are_refused() {
        let fix = |longitude_deg| Fix {
            latitude_deg: -17.0,
            longitude_deg,
        };
        let points = project(&[fix(179.999), fix(-179.999)], Path::new("a"), &Place::point).unwrap();
        assert!(points[0].distance(points[1]) < 300.0);
        let far = project(&[fix(0.0), fix(0.0), fix(30.0)], Path::new("a"), &|i| {
            Place::point(i)
        });
        assert!(far.unwrap_err().to_string().contains("km from the middle"));
    }
}
