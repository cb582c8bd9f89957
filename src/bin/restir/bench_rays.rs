//! `restir bench rays`: how many rays a second the traversal traces, alone.

use crate::failure::{Failure, Result};
use crate::ray_sets::{self, BenchRay, Met, RaySet};
use crate::{options, report, scene};
use glam::{UVec2, Vec3};
use pollster::block_on;
use restir::frame::Frame;
use restir::gpu::recorder::{Recorder, Timer};
use restir::gpu::shader::{Shader, table};
use restir::gpu_scene::GpuScene;
use restir::scene::bvh::{self, Preset};
use restir::scene::{Camera, FlatScene};
use restir::{Gpu, GpuOptions, lab};
use std::path::PathBuf;
use std::time::Instant;

/// Measure ray queries alone: primary, diffuse bounce, shadow and second bounce, millions of rays a second.
///
/// Each set is traced twice over: by a kernel with one ray an invocation, as the techniques trace theirs ("plain"), and by one
/// whose lanes take the next ray when theirs is done ("queue"). Shadow rays go to random points on the scene's lights, or to 64
/// points within it where no light has a place.
#[derive(clap::Args)]
pub struct Args {
    /// A .glb, .gltf, .obj or .restir file, or builtin:NAME (see `restir scenes`).
    #[arg(value_name = "SCENE", default_value = "builtin:hall:1000000")]
    scene: String,
    #[command(flatten)]
    choice: scene::Choice,
    /// Picture size in pixels: how many primary rays there are.
    #[arg(long, value_name = "WxH", default_value = "1920x1080", value_parser = options::size)]
    size: UVec2,
    /// Camera of the scene, by index or name; the first where none is given.
    #[arg(long, value_name = "INDEX|NAME", conflicts_with = "eye")]
    camera: Option<String>,
    /// Where the camera stands, instead of a camera of the scene.
    #[arg(long, value_name = "X,Y,Z", requires = "target", value_parser = point, allow_hyphen_values = true)]
    eye: Option<Vec3>,
    /// What it looks at.
    #[arg(long, value_name = "X,Y,Z", requires = "eye", value_parser = point, allow_hyphen_values = true)]
    target: Option<Vec3>,
    /// Its vertical field of view in degrees.
    #[arg(long, value_name = "DEGREES", default_value_t = 60.0, requires = "eye")]
    fov: f32,
    /// Trace the rays of this file instead: 32 bytes each, little-endian f32: origin, tmin, direction, tmax.
    #[arg(long, value_name = "FILE")]
    rays: Option<PathBuf>,
    /// Any hit will do for the rays of the file.
    #[arg(long, requires = "rays")]
    any: bool,
    /// Write the hits of the file's rays: {t: f32, triangle: u32} each; tmax and 4294967295 for a miss.
    #[arg(long, value_name = "FILE", requires = "rays")]
    hits: Option<PathBuf>,
    /// Take alpha masks for opaque.
    #[arg(long)]
    opaque: bool,
    /// Times each set is traced.
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Three numbers.
fn point(text: &str) -> std::result::Result<Vec3, String> {
    let numbers: Vec<f32> =
        text.split(',').filter_map(|n| n.trim().parse().ok()).filter(|n: &f32| n.is_finite()).collect();
    <[f32; 3]>::try_from(numbers).map(Vec3::from_array).map_err(|_| format!("'{text}' is not X,Y,Z"))
}

#[derive(serde::Serialize)]
struct Report<'a> {
    scene: &'a str,
    triangles: u64,
    adapter: String,
    /// "timestamps" of the GPU, or "wall" time where those mean nothing (software adapters).
    clock: &'static str,
    runs: u32,
    builds: Vec<BuildReport>,
    sets: Vec<SetReport>,
}

/// Building the trees of all meshes.
#[derive(serde::Serialize)]
struct BuildReport {
    preset: String,
    seconds: f64,
    /// Of the first mesh, as [`bvh::cost`].
    cost: f32,
    depth: u32,
    /// Whether rays are measured in it.
    used: bool,
}

#[derive(serde::Serialize)]
struct SetReport {
    name: &'static str,
    rays: usize,
    hits: usize,
    /// Millions of rays a second, median: one ray an invocation.
    plain: f64,
    /// The same: lanes take the next ray.
    queue: f64,
}

pub fn run(args: &Args) -> Result<()> {
    if args.hits.is_some() && args.hits == args.rays {
        return Err(Failure::usage("hits", "they would take the place of the rays"));
    }
    let listed = args.rays.as_ref().map(|path| ray_sets::read(path)).transpose()?;
    let flat = scene::open(&args.scene, &args.choice, None)?;
    report::warnings(&flat.warnings);
    let camera = match (args.eye, args.target) {
        (Some(eye), Some(target)) if eye == target => {
            return Err(Failure::usage("target", "it is where the camera stands"));
        }
        (Some(eye), Some(target)) => Camera::look_at("given", eye, target, args.fov.to_radians()),
        _ => flat.cameras[scene::camera(&flat.cameras, args.camera.as_deref())?].clone(),
    };
    let builds = Preset::ALL.map(|preset| build(&flat, preset));

    let gpu = block_on(Gpu::headless(&GpuOptions { default_limits: false }))?;
    let bench = Bench::new(&gpu, &flat, args)?;
    let mut sets = Vec::new();
    if let Some(rays) = listed {
        let (report, met) = bench.measure(&RaySet { name: "file", any_hit: args.any, rays })?;
        sets.push(report);
        if let Some(path) = &args.hits {
            ray_sets::write_hits(path, &met)?;
        }
    } else {
        let primary = RaySet { name: "primary", any_hit: false, rays: ray_sets::primary(&camera, args.size) };
        let (report, met) = bench.measure(&primary)?;
        sets.push(report);
        let [diffuse, shadow] = ray_sets::bounced(&flat, &primary.rays, &met, 1);
        let diffuse = RaySet { name: "diffuse", any_hit: false, rays: diffuse };
        let (report, met) = bench.measure(&diffuse)?;
        sets.push(report);
        sets.push(bench.measure(&RaySet { name: "shadow", any_hit: true, rays: shadow })?.0);
        let [second, _] = ray_sets::bounced(&flat, &diffuse.rays, &met, 2);
        sets.push(bench.measure(&RaySet { name: "second bounce", any_hit: false, rays: second })?.0);
    }
    let report = Report {
        scene: &flat.name,
        triangles: flat.stats.triangles,
        adapter: gpu.adapter_name(),
        clock: if bench.timestamps { "timestamps" } else { "wall" },
        runs: args.runs,
        builds: builds.into(),
        sets,
    };
    if args.json { report::json(&report) } else { report::text(&table_of(&report)) }
}

/// Builds the trees of all meshes anew.
fn build(flat: &FlatScene, preset: Preset) -> BuildReport {
    let start = Instant::now();
    let trees: Vec<bvh::Bvh> = flat
        .meshes
        .iter()
        .map(|mesh| mesh.first_triangle as usize..(mesh.first_triangle + mesh.triangles) as usize)
        .map(|triangles| bvh::build_with(&flat.triangles[triangles], preset))
        .collect();
    let seconds = start.elapsed().as_secs_f64();
    BuildReport {
        preset: format!("{preset:?}").to_lowercase(),
        seconds,
        cost: trees.first().map_or(0.0, |tree| bvh::cost(&tree.nodes)),
        depth: trees.iter().map(|tree| tree.depth).max().unwrap_or(0),
        used: preset == Preset::default(),
    }
}

fn table_of(report: &Report) -> String {
    let mut lines = vec![
        format!("{}, {} triangles, on {}", report.scene, report.triangles, report.adapter),
        format!("Mrays/s, median of {} ({})", report.runs, report.clock),
        format!("{:16} {:>9} {:>9} {:>9} {:>9}", "", "rays", "hits", "plain", "queue"),
    ];
    lines.extend(
        report
            .sets
            .iter()
            .map(|set| format!("{:16} {:9} {:9} {:9.2} {:9.2}", set.name, set.rays, set.hits, set.plain, set.queue)),
    );
    lines.join("\n")
}

restir::gpu_struct! {
/// A part of a list of rays, as `shaders/bench/bench.wgsl` declares it.
pub struct BenchRays {
    /// Number of rays.
    pub count: u32,
    /// 1 if any hit will do.
    pub any_hit: u32,
}
}

/// A scene on the device.
struct Bench<'a> {
    gpu: &'a Gpu,
    scene: GpuScene,
    frame: wgpu::Buffer,
    runs: u32,
    opaque: bool,
    timestamps: bool,
}

/// Part of a list on the device.
struct Part {
    uniform: wgpu::Buffer,
    rays: wgpu::Buffer,
    hits: wgpu::Buffer,
    count: u32,
}

/// Rays of a part: 64 MiB of them and as much of hits, within WebGPU's default limits.
const PART: usize = 1 << 21;

impl<'a> Bench<'a> {
    fn new(gpu: &'a Gpu, flat: &FlatScene, args: &Args) -> Result<Self> {
        let scene = GpuScene::new(gpu, flat)?;
        let frame = gpu.uniform("frame", size_of::<Frame>() as u64);
        let contents = Frame { top_level: scene.top_level(), ..bytemuck::Zeroable::zeroed() };
        gpu.queue.write_buffer(&frame, 0, bytemuck::bytes_of(&contents));
        // The timestamps of software adapters fall together.
        let timestamps = gpu.has_timestamps && !gpu.is_software();
        Ok(Bench { gpu, scene, frame, runs: args.runs, opaque: args.opaque, timestamps })
    }

    /// Traces a set with both kernels.
    fn measure(&self, set: &RaySet) -> Result<(SetReport, Vec<Met>)> {
        let parts: Vec<Part> =
            set.rays.chunks(PART).map(|rays| self.upload(rays, set.any_hit)).collect::<Result<_>>()?;
        let queue = self.time(&table::BENCH_QUEUE, 256, &parts)?;
        let plain = self.time(&table::BENCH_RAYS, 64, &parts)?;
        let mut met = Vec::new();
        for part in &parts {
            let bytes = block_on(self.gpu.read_buffer(&part.hits, u64::from(part.count) * 16))?;
            let hits: Vec<[u32; 4]> = bytemuck::pod_collect_to_vec(&bytes);
            met.extend(hits.iter().map(|&[t, triangle, instance, _]| Met { t: f32::from_bits(t), triangle, instance }));
        }
        let hits = met.iter().filter(|met| met.triangle != restir::scene::gpu_types::NONE).count();
        let rate = |seconds: f64| 1e-6 * set.rays.len() as f64 / seconds;
        Ok((SetReport { name: set.name, rays: set.rays.len(), hits, plain: rate(plain), queue: rate(queue) }, met))
    }

    fn upload(&self, rays: &[BenchRay], any_hit: bool) -> Result<Part> {
        let count = rays.len() as u32;
        let uniform = self.gpu.uniform("bench", size_of::<BenchRays>() as u64);
        let contents = BenchRays { count, any_hit: any_hit.into() };
        self.gpu.queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&contents));
        let hits = self.gpu.storage("hits", u64::from(count) * 16)?;
        Ok(Part { uniform, rays: self.gpu.storage_of("rays", rays)?, hits, count })
    }

    /// The median time in seconds that a kernel takes for all parts; it runs once before.
    fn time(&self, shader: &'static Shader, rays_per_group: u32, parts: &[Part]) -> Result<f64> {
        let mut timer = if self.timestamps { Timer::new(self.gpu) } else { None };
        let mut seconds = Vec::new();
        for _ in 0..=self.runs {
            let mut sum = 0.0;
            for part in parts {
                block_on(self.gpu.wait())?;
                let start = Instant::now();
                self.trace(shader, rays_per_group, part, timer.as_mut())?;
                block_on(self.gpu.wait())?;
                sum += match &timer {
                    Some(timer) => block_on(timer.read(self.gpu))?.iter().map(|pass| 1e-3 * pass.ms).sum(),
                    None => start.elapsed().as_secs_f64(),
                };
            }
            seconds.push(sum);
        }
        Ok(lab::median(&seconds[1..]))
    }

    fn trace(
        &self,
        shader: &'static Shader,
        rays_per_group: u32,
        part: &Part,
        timer: Option<&mut Timer>,
    ) -> Result<()> {
        let mut recorder = Recorder::new(self.gpu, timer);
        self.scene.share(&mut recorder);
        recorder.features.alpha_masks &= !self.opaque;
        recorder.share("frame", &self.frame);
        let pass = recorder.pass(shader).bind("bench", &part.uniform).bind("bench_rays", &part.rays);
        pass.bind("bench_hits", &part.hits)
            .dispatch([part.count.div_ceil(rays_per_group), 1, 1])
            .map_err(Failure::from)?;
        recorder.submit();
        Ok(())
    }
}
