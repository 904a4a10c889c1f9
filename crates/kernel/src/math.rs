//! The float functions whose last bits differ between platforms, from `libm`.
//!
//! `+ - * /` and `sqrt` are correctly rounded on every platform and stay with std; `clippy.toml` bans all others,
//! which live here, so that a result has the same bits on every machine.

macro_rules! unary {
    ($($name:ident = $libm:ident, $meaning:literal;)*) => {$(
        #[doc = $meaning]
        #[inline]
        pub fn $name(x: f64) -> f64 {
            libm::$libm(x)
        }
    )*};
}

unary! {
    sin = sin, "Sine of an angle in radians.";
    cos = cos, "Cosine of an angle in radians.";
    tan = tan, "Tangent of an angle in radians.";
    asin = asin, "Angle in radians whose sine is `x`.";
    acos = acos, "Angle in radians whose cosine is `x`.";
    atan = atan, "Angle in radians whose tangent is `x`.";
    exp = exp, "e to the power `x`.";
    ln = log, "Natural logarithm.";
    log2 = log2, "Logarithm to base 2.";
    log10 = log10, "Logarithm to base 10.";
    erfc = erfc, "Complementary error function: 1 - erf.";
}

/// Sine and cosine of an angle in radians, for less than two separate calls cost.
#[inline]
pub fn sin_cos(x: f64) -> (f64, f64) {
    libm::sincos(x)
}

/// Angle in radians of the vector (`x`, `y`), in (-pi, pi].
#[inline]
pub fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// Length of the vector (`x`, `y`).
#[inline]
pub fn hypot(x: f64, y: f64) -> f64 {
    libm::hypot(x, y)
}

/// `x` to the power `y`; NaN for a negative `x` and a `y` with a fraction.
#[inline]
pub fn powf(x: f64, y: f64) -> f64 {
    libm::pow(x, y)
}

/// `angle_rad` brought into [-pi, pi).
#[inline]
pub fn wrap_angle(angle_rad: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    let shifted = (angle_rad + PI).rem_euclid(TAU);
    // rem_euclid may round up to the modulus itself, which is outside the range.
    if shifted >= TAU { -PI } else { shifted - PI }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn wrapping_keeps_the_direction_and_the_range() {
        for k in -20..20 {
            let angle_rad = f64::from(k) * 0.7;
            let wrapped = wrap_angle(angle_rad);
            assert!((-PI..PI).contains(&wrapped));
            assert!((sin(wrapped) - sin(angle_rad)).abs() < 1e-12);
        }
        assert_eq!(wrap_angle(PI), -PI);
    }

    #[test]
    fn bits_are_those_of_every_other_machine() {
        assert_eq!(sin(1.0).to_bits(), 0x3fea_ed54_8f09_0cee);
        assert_eq!(ln(3.0).to_bits(), 0x3ff1_93ea_7aad_030a);
        assert_eq!(exp(1.0).to_bits(), 0x4005_bf0a_8b14_576a);
    }
}
