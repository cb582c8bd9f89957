//! Shader files: flattening includes, mapping lines back, and reflecting what a pass binds.
//!
//! Shared by `build.rs`, which makes the shader table, and by native debug builds, which reload shaders from disk. One
//! directive exists: a line `#include "path/from/shaders.wgsl"`, which is replaced by that file the first time it is met
//! and by nothing after that.

use super::binding_kind::BindingKind;
use std::collections::HashSet;
use std::path::Path;

/// Where a run of flattened lines came from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Segment {
    /// First line of the run in the flattened text, counted from 1.
    pub line: u32,
    /// The file, relative to `shaders/`.
    pub file: String,
    /// The line in that file, counted from 1.
    pub file_line: u32,
}

/// One pass with its includes in place, comments kept.
#[derive(Debug, Clone, Default)]
pub struct Flattened {
    /// WGSL.
    pub text: String,
    /// Sorted by `line`.
    pub segments: Vec<Segment>,
    /// Every file that went in, relative to `shaders/`.
    pub files: Vec<String>,
}

impl Flattened {
    /// `file:line` of a line of the flattened text.
    pub fn place(&self, line: u32) -> String {
        match self.segments.iter().take_while(|segment| segment.line <= line).last() {
            Some(segment) => format!("{}:{}", segment.file, segment.file_line + line - segment.line),
            None => format!("line {line}"),
        }
    }
}

/// Flattens `file` (relative to `root`) with everything it includes.
pub fn flatten(root: &Path, file: &str) -> Result<Flattened, String> {
    let mut out = Flattened::default();
    let mut line = 1;
    append(root, file, "", &mut HashSet::new(), &mut out, &mut line)?;
    Ok(out)
}

fn append(
    root: &Path,
    file: &str,
    includer: &str,
    seen: &mut HashSet<String>,
    out: &mut Flattened,
    line: &mut u32,
) -> Result<(), String> {
    if !seen.insert(file.to_owned()) {
        return Ok(());
    }
    let text = std::fs::read_to_string(root.join(file))
        .map_err(|e| format!("{includer}{}shaders/{file}: {e}", if includer.is_empty() { "" } else { ": " }))?;
    out.files.push(file.to_owned());
    let mut new_run = true;
    for (index, source) in text.lines().enumerate() {
        if let Some(rest) = source.trim_start().strip_prefix("#include") {
            let place = format!("shaders/{file}:{}", index + 1);
            let name = rest
                .trim()
                .strip_prefix('"')
                .and_then(|r| r.strip_suffix('"'))
                .ok_or_else(|| format!("{place}: expected #include \"file.wgsl\""))?;
            append(root, name, &place, seen, out, line)?;
            new_run = true;
            continue;
        }
        if new_run {
            out.segments.push(Segment { line: *line, file: file.to_owned(), file_line: index as u32 + 1 });
            new_run = false;
        }
        out.text.push_str(source);
        out.text.push('\n');
        *line += 1;
    }
    Ok(())
}

/// One resource that the entry points reach.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReflectedBinding {
    /// The variable's name.
    pub name: String,
    /// `@group`.
    pub group: u32,
    /// `@binding`.
    pub index: u32,
    /// What it is.
    pub kind: BindingKind,
}

/// A host-shareable struct as the shader lays it out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReflectedStruct {
    /// Its name.
    pub name: String,
    /// Its size in bytes.
    pub size: u32,
    /// (field, byte offset).
    pub fields: Vec<(String, u32)>,
}

/// What a pass is, read from its parsed WGSL.
#[derive(Debug, Clone, Default)]
pub struct Reflection {
    /// Entry points: (name, stage).
    pub entry_points: Vec<(String, naga::ShaderStage)>,
    /// `@workgroup_size` of `main`; zeros for a render pass.
    pub workgroup_size: [u32; 3],
    /// By group, then index.
    pub bindings: Vec<ReflectedBinding>,
    /// `override` declarations.
    pub overrides: Vec<String>,
    /// Every struct that has a layout.
    pub structs: Vec<ReflectedStruct>,
}

/// Parses, validates and reflects a flattened pass. Errors carry `file:line` of the source.
pub fn reflect(flattened: &Flattened) -> Result<Reflection, String> {
    let text = &flattened.text;
    let module = naga::front::wgsl::parse_str(text).map_err(|e| {
        let line = e.location(text).map_or(0, |l| l.line_number);
        format!("{}: {e}", flattened.place(line))
    })?;
    let info = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty())
        .validate(&module)
        .map_err(|e| {
            let line = e.location(text).map_or(0, |l| l.line_number);
            let mut what = e.as_inner().to_string();
            let mut source = std::error::Error::source(e.as_inner());
            while let Some(inner) = source {
                what = format!("{what}: {inner}");
                source = inner.source();
            }
            format!("{}: {what}", flattened.place(line))
        })?;
    let mut out = Reflection::default();
    for (index, entry) in module.entry_points.iter().enumerate() {
        out.entry_points.push((entry.name.clone(), entry.stage));
        if entry.stage == naga::ShaderStage::Compute {
            out.workgroup_size = entry.workgroup_size;
        }
        let used = info.get_entry_point(index);
        for (handle, variable) in module.global_variables.iter() {
            let Some(binding) = variable.binding.as_ref().filter(|_| !used[handle].is_empty()) else { continue };
            let name = variable.name.clone().unwrap_or_default();
            if out.bindings.iter().any(|b| b.name == name) {
                continue;
            }
            let kind =
                binding_kind(&module, variable).ok_or_else(|| format!("{name}: a resource we have no use for"))?;
            out.bindings.push(ReflectedBinding { name, group: binding.group, index: binding.binding, kind });
        }
    }
    out.overrides = module.overrides.iter().filter_map(|(_, o)| o.name.clone()).collect();
    out.bindings.sort_by_key(|b| (b.group, b.index));
    if let Some(pair) = out.bindings.windows(2).find(|w| (w[0].group, w[0].index) == (w[1].group, w[1].index)) {
        return Err(format!("{} and {} share one @group/@binding", pair[0].name, pair[1].name));
    }
    for (_, ty) in module.types.iter() {
        if let (Some(name), naga::TypeInner::Struct { members, span }) = (&ty.name, &ty.inner) {
            let fields = members.iter().map(|m| (m.name.clone().unwrap_or_default(), m.offset)).collect();
            out.structs.push(ReflectedStruct { name: name.clone(), size: *span, fields });
        }
    }
    Ok(out)
}

fn binding_kind(module: &naga::Module, variable: &naga::GlobalVariable) -> Option<BindingKind> {
    use naga::{AddressSpace, ImageClass, ImageDimension, ScalarKind, StorageAccess, StorageFormat, TypeInner};
    let inner = &module.types[variable.ty].inner;
    Some(match (variable.space, inner) {
        (AddressSpace::Uniform, _) => BindingKind::Uniform(inner.size(module.to_ctx())),
        (AddressSpace::Storage { access }, _) if access.contains(StorageAccess::STORE) => BindingKind::StorageReadWrite,
        (AddressSpace::Storage { .. }, _) => BindingKind::StorageRead,
        (_, TypeInner::Image { dim: ImageDimension::D2, arrayed, class }) => match (class, arrayed) {
            (ImageClass::Sampled { kind: ScalarKind::Float, .. }, false) => BindingKind::TextureFloat,
            (ImageClass::Sampled { kind: ScalarKind::Uint, .. }, false) => BindingKind::TextureUint,
            (ImageClass::Sampled { kind: ScalarKind::Float, .. }, true) => BindingKind::TextureFloatArray,
            (ImageClass::Storage { format: StorageFormat::Rgba32Float, .. }, false) => BindingKind::StorageTextureFloat,
            (ImageClass::Storage { format: StorageFormat::Rgba32Uint, .. }, false) => BindingKind::StorageTextureUint,
            _ => return None,
        },
        _ => return None,
    })
}
