//! The lab: files are understood or refused, an experiment writes whole files, and what was measured is not measured again.

mod support;

use restir::Gpu;
use restir::lab::experiment::{Axis, Metric};
use restir::lab::settings::{Settings, Value};
use restir::lab::truth::equivalence::counted_pictures;
use restir::lab::{self, Experiment, Options, Outcome, library};
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use support::*;

/// A new empty folder, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("restir-lab-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir(&path).unwrap();
        Folder(path)
    }

    fn names(&self, folder: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.join(folder)).unwrap();
        let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    fn read(&self, file: &str) -> String {
        std::fs::read_to_string(self.0.join(file)).unwrap()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

const TINY: &str = r#"
title = "Tiny"
source = "this test"
size = [24, 16]
frames = [1, 3]
runs = 2
metrics = ["mse", "bias", "rays"]
x = "frame"
settings = { "render.max_depth" = 1, indirect = false }

[[scene]]
name = "builtin:cornell"

[[series]]
name = "path tracing, averaged"
technique = "path-tracer"
accumulate = true
frames = [1, 2, 4, 8, 16, 32, 64, 128, 256, 512]

[[series]]
name = "restir-di"

[reference]
frames = 64
settings = { "render.max_depth" = 1 }

[equal_time]
baseline = "path tracing, averaged"

[quick]
size = [12, 8]
runs = 1
"#;

fn tiny() -> Experiment {
    Experiment::parse("tiny.toml", TINY).unwrap()
}

fn load(name: &str) -> restir::Result<restir::FlatScene> {
    Ok(flatten(&restir::scene::builtin::make(name.strip_prefix("builtin:").unwrap())?))
}

/// Carries an experiment out; gives what came of it and how often each kind of work was heard of.
fn run(folder: &Path, cache: &Path, experiment: &Experiment, fresh: bool) -> (Outcome, Vec<String>) {
    let (outcome, heard) = try_run(&gpu(), folder, cache, experiment, fresh);
    (outcome.unwrap(), heard)
}

fn try_run(
    gpu: &Gpu,
    folder: &Path,
    cache: &Path,
    experiment: &Experiment,
    fresh: bool,
) -> (restir::Result<Outcome>, Vec<String>) {
    let heard = RefCell::new(Vec::new());
    let outcome = lab::run(
        "tiny",
        experiment,
        gpu,
        &Options {
            out: folder,
            references: cache,
            fresh,
            command: "restir lab tiny",
            load: &load,
            progress: &|what, _, _| heard.borrow_mut().push(what.to_owned()),
        },
    );
    (outcome, heard.into_inner())
}

#[test]
fn a_reference_that_loses_samples_is_refused() {
    let (out, cache) = (Folder::new("broken-out"), Folder::new("broken-cache"));
    let gpu = fresh_gpu();
    gpu.plant("return surface.emission + scattered_radiance", "return sqrt(-1.0 - f32(pixel.x)) * scattered_radiance")
        .unwrap();
    let error = try_run(&gpu, &out.0, &cache.0, &tiny(), false).0.expect_err("it is all NaN");
    assert!(error.code() == "BAD_VALUE" && error.to_string().contains("not finite"), "{error}");
    assert!(cache.names("").is_empty(), "a broken reference was kept");
}

#[test]
fn another_size_is_taken_unless_sizes_are_swept() {
    let mut experiment = tiny();
    assert!(experiment.set_size([10, 20]));
    assert_eq!(experiment.size, [10, 20]);
    let mut swept = library::find("resolutions").unwrap();
    let before = swept.size;
    assert!(!swept.set_size([10, 20]));
    assert_eq!(swept.size, before);
}

#[test]
fn every_experiment_that_comes_with_the_program_is_sound() {
    assert!(library::FILES.len() >= 6);
    for (name, _) in library::FILES {
        let experiment = library::find(name).unwrap_or_else(|error| panic!("{name}: {error}"));
        let quick = experiment.quick();
        let pixels = |e: &Experiment| u64::from(e.size[0]) * u64::from(e.size[1]) * u64::from(e.runs);
        assert!(pixels(&quick) < pixels(&experiment) / 10, "{name}: its quick form is not quick");
    }
}

#[test]
fn a_file_is_understood() {
    let experiment = tiny();
    assert_eq!((experiment.axis(), experiment.metrics.len(), experiment.curves().len()), (Axis::Frame, 3, 2));
    let [path_tracing, restir] =
        [0, 1].map(|i| experiment.settings_of(&experiment.scenes[0], &experiment.series[i], None));
    // What a technique does not have is not set for it.
    let value = |text: &str| Value(text.to_owned());
    assert_eq!(path_tracing, Settings::from([("render.max_depth".to_owned(), value("1"))]));
    assert_eq!(restir.get("indirect"), Some(&value("false")));
    let quick = experiment.quick();
    assert_eq!((quick.size, quick.runs, quick.frames), ([12, 8], 1, vec![1, 3]));
    // A second sweep makes a series of each of its values.
    let swept = format!(
        "{TINY}\n[[sweep]]\nkey = \"render.max_depth\"\nvalues = [1, 2]\n[[sweep]]\nkey = \"render.mis_heuristic\"\nvalues = [\"balance\", \"power\"]\n"
    );
    let swept = swept.replace("[equal_time]\nbaseline = \"path tracing, averaged\"\n", "");
    let curves = Experiment::parse("swept.toml", &swept).unwrap().curves();
    assert_eq!(curves.len(), 4);
    assert_eq!(curves[3].name, "restir-di, render.mis_heuristic = power");
    let keys: std::collections::BTreeSet<_> = Metric::ALL.iter().map(|metric| metric.key()).collect();
    assert_eq!(keys.len(), Metric::ALL.len());
}

#[test]
fn what_makes_no_sense_is_refused() {
    // Each: what is replaced, by what, the error's code, a word in it.
    let cases = [
        ("technique = \"path-tracer\"", "technique = \"path-tracing\"", "UNKNOWN_NAME", "path-tracer"),
        ("indirect = false", "indirekt = false", "UNKNOWN_NAME", "indirect"),
        ("indirect = false", "indirect = \"perhaps\"", "BAD_VALUE", "true or false"),
        ("\"render.max_depth\" = 1, indirect", "\"render.max_depth\" = 0, indirect", "BAD_VALUE", "1 to 1024"),
        ("builtin:cornell", "builtin:cornel", "UNKNOWN_NAME", "cornell"),
        ("runs = 2", "runs = 0", "BAD_FILE", "runs"),
        ("runs = 2", "runs = \"two\"", "BAD_FILE", "line 6"),
        ("frames = [1, 3]", "frames = [3, 1]", "BAD_FILE", "rising"),
        ("frames = [1, 3]", "frames = []", "BAD_FILE", "rising"),
        ("size = [24, 16]", "size = [24, 0]", "BAD_FILE", "size"),
        ("size = [12, 8]", "size = [0, 8]", "BAD_FILE", "size"),
        ("\"bias\"", "\"beauty\"", "BAD_FILE", "beauty"),
        ("name = \"restir-di\"", "name = \"path tracing, averaged\"", "BAD_FILE", "two are called"),
        ("baseline = \"path tracing, averaged\"", "baseline = \"ris\"", "BAD_FILE", "no series"),
        ("accumulate = true", "accumulate = false", "BAD_FILE", "average several frames"),
        ("frames = [1, 2, 4, 8, 16, 32, 64, 128, 256, 512]", "frames = [512]", "BAD_FILE", "average several frames"),
        (
            "metrics = [\"mse\", \"bias\", \"rays\"]",
            "metrics = [\"bias\", \"rays\"]",
            "BAD_FILE",
            "no metric is an error",
        ),
        ("x = \"frame\"", "x = \"sweep\"", "BAD_FILE", "no sweep"),
        ("[quick]", "[quick]\nvalues = [1]", "BAD_FILE", "quick.values"),
        ("frames = 64", "frames = 1", "BAD_FILE", "reference"),
        ("x = \"frame\"", "x = \"frame\"\nview = \"beauty\"", "BAD_FILE", "no view 'beauty'"),
        ("x = \"frame\"", "x = \"frame\"\nview = \"duplicates\"", "BAD_FILE", "path-tracer has no view"),
        ("[quick]", "[motion]\nspeed = 1.0\n[quick]", "BAD_FILE", "motion"),
        ("[quick]", "[[sweep]]\nkey = \"light_samples\"\nvalues = [1]\n[quick]", "UNKNOWN_NAME", "light_samples"),
        ("[quick]", "[[sweep]]\nkey = \"scene\"\nvalues = [\"x\"]\n[quick]", "BAD_FILE", "'*'"),
        ("[quick]", "[[sweep]]\nkey = \"size\"\nvalues = [\"640\"]\n[quick]", "BAD_FILE", "WIDTHxHEIGHT"),
        (
            "name = \"restir-di\"",
            "name = \"restir-di\"\nsettings = { history_cap = 3 }\n[[sweep]]\nkey = \"history_cap\"\nvalues = [4]",
            "BAD_FILE",
            "'history_cap' is swept",
        ),
        ("[quick]", "[[sweep]]\nkey = \"render.seed\"\nvalues = [4, 4]\n[quick]", "BAD_FILE", "twice"),
        ("metrics = [\"mse\",", "metrics = [\"mse\", \"mse\",", "BAD_FILE", "twice"),
        ("name = \"restir-di\"", "name = \"\"", "BAD_FILE", "empty name"),
        ("\"builtin:cornell\"", "\"builtin:cornell\"\n[[scene]]\nname = \"builtin:cornell\"", "BAD_FILE", "twice"),
        (
            "\"builtin:cornell\"",
            "\"builtin:cornell\"\ncamera = { from = [0, 1, 2], to = [0, 1, 2], fov = 40 }",
            "BAD_FILE",
            "two places",
        ),
        (
            "\"builtin:cornell\"",
            "\"builtin:cornell\"\ncamera = { from = [0, nan, 2], to = [0, 1, 0], fov = 40 }",
            "BAD_FILE",
            "finite",
        ),
        (
            "\"builtin:cornell\"",
            "\"builtin:cornell\"\ncamera = { from = [0, 1, 2], to = [0, 1, 0], fov = 200 }",
            "BAD_FILE",
            "180 degrees",
        ),
        ("[quick]", "[motion]\nspeed = nan\n[quick]", "BAD_FILE", "finite"),
    ];
    for (old, new, code, word) in cases {
        assert_eq!(TINY.matches(old).count(), 1, "{old}");
        let error = Experiment::parse("tiny.toml", &TINY.replace(old, new)).expect_err(new);
        assert_eq!(error.code(), code, "{new}: {error}");
        assert!(error.to_string().contains(word), "{new}: {error}");
    }
    assert_eq!(library::find("light-sample").expect_err("unknown").code(), "UNKNOWN_NAME");
}

/// What contradicts itself is refused with the file, each point as a whole, and without a device.
#[test]
fn contradictory_settings_are_refused() {
    let parse = |settings: &str, values: &str| {
        let sweep = format!("[[sweep]]\nkey = \"visibility\"\nvalues = [{values}]\n[quick]");
        let text = TINY.replace("technique = \"path-tracer\"", "technique = \"restir-di-decoupled\"");
        let text = text.replace("name = \"restir-di\"", "name = \"the other\"\ntechnique = \"restir-di-decoupled\"");
        let text = text.replace("indirect = false", &format!("indirect = false, {settings}"));
        Experiment::parse("tiny.toml", &if values.is_empty() { text } else { text.replace("[quick]", &sweep) })
    };
    for (settings, values) in [
        ("visibility = \"mis\", checkerboard = true", ""),
        ("visibility = \"mis\", reuse_weights = \"heuristics\"", ""),
        ("checkerboard = true", "\"decoupled\", \"mis\""),
    ] {
        let error = parse(settings, values).expect_err(settings);
        assert_eq!(error.code(), "BAD_VALUE", "{settings}: {error}");
        assert!(error.to_string().contains("mis contradicts"), "{settings}: {error}");
    }
    for (settings, values) in [
        ("visibility = \"mis\", checkerboard = false", ""),
        ("checkerboard = true", "\"decoupled\", \"keep\""),
        // Every point has another visibility.
        ("visibility = \"mis\", checkerboard = true", "\"decoupled\""),
    ] {
        parse(settings, values).unwrap_or_else(|error| panic!("{settings}, swept {values}: {error}"));
    }
}

/// The film leaves such samples out, so that a picture does not show them: proofs and measurements count them.
#[test]
fn samples_that_are_not_finite_are_counted() {
    let faulty = [("fault_unguarded_pdf", "true")];
    for (settings, any) in [(&[][..], false), (&faulty, true)] {
        let mut renderer = renderer(&gpu(), builtin("cornell-64"), [24, 16], "restir-report", settings);
        let (pictures, not_finite) = counted_pictures(&mut renderer, 2, 2).unwrap();
        assert_eq!((pictures.len(), not_finite > 0), (2, any), "{settings:?}: {not_finite}");
    }
    let (out, cache) = (Folder::new("lossy-out"), Folder::new("lossy-cache"));
    let text = TINY.replace("name = \"restir-di\"", "name = \"faulty\"\ntechnique = \"restir-report\"");
    let mut experiment =
        Experiment::parse("tiny.toml", &text.replace("builtin:cornell", "builtin:cornell-64")).unwrap();
    experiment.series[0].frames = Some(vec![1, 2]);
    experiment.series[1].settings.insert("fault_unguarded_pdf".to_owned(), Value("true".to_owned()));
    run(&out.0, &cache.0, &experiment, false);
    let csv = out.read("tiny.csv");
    let lines: Vec<Vec<&str>> = csv.lines().map(|line| line.rsplit(',').collect()).collect();
    assert_eq!(lines[0][1], "not_finite");
    for line in &lines[1..] {
        let count: f64 = line[1].parse().unwrap();
        assert_eq!(count > 0.0, line.contains(&"faulty"), "{line:?}");
    }
    assert!(out.read("tiny.md").contains("not finite are left out, of a picture at most and on average: faulty ("));
}

#[test]
fn an_experiment_writes_whole_files_once_and_goes_on_from_what_it_has() {
    let (out, cache) = (Folder::new("out"), Folder::new("cache"));
    let experiment = tiny();
    let (outcome, heard) = run(&out.0, &cache.0, &experiment, false);
    assert_eq!((outcome.measured, outcome.kept), (4, 0));
    assert!(heard.iter().any(|what| what.contains("reference")));
    let files = ["points", "tiny-bias.svg", "tiny-mse.svg", "tiny-rays.svg", "tiny.csv", "tiny.md", "tiny.png"];
    assert_eq!(out.names(""), files);
    assert_eq!(outcome.files.len(), 6);
    // Two halves of the reference; four runs, and the pictures of the first of each series and of the reference.
    assert_eq!((cache.names("").len(), out.names("points").len()), (2, 4 + 3));

    let csv = out.read("tiny.csv");
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 1 + 10 + 2);
    // A name with a comma is quoted, which this simple reader sees as a column more.
    assert!(csv.lines().nth(1).unwrap().contains("\"path tracing, averaged\",,1,2,"));
    let errors: Vec<f64> = rows[1..11].iter().map(|row| row[7].parse().unwrap()).collect();
    assert!(errors[9] < 0.1 * errors[0], "averaging lowers errors: {errors:?}");
    let page = out.read("tiny.md");
    for part in
        ["# Tiny", "restir lab tiny", "24 × 16 on", "At equal time", "tiny-mse.svg", "tiny.png", "| restir-di | 3 |"]
    {
        assert!(page.contains(part), "{part} is not in {page}");
    }
    let plot = out.read("tiny-mse.svg");
    assert!(plot.starts_with("<svg") && plot.trim_end().ends_with("</svg>"));
    assert!(plot.contains("prefers-color-scheme: dark") && plot.contains("MSE") && plot.contains("restir-di"));

    // Again: nothing is measured or rendered, and the files are the same.
    let before: Vec<_> = files[1..].iter().map(|file| std::fs::read(out.0.join(file)).unwrap()).collect();
    let (outcome, heard) = run(&out.0, &cache.0, &experiment, false);
    assert_eq!((outcome.measured, outcome.kept), (0, 4));
    assert!(!heard.iter().any(|what| what.contains("reference")), "{heard:?}");
    let after: Vec<_> = files[1..].iter().map(|file| std::fs::read(out.0.join(file)).unwrap()).collect();
    for ((file, before), after) in files[1..].iter().zip(&before).zip(&after) {
        assert!(before == after, "{file}: the same numbers give the same files");
    }

    // A run that was lost or spoilt is measured again, and only that.
    let points = out.names("points").into_iter().filter(|name| name.ends_with(".json")).collect::<Vec<_>>();
    std::fs::write(out.0.join("points").join(&points[0]), "{").unwrap();
    assert_eq!(run(&out.0, &cache.0, &experiment, false).0.measured, 1);
    let tiles = out.names("points").into_iter().filter(|name| name.ends_with(".png")).collect::<Vec<_>>();
    tiles.iter().for_each(|name| std::fs::write(out.0.join("points").join(name), "").unwrap());
    assert_eq!(run(&out.0, &cache.0, &experiment, false).0.measured, 2, "the pictures of the first run");
    // More runs: those that are there are kept.
    assert_eq!(run(&out.0, &cache.0, &Experiment { runs: 3, ..experiment.clone() }, false).0.measured, 2);
    let (outcome, heard) = run(&out.0, &cache.0, &experiment, true);
    assert_eq!((outcome.measured, outcome.kept), (4, 0), "--fresh");
    assert!(!heard.iter().any(|what| what.contains("reference")), "references are not measurements");
    assert!(!out.names("").iter().chain(&out.names("points")).any(|name| name.ends_with(".tmp")));
}

#[test]
fn what_changes_the_numbers_changes_the_key() {
    let (out, cache) = (Folder::new("key-out"), Folder::new("key-cache"));
    let base = Experiment { runs: 1, frames: vec![1], equal_time: None, series: tiny().series[1..].to_vec(), ..tiny() };
    let measured = |experiment: &Experiment| run(&out.0, &cache.0, experiment, false).0.measured;
    assert_eq!((measured(&base), measured(&base)), (1, 0));
    let with = |key: &str, value: &str| {
        let mut other = base.clone();
        other.settings.insert(key.to_owned(), Value(value.to_owned()));
        other
    };
    let mut reference = base.clone();
    reference.reference.frames = 66;
    let mut camera = base.clone();
    camera.scenes[0].camera = restir::lab::settings::View::LookAt(restir::lab::settings::LookAt {
        from: [0.0, 0.5, 1.7],
        to: [0.0, 0.5, 0.0],
        fov: 40.0,
    });
    let mut scene = base.clone();
    scene.scenes[0].name = "builtin:veach-mis".into();
    let others = [
        with("light_samples", "3"),
        with("render.max_depth", "2"),
        Experiment { size: [16, 16], ..base.clone() },
        Experiment { frames: vec![2], ..base.clone() },
        Experiment { accumulate: true, ..base.clone() },
        reference,
        camera,
        scene,
    ];
    for (i, other) in others.iter().enumerate() {
        assert_eq!((measured(other), measured(other)), (1, 0), "change {i}");
    }
    // Words for people change nothing.
    assert_eq!(measured(&Experiment { title: "Another".into(), about: "Said otherwise.".into(), ..base }), 0);
}
