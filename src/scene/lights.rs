//! Giving light to a scene that has none.

use super::random::Random;
use super::{Environment, PunctualKind, PunctualLight, Scene};
use glam::Vec3;

/// More scattered lights than this are not made.
const MAX_SCATTERED: u32 = 1_000_000;
const SEED: u64 = 0x6c69_6768;

impl Scene {
    /// If nothing in the scene shines, adds `scatter` white point lights, uniformly in the box of the scene (as thesis
    /// `001`, section 5.1), or an even white sky if `scatter` is 0, and says so in the warnings. Together the point lights
    /// give the same light whatever their number, in proportion to the square of the scene's size.
    pub fn ensure_light(&mut self, scatter: u32, seed: u64) {
        if self.has_light() {
            return;
        }
        if scatter == 0 {
            self.environment = Some(Environment::even(Vec3::ONE));
            self.warnings.push("the scene has no light: an even white sky was added".into());
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
        let emits = |instance: &super::Instance| {
            let mesh = self.meshes.get(instance.mesh as usize).filter(|mesh| mesh.indices.len() >= 3);
            mesh.and_then(|mesh| self.materials.get(mesh.material as usize)).is_some_and(|m| m.emissive != Vec3::ZERO)
        };
        let bright = |environment: &Environment| environment.pixels.iter().flatten().any(|&c| c > 0.0);
        self.lights.iter().any(|light| light.intensity != Vec3::ZERO)
            || self.environment.as_ref().is_some_and(bright)
            || self.instances.iter().any(emits)
    }

    /// The box of all placed vertices, or a box of a metre if there are none.
    fn corners(&self) -> [Vec3; 2] {
        let mut corners = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        for instance in &self.instances {
            let Some(mesh) = self.meshes.get(instance.mesh as usize) else { continue };
            let placed = mesh.positions.iter().map(|p| instance.transform.transform_point3(*p));
            for p in placed.filter(|p| p.abs().max_element() <= super::MAX_COORDINATE) {
                corners = [corners[0].min(p), corners[1].max(p)];
            }
        }
        if corners[0].is_finite() { corners } else { [Vec3::splat(-0.5), Vec3::splat(0.5)] }
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
    fn no_lights_asked_for_means_a_sky() {
        for mut scene in [dark(), Scene::default()] {
            scene.ensure_light(0, 0);
            assert!(scene.environment.is_some() && scene.warnings.len() == 1);
        }
        let mut empty = Scene::default();
        empty.ensure_light(3, 0);
        assert!(empty.lights.iter().all(|light| light.position.is_finite() && light.intensity.x > 0.0));
    }
}
