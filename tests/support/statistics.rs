//! Pearson's chi-squared test, and what it needs.

/// Fewest expected counts in a bin; smaller bins are pooled (Cochran's rule).
const MINIMUM_EXPECTED: f64 = 5.0;

/// The probability that counts at least as far from `expected` as `observed` come from the expected distribution.
/// Bins with less than five expected counts are pooled; what is observed where nothing is expected gives 0.
pub fn chi_squared(observed: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(observed.len(), expected.len());
    let mut statistic = 0.0;
    let mut bins = 0;
    let mut pooled = (0.0, 0.0);
    let mut add = |o: f64, e: f64| {
        statistic += (o - e).powi(2) / e;
        bins += 1;
    };
    for (&o, &e) in observed.iter().zip(expected) {
        if e <= 0.0 {
            if o > 0.0 {
                return 0.0;
            }
            continue;
        }
        if e < MINIMUM_EXPECTED {
            pooled = (pooled.0 + o, pooled.1 + e);
            if pooled.1 >= MINIMUM_EXPECTED {
                add(pooled.0, pooled.1);
                pooled = (0.0, 0.0);
            }
        } else {
            add(o, e);
        }
    }
    // What is left of the pool is too little to be a bin of its own, but many counts there are still a surprise.
    if pooled.0 > 0.0 {
        add(pooled.0, pooled.1.max(1.0));
    }
    if bins < 2 {
        return 1.0;
    }
    upper_gamma(0.5 * f64::from(bins - 1), 0.5 * statistic)
}

/// The significance of one test such that `tests` of them together raise a false alarm with probability 0.001 (Šidák).
pub fn significance(tests: usize) -> f64 {
    1.0 - (1.0 - 0.001f64).powf(1.0 / tests as f64)
}

/// Regularised upper incomplete gamma function Q(a, x) (Press et al. 2007, Numerical Recipes, 6.2: the series below
/// a + 1, Lentz's continued fraction above).
pub fn upper_gamma(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let scale = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let mut term = 1.0 / a;
        let mut sum = term;
        for n in 1..10_000 {
            term *= x / (a + f64::from(n));
            sum += term;
            if term < sum * 1e-15 {
                break;
            }
        }
        return 1.0 - sum * scale;
    }
    let mut b = x + 1.0 - a;
    let mut c = 1e300;
    let mut d = 1.0 / b;
    let mut fraction = d;
    for n in 1..10_000 {
        let n = f64::from(n);
        b += 2.0;
        d = 1.0 / (n * (a - n) * d + b);
        c = b + n * (a - n) / c;
        fraction *= c * d;
        if (c * d - 1.0).abs() < 1e-15 {
            break;
        }
    }
    scale * fraction
}

/// Logarithm of the gamma function (Stirling's series, after shifting the argument above 10).
fn ln_gamma(x: f64) -> f64 {
    let mut shifted = x;
    let mut product = 1.0f64;
    while shifted < 10.0 {
        product *= shifted;
        shifted += 1.0;
    }
    let y = 1.0 / (shifted * shifted);
    let series = (1.0 / 12.0 - y * (1.0 / 360.0 - y * (1.0 / 1260.0 - y / 1680.0))) / shifted;
    (shifted - 0.5) * shifted.ln() - shifted + 0.5 * std::f64::consts::TAU.ln() + series - product.ln()
}
