//! Numbers as a person reads them.

/// Four digits that count; powers of ten where there would be many zeros.
pub fn short(value: f64) -> String {
    digits(value, 4)
}

/// `digits` digits that count.
pub fn digits(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    if value == 0.0 {
        return "0".into();
    }
    let scientific = format!("{value:.*e}", digits.saturating_sub(1));
    let exponent = exponent_of(&scientific);
    if (-3..6).contains(&exponent) {
        let places = (digits as i32 - 1 - exponent).max(0) as usize;
        return format!("{value:.places$}");
    }
    scientific
}

/// The same, or a dash for nothing.
pub fn or_dash(value: Option<f64>) -> String {
    value.map_or_else(|| "–".into(), short)
}

/// A mean and its spread, with as many places as the spread has two digits.
pub fn mean_and_spread(mean: f64, spread: f64) -> String {
    if !(spread > 0.0 && spread.is_finite()) {
        return short(mean);
    }
    let scientific = format!("{spread:.1e}");
    let exponent = exponent_of(&scientific);
    let larger = exponent_of(&format!("{mean:.1e}")).max(exponent);
    if (-4..6).contains(&larger) {
        let places = (1 - exponent).clamp(0, 8) as usize;
        return format!("{mean:.places$} ± {spread:.places$}");
    }
    let places = (larger - exponent + 1).clamp(0, 8) as usize;
    format!("{mean:.places$e} ± {spread:.1e}")
}

/// A power of ten as it stands at an axis: 10⁻³.
pub fn power_of_ten(exponent: i32) -> String {
    let digits = exponent.to_string();
    let raised = digits.chars().map(|c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32(0x2070 + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
    });
    "10".chars().chain(raised).collect()
}

fn exponent_of(scientific: &str) -> i32 {
    scientific.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_four_digits_that_count() {
        let cases = [
            (0.0034688, "0.003469"),
            (0.00034688, "3.469e-4"),
            (12.3456, "12.35"),
            (1e-7, "1.000e-7"),
            (99999.7, "100000"),
            (1234567.0, "1.235e6"),
            (0.0, "0"),
            (-1.5, "-1.500"),
            (f64::NAN, "–"),
        ];
        for (value, text) in cases {
            assert_eq!(short(value), text);
        }
    }

    #[test]
    fn a_spread_says_how_many_places_its_mean_has() {
        assert_eq!(mean_and_spread(29.8912, 5.863), "29.9 ± 5.9");
        assert_eq!(mean_and_spread(1001.3, 276.4), "1001 ± 276");
        assert_eq!(mean_and_spread(0.6519, 0.00213), "0.6519 ± 0.0021");
        assert_eq!(mean_and_spread(2.5e-7, 3.1e-8), "2.50e-7 ± 3.1e-8");
        assert_eq!(mean_and_spread(1.0, 0.0), "1.000");
    }

    #[test]
    fn powers_of_ten_are_raised() {
        assert_eq!(power_of_ten(-7), "10⁻⁷");
        assert_eq!(power_of_ten(12), "10¹²");
    }
}
