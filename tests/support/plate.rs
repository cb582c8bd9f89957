//! A plate whose every pixel has the same radiance, for lights of which that can be written down.

use super::twins::Brdf;
use super::*;
use glam::{DVec3, Vec3};
use restir::scene::{Camera, Instance, Material, Projection, Scene, shapes};

/// A horizontal square at the origin, four metres a side, seen along a direction `angle` radians from its normal by an
/// orthographic camera that covers a millimetre: every pixel has the same answer.
pub fn plate(material: Material, angle: f32) -> Scene {
    let wo = Vec3::new(angle.sin(), angle.cos(), 0.0);
    let mut camera = Camera::look_at("test", wo, Vec3::ZERO, 1.0);
    camera.projection = Projection::Orthographic { half_height: 0.0005 };
    Scene {
        name: "plate".into(),
        meshes: vec![shapes::parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::Z * -4.0, 0)],
        instances: vec![Instance { mesh: 0, transform: glam::Mat4::IDENTITY }],
        materials: vec![material],
        cameras: vec![camera],
        ..Scene::default()
    }
}

pub fn materials() -> Vec<(Material, Brdf)> {
    [([0.8, 0.5, 0.2], 0.0, 1.0), ([0.9, 0.6, 0.3], 1.0, 0.5), ([0.2, 0.4, 0.7], 0.5, 0.4)]
        .map(|(color, metallic, roughness)| {
            let base = Vec3::from(color);
            let material = Material { base_color: base.extend(1.0), metallic, roughness, ..Material::default() };
            let roughness = f64::from(roughness);
            (material, Brdf { base_color: base.as_dvec3(), metallic: metallic.into(), alpha: roughness * roughness })
        })
        .to_vec()
}

/// World directions (y up) as the BRDF's local ones (z up); the surface is isotropic.
pub fn local(v: DVec3) -> DVec3 {
    DVec3::new(v.x, v.z, v.y)
}

/// f(wo, wi) cos, for a world direction to the light.
pub fn scattered(brdf: &Brdf, angle: f64, wi: DVec3) -> DVec3 {
    if wi.y <= 0.0 {
        return DVec3::ZERO;
    }
    brdf.value(DVec3::new(angle.sin(), 0.0, angle.cos()), local(wi)) * wi.y
}

/// Frames of a run. Runs are added until the standard error is so much of the mean, which says nothing about where the mean lies.
const FRAMES: u32 = 8;
const SHARP: f64 = 0.001;
const FEWEST: usize = 16;
const MOST: usize = 192;

/// The mean picture of either technique is `expected`, channel by channel.
pub fn check(scene: &Scene, expected: DVec3, what: &str) {
    check_by(&["path-tracer", "restir-di"], scene, &[], expected, what);
}

/// [`check`] of these techniques with settings.
pub fn check_by(techniques: &[&str], scene: &Scene, settings: &[(&str, &str)], expected: DVec3, what: &str) {
    let flat = flatten(scene);
    let settings = [&[("render.max_depth", "1")], settings].concat();
    for &technique in techniques {
        let mut renderer = renderer(&gpu(), flat.clone(), [16, 16], technique, &settings);
        if technique == "restir-di" {
            renderer.set("indirect", "no").expect("a setting");
        }
        let mut runs: Vec<DVec3> = Vec::new();
        let (mean, error) = loop {
            renderer.set_seed(runs.len() as u32);
            let image = render(&mut renderer, FRAMES);
            let sum: DVec3 = image.pixels.iter().map(|p| Vec3::from(*p).as_dvec3()).sum();
            runs.push(sum / image.pixels.len() as f64);
            let n = runs.len() as f64;
            let mean = runs.iter().sum::<DVec3>() / n;
            let variance = runs.iter().map(|r| (*r - mean) * (*r - mean)).sum::<DVec3>() / (n * (n - 1.0));
            let error = variance.map(f64::sqrt);
            let is_sharp = (error / expected).max_element() < SHARP;
            if runs.len() >= FEWEST && is_sharp || runs.len() >= MOST {
                break (mean, error);
            }
        };
        println!("{what}, {technique}: {mean:.5} ± {error:.5}, expected {expected:.5}");
        for channel in 0..3 {
            let distance = (mean[channel] - expected[channel]).abs();
            // f32 arithmetic and 16-bit points on lights are good for 1e-4; the rest is noise.
            let allowed = 4.0 * error[channel] + 1e-4 * expected[channel];
            assert!(distance <= allowed, "{what}, {technique}: {mean} is not {expected} (± {error})");
            assert!(allowed < 0.01 * expected[channel], "{what}, {technique}: too noisy to tell ({error})");
        }
    }
}

/// The integral of f cos over a downward rectangle, by the midpoint rule over its area.
pub fn from_rectangle(brdf: &Brdf, angle: f64, corner: DVec3, u: DVec3, v: DVec3) -> DVec3 {
    let n = 400;
    let mut sum = DVec3::ZERO;
    for i in 0..n {
        for j in 0..n {
            let p = corner + u * ((f64::from(i) + 0.5) / f64::from(n)) + v * ((f64::from(j) + 0.5) / f64::from(n));
            let wi = p.normalize();
            sum += scattered(brdf, angle, wi) * (wi.y / p.length_squared());
        }
    }
    sum * u.length() * v.length() / f64::from(n * n)
}
