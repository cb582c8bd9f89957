//! The rays that `restir bench rays` traces: four sets made from a scene and a camera, or those of a file.

use glam::{UVec2, Vec3};
use restir::scene::gpu_types::{LIGHT_DIRECTIONAL, LIGHT_ENVIRONMENT, LIGHT_SUN, LIGHT_TRIANGLE, Light, NONE};
use restir::scene::random::Random;
use restir::scene::{Camera, FlatScene, Projection};
use restir::{Error, Result};
use std::f32::consts::TAU;
use std::path::Path;

restir::gpu_struct! {
/// One ray, as `shaders/bench/bench.wgsl` declares it: 32 bytes, little-endian in a file.
pub struct BenchRay {
    /// Where it starts.
    pub origin: Vec3,
    /// Distances count from here, in units of the direction's length.
    pub t_min: f32,
    /// Where it goes, of any length.
    pub direction: Vec3,
    /// Hits are nearer than this.
    pub t_max: f32,
}
}

/// What a ray met: its distance, and the triangle and instance, or `NONE`.
#[derive(Debug, Clone, Copy)]
pub struct Met {
    pub t: f32,
    pub triangle: u32,
    pub instance: u32,
}

/// Rays traced together.
pub struct RaySet {
    pub name: &'static str,
    /// Whether any hit will do.
    pub any_hit: bool,
    pub rays: Vec<BenchRay>,
}

/// Longer than any scene.
const FAR: f32 = 1e30;
/// How far bounced rays start from the surface, as a fraction of the scene's size.
const OFFSET: f32 = 1e-5;
/// Points that stand for lights where a scene has none in a place.
const STAND_INS: usize = 64;

/// Through the centres of pixels, in blocks of 8 x 4.
pub fn primary(camera: &Camera, size: UVec2) -> Vec<BenchRay> {
    let right = camera.forward.cross(camera.up).normalize_or(Vec3::X);
    let up = right.cross(camera.forward);
    let aspect = size.x as f32 / size.y as f32;
    let ray = |x: u32, y: u32| {
        let across = 2.0 * (x as f32 + 0.5) / size.x as f32 - 1.0;
        let above = 1.0 - 2.0 * (y as f32 + 0.5) / size.y as f32;
        let (origin, direction) = match camera.projection {
            Projection::Perspective { vertical_fov } => {
                let half = (0.5 * vertical_fov).tan();
                (camera.position, camera.forward + half * (aspect * across * right + above * up))
            }
            Projection::Orthographic { half_height } => {
                (camera.position + half_height * (aspect * across * right + above * up), camera.forward)
            }
        };
        BenchRay { origin, t_min: 0.0, direction: direction.normalize(), t_max: FAR }
    };
    let blocks = (0..size.y.div_ceil(4)).flat_map(|j| (0..size.x.div_ceil(8)).map(move |i| (8 * i, 4 * j)));
    let pixels = blocks.flat_map(|(x, y)| (0..32).map(move |k| (x + k % 8, y + k / 8)));
    pixels.filter(|&(x, y)| x < size.x && y < size.y).map(|(x, y)| ray(x, y)).collect()
}

/// From where `rays` met something: one ray each, cosine-weighted about the geometric normal, and one to a random light.
pub fn bounced(scene: &FlatScene, rays: &[BenchRay], met: &[Met], seed: u64) -> [Vec<BenchRay>; 2] {
    let mut random = Random::new(seed);
    let offset = OFFSET * scene.bounds[0].distance(scene.bounds[1]);
    let lights = Targets::new(scene);
    let (mut diffuse, mut shadow) = (Vec::new(), Vec::new());
    for (ray, met) in rays.iter().zip(met).filter(|(_, met)| met.triangle != NONE) {
        let [p0, p1, p2] = corners(scene, met.triangle, met.instance);
        let normal = (p1 - p0).cross(p2 - p0).normalize_or(Vec3::Y);
        let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
        let origin = ray.origin + met.t * ray.direction + offset * normal;
        let (u, v) = normal.any_orthonormal_pair();
        let (square, turn) = (random.unit(), TAU * random.unit());
        let radius = square.sqrt();
        let direction = radius * (turn.cos() * u + turn.sin() * v) + (1.0 - square).max(0.0).sqrt() * normal;
        diffuse.push(BenchRay { origin, t_min: 0.0, direction: direction.normalize(), t_max: FAR });
        let to_light = lights.point(scene, &mut random) - origin;
        let distance = to_light.length().max(1e-6);
        shadow.push(BenchRay { origin, t_min: 0.0, direction: to_light / distance, t_max: 0.999 * distance });
    }
    [diffuse, shadow]
}

fn corners(scene: &FlatScene, triangle: u32, instance: u32) -> [Vec3; 3] {
    let transform = scene.instances[instance as usize].transform;
    let triangle = &scene.triangles[triangle as usize];
    [triangle.p0, triangle.p1, triangle.p2].map(|p| transform.transform_point3(p))
}

/// Where shadow rays go.
struct Targets<'a> {
    lights: Vec<&'a Light>,
    stand_ins: Vec<Vec3>,
}

impl<'a> Targets<'a> {
    fn new(scene: &'a FlatScene) -> Self {
        let has_place = |light: &&Light| ![LIGHT_DIRECTIONAL, LIGHT_ENVIRONMENT, LIGHT_SUN].contains(&light.kind);
        let lights: Vec<&Light> = scene.lights.iter().filter(has_place).collect();
        let [low, high] = scene.bounds;
        let margin = 0.15 * (high - low);
        let mut random = Random::new(7);
        let stand_ins = (0..STAND_INS).map(|_| random.in_box(low + margin, high - margin)).collect();
        Targets { lights, stand_ins }
    }

    fn point(&self, scene: &FlatScene, random: &mut Random) -> Vec3 {
        let pick = |count: usize, random: &mut Random| ((random.unit() * count as f32) as usize).min(count - 1);
        if self.lights.is_empty() {
            return self.stand_ins[pick(STAND_INS, random)];
        }
        let light = self.lights[pick(self.lights.len(), random)];
        if light.kind != LIGHT_TRIANGLE {
            return light.position;
        }
        let [p0, p1, p2] = corners(scene, light.triangle, light.instance);
        let (mut u, mut v) = (random.unit(), random.unit());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        p0 + u * (p1 - p0) + v * (p2 - p0)
    }
}

/// Largest file of rays.
const MAX_RAY_BYTES: u64 = 1 << 30;

/// The rays of a file: 32 bytes each.
pub fn read(path: &Path) -> Result<Vec<BenchRay>> {
    let bytes = restir::scene::files::read(path, MAX_RAY_BYTES)?;
    if bytes.is_empty() || !bytes.len().is_multiple_of(size_of::<BenchRay>()) {
        let what = format!("{} holds {} bytes, not a whole number of rays of 32", path.display(), bytes.len());
        return Err(Error::bad_value("rays", what));
    }
    let rays: Vec<BenchRay> = bytemuck::pod_collect_to_vec(&bytes);
    let usable = |ray: &BenchRay| {
        let is_long = ray.direction.is_finite() && ray.direction != Vec3::ZERO;
        ray.origin.is_finite() && is_long && ray.t_min.is_finite() && !ray.t_max.is_nan()
    };
    match rays.iter().position(|ray| !usable(ray)) {
        Some(at) => Err(Error::bad_value("rays", format!("ray {at} of {} is not usable", path.display()))),
        None => Ok(rays),
    }
}

/// Writes (t, triangle) of each ray: 8 bytes.
pub fn write_hits(path: &Path, met: &[Met]) -> Result<()> {
    let bytes: Vec<u8> =
        met.iter().flat_map(|met| [met.t.to_bits(), met.triangle]).flat_map(u32::to_le_bytes).collect();
    std::fs::write(path, bytes).map_err(|source| Error::Io { path: path.display().to_string(), source })
}
