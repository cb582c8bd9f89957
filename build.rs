//! Makes the shader table: every pass under `shaders/` flattened, parsed, validated and reflected. Makes the table of
//! directional albedos that they read.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

#[path = "build/albedo.rs"]
mod albedo;
#[path = "src/gpu/binding_kind.rs"]
mod binding_kind;
#[path = "src/gpu/shader_source.rs"]
mod shader_source;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=build");
    println!("cargo:rerun-if-changed=src/gpu/binding_kind.rs");
    println!("cargo:rerun-if-changed=src/gpu/shader_source.rs");
    println!("cargo:rerun-if-changed=shaders");
    println!("cargo:rerun-if-changed=lab");
    let root = PathBuf::from(std::env::var("CARGO_MANIFEST_DIR").expect("cargo sets it")).join("shaders");
    let out = PathBuf::from(std::env::var("OUT_DIR").expect("cargo sets it"));
    let wasm = std::env::var("CARGO_CFG_TARGET_ARCH").is_ok_and(|arch| arch == "wasm32");
    let mut passes = Vec::new();
    collect(&root, &root, &mut passes);
    passes.sort();
    // The page carries no kernels of tests and benchmarks.
    passes.retain(|file| !(wasm && (file.starts_with("tests/") || file.starts_with("bench/"))));

    // A flat copy for other validators (Tint), beside the build rather than in it. Native only.
    let copies = (!wasm).then(|| out.ancestors().nth(4).expect("target/PROFILE/build/NAME/out").join("shaders"));
    if let Some(copies) = &copies {
        let _ = std::fs::remove_dir_all(copies);
        std::fs::create_dir_all(copies).expect("target folder is writable");
    }

    let mut table = String::new();
    let mut names = Vec::new();
    let mut errors = Vec::new();
    for file in &passes {
        match shader_source::flatten(&root, file).and_then(|f| shader_source::reflect(&f).map(|r| (f, r))) {
            Ok((flattened, reflection)) => {
                let id = file.trim_end_matches(".wgsl").trim_start_matches("techniques/").to_owned();
                let flat_name = format!("{}.wgsl", id.replace('/', "."));
                // The page downloads no comments; lines keep their numbers, so a browser's words match target/shaders.
                let text = if wasm { without_comments(&flattened.text) } else { flattened.text.clone() };
                std::fs::write(out.join(&flat_name), text).expect("OUT_DIR is writable");
                if let Some(copies) = &copies {
                    std::fs::write(copies.join(&flat_name), &flattened.text).expect("target folder is writable");
                }
                let name = id.replace(['/', '-'], "_").to_uppercase();
                write_entry(&mut table, &name, &id, file, &flat_name, &reflection);
                names.push(name);
            }
            Err(error) => errors.push(error),
        }
    }
    for error in &errors {
        for line in error.lines() {
            println!("cargo:warning=shaders/{line}");
        }
    }
    assert!(errors.is_empty(), "{} shader(s) failed:\n{}", errors.len(), errors.join("\n"));
    writeln!(table, "/// Every pass.\npub static ALL: &[&Shader] = &[{}];", list(&names, |n| format!("&{n}"))).unwrap();
    std::fs::write(out.join("shaders.rs"), table).expect("OUT_DIR is writable");
    for (folder, table) in [("lab", "experiments.rs"), ("lab/truth", "claims.rs")] {
        std::fs::write(out.join(table), embedded(&root.join("..").join(folder))).expect("OUT_DIR is writable");
    }
    // A second of work, and the same for every shader: only when its source is newer.
    let time = |path: &Path| std::fs::metadata(path).and_then(|m| m.modified()).ok();
    let albedo = out.join("albedo.bin");
    if time(&albedo).is_none() || time(&albedo) < time(&root.join("../build/albedo.rs")) {
        std::fs::write(albedo, albedo::table()).expect("OUT_DIR is writable");
    }
}

/// Every file with an entry point, relative to `root`.
fn collect(root: &Path, folder: &Path, passes: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).expect("shaders/ is readable") {
        let path = entry.expect("shaders/ is readable").path();
        if path.is_dir() {
            collect(root, &path, passes);
        } else if path.extension().is_some_and(|e| e == "wgsl") {
            let text = std::fs::read_to_string(&path).expect("shaders are UTF-8");
            if text.lines().any(|l| l.starts_with("@compute") || l.starts_with("@vertex")) {
                let file = path.strip_prefix(root).expect("below root");
                passes.push(file.to_str().expect("shader names are UTF-8").replace('\\', "/"));
            }
        }
    }
}

/// A Rust array of (name, text) of every .toml file in a folder, by name.
fn embedded(folder: &Path) -> String {
    let entries = std::fs::read_dir(folder).expect("lab/ is readable");
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("lab/ is readable").path()).collect();
    files.retain(|file| file.extension().is_some_and(|extension| extension == "toml"));
    files.sort();
    let entry = |file: &PathBuf| {
        let file = file.canonicalize().expect("the file is there");
        format!("({:?}, include_str!({:?}))", file.file_stem().unwrap_or_default().to_string_lossy(), file)
    };
    format!("&[{}]", list(&files, entry))
}

/// WGSL without its line comments (it has no strings that could hold a `//`).
fn without_comments(text: &str) -> String {
    text.lines().flat_map(|line| [line.split("//").next().unwrap_or_default().trim(), "\n"]).collect()
}

fn list<T>(items: &[T], show: impl Fn(&T) -> String) -> String {
    items.iter().map(show).collect::<Vec<_>>().join(", ")
}

fn write_entry(
    table: &mut String,
    name: &str,
    id: &str,
    file: &str,
    flat_name: &str,
    reflection: &shader_source::Reflection,
) {
    let bindings = list(&reflection.bindings, |b| {
        format!(
            "Binding {{ name: {:?}, group: {}, index: {}, kind: BindingKind::{:?} }}",
            b.name, b.group, b.index, b.kind
        )
    });
    let structs = list(&reflection.structs, |s| {
        let fields = list(&s.fields, |(name, offset)| format!("({name:?}, {offset})"));
        format!("StructLayout {{ name: {:?}, size: {}, fields: &[{fields}] }}", s.name, s.size)
    });
    writeln!(
        table,
        "/// `shaders/{file}`\npub static {name}: Shader = Shader {{\n    id: {id:?},\n    file: {file:?},\n    \
         source: include_str!(concat!(env!(\"OUT_DIR\"), \"/{flat_name}\")),\n    workgroup_size: {:?},\n    \
         bindings: &[{bindings}],\n    overrides: &{:?},\n    structs: &[{structs}],\n}};",
        reflection.workgroup_size, reflection.overrides
    )
    .unwrap();
}
