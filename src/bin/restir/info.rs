//! `restir info`: what a scene holds.

use crate::failure::Result;
use crate::{report, scene};
use restir::scene::flat::{SceneStats, TextureStats};
use restir::scene::gpu_types::NONE;

/// Show what a scene holds: triangles, lights, bytes, the BVH, warnings.
#[derive(clap::Args)]
pub struct Args {
    /// A .glb, .gltf, .obj or .restir file, or builtin:NAME (see `restir scenes`).
    #[arg(value_name = "SCENE")]
    scene: String,
    #[command(flatten)]
    choice: scene::Choice,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct Info {
    name: String,
    #[serde(flatten)]
    stats: SceneStats,
    cameras: Vec<String>,
    /// Of a glTF file: what --scene-index and --variant choose from.
    scenes: Vec<String>,
    variants: Vec<String>,
    moving_lights: usize,
    /// Lights that change their power.
    dimmed_lights: usize,
    moving_instances: usize,
    moving_cameras: usize,
    animations: Vec<Animation>,
    /// Lowest and highest corner in metres.
    bounds: [[f32; 3]; 2],
    warnings: Vec<String>,
}

/// One of the animations that `--animation` takes.
#[derive(serde::Serialize)]
struct Animation {
    name: String,
    seconds: f32,
}

impl Animation {
    fn of(clip: &restir::scene::rig::Clip) -> Self {
        Animation { name: clip.name.clone(), seconds: clip.duration }
    }

    fn line(&self) -> String {
        format!("{} ({:.2} s)", self.name, self.seconds)
    }
}

pub fn run(args: &Args) -> Result<()> {
    let flat = scene::open(&args.scene, &args.choice, None)?;
    let contents = scene::contents(&args.scene)?;
    let info = Info {
        name: flat.name,
        stats: flat.stats,
        cameras: flat.cameras.into_iter().map(|camera| camera.name).collect(),
        scenes: contents.scenes,
        variants: contents.variants,
        moving_lights: flat.rig.lights.len(),
        dimmed_lights: flat.light_powers.iter().filter(|&&power| power != NONE).count(),
        moving_instances: flat.rig.instances.len(),
        moving_cameras: flat.rig.cameras.len(),
        animations: flat.rig.clips.iter().map(Animation::of).collect(),
        bounds: flat.bounds.map(|corner| corner.to_array()),
        warnings: flat.warnings,
    };
    if args.json {
        return report::json(&info);
    }
    report::warnings(&info.warnings);
    report::text(&table(&info))
}

fn table(info: &Info) -> String {
    let (stats, [low, high]) = (&info.stats, info.bounds);
    let listed = |names: &[String]| if names.is_empty() { "none".to_owned() } else { names.join(", ") };
    [
        format!("name       {}", info.name),
        format!("triangles  {} (and {} dropped without area)", stats.triangles, stats.dropped_triangles),
        format!("instances  {}", stats.instances),
        format!("materials  {}", stats.materials),
        format!("textures   {}", stats.textures),
        format!("lights     {} ({} emissive triangles)", stats.lights, stats.emissive_triangles),
        format!(
            "moving     {} instances, {} lights, {} cameras; {} lights change their power",
            info.moving_instances, info.moving_lights, info.moving_cameras, info.dimmed_lights
        ),
        format!("animations {}", info.animations.iter().map(Animation::line).collect::<Vec<_>>().join(", ")),
        format!("cameras    {}", info.cameras.join(", ")),
        format!("scenes     {}", listed(&info.scenes)),
        format!("variants   {}", listed(&info.variants)),
        format!("bounds     {low:?} to {high:?} m"),
        format!("bvh        {} nodes, depth {}, cost {:.1}", stats.bvh_nodes, stats.bvh_depth, stats.bvh_cost),
        format!("memory     {:.1} MiB on the GPU", mebibytes(stats.gpu_bytes)),
    ]
    .into_iter()
    .chain(textures(&stats.texture_arrays))
    .collect::<Vec<_>>()
    .join("\n")
}

/// A line for all texture arrays, and one for each.
fn textures(arrays: &[TextureStats]) -> Vec<String> {
    if arrays.is_empty() {
        return Vec::new();
    }
    let of = |count: fn(&TextureStats) -> u64| arrays.iter().map(count).sum::<u64>();
    let (images, bytes, used) = (of(|a| a.images), of(|a| a.bytes), of(|a| a.used_bytes));
    let empty = |bytes: u64, used: u64| 100.0 * (bytes - used.min(bytes)) as f64 / bytes.max(1) as f64;
    let total = format!(
        "images     {images} in {} arrays: {:.1} MiB of that, {:.1} % of it empty",
        arrays.len(),
        mebibytes(bytes),
        empty(bytes, used)
    );
    let each = arrays.iter().map(|a| {
        format!(
            "  array    {} x {} x {} layers, {} levels: {} images, {:.1} MiB, {:.1} % empty",
            a.width,
            a.height,
            a.layers,
            a.levels,
            a.images,
            mebibytes(a.bytes),
            empty(a.bytes, a.used_bytes)
        )
    });
    std::iter::once(total).chain(each).collect()
}

fn mebibytes(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}
