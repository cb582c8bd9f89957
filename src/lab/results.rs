//! What came of an experiment: means over runs with their standard errors.

use super::experiment::{Axis, Experiment, Metric};
use super::measure::Run;

/// Two-sided 95 % quantile of the normal distribution, for error bars.
pub const Z_95_TWO_SIDED: f64 = 1.96;

/// A mean over independent runs.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Mean {
    /// The mean.
    pub mean: f64,
    /// Its standard error; none for one run.
    pub error: Option<f64>,
}

impl Mean {
    /// Of these values; none for no values.
    pub fn of(values: &[f64]) -> Option<Self> {
        let n = values.len() as f64;
        if values.is_empty() {
            return None;
        }
        let mean = values.iter().sum::<f64>() / n;
        let error = (values.len() > 1)
            .then(|| (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt());
        Some(Mean { mean, error })
    }
}

/// The middle value (the mean of the two middle ones); zero for none.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    if n == 0 { 0.0 } else { 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]) }
}

/// All runs of one point.
#[derive(Debug, Clone)]
pub struct Point {
    /// Index of the scene.
    pub scene: usize,
    /// Name of the series.
    pub series: String,
    /// Value of the first sweep, if there is one.
    pub value: Option<String>,
    /// Whether frames were averaged.
    pub accumulate: bool,
    /// Judged frames.
    pub frames: Vec<u32>,
    /// One a seed.
    pub runs: Vec<Run>,
}

impl Point {
    /// A metric after a frame, over the runs.
    pub fn mean(&self, metric: Metric, frame: u32) -> Option<Mean> {
        let values: Vec<f64> = self.runs.iter().filter_map(|run| run.value(metric, frame)).collect();
        Mean::of(&values)
    }

    /// Milliseconds that the picture after a frame took: all frames where they are averaged; else one, for the frames
    /// before it had pictures of their own. Of all passes by GPU timestamps, or by the wall where the device has none.
    pub fn time(&self, frame: u32) -> f64 {
        let frames = if self.accumulate { frame } else { 1 };
        let one = self.mean(Metric::GpuMs, frame).or_else(|| self.mean(Metric::FrameMs, frame));
        f64::from(frames) * one.map_or(0.0, |mean| mean.mean)
    }

    /// The last judged frame.
    pub fn last_frame(&self) -> u32 {
        self.frames.last().copied().unwrap_or(1)
    }

    /// Its name in tables and under pictures.
    pub fn label(&self, experiment: &Experiment) -> String {
        let swept =
            experiment.sweeps.first().zip(self.value.as_ref()).map(|(sweep, value)| format!("{} = {value}", sweep.key));
        match (self.series.is_empty(), swept) {
            (false, Some(swept)) => format!("{}, {swept}", self.series),
            (true, Some(swept)) => swept,
            (_, None) => self.series.clone(),
        }
    }
}

/// One row of a table at equal time.
#[derive(Debug, Clone, PartialEq)]
pub struct EqualTimeRow {
    /// Name of the series that is compared.
    pub label: String,
    /// Its frame.
    pub frame: u32,
    /// Milliseconds that its picture took.
    pub time: f64,
    /// Its error.
    pub error: f64,
    /// The baseline's error after as long; none where the baseline was not measured so long or so short.
    pub baseline: Option<f64>,
}

/// The error of each picture beside the baseline's at the same time, for one scene.
pub fn equal_time(experiment: &Experiment, points: &[&Point], metric: Metric) -> Vec<EqualTimeRow> {
    let Some(equal) = &experiment.equal_time else { return Vec::new() };
    let mut rows = Vec::new();
    for point in points.iter().filter(|point| point.series != equal.baseline) {
        let baseline = points.iter().find(|other| other.series == equal.baseline && other.value == point.value);
        let curve: Vec<(f64, f64)> = baseline.map_or(Vec::new(), |baseline| {
            let at = |frame: &u32| Some((baseline.time(*frame), baseline.mean(metric, *frame)?.mean));
            baseline.frames.iter().filter_map(at).collect()
        });
        for &frame in &point.frames {
            if let Some(mean) = point.mean(metric, frame) {
                let time = point.time(frame);
                let baseline = interpolate(&curve, time);
                rows.push(EqualTimeRow { label: point.label(experiment), frame, time, error: mean.mean, baseline });
            }
        }
    }
    rows
}

/// A value between those of a rising curve, straight in logarithms, for errors fall by powers; none outside it.
fn interpolate(curve: &[(f64, f64)], x: f64) -> Option<f64> {
    curve.windows(2).find(|pair| (pair[0].0..=pair[1].0).contains(&x)).map(|pair| {
        let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
        let t = if x1 > x0 { (x / x0).ln() / (x1 / x0).ln() } else { 0.0 };
        (y0.ln() * (1.0 - t) + y1.ln() * t).exp()
    })
}

/// Where a point lies along the axis, if that is a number.
pub fn abscissa(axis: Axis, point: &Point, frame: u32) -> Option<f64> {
    match axis {
        Axis::Frame => Some(frame.into()),
        Axis::Time => Some(point.time(frame)),
        // A scene's number stands after its colon.
        Axis::Sweep => point.value.as_ref()?.rsplit(':').next()?.parse().ok(),
        Axis::Series => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_and_medians() {
        let mean = Mean::of(&[1.0, 2.0, 3.0]).unwrap();
        assert_eq!(mean.mean, 2.0);
        assert!((mean.error.unwrap() - (1.0f64 / 3.0).sqrt()).abs() < 1e-12);
        assert_eq!(Mean::of(&[4.0]).unwrap().error, None);
        assert_eq!((median(&[3.0, 1.0, 2.0]), median(&[1.0, 2.0, 4.0, 8.0]), median(&[])), (2.0, 3.0, 0.0));
    }

    #[test]
    fn powers_are_interpolated_exactly() {
        let curve: Vec<(f64, f64)> = [1.0, 4.0, 64.0].map(|t: f64| (t, 3.0 / t)).to_vec();
        assert!((interpolate(&curve, 16.0).unwrap() - 3.0 / 16.0).abs() < 1e-12);
        assert_eq!(interpolate(&curve, 4.0).map(|y| (y * 1e9).round()), Some(0.75e9));
        assert_eq!((interpolate(&curve, 0.9), interpolate(&curve, 65.0), interpolate(&[], 1.0)), (None, None, None));
    }
}
