//! The files of an experiment: page, table, plots and strips. No dates: the same numbers give the same files.

use super::experiment::{Axis, Experiment, Metric};
use super::plot::{self, Curve, Plot};
use super::results::{self, EqualTimeRow, Mean, Point, Z_95_TWO_SIDED};
use super::run::{Findings, Site};
use super::{settings, strip};
use crate::error::Result;
use crate::output::write_atomic;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Writes them all into `folder`; gives their paths, the page first.
pub(super) fn write(findings: &Findings, folder: &Path) -> Result<Vec<PathBuf>> {
    let experiment = findings.experiment;
    let mut files = vec![folder.join(format!("{}.md", findings.name))];
    let table = folder.join(format!("{}.csv", findings.name));
    write_atomic(&table, csv(findings).as_bytes())?;
    files.push(table);
    let mut page = head(findings)?;
    for (index, site) in findings.sites.iter().enumerate() {
        let points: Vec<&Point> = findings.points.iter().filter(|point| point.scene == index).collect();
        let suffix = if findings.sites.len() == 1 { String::new() } else { format!("-{}", index + 1) };
        let _ = write!(page, "\n## {}\n\n{}", site.name.replace('*', "N"), noise(site));
        page += &markdown_table(experiment, &points);
        page += &left_out(experiment, &points);
        for &metric in &experiment.metrics {
            let Some(svg) = plot_of(experiment, site, &points, metric)? else { continue };
            let file = format!("{}{suffix}-{}.svg", findings.name, metric.key());
            write_atomic(&folder.join(&file), svg.as_bytes())?;
            let _ = write!(page, "\n![{} in {}]({file})\n", metric.title(), site.name.replace('*', "N"));
            files.push(folder.join(&file));
        }
        page += &equal_time_table(experiment, &points);
        let file = format!("{}{suffix}.png", findings.name);
        let tiles: Vec<PathBuf> = site.tiles.iter().map(|(_, path)| path.clone()).collect();
        strip::write(&folder.join(&file), &tiles)?;
        let _ = write!(page, "\n![Pictures]({file})\n\n{}\n", strip_legend(experiment, site));
        files.push(folder.join(&file));
    }
    write_atomic(&files[0], page.as_bytes())?;
    Ok(files)
}

fn head(findings: &Findings) -> Result<String> {
    let experiment = findings.experiment;
    let mut page = format!("# {}\n\nSource: {}.\n", experiment.title, experiment.source);
    for text in [&experiment.about, &experiment.reading] {
        if !text.trim().is_empty() {
            let _ = write!(page, "\n{}\n", text.trim());
        }
    }
    let sizes = experiment.sizes(findings.name)?;
    let sizes: Vec<String> = sizes.iter().map(|[width, height]| format!("{width} × {height}")).collect();
    let _ = write!(page, "\n```sh\n{}\n```\n\n", findings.command);
    let _ = writeln!(
        page,
        "{} on {}. {} independent runs; ± is 1.96 standard errors of their mean. References: {} frames of \
         `path-tracer` ({}).{}",
        sizes.join(", "),
        findings.adapter,
        experiment.runs,
        experiment.reference.frames,
        settings::describe(&experiment.reference.settings),
        if findings.software {
            " Times are those of a software adapter on the CPU: only their ratios mean anything."
        } else {
            ""
        },
    );
    Ok(page)
}

fn noise(site: &Site) -> String {
    let low = site.noise.iter().copied().fold(f64::INFINITY, f64::min);
    let high = site.noise.iter().copied().fold(0.0, f64::max);
    let range = if low == high { figure(low) } else { format!("{} to {}", figure(low), figure(high)) };
    format!("The reference's own MSE, which is in every MSE below: {range}.\n\n")
}

/// Four figures.
fn figure(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e5).contains(&size) {
        let digits = (3 - size.log10().floor() as i32).max(0) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.3e}")
    }
}

fn with_error(mean: Option<Mean>) -> String {
    match mean {
        Some(Mean { mean, error: Some(error) }) => format!("{} ± {:.1e}", figure(mean), Z_95_TWO_SIDED * error),
        Some(Mean { mean, error: None }) => figure(mean),
        None => "–".to_owned(),
    }
}

/// A row of a Markdown table, in whose cells a `|` would begin another.
fn row(cells: &[String]) -> String {
    let cell = |text: &String| if text.is_empty() { " |".into() } else { format!(" {} |", text.replace('|', "\\|")) };
    format!("|{}\n", cells.iter().map(cell).collect::<String>())
}

/// The first two rows of a Markdown table.
fn table_head(titles: &[String]) -> String {
    format!("{}|{}\n", row(titles), "---|".repeat(titles.len()))
}

/// A table row for each point, and each judged frame where that is the axis.
fn markdown_table(experiment: &Experiment, points: &[&Point]) -> String {
    let by_frame = points.iter().any(|point| point.frames.len() > 1);
    let cells = |label: String, frame: String, metrics: &dyn Fn(Metric) -> String| -> Vec<String> {
        let frame = by_frame.then_some(frame);
        [label].into_iter().chain(frame).chain(experiment.metrics.iter().map(|&metric| metrics(metric))).collect()
    };
    let mut table = table_head(&cells(String::new(), "frame".to_owned(), &|metric| metric.title().to_owned()));
    for point in points {
        for &frame in &point.frames {
            let figures = |metric| with_error(point.mean(metric, frame));
            table += &row(&cells(point.label(experiment), frame.to_string(), &figures));
        }
    }
    table
}

/// Which points have pictures that are not whole; nothing where there are none.
fn left_out(experiment: &Experiment, points: &[&Point]) -> String {
    let lossy = points.iter().filter_map(|point| {
        let means = point.frames.iter().filter_map(|&frame| point.mean(Metric::NotFinite, frame));
        let worst = means.map(|mean| mean.mean).fold(0.0, f64::max);
        (worst > 0.0).then(|| format!("{} ({})", point.label(experiment), figure(worst)))
    });
    match lossy.collect::<Vec<_>>().join("; ") {
        none if none.is_empty() => none,
        some => format!("\nSamples that were not finite are left out, of a picture at most and on average: {some}.\n"),
    }
}

/// Errors at equal time, for the experiment's first metric that is an error.
fn equal_time_table(experiment: &Experiment, points: &[&Point]) -> String {
    let Some(equal) = &experiment.equal_time else { return String::new() };
    let Some(&metric) = experiment.metrics.iter().find(|metric| metric.is_error()) else { return String::new() };
    let rows = results::equal_time(experiment, points, metric);
    let mut table = format!(
        "\nAt equal time: {} beside that of '{}' after as many milliseconds, between its frames by powers.\n\n",
        metric.title(),
        equal.baseline
    );
    table += &table_head(&["", "frame", "ms", metric.title(), &equal.baseline, "ratio"].map(str::to_owned));
    for EqualTimeRow { label, frame, time, error, baseline } in rows {
        let (baseline, ratio) = match baseline {
            Some(baseline) => (figure(baseline), format!("{:.3}", error / baseline)),
            None => ("not measured".to_owned(), "–".to_owned()),
        };
        table += &row(&[label, frame.to_string(), figure(time), figure(error), baseline, ratio]);
    }
    table
}

fn strip_legend(experiment: &Experiment, site: &Site) -> String {
    let labels = site.tiles.chunks(strip::columns(site.tiles.len()));
    let rows: Vec<String> =
        labels.map(|row| row.iter().map(|(label, _)| label.as_str()).collect::<Vec<_>>().join(" | ")).collect();
    let what = experiment.view.as_ref().map_or(String::new(), |view| format!(", its view `{view}`"));
    format!("From the left, row by row, the first run's last frame{what}: {}.", rows.join(" // "))
}

/// A plot of one metric; none where no point has it.
fn plot_of(experiment: &Experiment, site: &Site, points: &[&Point], metric: Metric) -> Result<Option<String>> {
    // What a frame takes is one number a run, however many of its frames are judged.
    let axis = match (experiment.axis(), metric) {
        (Axis::Frame | Axis::Time, metric) if metric.is_time() => Axis::Series,
        (axis, _) => axis,
    };
    let half = |mean: Mean| Z_95_TWO_SIDED * mean.error.unwrap_or(0.0);
    let sweep = experiment.sweeps.first();
    let numeric = points.iter().all(|p| results::abscissa(axis, p, p.last_frame()).is_some());
    let mut curves: Vec<Curve> = Vec::new();
    let mut categories: Option<Vec<String>> = (!numeric).then(Vec::new);
    for point in points {
        let frames =
            if matches!(axis, Axis::Frame | Axis::Time) { point.frames.clone() } else { vec![point.last_frame()] };
        // Along frames and time every point is a curve; along a sweep those of one series are; side by side all are one.
        let name = match axis {
            Axis::Frame | Axis::Time => point.label(experiment),
            Axis::Sweep => point.series.clone(),
            Axis::Series => String::new(),
        };
        let index = curves.iter().position(|curve| curve.name == name).unwrap_or_else(|| {
            curves.push(Curve { name, points: Vec::new() });
            curves.len() - 1
        });
        for frame in frames {
            let Some(mean) = point.mean(metric, frame) else { continue };
            let x = match &mut categories {
                None => results::abscissa(axis, point, frame).unwrap_or(0.0),
                Some(names) => {
                    let name = if axis == Axis::Series {
                        point.label(experiment)
                    } else {
                        point.value.clone().unwrap_or_default()
                    };
                    let known = names.iter().position(|known| *known == name);
                    known.unwrap_or_else(|| {
                        names.push(name);
                        names.len() - 1
                    }) as f64
                }
            };
            curves[index].points.push((x, mean.mean, half(mean)));
        }
    }
    curves.retain(|curve| !curve.points.is_empty());
    if curves.is_empty() {
        return Ok(None);
    }
    let x = match axis {
        Axis::Sweep => sweep.map_or("", |sweep| sweep.key.as_str()),
        Axis::Frame => "frames",
        Axis::Time => "milliseconds",
        Axis::Series => "",
    };
    plot::svg(&Plot {
        title: &site.name.replace('*', "N"),
        x,
        y: metric.title(),
        categories,
        may_be_logarithmic: metric != Metric::Bias,
        curves,
    })
    .map(Some)
}

/// Every metric of every point, a row for each judged frame.
fn csv(findings: &Findings) -> String {
    let experiment = findings.experiment;
    let mut text = "scene,series,value,frame,runs,picture_ms".to_owned();
    for metric in Metric::ALL {
        let name = metric.key().replace('-', "_");
        let _ = write!(text, ",{name},{name}_standard_error");
    }
    text.push('\n');
    for point in &findings.points {
        for &frame in &point.frames {
            let scene = quoted(&experiment.scenes[point.scene].name);
            let value = quoted(point.value.as_deref().unwrap_or_default());
            let (series, runs, time) = (quoted(&point.series), point.runs.len(), point.time(frame));
            let _ = write!(text, "{scene},{series},{value},{frame},{runs},{time}");
            for metric in Metric::ALL {
                let mean = point.mean(metric, frame);
                let number = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:e}"));
                let _ = write!(text, ",{},{}", number(mean.map(|m| m.mean)), number(mean.and_then(|m| m.error)));
            }
            text.push('\n');
        }
    }
    text
}

/// A CSV field (RFC 4180).
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::super::measure::{Reading, Run};
    use super::*;

    const SWEPT: &str = r#"
title = "Tiny"
source = "this test"
size = [24, 16]
frames = [1]
runs = 1
metrics = ["mse", "bias"]
[[scene]]
name = "builtin:cornell"
[[sweep]]
key = "size"
values = ["12x8", "48x32"]
[reference]
frames = 2
"#;

    fn experiment() -> Experiment {
        Experiment::parse("tiny.toml", SWEPT).expect("a sound file")
    }

    fn point(series: &str, value: &str, not_finite: u64) -> Point {
        let reading = Reading { frame: 1, mse: 0.5, relmse: 0.5, mape: None, bias: Some(0.01), rays: 3.0, not_finite };
        let run = Run { frame_ms: 1.0, gpu_ms: None, lighting_ms: None, readings: vec![reading] };
        let (series, value) = (series.to_owned(), Some(value.to_owned()));
        Point { scene: 0, series, value, accumulate: false, frames: vec![1], runs: vec![run] }
    }

    #[test]
    fn bars_in_labels_begin_no_cells() {
        let table = markdown_table(&experiment(), &[&point("1/|Z|", "12x8", 0)]);
        let rows =
            ["| | MSE | signed bias, % |", "|---|---|---|", "| 1/\\|Z\\|, size = 12x8 | 0.5000 | 1.000 |"].join("\n");
        assert_eq!(table.trim_end(), rows);
        let mut several = point("a", "12x8", 0);
        several.frames = vec![1, 2];
        let table = markdown_table(&experiment(), &[&several]);
        assert!(table.starts_with("| | frame | MSE |") && table.contains("| a, size = 12x8 | 1 | 0.5000 |"), "{table}");
    }

    #[test]
    fn a_page_states_the_sizes_that_are_swept() {
        let page = |experiment: &Experiment| {
            let (adapter, command) = ("a device".to_owned(), "restir lab tiny");
            let (sites, points) = (Vec::new(), Vec::new());
            head(&Findings { name: "tiny", experiment, command, adapter, software: false, sites, points })
        };
        assert!(page(&experiment()).expect("sizes").contains("\n12 × 8, 48 × 32 on a device. 1 independent"));
        let alone = Experiment { sweeps: Vec::new(), ..experiment() };
        assert!(page(&alone).expect("a size").contains("\n24 × 16 on a device. "));
    }

    #[test]
    fn pictures_that_are_not_whole_are_named() {
        let [whole, lossy] = [point("a", "12x8", 0), point("b", "12x8", 7)];
        assert_eq!(left_out(&experiment(), &[&whole]), "");
        let said = left_out(&experiment(), &[&whole, &lossy]);
        assert!(said.contains(": b, size = 12x8 (7.000).") && !said.contains("a, size"), "{said}");
    }
}
