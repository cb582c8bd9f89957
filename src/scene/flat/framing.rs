//! A camera for a scene that has none.

use super::FlatScene;
use crate::scene::Camera;
use crate::scene::intersect::intersect_cpu;
use glam::Vec3;
use std::f32::consts::{FRAC_PI_3, FRAC_PI_4, TAU};

/// Horizontal directions in which walls are looked for, and how many must find one.
const DIRECTIONS: u32 = 16;
const MIN_WALLS: usize = 14;

/// Inside a scene that surrounds its middle, else one that frames the bounds.
pub(super) fn camera(scene: &FlatScene) -> Camera {
    interior(scene).unwrap_or_else(|| framing(scene.bounds))
}

/// From the front and a little above, with all of the bounds in view.
fn framing([min, max]: [Vec3; 2]) -> Camera {
    const VERTICAL_FOV: f32 = FRAC_PI_4;
    let center = 0.5 * (min + max);
    let radius = 0.5 * (max - min).length();
    let distance = if radius > 0.0 { radius } else { 1.0 } / (0.5 * VERTICAL_FOV).sin();
    let from = Vec3::new(0.3, 0.25, 1.0).normalize();
    Camera::look_at("framing", center + from * distance, center, VERTICAL_FOV)
}

/// If there is a floor below the middle and there are walls nearly all around: off the middle towards the farther end of
/// the longer horizontal axis, looking back along it at eye height.
fn interior(scene: &FlatScene) -> Option<Camera> {
    let [min, max] = scene.bounds;
    let (middle, extent) = (0.5 * (min + max), max - min);
    let walls = (0..DIRECTIONS).filter(|&i| {
        let angle = TAU * (i as f32 + 0.5) / DIRECTIONS as f32;
        sight(scene, middle, Vec3::new(angle.cos(), 0.0, angle.sin())).is_some()
    });
    if walls.count() < MIN_WALLS {
        return None;
    }
    let floor = middle.y - sight(scene, middle, Vec3::NEG_Y)?;
    let eye = middle.with_y(floor + eye_height(max.y - floor));
    let (axis, length) = if extent.x > extent.z { (Vec3::X, extent.x) } else { (Vec3::Z, extent.z) };
    let free = |direction| intersect_cpu(scene, eye, direction, length).map_or(length, |hit| hit.t);
    let back = if free(axis) >= free(-axis) { axis } else { -axis };
    let step = (length / 6.0).min(0.8 * free(back));
    Some(Camera::look_at("interior", eye + back * step, eye, FRAC_PI_3))
}

/// A quarter of the height of a room, but in a high one that of a person, or a tenth where it is not built in metres.
fn eye_height(room: f32) -> f32 {
    (0.25 * room).min(f32::max(1.7, 0.1 * room))
}

/// Distance to what faces the ray first. What turns its back, even if it has two sides, is the inside of a solid: none.
fn sight(scene: &FlatScene, origin: Vec3, direction: Vec3) -> Option<f32> {
    let hit = intersect_cpu(scene, origin, direction, f32::INFINITY)?;
    let triangle = scene.triangles.get(hit.triangle as usize)?;
    let normal = (triangle.p1 - triangle.p0).cross(triangle.p2 - triangle.p0);
    // Which side is seen is the same in the triangle's own space.
    let to_object = scene.instances.get(hit.instance as usize)?.transform.inverse();
    (normal.dot(to_object.transform_vector3(direction)) < 0.0).then_some(hit.t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Instance, Material, Mesh, Scene, shapes};
    use glam::Mat4;

    fn flat(meshes: Vec<Mesh>, double_sided: bool) -> FlatScene {
        let scene = Scene {
            instances: (0..meshes.len() as u32).map(|mesh| Instance { mesh, transform: Mat4::IDENTITY }).collect(),
            materials: vec![Material { double_sided, ..Material::default() }],
            meshes,
            ..Scene::default()
        };
        FlatScene::build(&scene, &mut |_, _| ()).unwrap()
    }

    /// A box that is seen from within.
    fn room(min: Vec3, max: Vec3) -> Mesh {
        let mut walls = shapes::cuboid(min, max, 0);
        walls.indices.chunks_exact_mut(3).for_each(|corners| corners.swap(1, 2));
        walls
    }

    #[test]
    fn a_room_is_seen_from_inside() {
        let (min, max) = (Vec3::new(-6.0, 1.0, -2.0), Vec3::new(6.0, 5.0, 2.0));
        for double_sided in [false, true] {
            let camera = camera(&flat(vec![room(min, max)], double_sided));
            assert_eq!(camera.name, "interior");
            assert!(camera.position.abs_diff_eq(Vec3::new(2.0, 2.0, 0.0), 1e-4), "{}", camera.position);
            assert!(camera.forward.abs_diff_eq(Vec3::NEG_X, 1e-5), "{}", camera.forward);
        }
    }

    #[test]
    fn the_camera_stays_off_walls_and_high_rooms_have_low_eyes() {
        let (min, max) = (Vec3::new(-9.0, 0.0, -30.0), Vec3::new(9.0, 14.0, 30.0));
        // One screen a metre from the middle, another four on the other side.
        let screen = |z: f32| shapes::cuboid(Vec3::new(-8.0, 0.1, z), Vec3::new(8.0, 5.0, z + 0.1), 0);
        let screens = vec![room(min, max), screen(-1.0), screen(4.0)];
        let camera = camera(&flat(screens, true));
        assert_eq!(camera.name, "interior");
        assert!((camera.position.y - 1.7).abs() < 1e-3, "{}", camera.position);
        assert!((3.0..3.9).contains(&camera.position.z), "{}", camera.position);
    }

    #[test]
    fn objects_are_seen_from_outside() {
        let object = shapes::cuboid(Vec3::NEG_ONE, Vec3::ONE, 0);
        let ground = shapes::parallelogram(Vec3::new(-9.0, -1.0, 9.0), Vec3::X * 18.0, Vec3::Z * -18.0, 0);
        for double_sided in [false, true] {
            for meshes in [vec![object.clone()], vec![object.clone(), ground.clone()], vec![ground.clone()], vec![]] {
                assert_eq!(camera(&flat(meshes, double_sided)).name, "framing");
            }
        }
    }

    #[test]
    fn the_smallest_objects_fill_the_view() {
        for size in [1e-6, 1e-3, 1.0, 1e6] {
            let object = shapes::cuboid(Vec3::splat(-size), Vec3::splat(size), 0);
            let distance = camera(&flat(vec![object], false)).position.length();
            assert!((4.0..5.0).contains(&(distance / size)), "{size}: {distance}");
        }
    }
}
