//! The light table.

use super::emission::Emission;
use super::{FlatInstance, FlatMesh};
use crate::error::{Error, Result};
use crate::scene::gpu_types::{
    FULL_POWER, LIGHT_DIRECTIONAL, LIGHT_ENVIRONMENT, LIGHT_POINT, LIGHT_SPOT, LIGHT_SUN, LIGHT_TRIANGLE, Light, NONE,
    Triangle, TriangleAttributes,
};
use crate::scene::{PunctualKind, PunctualLight, Shape, Sun, alias};
use glam::{DVec3, Vec3};
use std::f32::consts::FRAC_PI_2;
use std::f64::consts::PI;

/// Smallest angular radius of a sun, in radians: below it no f32 direction would hit it.
const MIN_SUN_RADIUS: f32 = 1e-5;

/// Relative luminance of linear Rec. 709.
pub(super) fn luminance(color: Vec3) -> f64 {
    color.as_dvec3().dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// An emissive triangle of an instance.
pub(super) struct Emitter {
    pub light: Light,
    /// What it weighs in the table.
    pub weight: f64,
    /// Its number among the triangles of its mesh, in the order of the scene.
    pub place: u32,
}

/// The emissive triangles of all instances, instance after instance; each triangle learns which of its instance's lights
/// it is, each instance where its lights begin.
///
/// A triangle weighs the mean luminance of its emission times its area in the world, at rest.
pub(super) fn emitters(
    triangles: &mut [Triangle],
    meshes: &[FlatMesh],
    instances: &mut [FlatInstance],
    attributes: &[TriangleAttributes],
    emission: &Emission,
) -> Vec<Emitter> {
    // Place, index and mean emission of the emissive triangles of each mesh, by place: the order of the scene, which their
    // `light` holds so far, whatever that of the tree.
    let mut emitted: Vec<Vec<(u32, u32, f64)>> = Vec::with_capacity(meshes.len());
    for mesh in meshes {
        let mut of_mesh = Vec::new();
        for i in mesh.first_triangle..mesh.first_triangle + mesh.triangles {
            let (triangle, attributes) = (&mut triangles[i as usize], &attributes[i as usize]);
            let mean = match triangle.shape() {
                Shape::Triangles => emission.mean(triangle.material, |set| attributes.uvs(set)),
                _ => emission.untextured(triangle.material),
            };
            let place = std::mem::replace(&mut triangle.light, NONE);
            if mean > 0.0 {
                of_mesh.push((place, i, mean));
            }
        }
        of_mesh.sort_unstable_by_key(|&(place, ..)| place);
        emitted.push(of_mesh);
        for (&(_, i, _), number) in emitted.last().into_iter().flatten().zip(0..) {
            triangles[i as usize].light = number;
        }
    }
    let mut emitters = Vec::new();
    for (index, instance) in instances.iter_mut().enumerate() {
        instance.first_light = emitters.len() as u32;
        for &(place, i, mean) in &emitted[instance.mesh as usize] {
            let triangle = &triangles[i as usize];
            let [p0, p1, p2] = [triangle.p0, triangle.p1, triangle.p2].map(|p| instance.transform.transform_point3(p));
            let area = area_factor(triangle.shape()) * (p1 - p0).as_dvec3().cross((p2 - p0).as_dvec3()).length();
            let light = Light { triangle: i, instance: index as u32, intensity: FULL_POWER, ..empty(LIGHT_TRIANGLE) };
            emitters.push(Emitter { light, weight: mean * area, place });
        }
    }
    emitters
}

/// What moves may gain area after time 0, or come near: each of its triangles is drawn at least a thousandth as often as all
/// are on average. A light of probability 0 would be missing from every estimate that draws lights.
pub(super) fn keep_movers(emitters: &mut [Emitter], moves: impl Fn(u32) -> bool) {
    let total: f64 = emitters.iter().map(|emitter| emitter.weight).sum();
    let least = if total > 0.0 { 1e-3 * total / emitters.len() as f64 } else { 1.0 };
    for emitter in emitters.iter_mut().filter(|emitter| moves(emitter.light.instance)) {
        emitter.weight = emitter.weight.max(least);
    }
}

/// The area of a shape over that of the parallelogram of its edges.
fn area_factor(shape: Shape) -> f64 {
    match shape {
        Shape::Triangles => 0.5,
        Shape::Rectangle => 1.0,
        Shape::Disk => PI,
        Shape::Sphere => 4.0 * PI,
    }
}

/// The table: emissive triangles, punctual lights in order, the sun, the environment last. Returns it with the index of
/// the first punctual light.
///
/// A punctual light weighs the luminance of its intensity, sun and environment together as much as all the others, each
/// the same.
pub(super) fn build(
    emitters: Vec<Emitter>,
    punctual: &[PunctualLight],
    sun: Option<&Sun>,
    has_environment: bool,
) -> Result<(Vec<Light>, u32)> {
    let (mut lights, mut weights): (Vec<Light>, Vec<f64>) =
        emitters.into_iter().map(|emitter| (emitter.light, emitter.weight)).unzip();
    let first_punctual = lights.len() as u32;
    for (i, light) in punctual.iter().enumerate() {
        let sound = light.position.is_finite() && light.direction.is_finite() && !light.range.is_nan();
        if !sound || !light.intensity.is_finite() || light.intensity.min_element() < 0.0 {
            return Err(Error::bad_value(format!("light {i}"), "position, direction or intensity is not usable"));
        }
        lights.push(flatten(light));
        weights.push(luminance(light.intensity));
    }
    let sun = sun.map(flatten_sun).transpose()?.flatten();
    lights.extend(sun.into_iter().chain(has_environment.then(|| empty(LIGHT_ENVIRONMENT))));
    weigh(&mut lights, weights);
    Ok((lights, first_punctual))
}

/// Fills in the alias table and the cumulative distribution of all lights. `weights` are those of the first lights; the
/// distant ones, which are the last, have none and share as much as all the others together.
pub(crate) fn weigh(lights: &mut [Light], mut weights: Vec<f64>) {
    let distant = lights.len().saturating_sub(weights.len());
    let others: f64 = weights.iter().sum();
    let weight = if others > 0.0 { others / distant as f64 } else { 1.0 };
    weights.extend(std::iter::repeat_n(weight, distant));
    for (light, entry) in lights.iter_mut().zip(alias::build(&weights)) {
        light.pmf = entry.pmf;
        light.alias_threshold = entry.threshold;
        light.alias_light = entry.alias;
    }
    accumulate(lights);
}

/// Fills in the cumulative distribution, in whole parts of 2^32. Whatever can be drawn has a part at least, so that the
/// densities which follow from differences leave no light out.
fn accumulate(lights: &mut [Light]) {
    const WHOLE: f64 = 4_294_967_296.0;
    let can_be_drawn = lights.iter().filter(|light| light.pmf > 0.0).count() as f64;
    let total: f64 = lights.iter().map(|light| f64::from(light.pmf)).sum();
    let (mut sum, mut drawn) = (0.0, 0.0);
    for light in lights {
        // A part for each, and the rest by probability.
        light.cumulative = (drawn + sum * (WHOLE - can_be_drawn)).min(WHOLE - 1.0) as u32;
        sum += f64::from(light.pmf) / total;
        drawn += f64::from(u8::from(light.pmf > 0.0));
    }
}

fn empty(kind: u32) -> Light {
    Light { kind, triangle: NONE, direction: Vec3::NEG_Z, ..bytemuck::Zeroable::zeroed() }
}

/// The sun as a light, or none if it does not shine.
fn flatten_sun(sun: &Sun) -> Result<Option<Light>> {
    let bad = |what: &str| Err(Error::bad_value("sun", what));
    let Some(direction) = sun.direction.try_normalize() else { return bad("its direction has no length") };
    if !sun.irradiance.is_finite() || sun.irradiance.min_element() < 0.0 {
        return bad("its irradiance is negative or not finite");
    }
    if !(MIN_SUN_RADIUS..=FRAC_PI_2).contains(&sun.angular_radius) {
        return bad("its angular radius is not between 0.00001 and a right angle");
    }
    if !sun.radiance().is_finite() {
        return bad("its radiance is not finite");
    }
    Ok((sun.irradiance != Vec3::ZERO).then(|| Light {
        direction: -direction,
        intensity: sun.radiance(),
        cos_outer: sun.height() as f32,
        ..empty(LIGHT_SUN)
    }))
}

fn flatten(light: &PunctualLight) -> Light {
    let (kind, inner, outer) = match light.kind {
        PunctualKind::Point => (LIGHT_POINT, 0.0, std::f32::consts::PI),
        PunctualKind::Spot { inner, outer } => (LIGHT_SPOT, inner, outer),
        PunctualKind::Directional => (LIGHT_DIRECTIONAL, 0.0, std::f32::consts::PI),
    };
    Light {
        position: light.position,
        direction: light.direction.try_normalize().unwrap_or(Vec3::NEG_Z),
        range: if light.range.is_finite() { light.range.max(0.0) } else { 0.0 },
        intensity: light.intensity,
        cos_inner: inner.cos(),
        cos_outer: outer.cos(),
        ..empty(kind)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parts of the distribution are those of the probabilities, none is empty that can be drawn, and together they are whole.
    #[test]
    fn the_cumulative_distribution_leaves_out_no_light() {
        let weights = [1e-12, 3.0, 0.0, 1e-12, 1.0, 1e-12];
        let mut lights: Vec<Light> = weights.map(|_| empty(LIGHT_TRIANGLE)).to_vec();
        for (light, entry) in lights.iter_mut().zip(alias::build(&weights)) {
            light.pmf = entry.pmf;
        }
        accumulate(&mut lights);
        let ends = lights.iter().skip(1).map(|light| u64::from(light.cumulative)).chain([1 << 32]);
        let parts: Vec<u64> = lights.iter().zip(ends).map(|(light, end)| end - u64::from(light.cumulative)).collect();
        assert_eq!(parts.iter().sum::<u64>(), 1 << 32);
        for (weight, part) in weights.iter().zip(parts) {
            let expected = weight / 4.0 * 4_294_967_296.0;
            assert!((part > 0) == (*weight > 0.0) && (part as f64 - expected).abs() < 8.0, "{part} for {expected}");
        }
    }
}
