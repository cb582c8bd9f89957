//! Cameras.

use super::container::Document;
use super::tidy;
use crate::error::Result;
use crate::scene::{Camera, Projection};
use glam::{Mat4, Vec3};
use gltf::json;
use std::f32::consts::PI;

/// Camera `index` of the file where a node of transform `to_world` puts it, as [`Camera::at`]. Named after itself, else
/// after its node.
pub(super) fn load(
    document: &Document,
    index: usize,
    to_world: &Mat4,
    node: &json::Node,
    node_place: &str,
) -> Result<Option<Camera>> {
    let camera = document.at(&document.root.cameras, index, "cameras", &format!("{node_place}.camera"))?;
    let place = format!("cameras[{index}]");
    let projection = projection(document, camera, &place)?;
    let name = camera.name.as_deref().or(node.name.as_deref()).map_or(place, tidy);
    let camera = Camera { name, position: Vec3::ZERO, forward: Vec3::NEG_Z, up: Vec3::Y, projection };
    Ok(camera.at(to_world))
}

/// Field of view or half height; aspect ratio and clipping planes are the renderer's own.
fn projection(document: &Document, camera: &json::Camera, place: &str) -> Result<Projection> {
    match document.valid(&camera.type_, &format!("{place}.type"))? {
        json::camera::Type::Perspective => {
            let perspective = camera.perspective.as_ref();
            let vertical_fov = perspective.ok_or_else(|| document.bad(place, "it has no 'perspective'"))?.yfov;
            if !(vertical_fov > 0.0 && vertical_fov < PI) {
                let what = format!("{vertical_fov} is not between 0 and pi");
                return Err(document.bad(format!("{place}.perspective.yfov"), what));
            }
            Ok(Projection::Perspective { vertical_fov })
        }
        json::camera::Type::Orthographic => {
            let orthographic = camera.orthographic.as_ref();
            let ymag = orthographic.ok_or_else(|| document.bad(place, "it has no 'orthographic'"))?.ymag;
            if !ymag.is_finite() || ymag == 0.0 {
                return Err(document.bad(format!("{place}.orthographic.ymag"), format!("{ymag} is no half height")));
            }
            Ok(Projection::Orthographic { half_height: ymag.abs() })
        }
    }
}
