//! Every shader is valid on a real device, used, and says what it does; bindings and edits that are wrong are refused
//! with words that name them; edits that are right show at once.

mod support;

use glam::UVec2;
use restir::gpu::recorder::Recorder;
use restir::gpu::shader::{SceneFeatures, Shader, table};
use restir::gpu::shader_source::{Flattened, flatten, reflect};
use restir::gpu::specialize::specialize;
use restir::params::{FilmParams, ParamKind, Params, RenderParams};
use restir::view::{COMMON_VIEWS, View};
use restir::{Error, techniques};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};
use support::*;

fn source_root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_owned()
}

/// Every file below `folder` that ends so, as paths relative to it.
fn files_below(folder: &Path, extension: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut pending = vec![folder.to_owned()];
    while let Some(here) = pending.pop() {
        for entry in std::fs::read_dir(here).expect("readable") {
            let path = entry.expect("readable").path();
            if path.is_dir() {
                pending.push(path);
            } else if path.extension().is_some_and(|e| e == extension) {
                found.push(path.strip_prefix(folder).expect("below").to_str().expect("UTF-8").to_owned());
            }
        }
    }
    found
}

/// A folder of its own for one test, removed when the test is over.
struct TemporaryFolder(PathBuf);

impl TemporaryFolder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("restir-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).expect("a temporary folder");
        TemporaryFolder(path)
    }

    /// Writes a file as if `seconds` from now, for modification times may be coarse.
    fn write(&self, file: &str, text: &str, seconds: u64) {
        let path = self.0.join(file);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(&path, text).expect("written");
        let time = SystemTime::now() + Duration::from_secs(seconds);
        std::fs::File::options().write(true).open(path).and_then(|f| f.set_modified(time)).expect("a time");
    }
}

impl Drop for TemporaryFolder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Validation does not know all that the translation to the driver's language refuses.
#[test]
fn every_pass_builds_a_pipeline() {
    let gpu = fresh_gpu();
    for shader in table::ALL.iter().filter(|s| s.workgroup_size[0] > 0) {
        let software = SceneFeatures { is_software: true, ..SceneFeatures::ALL };
        for features in [SceneFeatures::ALL, SceneFeatures::NONE, software] {
            gpu.pipeline(shader, features);
            gpu.check().unwrap_or_else(|e| panic!("{} for {features:?}: {e}", shader.file));
        }
    }
    let shader = &table::FILM_BLIT;
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(shader.id),
        source: wgpu::ShaderSource::Wgsl(shader.source.into()),
    });
    let _pipeline = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(shader.id),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::TextureFormat::Rgba8Unorm.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    gpu.check().expect("the blit's pipeline");
    assert!(table::ALL.iter().filter(|s| s.workgroup_size[0] == 0).count() == 1, "a render pass is not tried here");
}

/// A name that `SceneFeatures` does not know would always be true, and nothing would be left out.
#[test]
fn every_override_is_a_scene_feature() {
    let known = SceneFeatures::OVERRIDES;
    for shader in table::ALL {
        for name in shader.overrides {
            assert!(known.contains(name), "{}: override {name}", shader.file);
        }
    }
    for name in known {
        assert!(table::ALL.iter().any(|shader| shader.overrides.contains(name)), "no shader has the override {name}");
    }
}

/// What each pass becomes for the plainest scene, for one that has everything, and for those that have one thing, or all but
/// one: valid, as long in lines as it was, and for the plainest much shorter.
#[test]
fn passes_stay_valid_for_every_scene() {
    let check = |shader: &Shader, value: &dyn Fn(&str) -> bool| {
        let text = specialize(shader.source, &|name| shader.overrides.contains(&name).then(|| value(name)));
        assert_eq!(text.lines().count(), shader.source.lines().count(), "{}", shader.file);
        reflect(&Flattened { text: text.clone(), ..Flattened::default() })
            .unwrap_or_else(|error| panic!("{}: {error}\n{text}", shader.file));
        text
    };
    for shader in table::ALL {
        check(shader, &|_| true);
        check(shader, &|_| false);
    }
    // Every feature is in these.
    for shader in [&table::RESTIR_DI_INITIAL, &table::RESTIR_DI_TEMPORAL, &table::PATH_TRACER_TRACE] {
        for feature in shader.overrides {
            check(shader, &|name| name == *feature);
            check(shader, &|name| name != *feature);
        }
    }
    let functions = |text: &str| text.lines().filter(|line| line.starts_with("fn ")).count();
    let whole = functions(table::RESTIR_DI_SHADE.source);
    let plain = functions(&check(&table::RESTIR_DI_SHADE, &|_| false));
    assert!(plain < whole * 2 / 3, "{plain} of {whole} functions are left");
}

#[test]
fn no_pass_exceeds_the_default_limits() {
    let limits = wgpu::Limits::default();
    for shader in table::ALL {
        use restir::gpu::shader::BindingKind::*;
        let count = |wanted: fn(restir::gpu::shader::BindingKind) -> bool| {
            shader.bindings.iter().filter(|b| wanted(b.kind)).count() as u32
        };
        assert!(count(|k| matches!(k, StorageRead | StorageReadWrite)) <= limits.max_storage_buffers_per_shader_stage);
        assert!(
            count(|k| matches!(k, StorageTextureFloat | StorageTextureUint))
                <= limits.max_storage_textures_per_shader_stage
        );
        assert!(shader.workgroup_size.iter().product::<u32>() <= limits.max_compute_invocations_per_workgroup);
        assert!(shader.group_count() <= limits.max_bind_groups);
    }
}

#[test]
fn every_pass_is_used() {
    let root = source_root();
    let text_below = |folder: &str| -> String {
        let folder = root.join(folder);
        files_below(&folder, "rs").iter().map(|f| std::fs::read_to_string(folder.join(f)).expect("readable")).collect()
    };
    let (library, tests) = (text_below("src"), text_below("tests"));
    for shader in table::ALL {
        let name = format!("table::{}", shader.id.replace(['/', '-'], "_").to_uppercase());
        let users = if shader.file.starts_with("tests/") { &tests } else { &library };
        let used = users
            .match_indices(&name)
            .any(|(at, _)| !users[at + name.len()..].starts_with(|c: char| c == '_' || c.is_ascii_alphanumeric()));
        assert!(used, "{} ({name}) is used nowhere", shader.file);
    }
}

#[test]
fn every_shader_file_is_part_of_a_pass() {
    let root = source_root().join("shaders");
    let mut reached = BTreeSet::new();
    for shader in table::ALL {
        reached.extend(flatten(&root, shader.file).expect("it flattened when it was built").files);
    }
    for file in files_below(&root, "wgsl") {
        assert!(reached.contains(&file), "shaders/{file} belongs to no pass");
    }
}

/// The comment a pass opens with says what one invocation is, and what it reads and writes or where it comes from.
#[test]
fn every_pass_opens_with_what_it_does() {
    for shader in table::ALL {
        let text = std::fs::read_to_string(source_root().join("shaders").join(shader.file)).expect("readable");
        let header: String = text.lines().take_while(|l| l.starts_with("//")).collect();
        let header = header.to_lowercase();
        let invocation = ["one invocation", "one workgroup", "one vertex invocation"];
        assert!(invocation.iter().any(|words| header.contains(words)), "{}: what is one invocation?", shader.file);
        let writes = header.contains("writes") || header.contains("adds");
        // A render pass writes to its target and nothing else.
        let what = (header.contains("reads") && writes) || shader.workgroup_size[0] == 0;
        assert!(what || header.contains("source"), "{}: what does it read and write?", shader.file);
    }
}

/// The numbers of all `const {prefix}NAME = 0u;` lines of the shaders (test kernels number their operations), by NAME.
fn enumeration(prefix: &str) -> BTreeMap<String, usize> {
    enumeration_below("", prefix)
}

/// Those of the shaders in a folder.
fn enumeration_below(folder: &str, prefix: &str) -> BTreeMap<String, usize> {
    let root = source_root().join("shaders").join(folder);
    let mut found = BTreeMap::new();
    for file in files_below(&root, "wgsl").iter().filter(|file| !file.starts_with("tests/")) {
        let text = std::fs::read_to_string(root.join(file)).expect("readable");
        for line in text.lines().filter_map(|line| line.strip_prefix("const ")?.strip_prefix(prefix)) {
            let number = line.split_once(';').and_then(|(constant, _)| constant.split_once(" = "));
            let (name, number) = number.unwrap_or_else(|| panic!("{file}: const {prefix}{line}"));
            let number = number.strip_suffix('u').and_then(|n| n.parse().ok());
            let number = number.unwrap_or_else(|| panic!("{file}: const {prefix}{line}"));
            assert_eq!(found.insert(name.to_owned(), number), None, "{prefix}{name} twice");
        }
    }
    found
}

/// Arrays of shaders hold as many as parameters allow.
#[test]
fn shaders_have_room_for_what_parameters_allow() {
    let most = |technique, name: &str| {
        let specs = techniques::find(technique).expect("a technique").params;
        match specs.iter().find(|spec| spec.name == name).map(|spec| spec.kind) {
            Some(ParamKind::Uint { max, .. }) => max as usize,
            _ => panic!("{technique} has no number {name}"),
        }
    };
    let room = enumeration("MAXIMUM_");
    // The pixel's own reservoir is one of them.
    assert_eq!(room["DOMAINS"], 1 + most("restir-di", "spatial_neighbors"));
    assert_eq!(room["DOMAINS"], 1 + most("restir-di", "disocclusion_neighbors"));
    assert_eq!(room["STREAMS"], most("ris", "samples"));
}

/// A uniform holds the index of a choice, so shaders must count choices as they are declared.
#[test]
fn shaders_number_choices_as_declared() {
    let params = |id| techniques::find(id).expect("a technique").params;
    let choices = [
        ("REUSE_WEIGHT_", params("restir-di-decoupled"), "reuse_weights"),
        ("VISIBILITY_", params("restir-di-decoupled"), "visibility"),
        ("SPATIAL_PATTERN_", params("restir-di"), "spatial_pattern"),
        ("PIXEL_ORDER_", params("restir-di"), "pixel_order"),
        ("CONFIGURATION_", params("restir-report"), "configuration"),
        ("TONE_MAP_", FilmParams::SPECS, "tone_map"),
        ("MIS_", RenderParams::SPECS, "mis_heuristic"),
        ("PIXEL_FILTER_", RenderParams::SPECS, "pixel_filter"),
    ];
    for (prefix, specs, name) in choices {
        let spec = specs.iter().find(|spec| spec.name == name).unwrap_or_else(|| panic!("no parameter {name}"));
        let ParamKind::Choice(names) = spec.kind else { panic!("{name} is no choice") };
        // A slash or a digit has no place in the name of a constant: 1/z is Z.
        let constant = |name: &str| name.trim_start_matches("1/").replace('-', "_").to_uppercase();
        let declared: BTreeMap<_, _> = names.iter().enumerate().map(|(i, name)| (constant(name), i)).collect();
        assert_eq!(enumeration(prefix), declared, "{prefix}* and the choices of {name}");
    }
}

/// What a shader shows for a number is what the view of that number says.
#[test]
fn shaders_number_views_as_declared() {
    let constant = |view: &View| view.name.replace(' ', "_").to_uppercase();
    let expected = |views: &[View]| -> BTreeMap<_, _> {
        views.iter().enumerate().map(|(i, view)| (constant(view), i + 1)).collect()
    };
    let numbered = |folder: &str| enumeration_below(folder, "VIEW_");
    // The picture has no constant; what techniques count is drawn by the film.
    let mut film = expected(&COMMON_VIEWS[1..]);
    film.insert("REJECTED_NEIGHBOURS".to_owned(), COMMON_VIEWS.len());
    assert_eq!(numbered("film"), film);
    for info in techniques::ALL {
        let drawn = info.views.split(|view| view.counts()).next().expect("a slice");
        assert_eq!(numbered(&format!("techniques/{}", info.id)), expected(drawn), "{}", info.id);
    }
}

fn refusal(result: restir::Result<()>) -> String {
    match result {
        Err(Error::Shader { shader, what }) => format!("{shader}: {what}"),
        other => panic!("expected Error::Shader, got {other:?}"),
    }
}

#[test]
fn wrong_bindings_are_refused_by_name() {
    let gpu = gpu();
    let uniform = gpu.uniform("film", std::mem::size_of::<restir::film::FilmUniforms>() as u64);
    let buffer = gpu.storage("buffer", 64).expect("fits");
    let texture = gpu.texture("texture", UVec2::ONE, wgpu::TextureFormat::Rgba32Float);
    let mut recorder = Recorder::new(&gpu, None);
    recorder.share("film", &uniform);

    let unbound = recorder.pass(&table::FILM_ACCUMULATE).bind("radiance", &texture).dispatch([1, 1, 1]);
    let what = refusal(unbound);
    assert!(what.contains("film/accumulate") && what.contains("'accumulation'"), "{what}");

    let pass = recorder.pass(&table::FILM_ACCUMULATE).bind("accumulation", &buffer).bind("counters", &buffer);
    let what = refusal(pass.bind("radiance", &buffer).dispatch([1, 1, 1]));
    assert!(what.contains("'radiance' wants a texture"), "{what}");

    let pass = recorder.pass(&table::FILM_ACCUMULATE).bind("radiance", &texture).bind("counters", &buffer);
    let what = refusal(pass.bind("accumulation", &texture).dispatch([1, 1, 1]));
    assert!(what.contains("'accumulation' wants a buffer"), "{what}");

    let counters = gpu.storage("counters", std::mem::size_of::<restir::film::Counters>() as u64).expect("fits");
    let pass = recorder.pass(&table::FILM_ACCUMULATE).bind("radiance", &texture).bind("counters", &counters);
    pass.bind("accumulation", &buffer).dispatch([1, 1, 1]).expect("all right now");
    recorder.submit();
    gpu.check().expect("no device error");
}

#[cfg(debug_assertions)]
#[test]
fn edits_show_at_once_and_broken_edits_change_nothing() {
    let shaders = source_root().join("shaders");
    let folder = TemporaryFolder::new("reload");
    for file in files_below(&shaders, "wgsl") {
        folder.write(&file, &std::fs::read_to_string(shaders.join(&file)).expect("readable"), 0);
    }
    let gpu = fresh_gpu();
    gpu.watch_shaders(&folder.0);
    let mut renderer = renderer(&gpu, builtin("cornell"), [16, 16], "normals", &[]);
    let before = render(&mut renderer, 1);
    assert!(renderer.shader_problems.is_empty(), "{:?}", renderer.shader_problems);

    let file = "techniques/normals/normals.wgsl";
    let original = std::fs::read_to_string(shaders.join(file)).expect("readable");
    let edited = original.replace("vec4f(color, 1.0)", "vec4f(2.0 * color, 1.0)");
    assert_ne!(original, edited, "the edit must find its place");
    folder.write(file, &edited, 10);
    renderer.reset();
    let after = render(&mut renderer, 1);
    assert!(renderer.shader_problems.is_empty(), "{:?}", renderer.shader_problems);
    for (a, b) in before.pixels.iter().flatten().zip(after.pixels.iter().flatten()) {
        assert!((2.0 * a - b).abs() <= 1e-6, "{a} did not become {b}");
    }

    let line = edited.lines().position(|l| l.contains("2.0 * color")).expect("it is there") + 1;
    folder.write(file, &edited.replace("2.0 * color", "2.0 * colour"), 20);
    renderer.reset();
    let broken = render(&mut renderer, 1);
    assert_same(&broken, &after, "the old pipeline is kept");
    assert_eq!(renderer.shader_problems.len(), 1, "{:?}", renderer.shader_problems);
    assert!(renderer.shader_problems[0].contains(&format!("{file}:{line}")), "{:?}", renderer.shader_problems);

    let rebound = edited.replace("@binding(3) var<uniform> params", "@binding(7) var<uniform> params");
    folder.write(file, &rebound, 30);
    renderer.reset();
    assert_same(&render(&mut renderer, 1), &after, "an edit that changes bindings is not taken");
    assert!(renderer.shader_problems[0].contains("rebuild"), "{:?}", renderer.shader_problems);

    folder.write(file, &original, 40);
    renderer.reset();
    assert_same(&render(&mut renderer, 1), &before, "the edit is undone");
    assert!(renderer.shader_problems.is_empty());
}

const GOOD_MAIN: &str = "// Head.\n#include \"lib/a.wgsl\"\n#include \"lib/b.wgsl\"\n\n@compute @workgroup_size(1)\n\
    fn main() {\n    let x = a(b());\n}\n";

/// A main file that includes a, which includes b; b is then included again, to no effect.
fn small_tree(name: &str) -> TemporaryFolder {
    let folder = TemporaryFolder::new(name);
    folder.write("main.wgsl", GOOD_MAIN, 0);
    folder.write("lib/a.wgsl", "// A\n#include \"lib/b.wgsl\"\nfn a(x: f32) -> f32 {\n    return x;\n}\n", 0);
    folder.write("lib/b.wgsl", "// B\nfn b() -> f32 {\n    return 1.0;\n}\n", 0);
    folder
}

#[test]
fn flattening_keeps_every_line_and_its_place() {
    let folder = small_tree("places");
    let flattened = flatten(&folder.0, "main.wgsl").expect("flattens");
    assert_eq!(flattened.files, ["main.wgsl", "lib/a.wgsl", "lib/b.wgsl"]);
    assert_eq!(flattened.text.matches("fn b()").count(), 1, "included once");
    for (index, text) in flattened.text.lines().enumerate() {
        let place = flattened.place(index as u32 + 1);
        let (file, line) = place.split_once(':').expect("file:line");
        let source = std::fs::read_to_string(folder.0.join(file)).expect("readable");
        let there = source.lines().nth(line.parse::<usize>().expect("a number") - 1);
        assert_eq!(there, Some(text), "{place}");
    }
    assert!(reflect(&flattened).is_ok());
}

#[test]
fn errors_name_the_file_and_line_they_come_from() {
    let broken = |name: &str, file: &str, text: &str| {
        let folder = small_tree(name);
        folder.write(file, text, 0);
        flatten(&folder.0, "main.wgsl").and_then(|f| reflect(&f).map(|_| ())).expect_err("it is broken")
    };
    // Syntax, in an included file, after another include.
    let error =
        broken("syntax", "lib/a.wgsl", "// A\n#include \"lib/b.wgsl\"\nfn a(x: f32) -> f32 {\n    return @;\n}\n");
    assert!(error.starts_with("lib/a.wgsl:4:"), "{error}");
    // A type error, found by validation rather than parsing.
    let error = broken("type", "lib/b.wgsl", "// B\nfn b() -> f32 {\n    return 1u;\n}\n");
    assert!(error.starts_with("lib/b.wgsl:"), "{error}");
    // In the main file, after its includes.
    let error = broken("main", "main.wgsl", &GOOD_MAIN.replace("a(b())", "missing()"));
    assert!(error.starts_with("main.wgsl:7:"), "{error}");
    // Includes themselves.
    let error = broken("lost", "lib/a.wgsl", "// A\n#include \"lib/lost.wgsl\"\n");
    assert!(error.contains("lib/a.wgsl:2") && error.contains("lib/lost.wgsl"), "{error}");
    let error = broken("quote", "main.wgsl", "#include lib/a.wgsl\n");
    assert!(error.contains("main.wgsl:1"), "{error}");
}

#[test]
fn a_circle_of_includes_ends() {
    let folder = small_tree("circle");
    folder.write("lib/b.wgsl", "#include \"lib/a.wgsl\"\nfn b() -> f32 {\n    return 1.0;\n}\n", 0);
    let flattened = flatten(&folder.0, "main.wgsl").expect("flattens");
    assert!(reflect(&flattened).is_ok());
}
