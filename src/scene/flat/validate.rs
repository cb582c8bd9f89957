//! Whether a flat scene that came from outside may be rendered: shaders check no index.

use super::{Atlas, FlatEnvironment, FlatScene};
use crate::scene::bvh::MAX_DEPTH;
use crate::scene::gpu_types::{LIGHT_ENVIRONMENT, LIGHT_TRIANGLE, Light, Material, NONE, TextureSlot, Triangle};
use crate::scene::rig::Counts;

/// (where, what is wrong there).
type Fault = (String, String);

/// The first fault, if any.
pub(super) fn validate(scene: &FlatScene) -> Result<(), Fault> {
    tree(scene)?;
    each("triangles", &scene.triangles, |i, triangle| check_triangle(scene, i, triangle))?;
    each("materials", &scene.materials, |_, material| check_material(&scene.atlas, material))?;
    each("lights", &scene.lights, |i, light| check_light(scene, i, light))?;
    let punctual = (scene.lights.len() as u64).checked_sub(u64::from(scene.first_punctual));
    let punctual = punctual.ok_or_else(|| fault("first_punctual", "past the lights"))?;
    check_atlas(&scene.atlas).map_err(|what| fault("atlas", what))?;
    if let Some(environment) = &scene.environment {
        check_environment(environment).map_err(|what| fault("environment", what))?;
    }
    each("cameras", &scene.cameras, |_, camera| {
        let finite = camera.position.is_finite() && camera.forward.is_finite() && camera.up.is_finite();
        must(finite, "numbers that are not finite")
    })?;
    let counts =
        Counts { instances: scene.stats.instances as usize, lights: punctual as usize, cameras: scene.cameras.len() };
    scene.rig.check(counts)?;
    let complete = !scene.materials.is_empty() && !scene.cameras.is_empty();
    must(complete, "materials or cameras are missing").map_err(|what| fault("scene", what))?;
    must(scene.bounds.iter().all(|corner| corner.is_finite()), "not finite").map_err(|what| fault("bounds", what))
}

fn fault(place: impl Into<String>, what: impl Into<String>) -> Fault {
    (place.into(), what.into())
}

fn must(condition: bool, otherwise: &'static str) -> Result<(), &'static str> {
    if condition { Ok(()) } else { Err(otherwise) }
}

fn each<T>(name: &str, items: &[T], mut check: impl FnMut(usize, &T) -> Result<(), &'static str>) -> Result<(), Fault> {
    items
        .iter()
        .enumerate()
        .try_for_each(|(i, item)| check(i, item).map_err(|what| fault(format!("{name}[{i}]"), what)))
}

/// Children come after their parent and belong to it alone, so that every walk ends; no path is too long.
fn tree(scene: &FlatScene) -> Result<(), Fault> {
    must(!scene.nodes.is_empty(), "empty").map_err(|what| fault("nodes", what))?;
    let mut depths = vec![0u32; scene.nodes.len()];
    depths[0] = 1;
    each("nodes", &scene.nodes, |i, node| {
        must(node.min.is_finite() && node.max.is_finite(), "a box that is not finite")?;
        let depth = depths[i];
        must(depth != 0, "belongs to no node before it")?;
        let first = node.first as usize;
        if node.count != 0 {
            let end = first.checked_add(node.count as usize);
            return must(end.is_some_and(|end| end <= scene.triangles.len()), "triangles out of range");
        }
        must(depth < MAX_DEPTH, "too deep")?;
        match depths.get_mut(first..).and_then(|rest| rest.get_mut(..2)) {
            Some(children) if first > i && *children == [0, 0] => {
                children.fill(depth + 1);
                Ok(())
            }
            _ => Err("children out of range or shared"),
        }
    })
}

fn check_triangle(scene: &FlatScene, index: usize, triangle: &Triangle) -> Result<(), &'static str> {
    let Triangle { p0, p1, p2, uv_a, uv_b, uv_c, .. } = triangle;
    must(p0.is_finite() && p1.is_finite() && p2.is_finite(), "a position that is not finite")?;
    must(uv_a.is_finite() && uv_b.is_finite() && uv_c.is_finite(), "texture coordinates that are not finite")?;
    must((triangle.material as usize) < scene.materials.len(), "no such material")?;
    let light = scene.lights.get(triangle.light as usize);
    let mutual = light.is_some_and(|light| light.kind == LIGHT_TRIANGLE && light.triangle as usize == index);
    must(triangle.light == NONE || mutual, "not the light it says it is")
}

fn check_material(atlas: &Atlas, material: &Material) -> Result<(), &'static str> {
    must(material.base_color.is_finite() && material.emissive.is_finite(), "a colour that is not finite")?;
    let factors = [material.metallic, material.roughness, material.normal_scale, material.alpha_cutoff];
    must(factors.iter().all(|f| f.is_finite()), "a factor that is not finite")?;
    let slots = [
        &material.base_color_texture,
        &material.metallic_roughness_texture,
        &material.normal_texture,
        &material.emissive_texture,
    ];
    let inside = |start: u32, length: u32| start.checked_add(length).is_some_and(|end| end <= atlas.size);
    let sound = |slot: &TextureSlot| {
        slot.width == 0
            || (slot.height > 0
                && slot.row_u.is_finite()
                && slot.row_v.is_finite()
                && slot.layer < atlas.layers
                && inside(slot.x, slot.width)
                && inside(slot.y, slot.height))
    };
    must(slots.into_iter().all(sound), "a texture outside the atlas")
}

fn check_light(scene: &FlatScene, index: usize, light: &Light) -> Result<(), &'static str> {
    let Light { position, previous_position, direction, intensity, .. } = light;
    let vectors = [position, previous_position, direction, intensity];
    let scalars = [light.range, light.cos_inner, light.cos_outer, light.pmf, light.alias_threshold];
    let finite = vectors.iter().all(|v| v.is_finite()) && scalars.iter().all(|s| s.is_finite());
    must(finite, "numbers that are not finite")?;
    must((light.alias_light as usize) < scene.lights.len(), "alias out of range")?;
    let is_last = index + 1 == scene.lights.len();
    match light.kind {
        LIGHT_TRIANGLE => {
            let triangle = scene.triangles.get(light.triangle as usize);
            let mutual = triangle.is_some_and(|triangle| triangle.light as usize == index);
            must(mutual && index < scene.first_punctual as usize, "not the triangle it says it is")
        }
        LIGHT_ENVIRONMENT => must(is_last && scene.environment.is_some(), "an environment out of place"),
        kind => must(kind < LIGHT_ENVIRONMENT && index >= scene.first_punctual as usize, "an unknown kind"),
    }
}

fn check_atlas(atlas: &Atlas) -> Result<(), &'static str> {
    must((1..=8192).contains(&atlas.size) && (1..=256).contains(&atlas.layers), "absurd size")?;
    let bytes = u64::from(atlas.size).pow(2) * u64::from(atlas.layers) * 4;
    must(bytes == atlas.texels.len() as u64, "wrong number of texels")
}

fn check_environment(environment: &FlatEnvironment) -> Result<(), &'static str> {
    let FlatEnvironment { width, height, radiance, alias } = environment;
    must((1..=8192).contains(width) && (1..=8192).contains(height), "absurd size")?;
    let texels = *width as usize * *height as usize;
    must(radiance.len() == texels && alias.len() == texels, "wrong number of texels")?;
    must(radiance.iter().flatten().all(|c| c.is_finite()), "a radiance that is not finite")?;
    let sound = |entry: &[u32; 4]| {
        let [threshold, alias, pdf, _] = *entry;
        (alias as usize) < texels && f32::from_bits(threshold).is_finite() && f32::from_bits(pdf).is_finite()
    };
    must(alias.iter().all(sound), "a bad alias entry")
}
