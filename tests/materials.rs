//! Each material extension from a file of our own making to its picture, which must be a closed form, or that of a twin
//! scene that is made without the extension.

mod support;

use glam::{DVec3, Vec2, Vec3};
use restir::scene::{Camera, Environment, Mesh, Projection, PunctualKind, PunctualLight, Scene, gltf, shapes};
use restir::{Error, Result};
use serde_json::{Value, json};
use std::f64::consts::{FRAC_PI_2, PI};
use support::bsdf::{ALL, Bsdf, Model, iridescent_fresnel, schlick, sheen_value};
use support::gltf_writer::Writer;
use support::{assert_same, flatten, gpu, render, renderer};

const SPECIFICATION: Model = Model { energy_compensation: false, conserving_mix: false };

fn load(writer: Writer) -> Result<Scene> {
    gltf::load_bytes("test.glb", &writer.glb(), &mut |path| {
        Err(Error::Io { path: path.into(), source: std::io::Error::other("no such file") })
    })
}

/// A file with one node for each mesh, whose materials are numbered as in `materials`.
fn file(meshes: &[Mesh], materials: &[Value]) -> Writer {
    let mut writer = Writer::new(json!({"nodes": [], "meshes": [], "materials": materials}));
    for (index, mesh) in meshes.iter().enumerate() {
        let flat = |vectors: &[Vec3]| vectors.iter().flat_map(|v| v.to_array()).collect::<Vec<_>>();
        let position = writer.floats("VEC3", &flat(&mesh.positions));
        let normal = writer.floats("VEC3", &flat(&mesh.normals));
        let uv = writer.floats("VEC2", &mesh.uvs[0].iter().flat_map(|uv| uv.to_array()).collect::<Vec<_>>());
        let mut attributes = json!({"POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv});
        if !mesh.tangents.is_empty() {
            let tangents: Vec<_> = mesh.tangents.iter().flat_map(|t| t.to_array()).collect();
            attributes["TANGENT"] = writer.floats("VEC4", &tangents).into();
        }
        let indices = writer.indices(&mesh.indices.iter().map(|i| *i as u16).collect::<Vec<_>>());
        writer.push(
            "meshes",
            json!({"primitives": [{"attributes": attributes, "indices": indices, "material": mesh.material}]}),
        );
        writer.push("nodes", json!({"mesh": index}));
    }
    writer
}

/// A horizontal square at a height, facing up, its tangent along +X.
fn square(height: f32, half: f32, material: u32) -> Mesh {
    let corner = Vec3::new(-half, height, half);
    let mut mesh = shapes::parallelogram(corner, Vec3::X * 2.0 * half, Vec3::Z * -2.0 * half, material);
    mesh.tangents = vec![Vec3::X.extend(1.0); 4];
    mesh
}

/// A material's JSON with one extension.
fn extended(base: Value, name: &str, extension: Value) -> Value {
    let mut material = base;
    material["extensions"][name] = extension;
    material
}

fn pbr(color: [f32; 3], metallic: f32, roughness: f32) -> Value {
    let [r, g, b] = color;
    json!({"pbrMetallicRoughness":
        {"baseColorFactor": [r, g, b, 1], "metallicFactor": metallic, "roughnessFactor": roughness}})
}

/// Shines and reflects nothing.
fn lamp(color: [f32; 3]) -> Value {
    let mut material = extended(pbr([0.0; 3], 0.0, 1.0), "KHR_materials_specular", json!({"specularFactor": 0}));
    material["emissiveFactor"] = json!(color);
    material
}

/// A material with every extension, which no mesh has: it makes kernels carry all lobes, so that one kernel is compiled
/// for all tests rather than one a test. That a scene's kernels carry what the scene needs is tested in src/gpu_scene.rs.
fn everything() -> Value {
    json!({"extensions": {
        "KHR_materials_anisotropy": {"anisotropyStrength": 1},
        "KHR_materials_clearcoat": {"clearcoatFactor": 1},
        "KHR_materials_dispersion": {"dispersion": 1},
        "KHR_materials_ior": {"ior": 2},
        "KHR_materials_iridescence": {"iridescenceFactor": 1},
        "KHR_materials_sheen": {"sheenColorFactor": [1, 1, 1]},
        "KHR_materials_transmission": {"transmissionFactor": 1},
        "KHR_materials_volume": {"thicknessFactor": 1}}})
}

/// The scene seen along a direction `angle` radians from +Y, in the plane x, y, by an orthographic camera that covers a
/// millimetre: every pixel has the same answer.
fn seen(mut writer: Writer, angle: f64) -> Scene {
    writer.push("materials", everything());
    seen_alone(writer, angle)
}

/// The same with kernels that carry only what the file needs.
fn seen_alone(writer: Writer, angle: f64) -> Scene {
    let mut scene = load(writer).expect("a good file");
    let wo = DVec3::new(angle.sin(), angle.cos(), 0.0).as_vec3();
    let mut camera = Camera::look_at("test", wo * 3.0, Vec3::ZERO, 1.0);
    camera.projection = Projection::Orthographic { half_height: 0.0005 };
    scene.cameras = vec![camera];
    scene
}

fn sun(direction: DVec3, irradiance: Vec3) -> PunctualLight {
    PunctualLight {
        kind: PunctualKind::Directional,
        position: Vec3::ZERO,
        direction: direction.as_vec3(),
        intensity: irradiance,
        range: f32::INFINITY,
    }
}

/// World directions (y up, tangent x) as the BSDF's local ones.
fn local(v: DVec3) -> DVec3 {
    DVec3::new(v.x, -v.z, v.y)
}

/// The mean radiance of a picture of 16 x 16 pixels.
fn radiance(scene: &Scene, technique: &str, depth: u32, frames: u32) -> DVec3 {
    let settings = [("render.max_depth", depth.to_string()), ("render.roulette_start", "64".into())];
    let settings: Vec<(&str, &str)> = settings.iter().map(|(key, value)| (*key, value.as_str())).collect();
    let mut renderer = renderer(&gpu(), flatten(scene), [16, 16], technique, &settings);
    let image = render(&mut renderer, frames);
    assert_eq!(pollster::block_on(renderer.counters()).map_or(0, |c| c.not_finite()), 0, "not a number");
    image.pixels.iter().map(|p| Vec3::from(*p).as_dvec3()).sum::<DVec3>() / image.pixels.len() as f64
}

#[track_caller]
fn assert_radiance(actual: DVec3, expected: DVec3, relative: f64, what: &str) {
    println!("{what}: {actual:.4}, expected {expected:.4}");
    for c in 0..3 {
        let allowed = relative * expected[c] + 1e-5;
        assert!((actual[c] - expected[c]).abs() <= allowed, "{what}: {actual} is not {expected}");
    }
}

/// A plate under a directional light, where every technique gives f cos E without noise. Each technique's kernels are
/// compiled for each material: one technique but for a few.
#[track_caller]
fn check_under_sun(material: Value, bsdf: Bsdf, from: DVec3, what: &str) {
    check_techniques_under_sun(&["path-tracer"], material, bsdf, from, what);
}

#[track_caller]
fn check_techniques_under_sun(techniques: &[&str], material: Value, bsdf: Bsdf, from: DVec3, what: &str) {
    let angle = 0.6f64;
    let writer = file(&[square(0.0, 2.0, 0)], &[material]);
    let mut scene = if techniques.len() == 1 { seen(writer, angle) } else { seen_alone(writer, angle) };
    scene.lights = vec![sun(-from, Vec3::new(3.0, 2.0, 1.0))];
    let wo = DVec3::new(angle.sin(), angle.cos(), 0.0);
    let expected = bsdf.evaluate(SPECIFICATION, ALL, local(wo), local(from)) * DVec3::new(3.0, 2.0, 1.0);
    assert!(expected.max_element() > 1e-3, "{what}: there is something to see");
    for technique in techniques {
        assert_radiance(radiance(&scene, technique, 1, 1), expected, 2e-3, &format!("{what}, {technique}"));
    }
}

const BASE: [f32; 3] = [0.8, 0.5, 0.2];

fn base(roughness: f32) -> Bsdf {
    Bsdf { base_color: Vec3::from(BASE), alpha: Vec2::splat(roughness * roughness), ..Bsdf::default() }
}

/// Near the mirror direction of the view, so that specular lobes show.
fn near_mirror() -> DVec3 {
    DVec3::new(-0.45, 0.8, 0.25).normalize()
}

#[test]
fn index_of_refraction() {
    for ior in [1.0f32, 1.33, 2.4, 0.0] {
        let material = extended(pbr(BASE, 0.0, 0.4), "KHR_materials_ior", json!({"ior": ior}));
        let f0 = ((ior - 1.0) / (ior + 1.0)).powi(2);
        check_under_sun(material, Bsdf { f0: Vec3::splat(f0), ..base(0.4) }, near_mirror(), &format!("ior {ior}"));
    }
}

#[test]
fn specular() {
    let material = extended(
        pbr(BASE, 0.0, 0.4),
        "KHR_materials_specular",
        json!({"specularFactor": 0.7, "specularColorFactor": [2.0, 0.5, 40.0]}),
    );
    let f0 = (Vec3::new(2.0, 0.5, 40.0) * 0.04).min(Vec3::ONE) * 0.7;
    check_under_sun(material, Bsdf { f0, f90: 0.7, ..base(0.4) }, near_mirror(), "specular");
}

#[test]
fn anisotropy() {
    for (rotation, turned) in [(0.0, false), (FRAC_PI_2, true)] {
        let material = extended(
            pbr(BASE, 1.0, 0.4),
            "KHR_materials_anisotropy",
            json!({"anisotropyStrength": 0.8, "anisotropyRotation": rotation}),
        );
        // alpha along the direction is mix(alpha, 1, strength^2).
        let stretched = 0.16 + (1.0 - 0.16) * 0.64;
        let alpha = if turned { Vec2::new(0.16, stretched) } else { Vec2::new(stretched, 0.16) };
        check_under_sun(material, Bsdf { metallic: 1.0, alpha, ..base(0.4) }, near_mirror(), "anisotropy");
    }
}

#[test]
fn clearcoat() {
    let material = extended(
        pbr(BASE, 0.3, 0.7),
        "KHR_materials_clearcoat",
        json!({"clearcoatFactor": 0.8, "clearcoatRoughnessFactor": 0.3}),
    );
    let bsdf = Bsdf { metallic: 0.3, clearcoat: 0.8, clearcoat_alpha: 0.09, ..base(0.7) };
    check_under_sun(material, bsdf, near_mirror(), "clearcoat");

    // Emission lies below the coat: seen itself, and as a lamp over a plate, sampled or run into alike.
    let coated = extended(lamp([1.0; 3]), "KHR_materials_clearcoat", json!({"clearcoatFactor": 1}));
    let scene = seen(file(&[square(0.0, 2.0, 0)], std::slice::from_ref(&coated)), 1.2);
    let seen_itself = 1.0 - (0.04 + 0.96 * schlick(1.2f64.cos()));
    assert_radiance(radiance(&scene, "ris", 1, 1), DVec3::splat(seen_itself), 1e-3, "emission below a coat");
}

#[test]
fn sheen() {
    let material = extended(
        pbr(BASE, 0.0, 0.7),
        "KHR_materials_sheen",
        json!({"sheenColorFactor": [0.9, 0.4, 0.6], "sheenRoughnessFactor": 0.5}),
    );
    let bsdf = Bsdf { sheen_color: Vec3::new(0.9, 0.4, 0.6), sheen_alpha: 0.25, ..base(0.7) };
    check_under_sun(material, bsdf, DVec3::new(0.3, 0.4, 0.7).normalize(), "sheen");

    // Alone over black in an even sky: the albedo, by quadrature.
    let black = extended(
        extended(pbr([0.0; 3], 0.0, 0.7), "KHR_materials_specular", json!({"specularFactor": 0})),
        "KHR_materials_sheen",
        json!({"sheenColorFactor": [1, 0.5, 0], "sheenRoughnessFactor": 0.6}),
    );
    let angle = 1.0f64;
    let mut scene = seen(file(&[square(0.0, 2.0, 0)], &[black]), angle);
    scene.environment = Some(Environment::even(Vec3::ONE));
    let wo = DVec3::new(angle.sin(), 0.0, angle.cos());
    let mut albedo = 0.0;
    let n = 400;
    for i in 0..n {
        let (sin, cos) = ((f64::from(i) + 0.5) / f64::from(n) * FRAC_PI_2).sin_cos();
        for j in 0..n {
            let (sin_phi, cos_phi) = ((f64::from(j) + 0.5) / f64::from(n) * PI).sin_cos();
            albedo += sheen_value(0.36, wo, DVec3::new(sin * cos_phi, sin * sin_phi, cos)) * cos * sin;
        }
    }
    albedo *= 2.0 * (FRAC_PI_2 / f64::from(n)) * (PI / f64::from(n));
    let actual = radiance(&scene, "path-tracer", 1, 64);
    assert_radiance(actual, albedo * DVec3::new(1.0, 0.5, 0.0), 0.01, "albedo of sheen");
}

#[test]
fn iridescence() {
    for metallic in [0.0f32, 1.0] {
        let material = extended(
            pbr(BASE, metallic, 0.4),
            "KHR_materials_iridescence",
            json!({"iridescenceFactor": 0.9, "iridescenceIor": 1.7, "iridescenceThicknessMaximum": 420}),
        );
        let bsdf = Bsdf { metallic, iridescence: 0.9, film_ior: 1.7, film_thickness: 420.0, ..base(0.4) };
        check_under_sun(material, bsdf, near_mirror(), &format!("film, metallic {metallic}"));
    }
    // Under an even sky a smooth metal shows the film's reflectance itself.
    let material = extended(
        pbr([0.9; 3], 1.0, 0.0),
        "KHR_materials_iridescence",
        json!({"iridescenceFactor": 1, "iridescenceIor": 1.5, "iridescenceThicknessMaximum": 550}),
    );
    let mut scene = seen(file(&[square(0.0, 2.0, 0)], &[material]), 0.5);
    scene.environment = Some(Environment::even(Vec3::ONE));
    let expected = iridescent_fresnel(1.5, 550.0, DVec3::splat(0.9), 0.5f64.cos());
    assert_radiance(radiance(&scene, "path-tracer", 1, 16), expected, 0.01, "film on a mirror");
}

fn thin(color: [f32; 3], roughness: f32) -> Value {
    let mut material =
        extended(pbr(color, 0.0, roughness), "KHR_materials_transmission", json!({"transmissionFactor": 1}));
    material["doubleSided"] = true.into();
    material
}

#[test]
fn thin_walls_transmit() {
    // Light from below the plate, through its rough wall: light samples reach it from all techniques.
    let from = DVec3::new(-0.5, -0.8, 0.1).normalize();
    let bsdf = Bsdf { transmission: 1.0, eta: 0.0, ..base(0.5) };
    check_techniques_under_sun(&["path-tracer", "ris", "restir-di"], thin(BASE, 0.5), bsdf, from, "thin wall");
    check_under_sun(thin(BASE, 0.5), bsdf, near_mirror(), "thin wall, reflection");

    // Smooth, between an upper sky and a lower light: F of one and 1 - F of the other, tinted.
    let angle = 1.1f64;
    let floor = lamp([1.0; 3]);
    let mut scene = seen(file(&[square(0.0, 2.0, 0), square(-0.1, 50.0, 1)], &[thin(BASE, 0.0), floor]), angle);
    scene.environment = Some(Environment::even(Vec3::new(0.5, 1.0, 2.0)));
    let f = 0.04 + 0.96 * schlick(angle.cos());
    let expected = f * DVec3::new(0.5, 1.0, 2.0) + (1.0 - f) * Vec3::from(BASE).as_dvec3();
    assert_radiance(radiance(&scene, "path-tracer", 2, 64), expected, 0.01, "smooth thin wall");
}

/// The radiance of a slab of index n in an even sky of radiance 1: reflections between its faces summed up,
/// F + (1 - F)^2 t / (1 - F t), with t what is left of light after one way through.
fn slab(n: f64, angle: f64, absorption: DVec3, thickness: f64) -> DVec3 {
    let f0 = ((n - 1.0) / (n + 1.0)).powi(2);
    let f = f0 + (1.0 - f0) * schlick(angle.cos());
    let inside = (1.0 - (angle.sin() / n).powi(2)).sqrt();
    let t = (absorption * (-thickness / inside)).exp();
    f + (1.0 - f).powi(2) * t / (1.0 - f * t)
}

fn glass(ior: f32, volume: Value) -> Value {
    let material = extended(pbr([1.0; 3], 0.0, 0.0), "KHR_materials_transmission", json!({"transmissionFactor": 1}));
    extended(extended(material, "KHR_materials_ior", json!({"ior": ior})), "KHR_materials_volume", volume)
}

fn block(half: f32, height: f32, material: u32) -> Mesh {
    shapes::cuboid(Vec3::new(-half, -0.5 * height, -half), Vec3::new(half, 0.5 * height, half), material)
}

#[test]
fn media_absorb_as_beer_and_lambert_say() {
    let color = DVec3::new(0.5, 0.8, 0.95);
    let volume = json!({"thicknessFactor": 1, "attenuationDistance": 0.3, "attenuationColor": [0.5, 0.8, 0.95]});
    let absorption = -DVec3::new(color.x.ln(), color.y.ln(), color.z.ln()) / 0.3;
    for (ior, angle) in [(1.5f32, 0.0), (1.5, 0.9), (1.33, 0.5)] {
        let mut scene = seen(file(&[block(20.0, 0.4, 0)], &[glass(ior, volume.clone())]), angle);
        scene.environment = Some(Environment::even(Vec3::ONE));
        let expected = slab(ior.into(), angle, absorption, 0.4);
        let actual = radiance(&scene, "path-tracer", 12, 48);
        assert_radiance(actual, expected, 0.015, &format!("slab of index {ior} at {angle}"));
    }
}

/// A block inside a block of the same index, with another absorption: what the stack of media must get right. Without it
/// the inner faces would reflect, and the outer medium would not go on behind the inner block.
#[test]
fn media_nest() {
    let outer = json!({"thicknessFactor": 1, "attenuationDistance": 1.0, "attenuationColor": [0.5, 1, 0.9]});
    let inner = json!({"thicknessFactor": 1, "attenuationDistance": 1.0, "attenuationColor": [1, 0.3, 0.9]});
    let blocks = [block(20.0, 1.0, 0), block(10.0, 0.4, 1)];
    let mut scene = seen(file(&blocks, &[glass(1.5, outer), glass(1.5, inner)]), 0.7);
    scene.environment = Some(Environment::even(Vec3::ONE));
    // 0.6 m of the outer and 0.4 m of the inner medium on the way through.
    let absorption = DVec3::new(-0.6 * 0.5f64.ln(), -0.4 * 0.3f64.ln(), -0.9f64.ln());
    let expected = slab(1.5, 0.7, absorption, 1.0);
    assert_radiance(radiance(&scene, "path-tracer", 16, 48), expected, 0.015, "a block in a block");
}

/// An object without effect is not seen: glass of index 1 that absorbs nothing, and a film of thickness that is not there.
#[test]
fn extensions_at_their_zero_are_the_core_material() {
    let plain = pbr(BASE, 0.2, 0.4);
    let picture = |material: Value| {
        let mut scene = seen_alone(file(&[square(0.0, 2.0, 0)], &[material]), 0.6);
        scene.lights = vec![sun(-near_mirror(), Vec3::ONE)];
        scene.environment = Some(Environment::even(Vec3::ONE));
        let mut renderer = renderer(&gpu(), flatten(&scene), [16, 16], "path-tracer", &[]);
        render(&mut renderer, 2)
    };
    let expected = picture(plain.clone());
    for (name, extension) in [
        ("KHR_materials_ior", json!({"ior": 1.5})),
        ("KHR_materials_specular", json!({"specularFactor": 1, "specularColorFactor": [1, 1, 1]})),
        ("KHR_materials_transmission", json!({"transmissionFactor": 0})),
        (
            "KHR_materials_volume",
            json!({"thicknessFactor": 1, "attenuationDistance": 1, "attenuationColor": [0, 0, 0]}),
        ),
        ("KHR_materials_clearcoat", json!({"clearcoatFactor": 0, "clearcoatRoughnessFactor": 0.5})),
        ("KHR_materials_sheen", json!({"sheenColorFactor": [0, 0, 0], "sheenRoughnessFactor": 0.5})),
        ("KHR_materials_anisotropy", json!({"anisotropyStrength": 0, "anisotropyRotation": 1})),
        ("KHR_materials_iridescence", json!({"iridescenceFactor": 0})),
        ("KHR_materials_dispersion", json!({"dispersion": 0.5})),
    ] {
        assert_same(&picture(extended(plain.clone(), name, extension)), &expected, name);
    }
}

/// Each colour is bent by its own index, but a slab in an even sky hides all bending: what is left is the closed form, a
/// colour at a time, and that the three colours together weigh what they should.
#[test]
fn dispersion_keeps_the_light() {
    let material =
        extended(glass(1.7, json!({"thicknessFactor": 1})), "KHR_materials_dispersion", json!({"dispersion": 2}));
    let mut scene = seen(file(&[block(20.0, 0.4, 0)], &[material]), 0.9);
    scene.environment = Some(Environment::even(Vec3::ONE));
    let spread = 0.7 * 0.025 * 2.0;
    let expected = DVec3::from_array([-1.0, 0.0, 1.0].map(|s| slab(1.7 + s * spread, 0.9, DVec3::ZERO, 0.4).x));
    assert_radiance(radiance(&scene, "path-tracer", 12, 64), expected, 0.02, "dispersing slab");
}

#[test]
fn dispersing_surfaces_are_lit_alike_by_every_technique() {
    let mut material =
        extended(glass(1.7, json!({"thicknessFactor": 1})), "KHR_materials_dispersion", json!({"dispersion": 2}));
    material["pbrMetallicRoughness"]["roughnessFactor"] = 0.5.into();
    let mut scene = seen_alone(file(&[block(20.0, 0.4, 0)], &[material]), 0.9);
    scene.lights = vec![sun(DVec3::NEG_Y, Vec3::splat(10.0))];
    // Of one index for all colours, red would be 8 % brighter and blue 7 % darker.
    let expected = radiance(&scene, "path-tracer", 1, 256);
    assert!(expected.x < 0.95 * expected.z, "{expected}");
    for technique in ["ris", "restir-di"] {
        assert_radiance(radiance(&scene, technique, 1, 4), expected, 0.02, technique);
    }
}

#[test]
fn unlit_shows_its_colour() {
    let unlit = json!({"pbrMetallicRoughness": {"baseColorFactor": [0.9, 0.4, 0.1, 1]},
                       "emissiveFactor": [5, 5, 5], "extensions": {"KHR_materials_unlit": {}}});
    let mut scene = seen_alone(file(&[square(0.0, 2.0, 0)], std::slice::from_ref(&unlit)), 0.4);
    scene.lights = vec![sun(DVec3::NEG_Y, Vec3::splat(10.0))];
    for technique in ["path-tracer", "ris", "restir-di"] {
        let actual = radiance(&scene, technique, 4, 2);
        assert_radiance(actual, DVec3::new(0.9, 0.4, 0.1), 1e-6, technique);
    }
    // It lights what is near it as an emission of that colour would, and shades what is below it: a plate with an unlit
    // ceiling, and the twin with a ceiling that is a light.
    let plate = pbr([0.7; 3], 0.0, 1.0);
    let mut ceiling = shapes::parallelogram(Vec3::new(-1.0, 1.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0, 1);
    ceiling.uvs[0] = vec![Vec2::ZERO; 4];
    let of = |mut material: Value, technique: &str| {
        // So that it shades the plate.
        material["doubleSided"] = true.into();
        let mut scene = seen_alone(file(&[square(0.0, 2.0, 0), ceiling.clone()], &[plate.clone(), material]), 1.0);
        scene.lights = vec![sun(DVec3::NEG_Y, Vec3::splat(10.0))];
        radiance(&scene, technique, 1, 128)
    };
    let expected = of(lamp([0.9, 0.4, 0.1]), "path-tracer");
    assert!(expected.x > 0.1, "{expected}");
    for technique in ["path-tracer", "restir-di"] {
        assert_radiance(of(unlit.clone(), technique), expected, 0.02, &format!("under an unlit ceiling, {technique}"));
    }
}

#[test]
fn the_loader_clamps_and_refuses() {
    let one =
        |extension: &str, value: Value| load(file(&[square(0.0, 1.0, 0)], &[extended(json!({}), extension, value)]));
    let clamped = [
        ("KHR_materials_transmission", json!({"transmissionFactor": 7}), "transmissionFactor is clamped to [0, 1]"),
        ("KHR_materials_ior", json!({"ior": 0.5}), "ior is clamped to at least 1"),
        ("KHR_materials_clearcoat", json!({"clearcoatRoughnessFactor": -1}), "clearcoatRoughnessFactor is clamped"),
        (
            "KHR_materials_specular",
            json!({"specularColorFactor": [1, -1, 2]}),
            "specularColorFactor is clamped to at least 0",
        ),
        ("KHR_materials_sheen", json!({"sheenColorFactor": [1, 2, 3]}), "sheenColorFactor is clamped"),
        ("KHR_materials_anisotropy", json!({"anisotropyStrength": -2}), "anisotropyStrength is clamped"),
        ("KHR_materials_iridescence", json!({"iridescenceIor": 0}), "iridescenceIor is clamped"),
        ("KHR_materials_dispersion", json!({"dispersion": -1}), "dispersion is clamped"),
        (
            "KHR_materials_volume",
            json!({"thicknessFactor": 1, "attenuationDistance": 0}),
            "attenuationDistance is not positive",
        ),
    ];
    for (extension, value, warning) in clamped {
        let scene = one(extension, value).expect("a file that loads");
        assert!(scene.warnings.iter().any(|w| w.contains(warning)), "{extension}: {:?}", scene.warnings);
        flatten(&scene);
    }
    let refused = [
        ("KHR_materials_transmission", json!({"transmissionFactor": "all"})),
        ("KHR_materials_ior", json!({"ior": 1e60})),
        ("KHR_materials_sheen", json!({"sheenColorFactor": [1, 2]})),
        ("KHR_materials_clearcoat", json!({"clearcoatTexture": {"index": 3}})),
        ("KHR_materials_clearcoat", json!({"clearcoatTexture": {}})),
    ];
    for (extension, value) in refused {
        let error = one(extension, value.clone()).expect_err("a file that is refused");
        assert_eq!(error.code(), "BAD_FILE", "{extension} {value}: {error}");
        assert!(error.to_string().contains(extension), "{error}");
    }
    let mut writer = file(&[square(0.0, 1.0, 0)], &[json!({})]);
    writer.json["extensionsUsed"] = json!(["KHR_materials_made_up"]);
    writer.json["extensionsRequired"] = json!(["KHR_materials_made_up"]);
    let error = load(writer).expect_err("a required extension that is unknown");
    assert!(error.code() == "UNSUPPORTED" && error.to_string().contains("KHR_materials_made_up"), "{error}");
    // What is not unlit's is not looked at.
    let scene = one("KHR_materials_unlit", json!({})).expect("a good file");
    assert!(scene.materials[0].unlit);
}

#[test]
fn a_medium_has_two_sides() {
    let scene = load(file(&[block(1.0, 1.0, 0)], &[glass(1.5, json!({"thicknessFactor": 1}))])).expect("a good file");
    assert!(scene.materials[0].bounds_a_medium() && scene.materials[0].is_two_sided());
    let thin = load(file(&[block(1.0, 1.0, 0)], &[glass(1.5, json!({"thicknessFactor": 0}))])).expect("a good file");
    assert!(!thin.materials[0].bounds_a_medium() && !thin.materials[0].is_two_sided());
}
