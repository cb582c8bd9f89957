//! Reloading shaders from disk while the program runs (native debug builds).

use super::PipelineKey;
use super::shader::{Pipeline, table};
use super::shader_source::{flatten, reflect};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Watches a shader folder by modification times.
#[derive(Debug)]
pub struct Reloader {
    folder: PathBuf,
    seen: SystemTime,
}

impl Reloader {
    /// Watches `folder`; only changes from now on count.
    pub fn new(folder: &Path) -> Self {
        Reloader { folder: folder.to_owned(), seen: newest(folder).unwrap_or(SystemTime::UNIX_EPOCH) }
    }

    /// Watches the folder this program was built from, if it is still there.
    pub fn of_source_tree() -> Option<Self> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
        folder.is_dir().then(|| Self::new(&folder))
    }

    /// Rebuilds every pipeline in `pipelines` if any file changed. Returns one line for each that failed and was kept.
    pub fn reload(&mut self, device: &wgpu::Device, pipelines: &mut HashMap<PipelineKey, Pipeline>) -> Vec<String> {
        let Some(newest) = newest(&self.folder).filter(|t| *t > self.seen) else { return Vec::new() };
        self.seen = newest;
        let mut problems = Vec::new();
        for shader in table::ALL {
            if !pipelines.keys().any(|(id, _)| *id == shader.id) {
                continue;
            }
            let source = flatten(&self.folder, shader.file).and_then(|flattened| {
                let reflection = reflect(&flattened)?;
                let same = reflection.workgroup_size == shader.workgroup_size
                    && reflection.bindings.len() == shader.bindings.len()
                    && reflection.bindings.iter().zip(shader.bindings).all(|(new, old)| {
                        (new.name.as_str(), new.group, new.index, new.kind)
                            == (old.name, old.group, old.index, old.kind)
                    });
                if !same {
                    return Err(format!("{}: bindings or workgroup size changed; rebuild the program", shader.file));
                }
                Ok(flattened.text)
            });
            match source {
                Ok(text) => {
                    for ((id, features), slot) in pipelines.iter_mut() {
                        if *id == shader.id {
                            *slot = shader.compute_pipeline(device, &text, *features);
                        }
                    }
                }
                Err(problem) => problems.push(problem),
            }
        }
        problems
    }
}

fn newest(folder: &Path) -> Option<SystemTime> {
    let mut newest = None;
    for entry in std::fs::read_dir(folder).ok()?.flatten() {
        let path = entry.path();
        let time = if path.is_dir() { self::newest(&path) } else { entry.metadata().and_then(|m| m.modified()).ok() };
        newest = newest.max(time);
    }
    newest
}
