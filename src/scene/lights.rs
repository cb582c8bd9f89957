//! Giving light to a scene that has none.

use super::flat::face_normal;
use super::random::Random;
use super::sky::Sky;
use super::{Environment, PunctualKind, PunctualLight, Scene, TextureRef};
use crate::error::Result;
use glam::Vec3;

/// More scattered lights than this are not made.
const MAX_SCATTERED: u32 = 1_000_000;
/// A scene smaller than this counts as a point, in metres: the light of its square would be lost in rounding.
const MIN_EXTENT: f32 = 1e-6;
const SEED: u64 = 0x6c69_6768;

impl Scene {
    /// Puts what `name` calls round the scene, in place of its environment and sun: `sky`, `sky:elevation=10,turbidity=4`
    /// (see [`Sky::parse`]), or `white`, radiance 1 from everywhere. Whether the name is one of these; others are left to
    /// the caller, as names of files.
    ///
    /// # Errors
    /// As [`Sky::parse`].
    pub fn surround(&mut self, name: &str) -> Result<bool> {
        match name.split_once(':').unwrap_or((name, "")) {
            ("sky", parameters) => Sky::parse(parameters)?.surround(self),
            ("white", "") => self.surround_by(Environment::even(Vec3::ONE)),
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// Puts a map round the scene, in place of its environment and sun.
    pub fn surround_by(&mut self, environment: Environment) {
        self.environment = Some(environment);
        self.sun = None;
    }

    /// If nothing in the scene shines, adds `scatter` white point lights, uniformly in the box of the scene (as thesis
    /// `001`, section 5.1), or sun and sky if `scatter` is 0, and says so in the warnings. Together the point lights
    /// give the same light whatever their number, in proportion to the square of the scene's size.
    pub fn ensure_light(&mut self, scatter: u32, seed: u64) {
        if self.has_light() {
            return;
        }
        if scatter == 0 {
            Sky::default().surround(self);
            self.warnings.push("the scene has no light: sun and sky were added".into());
            return;
        }
        let scatter = scatter.min(MAX_SCATTERED);
        let [low, high] = self.corners();
        let extent = (high - low).max_element();
        let candela = 2.0 * extent * extent / scatter as f32;
        let mut random = Random::new(seed ^ SEED);
        self.lights.extend((0..scatter).map(|_| PunctualLight {
            kind: PunctualKind::Point,
            position: random.in_box(low, high),
            direction: Vec3::NEG_Z,
            intensity: candela * random.in_box(Vec3::splat(0.8), Vec3::splat(1.2)),
            range: f32::INFINITY,
        }));
        self.warnings.push(format!("the scene has no light: {scatter} point lights were scattered in it"));
    }

    fn has_light(&self) -> bool {
        let emits = |(index, instance): (usize, &super::Instance)| {
            let Some(mesh) = self.meshes.get(instance.mesh as usize) else { return false };
            let moves = || self.rig.instances.iter().any(|placement| placement.instance == index as u32);
            let material = self.materials.get(mesh.material as usize);
            let placed = |&corner: &u32| {
                mesh.positions.get(corner as usize).map_or(Vec3::NAN, |p| instance.transform.transform_point3(*p))
            };
            // As flattening leaves it out, a triangle without area does not shine; one that moves may gain some.
            material
                .is_some_and(|material| material.emitted() != Vec3::ZERO && !self.is_black(material.emissive_texture))
                && (moves()
                    || mesh
                        .indices
                        .as_chunks()
                        .0
                        .iter()
                        .any(|corners| face_normal(corners.each_ref().map(placed)).is_some()))
        };
        let bright = |environment: &Environment| environment.pixels.iter().flatten().any(|&c| c > 0.0);
        self.lights.iter().any(|light| light.intensity != Vec3::ZERO)
            || self.environment.as_ref().is_some_and(bright)
            || self.sun.is_some_and(|sun| sun.irradiance != Vec3::ZERO)
            || self.instances.iter().enumerate().any(emits)
    }

    /// Whether there is a texture and it is black all over.
    fn is_black(&self, reference: Option<TextureRef>) -> bool {
        let texture = reference.and_then(|reference| self.textures.get(reference.texture as usize));
        texture.is_some_and(|texture| texture.pixels.as_chunks().0.iter().all(|[r, g, b, _]| [*r, *g, *b] == [0; 3]))
    }

    /// The box of all placed vertices, or one of a metre if there are none or all are at one point.
    fn corners(&self) -> [Vec3; 2] {
        let mut corners = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        for instance in &self.instances {
            let Some(mesh) = self.meshes.get(instance.mesh as usize) else { continue };
            let placed = mesh.positions.iter().map(|p| instance.transform.transform_point3(*p));
            for p in placed.filter(|p| p.abs().max_element() <= super::MAX_COORDINATE) {
                corners = [corners[0].min(p), corners[1].max(p)];
            }
        }
        let extent = (corners[1] - corners[0]).max_element();
        match (corners[0].is_finite(), extent < MIN_EXTENT) {
            (true, false) => corners,
            (true, true) => [corners[0] - 0.5, corners[1] + 0.5],
            (false, _) => [Vec3::splat(-0.5), Vec3::splat(0.5)],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    fn dark() -> Scene {
        let mut scene = builtin::make("cornell").unwrap();
        scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
        scene
    }

    #[test]
    fn a_lit_scene_is_left_alone() {
        for name in ["cornell", "furnace"] {
            let mut scene = builtin::make(name).unwrap();
            scene.ensure_light(10, 0);
            assert!(scene.lights.is_empty() && scene.warnings.is_empty());
        }
    }

    #[test]
    fn scatters_in_the_box_by_seed() {
        let lights = |count, seed| {
            let mut scene = dark();
            scene.ensure_light(count, seed);
            assert_eq!(scene.warnings.len(), 1);
            scene.lights
        };
        let hundred = lights(100, 1);
        assert_eq!(hundred.len(), 100);
        assert_eq!(hundred, lights(100, 1));
        assert_ne!(hundred, lights(100, 2));
        assert!(hundred.iter().all(|l| l.position.x.abs() <= 0.5 && (0.0..=1.0).contains(&l.position.y)));
        let total = |lights: &[PunctualLight]| lights.iter().map(|l| l.intensity.y).sum::<f32>();
        assert!((total(&lights(1000, 1)) / total(&hundred) - 1.0).abs() < 0.1);
    }

    #[test]
    fn a_scene_at_one_point_is_lit_too() {
        let mut scene = dark();
        for instance in &mut scene.instances {
            instance.transform = glam::Mat4::from_scale(Vec3::ZERO);
        }
        scene.ensure_light(3, 0);
        assert_eq!(scene.lights.len(), 3);
        assert!(scene.lights.iter().all(|light| light.intensity.min_element() > 1e-3));
    }

    #[test]
    fn a_black_emissive_texture_is_no_light() {
        for (value, lit) in [(0, false), (1, true)] {
            let mut scene = builtin::make("cornell").unwrap();
            scene.textures.push(crate::scene::Texture {
                name: String::new(),
                width: 2,
                height: 1,
                pixels: std::sync::Arc::new(vec![0, 0, 0, 255, 0, value, 0, 255]),
                wrap: [crate::scene::Wrap::Repeat; 2],
                linear_filter: true,
            });
            let reference = TextureRef {
                texture: scene.textures.len() as u32 - 1,
                uv_set: 0,
                offset: glam::Vec2::ZERO,
                rotation: 0.0,
                scale: glam::Vec2::ONE,
            };
            scene.materials.iter_mut().for_each(|material| material.emissive_texture = Some(reference));
            scene.ensure_light(0, 0);
            assert_eq!(scene.environment.is_none(), lit);
        }
    }

    #[test]
    fn emission_without_area_is_no_light() {
        let mut scene = builtin::make("cornell").unwrap();
        for mesh in &mut scene.meshes {
            mesh.indices.iter_mut().for_each(|index| *index = 0);
        }
        scene.ensure_light(0, 0);
        assert!(scene.environment.is_some());
    }

    #[test]
    fn surroundings_by_name() {
        let mut scene = Scene::default();
        assert!(scene.surround("sky:elevation=70").unwrap());
        let high = scene.sun.unwrap();
        assert!((high.direction.y - 70f32.to_radians().sin()).abs() < 1e-5);
        assert!(scene.surround("white").unwrap());
        assert!(scene.sun.is_none() && scene.environment.as_ref().is_some_and(|e| e.pixels == [[1.0; 3]]));
        assert!(!scene.surround("sky.exr").unwrap() && !scene.surround("white:1").unwrap());
        assert!(scene.surround("sky:elevation=100").is_err());
    }

    #[test]
    fn no_lights_asked_for_means_a_sky() {
        for mut scene in [dark(), Scene::default()] {
            scene.ensure_light(0, 0);
            assert!(scene.environment.is_some() && scene.sun.is_some() && scene.warnings.len() == 1);
        }
        let mut empty = Scene::default();
        empty.ensure_light(3, 0);
        assert!(empty.lights.iter().all(|light| light.position.is_finite() && light.intensity.x > 0.0));
    }
}
