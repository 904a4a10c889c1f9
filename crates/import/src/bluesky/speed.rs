//! Speeds in the units of scenarios, and the true airspeeds that they stand for.

use sidestep_kernel::math;

/// A knot in m/s.
pub const KNOT_MPS: f64 = 1852.0 / 3600.0;

/// The international foot in m.
pub const FOOT_M: f64 = 0.3048;

const SEA_LEVEL_PRESSURE_PA: f64 = 101_325.0;
const GRAVITY_MPS2: f64 = 9.806_65;
const AIR_GAS_CONSTANT: f64 = 287.052_87;
/// Ratio of the heat capacities of air, by which impact pressure follows from the Mach number.
const HEAT_CAPACITY_RATIO: f64 = 1.4;

/// The speed of sound at sea level, in m/s.
const SEA_LEVEL_SOUND_MPS: f64 = 340.294;

/// Layers of the standard atmosphere: base in m, temperature at the base in K, its gradient in K/m.
/// The last one has no upper end.
const LAYERS: [(f64, f64, f64); 4] = [
    (0.0, 288.15, -0.0065),
    (11_000.0, 216.65, 0.0),
    (20_000.0, 216.65, 0.001),
    (32_000.0, 228.65, 0.0),
];

/// A speed through the air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Airspeed {
    /// Calibrated airspeed in kt: the true one at sea level that has the same impact pressure.
    CasKt(f64),
    /// Multiple of the speed of sound.
    Mach(f64),
}

impl Airspeed {
    /// Returns the true airspeed in m/s at a pressure altitude in ft, by the international standard
    /// atmosphere: exact below the speed of sound up to 32 km (105 000 ft), and above that with a
    /// constant temperature. Pitot tubes are treated as subsonic at every speed.
    pub fn true_airspeed_mps(self, altitude_ft: f64) -> f64 {
        let (temperature_k, pressure_pa) = standard_air(altitude_ft * FOOT_M);
        let sound_mps = (HEAT_CAPACITY_RATIO * AIR_GAS_CONSTANT * temperature_k).sqrt();
        match self {
            Self::Mach(mach) => mach * sound_mps,
            Self::CasKt(cas_kt) => {
                // The pressure that a pitot tube adds is the same at sea level and at altitude.
                let sea_level_mach = cas_kt * KNOT_MPS / SEA_LEVEL_SOUND_MPS;
                let impact_pa = SEA_LEVEL_PRESSURE_PA * impact_ratio(sea_level_mach);
                mach_from_ratio(impact_pa / pressure_pa) * sound_mps
            }
        }
    }
}

/// Returns the speed of sound at a pressure altitude in ft, in m/s.
pub(super) fn sound_mps(altitude_ft: f64) -> f64 {
    let (temperature_k, _) = standard_air(altitude_ft * FOOT_M);
    (HEAT_CAPACITY_RATIO * AIR_GAS_CONSTANT * temperature_k).sqrt()
}

/// Returns impact pressure over static pressure at a Mach number.
fn impact_ratio(mach: f64) -> f64 {
    math::powf(
        1.0 + 0.5 * (HEAT_CAPACITY_RATIO - 1.0) * mach * mach,
        HEAT_CAPACITY_RATIO / (HEAT_CAPACITY_RATIO - 1.0),
    ) - 1.0
}

/// Returns the Mach number at which impact pressure over static pressure is `ratio`.
fn mach_from_ratio(ratio: f64) -> f64 {
    (2.0 / (HEAT_CAPACITY_RATIO - 1.0)
        * (math::powf(1.0 + ratio, (HEAT_CAPACITY_RATIO - 1.0) / HEAT_CAPACITY_RATIO) - 1.0))
        .sqrt()
}

/// Returns temperature in K and pressure in Pa at a geopotential altitude in m.
fn standard_air(altitude_m: f64) -> (f64, f64) {
    let mut pressure_pa = SEA_LEVEL_PRESSURE_PA;
    for (i, &(base_m, base_k, gradient)) in LAYERS.iter().enumerate() {
        let top_m = LAYERS.get(i + 1).map_or(f64::INFINITY, |layer| layer.0);
        let rise_m = altitude_m.min(top_m) - base_m;
        let temperature_k = base_k + gradient * rise_m;
        pressure_pa *= if gradient == 0.0 {
            math::exp(-GRAVITY_MPS2 * rise_m / (AIR_GAS_CONSTANT * base_k))
        } else {
            let exponent = -GRAVITY_MPS2 / (gradient * AIR_GAS_CONSTANT);
            math::powf(temperature_k / base_k, exponent)
        };
        if altitude_m <= top_m {
            return (temperature_k, pressure_pa);
        }
    }
    unreachable!("the last layer has no top")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() < tolerance, "{a} is not {b}");
    }

    #[test]
    fn the_air_is_that_of_the_standards_tables() {
        for (altitude_m, temperature_k, pressure_pa) in [
            (0.0, 288.15, 101_325.0),
            (-100.0, 288.8, 102_532.0),
            (5_000.0, 255.65, 54_019.9),
            (11_000.0, 216.65, 22_632.1),
            (20_000.0, 216.65, 5_474.89),
            (32_000.0, 228.65, 868.02),
        ] {
            let (temperature, pressure) = standard_air(altitude_m);
            close(temperature, temperature_k, 1e-9);
            close(pressure, pressure_pa, pressure_pa * 1e-4);
        }
    }

    #[test]
    fn calibrated_is_true_airspeed_at_sea_level_and_slower_above() {
        close(Airspeed::CasKt(250.0).true_airspeed_mps(0.0), 250.0 * KNOT_MPS, 1e-3);
        // Found in tables of airspeeds: 400 kt at FL200 are 524 kt, Mach 0.8 at FL350 461 kt.
        close(Airspeed::CasKt(400.0).true_airspeed_mps(20_000.0) / KNOT_MPS, 524.37, 0.01);
        close(Airspeed::Mach(0.8).true_airspeed_mps(35_000.0) / KNOT_MPS, 461.1, 0.1);
        assert_eq!(Airspeed::CasKt(0.0).true_airspeed_mps(30_000.0), 0.0);
        for altitude_ft in [-10_000.0, 300_000.0] {
            assert!(Airspeed::CasKt(10_000.0).true_airspeed_mps(altitude_ft).is_finite());
        }
    }
}
