//! The command line as a contract: exit codes, one-line errors, JSON shapes, files.

use restir::output::{ExrPicture, Image, encode_exr, read_exr};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A new empty folder, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("restir-cli-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir(&path).unwrap();
        Folder(path)
    }

    fn path(&self, name: &str) -> String {
        self.0.join(name).to_str().unwrap().to_owned()
    }

    fn write(&self, name: &str, bytes: &[u8]) -> String {
        std::fs::write(self.0.join(name), bytes).unwrap();
        self.path(name)
    }

    fn names(&self) -> Vec<String> {
        let mut names: Vec<String> =
            std::fs::read_dir(&self.0).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn restir(args: &[&str]) -> Output {
    // Mesa complains on stderr where this is not set.
    let folder = std::env::temp_dir();
    Command::new(env!("CARGO_BIN_EXE_restir")).args(args).env("XDG_RUNTIME_DIR", folder).output().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// Runs a command that must succeed, and gives its stdout.
fn succeed(args: &[&str]) -> String {
    let output = restir(args);
    assert_eq!(output.status.code(), Some(0), "{args:?}: {}", stderr(&output));
    String::from_utf8(output.stdout).unwrap()
}

fn succeed_json(args: &[&str]) -> Value {
    let stdout = succeed(args);
    serde_json::from_str(&stdout).unwrap_or_else(|error| panic!("{args:?}: {error} in {stdout}"))
}

/// Runs a command that must fail with this exit code and error code, in one line that holds `what`.
fn fail(args: &[&str], exit: i32, code: &str, what: &str) {
    let output = restir(args);
    let stderr = stderr(&output);
    assert_eq!(output.status.code(), Some(exit), "{args:?}: {stderr}");
    let errors: Vec<&str> = stderr.lines().filter(|line| !line.starts_with("warning: ")).collect();
    assert_eq!(errors.len(), 1, "{args:?}: {stderr}");
    assert!(errors[0].starts_with(&format!("error[{code}]: ")), "{args:?}: {stderr}");
    assert!(errors[0].contains(what), "{args:?}: {stderr}");
    assert!(output.stdout.is_empty(), "{args:?}: nothing on stdout");
}

fn exr(folder: &Folder, name: &str, width: u32, height: u32, value: f32) -> String {
    let image = Image::new(width, height, vec![[value; 3]; (width * height) as usize]).unwrap();
    let picture = ExrPicture {
        image: &image,
        albedo: None,
        normal: None,
        depth: None,
        motion: None,
        technique: "none",
        parameters: "{}",
        seed: 0,
        frames: 1,
    };
    folder.write(name, &encode_exr(&picture).unwrap())
}

#[test]
fn wrong_usage_is_exit_code_2_and_does_nothing() {
    let folder = Folder::new("usage");
    let out = folder.path("a.png");
    let render = |more: &[&'static str]| {
        let mut args = vec!["render".to_owned(), "builtin:cornell".to_owned(), "--out".to_owned(), out.clone()];
        args.extend(more.iter().map(|s| s.to_string()));
        args
    };
    let mut wrong: Vec<Vec<String>> = [
        &[][..],
        &["paint"],
        &["render"],
        &["render", "builtin:cornell"],
        &["render", "missing.glb", "--out", "a.jpg"],
        &["render", "missing.glb", "--out", "png"],
        &["compare", "a.exr"],
        &["techniques", "extra"],
    ]
    .iter()
    .map(|args| args.iter().map(|s| s.to_string()).collect())
    .collect();
    for size in ["0x10", "10x0", "16385x1", "1x16385", "10", "10x", "x", "-1x5", "axb", "4294967297x1", "1x1x1"] {
        let mut args = render(&[]);
        args.push(format!("--size={size}"));
        wrong.push(args);
    }
    wrong.extend([
        render(&["--frames", "0"]),
        render(&["--frames", "many"]),
        render(&["--spp", "0"]),
        render(&["--seconds", "0"]),
        render(&["--seconds", "-1"]),
        render(&["--seconds", "nan"]),
        render(&["--seconds", "inf"]),
        render(&["--frames", "1", "--spp", "1"]),
        render(&["--frames", "1", "--seconds", "1"]),
        render(&["--set", "candidates"]),
        render(&["--set", "=1"]),
        render(&["--seed", "-1"]),
        render(&["--seed", "4294967296"]),
        render(&["--accumulate", "maybe"]),
        render(&["--lights", "0"]),
        render(&["--unknown"]),
    ]);
    for args in wrong {
        let output = restir(&args.iter().map(String::as_str).collect::<Vec<_>>());
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", stderr(&output));
        assert!(output.stdout.is_empty() && !output.stderr.is_empty(), "{args:?}");
        // Without any argument there is help.
        if !args.is_empty() {
            let stderr = stderr(&output);
            assert!(stderr.starts_with("error[") && stderr.lines().count() == 1, "{args:?}: {stderr}");
        }
    }
    fail(&["render", "builtin:cornell"], 2, "USAGE", "--out <FILE> (try --help)");
    fail(&["paint"], 2, "USAGE", "'paint'");
    assert!(folder.names().is_empty());
}

#[test]
fn help_and_version_are_no_errors() {
    assert!(succeed(&["--help"]).contains("Usage: restir <COMMAND>"));
    assert!(succeed(&["render", "--help"]).contains("--max-depth"));
    assert_eq!(succeed(&["--version"]).trim(), format!("restir {}", env!("CARGO_PKG_VERSION")));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_stderr_changes_no_exit_code() {
    let code = |args: &[&str]| {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        Command::new(env!("CARGO_BIN_EXE_restir")).args(args).stderr(full).output().unwrap().status.code()
    };
    assert_eq!(code(&["render"]), Some(2));
    assert_eq!(code(&["info", "missing.glb"]), Some(1));
    assert_eq!(code(&["info", "builtin:nothing"]), Some(2));
}

#[test]
fn a_view_of_a_number_is_written_as_that_number() {
    let folder = Folder::new("view");
    let out = folder.path("rays.exr");
    let frame = ["--size", "16x12", "--frames", "1", "--out", &out, "--json"];
    let report = succeed_json(&[&["render", "builtin:cornell", "--view", "rays"][..], &frame].concat());
    let image = read_exr(Path::new(&out)).unwrap();
    let rays: f64 = image.pixels.iter().map(|pixel| f64::from(pixel[0])).sum();
    assert_eq!(Some(rays), report["counters"]["rays"].as_f64());
}

#[test]
fn wrong_names_and_values_are_exit_code_2_and_say_what_is_right() {
    let folder = Folder::new("names");
    let out = folder.path("a.png");
    let render = |scene: &'static str, more: &[&'static str], code: &str, what: &str| {
        let mut args = vec!["render", scene, "--size", "16x16", "--out", &out];
        args.extend(more);
        fail(&args, 2, code, what);
    };
    render("builtin:nothing", &[], "UNKNOWN_NAME", "cornell");
    render("scene.fbx", &[], "BAD_VALUE", "scene.fbx");
    render("builtin:cornell", &["--camera", "nobody"], "UNKNOWN_NAME", "nobody");
    render("builtin:cornell", &["--camera", "99"], "UNKNOWN_NAME", "99");
    render("builtin:cornell", &["--technique", "magic"], "UNKNOWN_NAME", "restir-di");
    render("missing.glb", &["--preset", "bitterli"], "UNKNOWN_NAME", "bitterli-2020-unbiased");
    render("missing.glb", &["--preset", "lanz-2025", "--technique", "ris"], "USAGE", "--technique");
    render("missing.glb", &["--pose", "0,0,0,0,0,1,0,1"], "USAGE", "nine numbers");
    render("missing.glb", &["--pose", "0,0,0,0,0,1,0,0,1"], "USAGE", "nine numbers");
    render("missing.glb", &["--max-depth", "2", "--set", "render.max_depth=3"], "BAD_VALUE", "--set render.max_depth");
    render("missing.glb", &["--view", "beauty"], "UNKNOWN_NAME", "BVH steps");
    render("builtin:cornell", &["--set", "colour=1"], "UNKNOWN_NAME", "colour");
    render("builtin:cornell", &["--set", "film.exposure=bright"], "BAD_VALUE", "exposure");
    render("builtin:many", &[], "UNKNOWN_NAME", "many-lights:N");
    render("builtin:many-lights", &[], "BAD_VALUE", "many-lights:10000");
    render("builtin:cornell", &["--max-depth", "0"], "USAGE", "max_depth");
    // Told before the scene is looked for.
    render("missing.glb", &["--max-depth", "1025"], "USAGE", "from 1 to 1024");
    render("missing.glb", &["--set", "film.exposure=bright"], "BAD_VALUE", "exposure");
    render("missing.glb", &["--set", "render.max_depth=0"], "BAD_VALUE", "max_depth");
    render("missing.glb", &["--set", "light_samples=none"], "BAD_VALUE", "light_samples");
    let unbiased = ["--technique", "restir-di-decoupled", "--set", "visibility=mis", "--set", "checkerboard=yes"];
    render("missing.glb", &unbiased, "BAD_VALUE", "mis contradicts checkerboard");
    render("builtin:cornell", &["--spp", "4", "--accumulate", "no"], "BAD_VALUE", "--spp");
    assert!(folder.names().is_empty());
}

#[test]
fn files_that_fail_are_exit_code_1_in_one_line_that_names_them() {
    let folder = Folder::new("files");
    let out = folder.path("a.png");
    let missing = folder.path("missing.glb");
    fail(&["render", &missing, "--out", &out], 1, "IO", "missing.glb");
    fail(&["info", &missing], 1, "IO", "missing.glb");
    let broken = folder.write("broken.glb", b"this is not glTF");
    fail(&["render", &broken, "--out", &out], 1, "BAD_FILE", "broken.glb");
    fail(&["info", &broken], 1, "BAD_FILE", "broken.glb");
    let nowhere = folder.path("no/such/folder/a.png");
    fail(&["render", "builtin:cornell", "--out", &nowhere], 1, "IO", "no/such/folder/a.png");
    let args = ["render", "builtin:cornell", "--environment", &missing, "--out", &out];
    fail(&args, 1, "IO", "missing.glb");
    assert_eq!(folder.names(), ["broken.glb"]);
}

#[test]
fn names_may_be_as_long_as_the_file_system_allows() {
    let folder = Folder::new("long");
    let name = |length: usize| format!("{}.png", "a".repeat(length - 4));
    let render =
        |out: &str| ["render", "builtin:furnace", "--size", "8x8", "--frames", "1", "--out", out].map(String::from);
    succeed(&render(&folder.path(&name(255))).each_ref().map(String::as_str));
    fail(&render(&folder.path(&name(256))).each_ref().map(String::as_str), 1, "IO", "too long");
    assert_eq!(folder.names(), [name(255)]);
}

#[test]
fn lights_for_a_lit_scene_are_a_warning() {
    let folder = Folder::new("lit");
    let out = folder.path("a.png");
    let args =
        ["render", "builtin:furnace", "--lights", "5", "--size", "8x8", "--frames", "1", "--json", "--out", &out];
    assert!(succeed_json(&args)["warnings"][0].as_str().unwrap().contains("--lights"));
}

#[test]
fn what_was_written_before_survives_every_failure() {
    let folder = Folder::new("survive");
    let out = folder.write("a.png", b"precious");
    let missing = folder.path("missing.glb");
    fail(&["render", &missing, "--out", &out], 1, "IO", "missing.glb");
    fail(&["render", "builtin:cornell", "--technique", "magic", "--out", &out], 2, "UNKNOWN_NAME", "magic");
    assert_eq!(std::fs::read(&out).unwrap(), b"precious");
    assert_eq!(folder.names(), ["a.png"]);
}

#[test]
fn compare_reports_every_metric() {
    let folder = Folder::new("compare");
    let (a, b) = (exr(&folder, "a.exr", 16, 12, 0.75), exr(&folder, "b.exr", 16, 12, 0.5));
    let report = succeed_json(&["compare", &a, &b, "--json"]);
    let close = |pointer: &str, want: f64| {
        let got = report.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("{pointer} in {report}"));
        assert!((got - want).abs() < 1e-9, "{pointer}: {got}, expected {want}");
    };
    close("/mse", 0.0625);
    close("/rmse", 0.25);
    close("/relmse", 0.0625 / 0.26);
    close("/mape", 0.25 / 0.505);
    for channel in ["r", "g", "b", "luminance"] {
        close(&format!("/bias/{channel}/absolute"), 0.25);
        close(&format!("/bias/{channel}/relative"), 0.5);
    }
    assert!(report["flip"].as_f64().unwrap() > 0.05);
    assert!(report["ssim"].as_f64().unwrap() < 1.0);

    let text = succeed(&["compare", &a, &b]);
    for metric in ["mse", "rmse", "relmse", "mape", "ssim", "flip", "bias"] {
        assert!(text.lines().any(|line| line.starts_with(metric)), "{metric} in {text}");
    }
    let same = succeed_json(&["compare", &a, &a, "--json"]);
    assert_eq!((same["mse"].as_f64(), same["flip"].as_f64()), (Some(0.0), Some(0.0)));
}

#[test]
fn compare_refuses_what_it_cannot_compare() {
    let folder = Folder::new("refuse");
    let (a, b) = (exr(&folder, "a.exr", 16, 12, 1.0), exr(&folder, "b.exr", 12, 16, 1.0));
    let nan = exr(&folder, "nan.exr", 16, 12, f32::NAN);
    let text = folder.write("text.exr", b"hello");
    fail(&["compare", &a, &b], 1, "BAD_VALUE", "16x12");
    fail(&["compare", &a, &nan], 1, "BAD_VALUE", "576 NaN");
    fail(&["compare", &a, &text], 1, "BAD_FILE", "text.exr");
    fail(&["compare", &a, &folder.path("missing.exr")], 1, "IO", "missing.exr");
    // A device may never end, so only regular files are read.
    fail(&["compare", &a, "/dev/zero"], 1, "IO", "not a regular file");
}

#[test]
fn clamped_environments_are_warned_of() {
    let folder = Folder::new("clamped");
    let (sky, out) = (exr(&folder, "sky.exr", 4, 2, f32::INFINITY), folder.path("a.png"));
    let args = ["render", "builtin:cornell", "--environment", &sky, "--size", "16x8", "--frames", "1", "--out", &out];
    let output = restir(&args);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("24 values were not within 0 and 1e8"), "{}", stderr(&output));
    let report = succeed_json(&[&args[..], &["--json"]].concat());
    assert!(report["warnings"][0].as_str().unwrap().contains("24 values"), "{report}");

    let nan = exr(&folder, "nan.exr", 4, 2, f32::NAN);
    let args = ["render", "builtin:cornell", "--environment", &nan, "--out", &out];
    fail(&args, 1, "BAD_FILE", "24 of 24 values");
    fail(
        &["render", "builtin:cornell", "--environment", "sky:height=1", "--out", &out],
        2,
        "UNKNOWN_NAME",
        "elevation",
    );
    fail(&["render", "builtin:cornell", "--environment", "sky:albedo=2", "--out", &out], 2, "BAD_VALUE", "albedo");
}

#[test]
fn scenes_and_techniques_are_listed() {
    let scenes = succeed_json(&["scenes", "--json"]);
    let examples: Vec<&str> = scenes.as_array().unwrap().iter().map(|s| s["example"].as_str().unwrap()).collect();
    assert!(examples.contains(&"cornell"), "{examples:?}");
    let text = succeed(&["scenes"]);
    for example in examples {
        assert!(text.contains(&format!("builtin:{example}")), "{example} in {text}");
    }

    let listed = succeed_json(&["techniques", "--json"]);
    let text = succeed(&["techniques"]);
    let techniques = listed["techniques"].as_array().unwrap();
    assert_eq!(listed["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(listed["scenes"], scenes);
    for (group, name) in [("render", "max_depth"), ("film", "exposure")] {
        let params = listed[group]["params"].as_array().unwrap();
        assert!(params.iter().any(|parameter| parameter["name"] == name), "{name} in {listed}");
        assert!(text.contains(&format!("{group}.{name}")), "{group}.{name} in {text}");
    }
    for id in ["normals", "path-tracer", "restir-di", "restir-report", "ris"] {
        let info = techniques.iter().find(|t| t["id"] == id).unwrap_or_else(|| panic!("{id} in {listed}"));
        assert!(info["title"].is_string() && info["summary"].is_string() && info["bias"].is_string(), "{info}");
        assert!(info["unbiased"].is_boolean() && info["papers"].is_array() && info["views"].is_array(), "{info}");
        assert!(text.contains(&format!("{id}: ")), "{id} in {text}");
        for parameter in info["params"].as_array().unwrap() {
            for key in ["name", "doc", "kind", "unit"] {
                assert!(parameter[key].is_string(), "{key} of {parameter}");
            }
            assert!(!parameter["default"].is_null(), "{parameter}");
            assert!(text.contains(parameter["doc"].as_str().unwrap()), "{parameter} in {text}");
        }
    }
}

#[test]
fn info_says_what_a_scene_holds() {
    let info = succeed_json(&["info", "builtin:cornell", "--json"]);
    for key in ["triangles", "instances", "materials", "textures", "lights", "bvh_nodes", "bvh_depth", "gpu_bytes"] {
        assert!(info[key].is_u64(), "{key} in {info}");
    }
    assert!(info["triangles"].as_u64().unwrap() >= 12 && info["lights"].as_u64().unwrap() >= 1, "{info}");
    assert!(info["warnings"].is_array() && !info["cameras"].as_array().unwrap().is_empty(), "{info}");
    assert!(info["texture_arrays"].as_array().unwrap().is_empty(), "{info}");
    assert!(succeed(&["info", "builtin:cornell"]).contains("triangles"));
}

#[test]
fn render_writes_a_picture_and_a_report() {
    let folder = Folder::new("render");
    let out = folder.path("a.png");
    let args =
        ["render", "builtin:cornell", "--size", "32x24", "--frames", "3", "--seed", "7", "--out", &out, "--json"];
    let report = succeed_json(&args);
    assert_eq!(report["size"], serde_json::json!([32, 24]));
    assert_eq!((&report["frames"], &report["seed"]), (&3.into(), &7.into()));
    assert_eq!((&report["technique"], &report["accumulate"]), (&"restir-di".into(), &true.into()));
    assert!(report["seconds"].as_f64().unwrap() > 0.0);
    assert!(!report["adapter"].as_str().unwrap().is_empty());
    assert!(report["stats"]["triangles"].as_u64().unwrap() >= 12);
    assert!(report["parameters"]["technique"].is_object() && report["parameters"]["film"].is_object());
    assert!(report["counters"]["rays"].as_u64().unwrap() >= 3 * 32 * 24, "{report}");
    assert_eq!((&report["counters"]["nan"], &report["counters"]["inf"]), (&0.into(), &0.into()));
    assert!(report["warnings"].is_array());
    let passes = report["passes"].as_array().unwrap();
    assert!(!passes.is_empty());
    for pass in passes {
        assert!(pass["name"].is_string(), "{pass}");
        assert!(pass["median_ms"].as_f64().unwrap() <= pass["total_ms"].as_f64().unwrap(), "{pass}");
    }

    let picture = image::open(&out).unwrap().to_rgba8();
    assert_eq!(picture.dimensions(), (32, 24));
    let lit = picture.pixels().filter(|p| p.0[..3].iter().any(|&v| v > 20)).count();
    assert!(lit > 32 * 24 / 2, "only {lit} pixels are lit");
    assert_eq!(folder.names(), ["a.png"]);
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_does_not() {
    let folder = Folder::new("seed");
    let render = |name: &str, seed: &str| {
        let out = folder.path(name);
        succeed(&["render", "builtin:cornell", "--size", "32x32", "--frames", "2", "--seed", seed, "--out", &out]);
        std::fs::read(out).unwrap()
    };
    let first = render("a.exr", "1");
    assert!(first == render("b.exr", "1"));
    assert!(first != render("c.exr", "2"));
}

#[test]
fn exr_is_linear_and_says_how_it_was_made() {
    let folder = Folder::new("exr");
    let out = folder.path("a.exr");
    let args = ["render", "builtin:cornell", "--technique", "path-tracer", "--set", "film.exposure=-3"];
    let more = ["--max-depth", "2", "--size", "40x30", "--spp", "2", "--out", &out];
    succeed(&[&args[..], &more].concat());
    let image = read_exr(Path::new(&out)).unwrap();
    assert_eq!((image.width, image.height), (40, 30));
    let largest = image.pixels.iter().flatten().fold(0.0f32, |a, &b| a.max(b));
    assert!(largest > 1.0, "the light of the box is brighter than 1, and exposure does not touch it: {largest}");

    let file = exr::meta::MetaData::read_from_file(&out, true).unwrap();
    let header = &file.headers[0];
    let names: Vec<String> = header.channels.list.iter().map(|c| c.name.to_string()).collect();
    let expected = [
        "B", "G", "R", "albedo.B", "albedo.G", "albedo.R", "depth.Z", "motion.X", "motion.Y", "normal.X", "normal.Y",
        "normal.Z",
    ];
    assert_eq!(names, expected);
    let attribute = |name: &str| match header.own_attributes.other.get(&exr::prelude::Text::from(name)) {
        Some(exr::meta::attribute::AttributeValue::Text(text)) => text.to_string(),
        other => panic!("{name}: {other:?}"),
    };
    assert_eq!(attribute("restir.technique"), "path-tracer");
    assert_eq!(attribute("restir.frames"), "2");
    assert_eq!(attribute("restir.version"), env!("CARGO_PKG_VERSION"));
    let parameters: Value = serde_json::from_str(&attribute("restir.parameters")).unwrap();
    assert_eq!(parameters["render"]["max_depth"], 2);
}

#[test]
fn seconds_and_cameras_and_moving_scenes_are_understood() {
    let folder = Folder::new("seconds");
    let out = folder.path("a.png");
    let start = std::time::Instant::now();
    let args = ["render", "builtin:cornell-64", "--size", "16x16", "--seconds", "0.2", "--camera", "0", "--out", &out];
    let report = succeed_json(&[&args[..], &["--json"]].concat());
    assert!(start.elapsed().as_secs_f64() > 0.2 && report["seconds"].as_f64().unwrap() >= 0.2);
    assert!(report["frames"].as_u64().unwrap() >= 1);
    assert_eq!(report["accumulate"], false, "its lights revolve");
    let accumulated = [&args[..], &["--accumulate", "yes", "--json"]].concat();
    assert_eq!(succeed_json(&accumulated)["accumulate"], true);
}

#[test]
fn bench_measures_passes_and_rays() {
    let args = ["bench", "--size", "32x32", "--frames", "3", "--warm-up", "1", "--technique", "path-tracer"];
    let report = succeed_json(&[&args[..], &["--json"]].concat());
    assert!(!report["passes"].as_array().unwrap().is_empty());
    assert!(report["rays_per_second"].as_f64().unwrap() > 0.0);
    assert!(report["rays_per_frame"].as_f64().unwrap() >= 32.0 * 32.0, "{report}");
    assert!(report["frame_ms"].as_f64().unwrap() >= report["gpu_ms"].as_f64().unwrap() * 0.5, "{report}");
    assert!(succeed(&args).contains("Mrays/s"));
}

#[test]
fn bench_rays_measures_four_sets() {
    let args = ["bench", "rays", "builtin:cornell", "--size", "32x32", "--runs", "1"];
    let report = succeed_json(&[&args[..], &["--json"]].concat());
    let sets = report["sets"].as_array().unwrap();
    let names: Vec<_> = sets.iter().map(|set| set["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["primary", "diffuse", "shadow", "second bounce"]);
    assert_eq!((sets[0]["rays"].as_u64(), sets[1]["rays"].as_u64()), (Some(32 * 32), sets[0]["hits"].as_u64()));
    assert!(sets.iter().all(|set| set["plain"].as_f64() > Some(0.0) && set["queue"].as_f64() > Some(0.0)), "{report}");
    assert_eq!(report["builds"].as_array().unwrap().len(), 2);
    assert!(succeed(&args).contains("Mrays/s"));
}

/// Straight up from the floor of the box to its ceiling, a metre above; up from there; and to half a metre.
#[test]
fn bench_rays_traces_a_file() {
    let folder = Folder::new("rays");
    let ray = |y: f32, t_max: f32| [-0.3, y, 0.2, 0.0, 0.0, 1.0, 0.0, t_max];
    let rays: Vec<u8> =
        [ray(0.7, 100.0), ray(2.0, 100.0), ray(0.7, 0.1)].concat().into_iter().flat_map(f32::to_le_bytes).collect();
    let (file, hits) = (folder.write("rays.bin", &rays), folder.path("hits.bin"));
    succeed(&["bench", "rays", "builtin:cornell", "--rays", &file, "--hits", &hits, "--runs", "1"]);
    let bytes = std::fs::read(&hits).unwrap();
    let words: Vec<u32> = bytes.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
    assert_eq!(words.len(), 6);
    assert!((f32::from_bits(words[0]) - 0.3).abs() < 0.05 && words[1] != u32::MAX, "{words:?}");
    assert_eq!(words[2..], [100f32.to_bits(), u32::MAX, 0.1f32.to_bits(), u32::MAX]);

    let overwrite = restir(&["bench", "rays", "builtin:cornell", "--rays", &file, "--hits", &file]);
    assert_eq!((overwrite.status.code(), std::fs::read(&file).unwrap()), (Some(2), rays.clone()));
    let nowhere = restir(&["bench", "rays", "builtin:cornell", "--eye", "1,2,3", "--target", "1,2,3"]);
    assert_eq!(nowhere.status.code(), Some(2));

    let short = folder.write("short.bin", &rays[..31]);
    let endless = restir(&["bench", "rays", "builtin:cornell", "--rays", "/dev/zero"]);
    assert_eq!(endless.status.code(), Some(1), "what never ends is not read");
    let output = restir(&["bench", "rays", "builtin:cornell", "--rays", &short]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("31 bytes"), "{}", stderr(&output));
}

#[test]
fn output_that_nobody_reads_is_no_error() {
    use std::process::Stdio;
    let mut child = Command::new(env!("CARGO_BIN_EXE_restir"))
        .arg("techniques")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()));
}

#[test]
fn moments_and_sequences() {
    let folder = Folder::new("motion");
    let out = folder.path("still.png");
    // Through the middle of pixels: a frame of a sequence has other random numbers than a first one.
    let center = "render.pixel_filter=center";
    let base = ["render", "builtin:motion", "--technique", "normals", "--size", "48x32", "--json", "--set", center];
    let still = |time: &str, extra: &[&str]| {
        let args = [&base[..], &["--time", time, "--frames", "1", "--out", &out], extra].concat();
        let report = succeed_json(&args);
        assert_eq!(report["time"], time.parse::<f64>().unwrap(), "{report}");
        std::fs::read(&out).unwrap()
    };
    let [start, middle] = ["0", "1.5"].map(|time| still(time, &[]));
    assert_ne!(start, middle, "things have moved");
    assert_eq!(still("5.5", &[]), middle, "a loop of four seconds");
    assert_eq!(still("1.5", &["--animation", "everything"]), middle);
    assert_ne!(still("1.5", &["--camera", "moving"]), still("0.5", &["--camera", "moving"]));

    // A sequence: each picture is that of its moment.
    let sequence = folder.path("run.png");
    succeed_json(&[&base[..], &["--animate", "2", "--frames", "4", "--out", &sequence]].concat());
    let numbered = |i: u32| std::fs::read(folder.path(&format!("run-000{i}.png"))).unwrap();
    assert_eq!((numbered(0), numbered(3)), (start, middle));
    assert!(!std::path::Path::new(&sequence).exists());

    for (args, text) in [
        (&["--animation", "dance"][..], "everything"),
        (&["--time", "soon"], "time"),
        (&["--animate", "0"], "animate"),
        (&["--animate", "2", "--seconds", "1"], "--seconds"),
    ] {
        let output = restir(&[&["render", "builtin:motion", "--out", &out], args].concat());
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(String::from_utf8_lossy(&output.stderr).contains(text), "{args:?}");
    }
}

#[test]
fn experiments_are_listed_and_wrong_ones_refused() {
    let list = succeed_json(&["lab", "list", "--json"]);
    assert!(list.as_array().unwrap().iter().any(|entry| entry["name"] == "light-samples"));
    assert!(succeed(&["lab", "list"]).contains("thesis 001"));
    fail(&["lab", "light-sample"], 2, "UNKNOWN_NAME", "light-samples");
    fail(&["lab", "nowhere.toml"], 1, "IO", "nowhere.toml");
    fail(&["truth", "normals"], 2, "UNKNOWN_NAME", "restir-di");
    let folder = Folder::new("lab");
    let file = folder.write("broken.toml", b"title = 1");
    fail(&["lab", &file], 1, "BAD_FILE", "line 1");
}
