//! The light table and the environment, each with its alias table.

use super::{FlatEnvironment, FlatInstance, FlatMesh};
use crate::error::{Error, Result};
use crate::scene::gpu_types::{
    LIGHT_DIRECTIONAL, LIGHT_ENVIRONMENT, LIGHT_POINT, LIGHT_SPOT, LIGHT_TRIANGLE, Light, Material, NONE, Triangle,
};
use crate::scene::{Environment, PunctualKind, PunctualLight, alias};
use glam::{DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// Longest side of an environment, in texels: what every WebGPU device can hold.
const MAX_ENVIRONMENT_SIDE: u32 = 8192;

/// Relative luminance of linear Rec. 709.
pub(super) fn luminance(color: Vec3) -> f64 {
    color.as_dvec3().dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// Emissive triangles with what each weighs in the table.
pub(super) type Emitters = Vec<(Light, f64)>;

/// The emissive triangles of all instances, instance after instance; each triangle learns which of its instance's lights
/// it is, each instance where its lights begin.
///
/// A triangle weighs luminance x area in the world, at rest (its texture is not considered: it can only make it darker).
pub(super) fn emitters(
    triangles: &mut [Triangle],
    meshes: &[FlatMesh],
    instances: &mut [FlatInstance],
    materials: &[Material],
) -> Emitters {
    let emitted: Vec<f64> = materials.iter().map(|material| luminance(material.emissive)).collect();
    let emission = |t: &Triangle| emitted.get(t.material as usize).copied().unwrap_or_default();
    for mesh in meshes {
        let range = mesh.first_triangle as usize..(mesh.first_triangle + mesh.triangles) as usize;
        let emissive = triangles[range].iter_mut().filter(|t| emission(t) > 0.0);
        emissive.zip(0..).for_each(|(triangle, number)| triangle.light = number);
    }
    let mut emitters = Emitters::new();
    for (index, instance) in instances.iter_mut().enumerate() {
        instance.first_light = emitters.len() as u32;
        let mesh = &meshes[instance.mesh as usize];
        for i in mesh.first_triangle..mesh.first_triangle + mesh.triangles {
            let triangle = &triangles[i as usize];
            if triangle.light == NONE {
                continue;
            }
            let [p0, p1, p2] = [triangle.p0, triangle.p1, triangle.p2].map(|p| instance.transform.transform_point3(p));
            let area = 0.5 * (p1 - p0).as_dvec3().cross((p2 - p0).as_dvec3()).length();
            let light = Light { triangle: i, instance: index as u32, ..empty(LIGHT_TRIANGLE) };
            emitters.push((light, emission(triangle) * area));
        }
    }
    emitters
}

/// The table: emissive triangles, punctual lights in order, the environment last. Returns it with the index of the first
/// punctual light.
///
/// A punctual light weighs the luminance of its intensity, the environment as much as all the others.
pub(super) fn build(
    emitters: Emitters,
    punctual: &[PunctualLight],
    has_environment: bool,
) -> Result<(Vec<Light>, u32)> {
    let (mut lights, mut weights): (Vec<Light>, Vec<f64>) = emitters.into_iter().unzip();
    let first_punctual = lights.len() as u32;
    for (i, light) in punctual.iter().enumerate() {
        let sound = light.position.is_finite() && light.direction.is_finite() && !light.range.is_nan();
        if !sound || !light.intensity.is_finite() || light.intensity.min_element() < 0.0 {
            return Err(Error::bad_value(format!("light {i}"), "position, direction or intensity is not usable"));
        }
        lights.push(flatten(light));
        weights.push(luminance(light.intensity));
    }
    if has_environment {
        let others: f64 = weights.iter().sum();
        lights.push(empty(LIGHT_ENVIRONMENT));
        weights.push(if others > 0.0 { others } else { 1.0 });
    }
    for (light, entry) in lights.iter_mut().zip(alias::build(&weights)) {
        light.pmf = entry.pmf;
        light.alias_threshold = entry.threshold;
        light.alias_light = entry.alias;
    }
    Ok((lights, first_punctual))
}

fn empty(kind: u32) -> Light {
    Light { kind, triangle: NONE, direction: Vec3::NEG_Z, ..bytemuck::Zeroable::zeroed() }
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

/// The environment with its alias table, or none if it is black everywhere.
///
/// A texel weighs its solid angle times the mean luminance of the bilinearly filtered map over it, so that nothing the
/// filter can read has density 0; within the texel directions are uniform in solid angle.
pub(super) fn environment(environment: &Environment) -> Result<Option<FlatEnvironment>> {
    let (width, height) = (environment.width, environment.height);
    let bad = |what: String| Error::bad_value("environment", what);
    if width == 0 || height == 0 || u64::from(width) * u64::from(height) != environment.pixels.len() as u64 {
        return Err(bad(format!("{width}x{height} texels were promised, {} came", environment.pixels.len())));
    }
    if width.max(height) > MAX_ENVIRONMENT_SIDE {
        return Err(Error::Limit {
            what: "the environment".into(),
            wanted: u64::from(width.max(height)),
            had: u64::from(MAX_ENVIRONMENT_SIDE),
            unit: "texels a side",
        });
    }
    if environment.pixels.iter().flatten().any(|c| !c.is_finite() || *c < 0.0) {
        return Err(bad("a radiance is negative or not finite".into()));
    }
    let filtered = filtered_luminance(environment);
    if filtered.iter().all(|&l| l == 0.0) {
        return Ok(None);
    }
    let solid_angle = |row: usize| {
        let latitude = |edge: usize| (PI * edge as f64 / f64::from(height)).cos();
        TAU / f64::from(width) * (latitude(row) - latitude(row + 1))
    };
    let weights: Vec<f64> = filtered.iter().enumerate().map(|(i, l)| l * solid_angle(i / width as usize)).collect();
    let entries = alias::build(&weights).into_iter().enumerate().map(|(i, entry)| {
        let pdf = (f64::from(entry.pmf) / solid_angle(i / width as usize)) as f32;
        [entry.threshold.to_bits(), entry.alias, pdf.to_bits(), 0]
    });
    let alias = entries.collect();
    let radiance = environment.pixels.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();
    Ok(Some(FlatEnvironment { width, height, radiance, alias }))
}

/// The mean over each texel of the bilinearly interpolated luminance: a tent of (1, 6, 1) / 8 along both axes, wrapped
/// along u and clamped along v.
fn filtered_luminance(environment: &Environment) -> Vec<f64> {
    let (width, height) = (environment.width as usize, environment.height as usize);
    let texels: Vec<f64> = environment.pixels.iter().map(|&p| luminance(Vec3::from_array(p))).collect();
    let tent = |before: f64, here: f64, after: f64| (before + 6.0 * here + after) / 8.0;
    let along_u: Vec<f64> = (0..width * height)
        .map(|i| {
            let (x, row) = (i % width, i - i % width);
            tent(texels[row + (x + width - 1) % width], texels[i], texels[row + (x + 1) % width])
        })
        .collect();
    (0..width * height)
        .map(|i| {
            let above = if i < width { i } else { i - width };
            let below = if i + width < along_u.len() { i + width } else { i };
            tent(along_u[above], along_u[i], along_u[below])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pdf(environment: &FlatEnvironment, i: usize) -> f64 {
        f64::from(f32::from_bits(environment.alias[i][2]))
    }

    #[test]
    fn even_environment_is_uniform_over_the_sphere() {
        for (width, height) in [(1, 1), (8, 4)] {
            let map = Environment { width, height, pixels: vec![[2.0; 3]; (width * height) as usize] };
            let flat = environment(&map).unwrap().unwrap();
            for i in 0..flat.alias.len() {
                assert!((pdf(&flat, i) * 4.0 * PI - 1.0).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn one_bright_texel_spreads_as_far_as_the_filter_reads() {
        let (width, height) = (8u32, 4u32);
        let mut pixels = vec![[0.0; 3]; 32];
        pixels[0] = [1.0; 3]; // the top left corner: wraps to x = 7
        let flat = environment(&Environment { width, height, pixels }).unwrap().unwrap();
        let mut total = 0.0;
        for i in 0..32 {
            let (x, y) = (i % 8, i / 8);
            let near = (x <= 1 || x == 7) && y <= 1;
            assert_eq!(pdf(&flat, i) > 0.0, near, "{x} {y}");
            let cos = |edge: usize| (PI * edge as f64 / 4.0).cos();
            total += pdf(&flat, i) * TAU / 8.0 * (cos(y) - cos(y + 1));
        }
        assert!((total - 1.0).abs() < 1e-5, "{total}");
    }

    #[test]
    fn bad_and_black_environments() {
        let map = |width, height, pixel: f32, n| Environment { width, height, pixels: vec![[pixel; 3]; n] };
        assert!(environment(&map(2, 2, 0.0, 4)).unwrap().is_none());
        assert!(environment(&map(2, 2, 1.0, 3)).is_err());
        assert!(environment(&map(0, 2, 1.0, 0)).is_err());
        assert!(environment(&map(1, 1, f32::NAN, 1)).is_err());
        assert!(environment(&map(1, 1, -1.0, 1)).is_err());
        assert!(environment(&map(8193, 1, 1.0, 8193)).is_err());
    }
}
