//! Scenes whose radiance can be written down: a glTF surface under a point light, a rectangle, an even sky, a spot and a
//! directional light, and a furnace. `path-tracer` and `restir-di` (unbiased) must both give the number.
//!
//! The expected values integrate the specification's BRDF (support/twins.rs) in f64; where the light has extent the
//! estimate is noisy, and the mean of independent runs must lie within 4 standard errors and 1 %.

mod support;

use glam::{DVec3, Vec2, Vec3};
use restir::scene::{
    AlphaMode, Camera, Environment, Instance, Material, Projection, PunctualKind, PunctualLight, Texture, TextureRef,
    Wrap, shapes,
};
use std::f64::consts::PI;
use std::sync::Arc;
use support::plate::{check, from_rectangle, materials, plate, scattered};
use support::twins::Brdf;

#[test]
fn under_a_point_light() {
    for (index, (material, brdf)) in materials().into_iter().enumerate() {
        let mut scene = plate(material, 0.6);
        let at = DVec3::new(-0.7, 1.1, 0.4);
        let intensity = DVec3::new(3.0, 2.0, 1.0);
        scene.lights.push(PunctualLight {
            kind: PunctualKind::Point,
            position: at.as_vec3(),
            direction: Vec3::NEG_Y,
            intensity: intensity.as_vec3(),
            range: f32::INFINITY,
        });
        let expected = scattered(&brdf, 0.6, at.normalize()) * intensity / at.length_squared();
        check(&scene, expected, &format!("point light, material {index}"));
    }
}

#[test]
fn under_a_spot_and_a_directional_light() {
    let (material, brdf) = materials().remove(0);
    let at = DVec3::new(0.5, 1.5, -0.2);
    let axis = (DVec3::new(0.3, 0.0, 0.2) - at).normalize();
    let (inner, outer) = (0.1f64, 0.6f64);
    let light = |kind, direction: DVec3, intensity: Vec3, range| PunctualLight {
        kind,
        position: at.as_vec3(),
        direction: direction.as_vec3(),
        intensity,
        range,
    };
    // KHR_lights_punctual: angular falloff squared, window 1 - (d / range)^4.
    let cosine = (-at.normalize()).dot(axis);
    let cone = ((cosine - outer.cos()) / (inner.cos() - outer.cos())).clamp(0.0, 1.0).powi(2);
    assert!(cone > 0.05 && cone < 0.95, "the plate lies between the cones: {cone}");
    let window = 1.0 - (at.length() / 4.0).powi(4);
    let mut scene = plate(material.clone(), 0.3);
    let kind = PunctualKind::Spot { inner: inner as f32, outer: outer as f32 };
    scene.lights.push(light(kind, axis, Vec3::new(5.0, 5.0, 4.0), 4.0));
    let irradiance = DVec3::new(5.0, 5.0, 4.0) * cone * window / at.length_squared();
    check(&scene, scattered(&brdf, 0.3, at.normalize()) * irradiance, "spot light");

    let sun = DVec3::new(0.4, -1.0, 0.1).normalize();
    let mut scene = plate(material, 0.3);
    scene.lights.push(light(PunctualKind::Directional, sun, Vec3::new(0.5, 0.6, 0.7), f32::INFINITY));
    check(&scene, scattered(&brdf, 0.3, -sun) * DVec3::new(0.5, 0.6, 0.7), "directional light");
}

#[test]
fn under_a_rectangle() {
    for (index, (material, brdf)) in materials().into_iter().enumerate() {
        let mut scene = plate(material, 0.5);
        // Faces down; two triangles, 0.6 m x 0.4 m, 0.9 m above and off to the side where the highlight is.
        let (corner, u, v) = (DVec3::new(-0.9, 0.9, -0.2), DVec3::X * 0.6, DVec3::Z * 0.4);
        let radiance = DVec3::new(4.0, 5.0, 6.0);
        scene.materials.push(Material { emissive: radiance.as_vec3(), ..Material::default() });
        scene.meshes.push(shapes::parallelogram(corner.as_vec3(), u.as_vec3(), v.as_vec3(), 1));
        scene.instances.push(Instance { mesh: 1, transform: glam::Mat4::IDENTITY });
        let expected = from_rectangle(&brdf, 0.5, corner, u, v) * radiance;
        check(&scene, expected, &format!("rectangle, material {index}"));
    }
}

/// The same light seen from a hundred metres and from two centimetres: it must not shadow itself, nor be lost. Not from
/// a millimetre: a path leaves the plate 1/65536 m above it, and from there so near a light looks a percent larger.
#[test]
fn under_a_far_and_a_near_rectangle() {
    let (material, brdf) = materials().remove(0);
    for height in [100.0, 0.02] {
        let mut scene = plate(material.clone(), 0.5);
        scene.cameras[0].projection = Projection::Orthographic { half_height: 1e-6 };
        let (corner, u, v) = (DVec3::new(-1.5, 1.0, -1.0) * height, DVec3::X * 2.0 * height, DVec3::Z * 2.0 * height);
        scene.materials.push(Material { emissive: Vec3::splat(3.0), ..Material::default() });
        scene.meshes.push(shapes::parallelogram(corner.as_vec3(), u.as_vec3(), v.as_vec3(), 1));
        scene.instances.push(Instance { mesh: 1, transform: glam::Mat4::IDENTITY });
        let expected = from_rectangle(&brdf, 0.5, corner, u, v) * 3.0;
        check(&scene, expected, &format!("rectangle {height} m away"));
    }
}

/// A light of which the mask has cut away one quarter is the other three, whichever way its paths are made.
#[test]
fn under_a_masked_rectangle() {
    let (material, brdf) = materials().remove(0);
    let mut scene = plate(material, 0.5);
    let (corner, u, v) = (DVec3::new(-0.9, 0.9, -0.4), DVec3::X * 0.8, DVec3::Z * 0.8);
    scene.textures.push(Texture {
        name: "mask".into(),
        width: 4,
        height: 1,
        pixels: Arc::new([255, 255, 255, 0].iter().flat_map(|alpha| [255, 255, 255, *alpha]).collect()),
        wrap: [Wrap::Clamp; 2],
        linear_filter: false,
    });
    let reference = TextureRef { texture: 0, uv_set: 0, offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE };
    scene.materials.push(Material {
        emissive: Vec3::splat(5.0),
        alpha: AlphaMode::Mask(0.5),
        base_color_texture: Some(reference),
        ..Material::default()
    });
    scene.meshes.push(shapes::parallelogram(corner.as_vec3(), u.as_vec3(), v.as_vec3(), 1));
    scene.instances.push(Instance { mesh: 1, transform: glam::Mat4::IDENTITY });
    let expected = from_rectangle(&brdf, 0.5, corner, 0.75 * u, v) * 5.0;
    check(&scene, expected, "masked rectangle");
}

#[test]
fn under_an_even_sky() {
    for (index, (material, brdf)) in materials().into_iter().enumerate() {
        let angle = 0.7;
        let mut scene = plate(material, angle as f32);
        scene.environment = Some(Environment::even(Vec3::new(1.0, 0.9, 0.8)));
        check(&scene, albedo(&brdf, angle) * DVec3::new(1.0, 0.9, 0.8), &format!("even sky, material {index}"));
    }
}

/// Directional albedo: the integral of f cos over the hemisphere.
fn albedo(brdf: &Brdf, angle: f64) -> DVec3 {
    let (rings, sectors) = (600, 1200);
    let mut sum = DVec3::ZERO;
    for i in 0..rings {
        let theta = (f64::from(i) + 0.5) / f64::from(rings) * PI / 2.0;
        for j in 0..sectors {
            let phi = (f64::from(j) + 0.5) / f64::from(sectors) * 2.0 * PI;
            let wi = DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            sum += scattered(brdf, angle, wi) * theta.sin();
        }
    }
    sum * (PI / 2.0 / f64::from(rings)) * (2.0 * PI / f64::from(sectors))
}

/// A sphere of the furnace's material in an even environment: at the middle of the picture it is seen head on, so its
/// radiance is the albedo at normal incidence; round it the environment shows as it is.
#[test]
fn in_a_furnace() {
    let mut scene = restir::scene::builtin::make("furnace").expect("a built-in scene");
    let material = &scene.materials[0];
    let roughness = f64::from(material.roughness);
    let brdf = Brdf {
        base_color: material.base_color.truncate().as_dvec3(),
        metallic: material.metallic.into(),
        alpha: roughness * roughness,
    };
    let camera = &mut scene.cameras[0];
    camera.projection = Projection::Orthographic { half_height: 0.002 };
    check(&scene, albedo(&brdf, 0.0), "furnace, head on");
    scene.cameras[0] = Camera::look_at("away", Vec3::new(0.0, 0.0, 50.0), Vec3::new(0.0, 0.0, 100.0), 0.5);
    check(&scene, DVec3::ONE, "furnace, the environment");
}
