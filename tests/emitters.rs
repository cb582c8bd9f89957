//! Textured emitters are weighed by what they emit: dark ones are no lights, bright ones get the samples, and the picture
//! stays what it was, with less noise.

mod support;

use glam::{DVec3, Mat4, Vec2, Vec3};
use restir::scene::{Instance, Material, Mesh, Scene, Texture, TextureRef, Wrap, shapes};
use std::sync::Arc;
use support::plate::{check_by, from_rectangle, materials, plate};
use support::{flatten, gpu, render, renderer};

const COLUMNS: usize = 16;
const BRIGHT: usize = 5;

/// A strip of light over the plate, of which one column in sixteen shines and another at a tenth; cut into `parts`.
fn under_a_strip(parts: usize) -> Scene {
    let (material, _) = materials().remove(0);
    let mut scene = plate(material, 0.5);
    let column = |i: usize| match i {
        BRIGHT => [255, 255, 255, 255],
        // 0.1 in linear light.
        12 => [89, 89, 89, 255],
        _ => [0, 0, 0, 255],
    };
    scene.textures.push(Texture {
        name: "strip".into(),
        width: COLUMNS as u32,
        height: 1,
        pixels: Arc::new((0..COLUMNS).flat_map(column).collect()),
        wrap: [Wrap::Clamp; 2],
        linear_filter: false,
    });
    let reference = TextureRef { texture: 0, uv_set: 0, offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE };
    scene.materials.push(Material {
        emissive: Vec3::splat(20.0),
        emissive_texture: Some(reference),
        ..Material::default()
    });
    let (corner, u, v) = (CORNER.as_vec3(), Vec3::X * WIDTH as f32 / parts as f32, Vec3::Z * DEPTH as f32);
    let mut strip = Mesh { material: 1, ..Mesh::default() };
    for i in 0..parts {
        let mut part = shapes::parallelogram(corner + u * i as f32, u, v, 1);
        part.uvs[0].iter_mut().for_each(|uv| uv.x = (uv.x + i as f32) / parts as f32);
        shapes::append(&mut strip, &part);
    }
    scene.meshes.push(strip);
    scene.instances.push(Instance { mesh: 1, transform: Mat4::IDENTITY });
    scene
}

const CORNER: DVec3 = DVec3::new(-0.8, 0.9, -0.2);
const WIDTH: f64 = 1.6;
const DEPTH: f64 = 0.4;

fn expected() -> DVec3 {
    let (_, brdf) = materials().remove(0);
    let cell = DVec3::X * (WIDTH / COLUMNS as f64);
    let column = |i: usize| from_rectangle(&brdf, 0.5, CORNER + cell * i as f64, cell, DVec3::Z * DEPTH);
    let tenth = ((89.0 / 255.0 + 0.055) / 1.055f64).powf(2.4);
    20.0 * (column(BRIGHT) + tenth * column(12))
}

#[test]
fn only_what_shines_is_a_light() {
    let scene = flatten(&under_a_strip(COLUMNS));
    let mut pmf: Vec<f32> = scene.lights.iter().map(|light| light.pmf).collect();
    pmf.sort_by(|a, b| b.total_cmp(a));
    // Two triangles each of two columns; and a little for their neighbours, for texels are taken for a hundredth larger
    // than they are.
    assert!(pmf.len() <= 12, "{} of {} triangles are lights", pmf.len(), 2 * COLUMNS);
    assert!(pmf[..4].iter().sum::<f32>() > 0.96, "{pmf:?}");
    assert!((pmf[0] / pmf[3] / 10.0 - 1.0).abs() < 0.1, "{pmf:?}");
    assert_eq!(flatten(&under_a_strip(1)).lights.len(), 2);
}

#[test]
fn the_picture_is_the_same_and_the_noise_is_less() {
    check_by(&["ris"], &under_a_strip(1), &[("candidates", "32")], expected(), "the whole strip");
    check_by(&["path-tracer", "restir-di"], &under_a_strip(COLUMNS), &[], expected(), "its parts");
    // One light sample a pixel: of samples over the whole strip one in sixteen finds the column.
    let variance = |parts: usize| {
        let settings = [("candidates", "1"), ("render.max_depth", "1")];
        let image = render(&mut renderer(&gpu(), flatten(&under_a_strip(parts)), [64, 64], "ris", &settings), 1);
        let n = image.pixels.len() as f64;
        let mean = image.pixels.iter().map(|p| f64::from(p[1])).sum::<f64>() / n;
        image.pixels.iter().map(|p| (f64::from(p[1]) - mean).powi(2)).sum::<f64>() / n
    };
    let (whole, cut) = (variance(1), variance(COLUMNS));
    println!("variance {whole:.4} of the whole strip, {cut:.4} of its parts");
    assert!(cut < whole / 20.0, "{cut} is not far below {whole}");
}
