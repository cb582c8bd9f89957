//! `restir info`: what a scene holds.

use crate::failure::Result;
use crate::{report, scene};
use restir::scene::flat::SceneStats;

/// Show what a scene holds: triangles, lights, bytes, the BVH, warnings.
#[derive(clap::Args)]
pub struct Args {
    /// A .glb or .gltf file, or builtin:NAME (see `restir scenes`).
    #[arg(value_name = "SCENE")]
    scene: String,
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
    moving_lights: usize,
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
    let flat = scene::flatten(&scene::load(&args.scene)?)?;
    let info = Info {
        name: flat.name,
        stats: flat.stats,
        cameras: flat.cameras.into_iter().map(|camera| camera.name).collect(),
        moving_lights: flat.rig.lights.len(),
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
    [
        format!("name       {}", info.name),
        format!("triangles  {} (and {} dropped without area)", stats.triangles, stats.dropped_triangles),
        format!("instances  {}", stats.instances),
        format!("materials  {}", stats.materials),
        format!("textures   {}", stats.textures),
        format!("lights     {} ({} emissive triangles)", stats.lights, stats.emissive_triangles),
        format!(
            "moving     {} instances, {} lights, {} cameras",
            info.moving_instances, info.moving_lights, info.moving_cameras
        ),
        format!("animations {}", info.animations.iter().map(Animation::line).collect::<Vec<_>>().join(", ")),
        format!("cameras    {}", info.cameras.join(", ")),
        format!("bounds     {low:?} to {high:?} m"),
        format!("bvh        {} nodes, depth {}, cost {:.1}", stats.bvh_nodes, stats.bvh_depth, stats.bvh_cost),
        format!("memory     {:.1} MiB on the GPU", stats.gpu_bytes as f64 / f64::from(1 << 20)),
    ]
    .join("\n")
}
