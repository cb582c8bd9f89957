//! Alias tables: draw one of n outcomes by its weight in constant time (Walker 1977; built in O(n) as by Vose 1991).

/// One bucket: keep this bucket's own outcome if u < `threshold`, else take `alias`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AliasEntry {
    /// In [0, 1].
    pub threshold: f32,
    /// The other outcome of this bucket.
    pub alias: u32,
    /// Probability of this bucket's own outcome over the whole table; exactly 0 if it is never drawn.
    pub pmf: f32,
}

/// Probabilities below this are taken for 0: they would be denormal in the table, which GPUs flush.
const MINIMUM_PMF: f64 = 1e-30;

/// The alias table of `weights` (each finite and not negative), computed in f64. If all are zero, all are equally likely,
/// so that no draw ever has probability 0.
pub fn build(weights: &[f64]) -> Vec<AliasEntry> {
    let n = weights.len();
    let total: f64 = weights.iter().sum();
    let mut pmf: Vec<f64> = if total > 0.0 {
        weights.iter().map(|w| w / total).map(|p| if p < MINIMUM_PMF { 0.0 } else { p }).collect()
    } else {
        vec![1.0 / n as f64; n]
    };
    let mut table: Vec<AliasEntry> =
        pmf.iter().zip(0..).map(|(&p, i)| AliasEntry { threshold: 1.0, alias: i, pmf: p as f32 }).collect();

    // Each light bucket is filled up to 1 from a heavy one.
    pmf.iter_mut().for_each(|p| *p *= n as f64);
    let mut scaled = pmf;
    let (mut light, mut heavy): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| scaled[i] < 1.0);
    while let (Some(&small), Some(&large)) = (light.last(), heavy.last()) {
        light.pop();
        table[small].threshold = scaled[small] as f32;
        table[small].alias = large as u32;
        scaled[large] -= 1.0 - scaled[small];
        if scaled[large] < 1.0 {
            heavy.pop();
            light.push(large);
        }
    }
    // What rounding leaves in `light` is 1 but for rounding. An outcome that must never be drawn cannot be among them
    // unless rounding ate the last heavy bucket; then it borrows from the most likely outcome.
    let likeliest = (0..n).max_by(|&a, &b| table[a].pmf.total_cmp(&table[b].pmf));
    for i in light {
        if let (true, Some(likeliest)) = (table[i].pmf == 0.0, likeliest) {
            table[i].threshold = 0.0;
            table[i].alias = likeliest as u32;
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::random::Random;

    /// The probability of each outcome when the table is drawn from.
    fn drawn(table: &[AliasEntry]) -> Vec<f64> {
        let mut p = vec![0.0; table.len()];
        for (i, entry) in table.iter().enumerate() {
            p[i] += f64::from(entry.threshold) / table.len() as f64;
            p[entry.alias as usize] += (1.0 - f64::from(entry.threshold)) / table.len() as f64;
        }
        p
    }

    fn check(weights: &[f64]) {
        let table = build(weights);
        let total: f64 = weights.iter().sum();
        let p = drawn(&table);
        for (i, (w, entry)) in weights.iter().zip(&table).enumerate() {
            assert!((p[i] - w / total).abs() < 1e-6, "{i}: {} for {}", p[i], w / total);
            assert!((f64::from(entry.pmf) - w / total).abs() < 1e-6);
            assert_eq!(*w == 0.0, p[i] == 0.0, "{i}");
            assert_eq!(*w == 0.0, entry.pmf == 0.0, "{i}");
        }
        assert!((table.iter().map(|e| f64::from(e.pmf)).sum::<f64>() - 1.0).abs() < 1e-6);
        // Sum of 1 / (p n) over draws is 1 if every outcome is possible: E[1 / (p n)] = sum over the support of 1 / n.
        let support = weights.iter().filter(|&&w| w > 0.0).count() as f64;
        let sum: f64 = p.iter().zip(&table).filter(|(p, _)| **p > 0.0).map(|(p, e)| p / f64::from(e.pmf)).sum();
        assert!((sum / support - 1.0).abs() < 1e-4, "{sum} of {support}");
    }

    #[test]
    fn reproduces_its_weights() {
        check(&[1.0]);
        check(&[1.0, 1.0, 1.0]);
        check(&[0.0, 3.0, 1.0, 0.0, 0.5]);
        check(&[1e-3, 1e3, 1.0]);
        let mut random = Random::new(5);
        let weights: Vec<f64> =
            (0..1001).map(|i| if i % 7 == 0 { 0.0 } else { f64::from(random.unit()).powi(4) * 100.0 + 1e-2 }).collect();
        check(&weights);
    }

    #[test]
    fn impossible_outcomes_stay_impossible() {
        for n in [3, 49, 1000, 10_007] {
            let weights: Vec<f64> = (0..n).map(|i| if i % 2 == 0 { 0.1 } else { 0.0 }).collect();
            for (w, p) in weights.iter().zip(drawn(&build(&weights))) {
                assert_eq!(*w == 0.0, p == 0.0);
            }
        }
    }

    #[test]
    fn nothing_and_all_zero() {
        assert!(build(&[]).is_empty());
        assert!(build(&[0.0, 0.0]).iter().all(|e| e.pmf == 0.5 && e.threshold == 1.0));
    }

    #[test]
    fn negligible_weights_are_never_drawn() {
        let table = build(&[1.0, 1e-40]);
        assert_eq!((table[1].pmf, table[1].threshold), (0.0, 0.0));
    }
}
