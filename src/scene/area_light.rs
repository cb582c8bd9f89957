//! Lights with a simple shape: sphere, rectangle, disk. Each is one primitive of the BVH, seen and sampled as a whole.

use super::{Instance, Material, Mesh, Scene, Shape};
use crate::error::{Error, Result};
use glam::{Mat4, Vec2, Vec3};

/// A light with a shape, in its own space: flat ones lie round the origin in the plane of X and Y and shine along -Z, as
/// spot lights do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AreaLight {
    /// Its outline.
    pub outline: Outline,
    /// Radiance, linear Rec. 709, the same from every point in every direction.
    pub radiance: Vec3,
    /// Whether a flat one shines along +Z too.
    pub double_sided: bool,
}

/// The outlines of an [`AreaLight`], in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outline {
    /// Shines outwards.
    Sphere {
        /// Of the sphere.
        radius: f32,
    },
    /// Shines along -Z.
    Rectangle {
        /// Along X.
        width: f32,
        /// Along Y.
        height: f32,
    },
    /// Shines along -Z.
    Disk {
        /// Of the disk.
        radius: f32,
    },
}

impl Scene {
    /// Places a light: as a mesh of one primitive with a black material that shines. `transform` may be any affine matrix
    /// for a flat light; a sphere has to stay one.
    ///
    /// # Errors
    /// [`Error::BadValue`] for a size or radiance that is negative or not finite, and for a sphere whose axes are scaled
    /// by different factors.
    pub fn add_area_light(&mut self, light: &AreaLight, transform: Mat4) -> Result<()> {
        let bad = |what: &str| Err(Error::bad_value("area light", what));
        let (shape, sides) = match light.outline {
            Outline::Sphere { radius } => (Shape::Sphere, [radius, radius]),
            Outline::Rectangle { width, height } => (Shape::Rectangle, [width, height]),
            Outline::Disk { radius } => (Shape::Disk, [radius, radius]),
        };
        if sides.iter().any(|side| !side.is_finite() || *side <= 0.0) {
            return bad("a size is not a number above 0");
        }
        if !light.radiance.is_finite() || light.radiance.min_element() < 0.0 {
            return bad("its radiance is negative or not finite");
        }
        if shape == Shape::Sphere && !keeps_spheres(transform) {
            return bad("a sphere whose axes are scaled by different factors");
        }
        self.materials.push(Material {
            name: "area light".into(),
            base_color: Vec3::ZERO.extend(1.0),
            metallic: 0.0,
            emissive: light.radiance,
            double_sided: light.double_sided && shape != Shape::Sphere,
            ..Material::default()
        });
        // The front, where the edges' cross product points, is -Z.
        let [x, y] = [Vec3::X * sides[0], Vec3::NEG_Y * sides[1]];
        let corner = if shape == Shape::Rectangle { -0.5 * (x + y) } else { Vec3::ZERO };
        self.meshes.push(Mesh {
            shape,
            positions: vec![corner, corner + x, corner + y],
            normals: vec![Vec3::NEG_Z; 3],
            uvs: [vec![Vec2::ZERO, Vec2::X, Vec2::Y], Vec::new()],
            indices: vec![0, 1, 2],
            material: self.materials.len() as u32 - 1,
            ..Mesh::default()
        });
        self.instances.push(Instance { mesh: self.meshes.len() as u32 - 1, transform });
        Ok(())
    }
}

/// Whether a transform scales all directions by the same factor.
pub(crate) fn keeps_spheres(transform: Mat4) -> bool {
    let [x, y, z] = [transform.x_axis, transform.y_axis, transform.z_axis].map(|axis| axis.truncate());
    let length = x.length().max(y.length()).max(z.length());
    let close = |a: f32, b: f32| (a - b).abs() <= 1e-4 * length * length;
    length > 0.0
        && [y, z].iter().all(|axis| close(axis.length_squared(), x.length_squared()))
        && [x.dot(y), y.dot(z), z.dot(x)].iter().all(|dot| close(*dot, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;

    #[test]
    fn spheres_stay_spheres_or_are_refused() {
        let turned = Mat4::from_scale_rotation_translation(Vec3::splat(3.0), Quat::from_rotation_x(1.0), Vec3::ONE);
        assert!(keeps_spheres(turned) && keeps_spheres(Mat4::from_scale(Vec3::new(2.0, -2.0, 2.0))));
        assert!(!keeps_spheres(Mat4::from_scale(Vec3::new(1.0, 1.0, 1.1))));
        assert!(!keeps_spheres(Mat4::ZERO));
        let sheared = Mat4::from_cols_array_2d(&[
            [1.0, 0.0, 0.0, 0.0],
            [0.5, 0.75f32.sqrt(), 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]);
        assert!(!keeps_spheres(sheared));
    }

    #[test]
    fn bad_lights_are_refused() {
        let light = |outline, radiance| AreaLight { outline, radiance, double_sided: false };
        let mut scene = Scene::default();
        let mut add = |light, scale| scene.add_area_light(&light, Mat4::from_scale(scale));
        let sphere = Outline::Sphere { radius: 1.0 };
        assert!(add(light(sphere, Vec3::ONE), Vec3::ONE).is_ok());
        assert!(add(light(Outline::Disk { radius: 1.0 }, Vec3::ONE), Vec3::new(1.0, 2.0, 1.0)).is_ok());
        for (light, scale) in [
            (light(sphere, Vec3::NAN), Vec3::ONE),
            (light(sphere, Vec3::NEG_ONE), Vec3::ONE),
            (light(sphere, Vec3::ONE), Vec3::new(1.0, 2.0, 1.0)),
            (light(Outline::Disk { radius: 0.0 }, Vec3::ONE), Vec3::ONE),
            (light(Outline::Rectangle { width: 1.0, height: f32::INFINITY }, Vec3::ONE), Vec3::ONE),
        ] {
            assert_eq!(add(light, scale).unwrap_err().code(), "BAD_VALUE");
        }
    }
}
