//! Reloading shaders from disk while the program runs (native debug builds).

use super::PipelineKey;
use super::shader::{Shader, table};
use super::shader_source::flatten;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Watches a shader folder by modification times.
#[derive(Debug)]
pub struct Reloader {
    folder: PathBuf,
    seen: SystemTime,
    /// Flattened text of every shader that was edited, by id.
    edited: HashMap<&'static str, String>,
}

impl Reloader {
    /// Watches `folder`; only changes from now on count.
    pub fn new(folder: &Path) -> Self {
        Reloader {
            folder: folder.to_owned(),
            seen: newest(folder).unwrap_or(SystemTime::UNIX_EPOCH),
            edited: HashMap::new(),
        }
    }

    /// Watches the folder this program was built from, if it is still there.
    pub fn of_source_tree() -> Option<Self> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
        folder.is_dir().then(|| Self::new(&folder))
    }

    /// Takes up every shader whose text changed and drops its pipelines, so that the next use makes them anew. No file
    /// changed: `None`. Else one line for each shader that does not compile; it keeps its old text and pipelines.
    pub fn reload(&mut self, pipelines: &mut HashMap<PipelineKey, wgpu::ComputePipeline>) -> Option<Vec<String>> {
        let newest = newest(&self.folder).filter(|t| *t > self.seen)?;
        self.seen = newest;
        let mut problems = Vec::new();
        for shader in table::ALL {
            match flatten(&self.folder, shader.file) {
                Ok(flattened) if flattened.text == self.source(shader) => {}
                Ok(flattened) => match shader.accepts(&flattened) {
                    Ok(()) => {
                        self.edited.insert(shader.id, flattened.text);
                        pipelines.retain(|(id, _), _| *id != shader.id);
                    }
                    Err(problem) => problems.push(problem),
                },
                Err(problem) => problems.push(problem),
            }
        }
        Some(problems)
    }

    /// The text a shader's pipelines are made from: as edited, or as built.
    pub fn source<'a>(&'a self, shader: &'a Shader) -> &'a str {
        self.edited.get(shader.id).map_or(shader.source, String::as_str)
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
