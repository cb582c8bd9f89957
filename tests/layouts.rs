//! Rust and WGSL agree on every struct they share: each registered Rust struct equals the WGSL struct of the same name
//! in every shader that declares it, none is registered in vain, and no struct is bound to a shader without a Rust twin.

mod support;

use restir::gpu::shader::{Shader, table};
use restir::scene::gpu_types::Layout;
use std::collections::BTreeSet;
use support::bsdf::Bsdf;
use support::harness::{TestInput, TestOutput, TestRun};

/// Bound structs that need no twin, with the reason.
const WITHOUT_TWIN: &[(&str, &str)] = &[
    ("PassIndex", "one word, written as such"),
    ("BenchRay", "32 bytes of a file of rays, copied as they are"),
    ("BenchRays", "its twin is in the program, which the library does not know"),
];

fn registered() -> Vec<Layout> {
    let mut all = restir::gpu_layouts();
    all.extend([TestInput::LAYOUT, TestOutput::LAYOUT, TestRun::LAYOUT, Bsdf::LAYOUT]);
    all
}

/// One line for each way in which Rust and WGSL differ.
fn problems(layouts: &[Layout], shaders: &[&Shader]) -> Vec<String> {
    let mut problems = Vec::new();
    for layout in layouts {
        let mut seen = false;
        for shader in shaders {
            for wgsl in shader.structs.iter().filter(|s| s.name == layout.name) {
                seen = true;
                let place = format!("{} in {}", layout.name, shader.file);
                if wgsl.size as usize != layout.size {
                    problems.push(format!("{place}: {} bytes in WGSL, {} in Rust", wgsl.size, layout.size));
                }
                let rust: Vec<_> = layout.fields.iter().map(|(name, offset)| (*name, *offset)).collect();
                let fields: Vec<_> = wgsl.fields.iter().map(|(name, offset)| (*name, *offset as usize)).collect();
                if rust != fields {
                    problems.push(format!("{place}: WGSL has {fields:?}, Rust {rust:?}"));
                }
            }
        }
        if !seen {
            problems.push(format!("{} is registered, but no shader declares it", layout.name));
        }
    }
    problems
}

/// Names of the structs that a shader's uniform and storage buffers hold, however deep.
fn bound_structs(shader: &Shader) -> BTreeSet<String> {
    let module = naga::front::wgsl::parse_str(shader.source).expect("the build validated it");
    let mut found = BTreeSet::new();
    let mut pending: Vec<_> = module
        .global_variables
        .iter()
        .filter(|(_, v)| matches!(v.space, naga::AddressSpace::Uniform | naga::AddressSpace::Storage { .. }))
        .map(|(_, v)| v.ty)
        .collect();
    while let Some(handle) = pending.pop() {
        match &module.types[handle].inner {
            naga::TypeInner::Struct { members, .. } => {
                found.extend(module.types[handle].name.clone());
                pending.extend(members.iter().map(|m| m.ty));
            }
            naga::TypeInner::Array { base, .. } => pending.push(*base),
            _ => {}
        }
    }
    found
}

#[test]
fn rust_and_wgsl_layouts_agree() {
    let problems = problems(&registered(), table::ALL);
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
fn every_bound_struct_has_a_rust_twin() {
    let known: BTreeSet<_> =
        registered().iter().map(|l| l.name).chain(WITHOUT_TWIN.iter().map(|(name, _)| *name)).collect();
    let mut bound = BTreeSet::new();
    for shader in table::ALL {
        for name in bound_structs(shader) {
            assert!(known.contains(name.as_str()), "{name} in {} is bound, but has no Rust twin", shader.file);
            bound.insert(name);
        }
    }
    for (name, reason) in WITHOUT_TWIN {
        assert!(bound.contains(*name), "{name} ({reason}) is excused in vain");
    }
    assert!(bound.contains("CameraView"), "nested structs are followed");
}

#[test]
fn no_name_is_registered_twice() {
    let all = registered();
    let names: BTreeSet<_> = all.iter().map(|l| l.name).collect();
    assert_eq!(names.len(), all.len());
}

/// The comparison itself can fail: a wrong size, offset, name, or a struct that no shader has is reported.
#[test]
fn wrong_layouts_are_reported() {
    let right = Layout { name: "TestRun", size: 8, fields: &[("operation", 0), ("count", 4)] };
    assert!(problems(&[right], table::ALL).is_empty());
    let wrong = [
        Layout { size: 16, ..right },
        Layout { fields: &[("operation", 0), ("count", 8)], ..right },
        Layout { fields: &[("count", 0), ("operation", 4)], ..right },
        Layout { fields: &[("operation", 0)], ..right },
        Layout { name: "NowhereDeclared", ..right },
    ];
    for layout in wrong {
        assert!(!problems(&[layout], table::ALL).is_empty(), "{layout:?} passed");
    }
}
