//! Whether a flat scene that came from outside may be rendered: shaders check no index.

use super::mips::{level_count, side};
use super::packing::{MAX_ARRAYS, MAX_LAYERS, MAX_SIDE};
use super::{FlatEnvironment, FlatScene, TextureArray};
use crate::scene::bvh::wide::MAX_ITEMS;
use crate::scene::bvh::{MAX_DEPTH, MAX_TOP_DEPTH};
use crate::scene::gpu_types::{
    LIGHT_ENVIRONMENT, LIGHT_SUN, LIGHT_TRIANGLE, Light, Material, MaterialExtensions, NONE, TextureSlot, Triangle,
    TriangleAttributes,
};
use crate::scene::rig::Counts;
use std::ops::Range;

/// (where, what is wrong there).
type Fault = (String, String);

/// The first fault, if any.
pub(super) fn validate(scene: &FlatScene) -> Result<(), Fault> {
    forest(scene)?;
    each("triangles", &scene.triangles, |_, triangle| check_triangle(scene, triangle))?;
    each("attributes", &scene.attributes, |_, attributes| check_attributes(attributes))?;
    each("materials", &scene.materials, |_, material| check_material(&scene.textures, material))?;
    let extensions = &scene.material_extensions;
    let complete = extensions.is_empty() || extensions.len() == scene.materials.len();
    must(complete, "not one a material").map_err(|what| fault("material extensions", what))?;
    each("material extensions", extensions, |_, extensions| check_extensions(&scene.textures, extensions))?;
    each("lights", &scene.lights, |i, light| check_light(scene, i, light))?;
    let complete = scene.light_powers.is_empty() || scene.light_powers.len() == scene.lights.len();
    must(complete, "not one a light").map_err(|what| fault("light_powers", what))?;
    each("light_powers", &scene.light_powers, |i, &power| {
        let can_be_dimmed = scene.lights.get(i).is_some_and(|light| light.kind < LIGHT_ENVIRONMENT);
        must(power == NONE || (can_be_dimmed && (power as usize) < scene.rig.powers.len()), "no such power")
    })?;
    let complete = scene.rig.powers.is_empty() || !scene.light_powers.is_empty() || scene.lights.is_empty();
    must(complete, "missing").map_err(|what| fault("light_powers", what))?;
    emitters(scene)?;
    let punctual = (scene.lights.len() as u64).checked_sub(u64::from(scene.first_punctual));
    let punctual = punctual.ok_or_else(|| fault("first_punctual", "past the lights"))?;
    must(scene.textures.len() <= MAX_ARRAYS, "too many").map_err(|what| fault("textures", what))?;
    each("textures", &scene.textures, |_, array| check_texture_array(array))?;
    if let Some(environment) = &scene.environment {
        check_environment(environment).map_err(|what| fault("environment", what))?;
    }
    each("cameras", &scene.cameras, |_, camera| {
        let finite = camera.position.is_finite() && camera.forward.is_finite() && camera.up.is_finite();
        must(finite, "numbers that are not finite")
    })?;
    let counts = Counts { instances: scene.instances.len(), lights: punctual as usize, cameras: scene.cameras.len() };
    scene.rig.check(counts)?;
    let triangles: Vec<u32> = scene.meshes.iter().map(|mesh| mesh.triangles).collect();
    scene.deformers.check(&triangles, &scene.rig.instances)?;
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

/// Meshes cover all nodes and triangles one after another, then comes the top level; each is a tree; instances refer to
/// meshes.
fn forest(scene: &FlatScene) -> Result<(), Fault> {
    must(!scene.meshes.is_empty(), "empty").map_err(|what| fault("meshes", what))?;
    must(scene.attributes.len() == scene.triangles.len(), "not one a triangle")
        .map_err(|what| fault("attributes", what))?;
    let (mut node, mut triangle) = (0u32, 0u32);
    for (i, mesh) in scene.meshes.iter().enumerate() {
        let follows = mesh.root == node && mesh.first_triangle == triangle && mesh.nodes > 0 && mesh.triangles > 0;
        let ends = node.checked_add(mesh.nodes).zip(triangle.checked_add(mesh.triangles));
        match ends {
            Some(ends)
                if follows && ends.0 as usize <= scene.nodes.len() && ends.1 as usize <= scene.triangles.len() =>
            {
                tree(scene, node..ends.0, triangle..ends.1, MAX_DEPTH)?;
                (node, triangle) = ends;
            }
            _ => return Err(fault(format!("meshes[{i}]"), "out of place")),
        }
    }
    must(triangle as usize == scene.triangles.len(), "more than the meshes'")
        .map_err(|what| fault("triangles", what))?;
    each("instances", &scene.instances, |_, instance| {
        must((instance.mesh as usize) < scene.meshes.len(), "no such mesh")?;
        must(instance.transform.is_finite(), "a transform that is not finite")?;
        must(instance.first_light <= scene.first_punctual, "lights out of range")
    })?;
    let complete = !scene.instances.is_empty() && (scene.has_top_level() || scene.instances.len() == 1);
    must(complete, "too few or too many").map_err(|what| fault("instances", what))?;
    let top_nodes = if scene.has_top_level() { 2 * scene.instances.len() - 1 } else { 0 };
    must(scene.nodes.len() - node as usize == top_nodes, "a top level of another size")
        .map_err(|what| fault("nodes", what))?;
    if top_nodes > 0 {
        tree(scene, node..scene.nodes.len() as u32, 0..scene.instances.len() as u32, MAX_TOP_DEPTH)?;
    }
    Ok(())
}

/// Within `range` children come after their parent and belong to it alone, so that every walk ends; no path is too long;
/// leaves hold some of `items`.
fn tree(scene: &FlatScene, range: Range<u32>, items: Range<u32>, max_depth: u32) -> Result<(), Fault> {
    let start = range.start as usize;
    let mut depths = vec![0u32; range.len()];
    depths[0] = 1;
    for i in 0..depths.len() {
        let check = || {
            let node = &scene.nodes[start + i];
            must(node.min.is_finite() && node.max.is_finite(), "a box that is not finite")?;
            must(depths[i] != 0, "belongs to no node before it")?;
            if node.count != 0 {
                must(node.count <= MAX_ITEMS, "a leaf of too many")?;
                let end = node.first.checked_add(node.count);
                let within = node.first >= items.start && end.is_some_and(|end| end <= items.end);
                return must(within, "triangles out of range").map(|()| None);
            }
            must(depths[i] < max_depth, "too deep")?;
            let first = (node.first as usize).checked_sub(start).filter(|&first| first > i);
            let children = first.and_then(|first| depths.get(first..first.checked_add(2)?).map(|pair| (first, pair)));
            match children {
                Some((first, [0, 0])) => Ok(Some(first)),
                _ => Err("children out of range or shared"),
            }
        };
        if let Some(first) = check().map_err(|what| fault(format!("nodes[{}]", start + i), what))? {
            let below = depths[i] + 1;
            depths[first..first + 2].fill(below);
        }
    }
    Ok(())
}

fn check_attributes(attributes: &TriangleAttributes) -> Result<(), &'static str> {
    let TriangleAttributes { uv_a, uv_b, uv_c, .. } = attributes;
    must(uv_a.is_finite() && uv_b.is_finite() && uv_c.is_finite(), "texture coordinates that are not finite")
}

fn check_triangle(scene: &FlatScene, triangle: &Triangle) -> Result<(), &'static str> {
    let Triangle { p0, p1, p2, .. } = triangle;
    must(p0.is_finite() && p1.is_finite() && p2.is_finite(), "a position that is not finite")?;
    must((triangle.material as usize) < scene.materials.len(), "no such material")
}

/// Every instance's emissive triangles are the lights it says they are.
fn emitters(scene: &FlatScene) -> Result<(), Fault> {
    let mut expected = 0;
    for (i, instance) in scene.instances.iter().enumerate() {
        let mesh = &scene.meshes[instance.mesh as usize];
        must(instance.first_light == expected, "lights out of order")
            .map_err(|what| fault(format!("instances[{i}]"), what))?;
        for index in mesh.first_triangle..mesh.first_triangle + mesh.triangles {
            let triangle = &scene.triangles[index as usize];
            if triangle.light == NONE {
                continue;
            }
            let number = instance.first_light.checked_add(triangle.light);
            let mutual = number
                .and_then(|number| scene.lights.get(number as usize))
                .is_some_and(|l| l.kind == LIGHT_TRIANGLE && l.triangle == index && l.instance as usize == i);
            must(mutual, "not the light it says it is").map_err(|what| fault(format!("triangles[{index}]"), what))?;
            expected += 1;
        }
    }
    must(expected == scene.first_punctual, "not where the punctual lights begin")
        .map_err(|what| fault("first_punctual", what))
}

fn check_material(textures: &[TextureArray], material: &Material) -> Result<(), &'static str> {
    must(material.base_color.is_finite() && material.emissive.is_finite(), "a colour that is not finite")?;
    let factors = [material.metallic, material.roughness, material.normal_scale, material.alpha_cutoff];
    must(factors.iter().all(|f| f.is_finite()), "a factor that is not finite")?;
    let slots = [
        &material.base_color_texture,
        &material.metallic_roughness_texture,
        &material.normal_texture,
        &material.emissive_texture,
    ];
    check_slots(textures, &slots)
}

fn check_extensions(textures: &[TextureArray], extensions: &MaterialExtensions) -> Result<(), &'static str> {
    must(extensions.factors().iter().all(|f| f.is_finite()), "a factor that is not finite")?;
    check_slots(textures, &extensions.slots())
}

fn check_slots(textures: &[TextureArray], slots: &[&TextureSlot]) -> Result<(), &'static str> {
    must(slots.iter().all(|slot| is_sound(textures, slot)), "a texture outside its array")
}

/// Whether every level that a slot reads lies in its array.
fn is_sound(textures: &[TextureArray], slot: &TextureSlot) -> bool {
    let Some(read) = slot.read() else { return true };
    let ([x, y], [width, height]) = (read.origin, read.size);
    let levels = level_count(width, height);
    let inside = |start: u32, length: u32, whole: u32, k: u32| (start >> k) + side(length, k) <= side(whole, k);
    let holds = |array: &TextureArray| {
        read.layer < array.layers
            && levels <= array.levels
            && (0..levels).all(|k| inside(x, width, array.width, k) && inside(y, height, array.height, k))
    };
    slot.row_u.is_finite() && slot.row_v.is_finite() && textures.get(read.array as usize).is_some_and(holds)
}

fn check_light(scene: &FlatScene, index: usize, light: &Light) -> Result<(), &'static str> {
    let Light { position, direction, intensity, .. } = light;
    let vectors = [position, direction, intensity];
    let scalars = [light.range, light.cos_inner, light.cos_outer, light.pmf, light.alias_threshold];
    let finite = vectors.iter().all(|v| v.is_finite()) && scalars.iter().all(|s| s.is_finite());
    must(finite, "numbers that are not finite")?;
    must((light.alias_light as usize) < scene.lights.len(), "alias out of range")?;
    let is_last = index + 1 == scene.lights.len();
    match light.kind {
        // That it is the triangle it says it is, `emitters` has seen.
        LIGHT_TRIANGLE => must(index < scene.first_punctual as usize, "a triangle out of place"),
        LIGHT_SUN => {
            let only_environment_follows =
                scene.lights.get(index + 1..).is_some_and(|rest| rest.iter().all(|l| l.kind == LIGHT_ENVIRONMENT));
            must(only_environment_follows && light.cos_outer > 0.0, "a sun out of place")
        }
        LIGHT_ENVIRONMENT => must(is_last && scene.environment.is_some(), "an environment out of place"),
        kind => must(kind < LIGHT_ENVIRONMENT && index >= scene.first_punctual as usize, "an unknown kind"),
    }
}

fn check_texture_array(array: &TextureArray) -> Result<(), &'static str> {
    let TextureArray { width, height, layers, levels, .. } = *array;
    must((1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height), "absurd size")?;
    must((1..=MAX_LAYERS).contains(&layers) && (1..=level_count(width, height)).contains(&levels), "absurd size")?;
    must(array.expected_bytes() == array.texels.len() as u64, "wrong number of texels")
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
