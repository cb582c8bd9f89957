//! `path-tracer`: the reference.

use super::{Technique, TechniqueInfo};
use crate::error::Result;
use crate::gpu::{Gpu, recorder::Recorder, shader::table};
use glam::UVec2;

pub(super) static INFO: TechniqueInfo = TechniqueInfo {
    id: "path-tracer",
    title: "Path tracer",
    summary: "The reference: unidirectional paths, next-event estimation and BRDF sampling joined by multiple importance \
              sampling.",
    papers: &["Veach and Guibas 1995", "Lanz 2025, sections 2.1 and 2.2", "Heitz 2014", "Dupuy and Benyoub 2023"],
    unbiased: true,
    bias: "Unbiased for paths of up to max_depth scattering events; longer ones are left out.",
    params: &[],
    views: &[],
    layouts: &[],
    check: |_| Ok(()),
    create: |_| Box::new(PathTracer),
};

/// Its settings are those of all path tracing, in [`crate::params::RenderParams`].
struct PathTracer;

impl Technique for PathTracer {
    fn info(&self) -> &'static TechniqueInfo {
        &INFO
    }
    fn set(&mut self, _name: &str, _value: &str) -> Result<bool> {
        Ok(false)
    }
    fn values(&self) -> serde_json::Value {
        serde_json::json!({})
    }
    fn prepare(&mut self, _gpu: &Gpu, _size: UVec2) -> Result<()> {
        Ok(())
    }
    fn memory(&self) -> u64 {
        0
    }
    fn record(&mut self, recorder: &mut Recorder<'_>, size: UVec2) -> Result<()> {
        recorder.pass(&table::PATH_TRACER_TRACE).dispatch_over(size)
    }
}
