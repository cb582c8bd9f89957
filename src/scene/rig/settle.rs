//! What only seems to move is put in its place once and for all.

use super::{Motion, NONE, Rig, deform};
use crate::scene::flat::face_normal;
use crate::scene::{Mesh, Scene};
use glam::{Mat4, Vec3};

impl Scene {
    /// Takes from the rig what no clip and no spin moves: instances, lights and cameras that hang on nodes which stay
    /// where they are, and skinned or morphed meshes whose shape never changes, which take that shape for good. What
    /// was read from a file is settled before it is shown, so that only what moves costs anything.
    pub fn settle(&mut self) {
        let rig = std::mem::take(&mut self.rig);
        let moving = rig.moving_nodes();
        let rest = rig.rest();
        let mut kept = Vec::new();
        for placement in &rig.instances {
            if rig.motion(placement, &moving) != Motion::Still {
                kept.push(*placement);
                continue;
            }
            let Some(instance) = self.instances.get_mut(placement.instance as usize) else { continue };
            instance.transform = rest.instance(placement);
            let weights = rest.morph_weights(placement);
            let skinned = placement.skin != NONE;
            let Some(mesh) = self.meshes.get(instance.mesh as usize) else { continue };
            if skinned || weights.iter().any(|&weight| weight != 0.0) {
                let shaped = mesh.shaped(weights, &rest.joint_matrices(&rig, placement.skin));
                instance.mesh = self.meshes.len() as u32;
                self.meshes.push(shaped);
            }
        }
        let moves = |node: u32| moving.get(node as usize).copied().unwrap_or(false);
        let lights = rig.lights.iter().filter(|light| moves(light.node)).copied().collect();
        let cameras = rig.cameras.iter().filter(|camera| moves(camera.node)).copied().collect();
        self.rig = Rig { instances: kept, lights, cameras, ..rig };
        if self.rig.is_still() {
            self.rig = Rig::default();
        }
        // What is left of deformations belongs to instances that use them.
        let mut deforming = vec![false; self.meshes.len()];
        for placement in &self.rig.instances {
            let mesh = self.instances.get(placement.instance as usize).map_or(NONE, |instance| instance.mesh);
            if let Some(deforming) = deforming.get_mut(mesh as usize) {
                *deforming |= placement.skin != NONE || placement.weight_count > 0;
            }
        }
        for (mesh, deforming) in self.meshes.iter_mut().zip(deforming) {
            if !deforming {
                mesh.deformation = Default::default();
            }
        }
    }
}

impl Mesh {
    /// The vertices with what moves them; weights that are missing are 0.
    pub fn vertices(&self) -> Vec<deform::Vertex> {
        let each = self.positions.iter().enumerate().map(|(i, &position)| {
            let influence = self.deformation.influences.get(i).copied().unwrap_or_default();
            deform::Vertex {
                position,
                normal: self.normals.get(i).copied().unwrap_or_default(),
                tangent: self.tangents.get(i).copied().unwrap_or_default().to_array(),
                joints: influence.joints,
                weights: influence.weights,
            }
        });
        each.collect()
    }

    /// This mesh in the shape that weights and joints give it.
    pub(in crate::scene) fn shaped(&self, weights: &[f32], joints: &[Mat4]) -> Mesh {
        let displacements = self.deformation.targets.concat();
        let mut deformed = Vec::new();
        deform::deform(&self.vertices(), &displacements, weights, joints, &mut deformed);
        let mut shaped = Mesh {
            positions: deformed.iter().map(|vertex| vertex.position).collect(),
            normals: deformed.iter().map(|vertex| vertex.normal).collect(),
            uvs: self.uvs.clone(),
            colors: self.colors.clone(),
            indices: self.indices.clone(),
            material: self.material,
            ..Mesh::default()
        };
        if self.deformation.flat {
            for corners in self.indices.as_chunks::<3>().0 {
                let corners = corners.map(|corner| corner as usize);
                let face = face_normal(corners.map(|corner| shaped.positions[corner]));
                corners.iter().for_each(|&corner| shaped.normals[corner] = face.unwrap_or(Vec3::Z));
            }
        }
        if deform::is_mirrored(joints) {
            shaped.indices.as_chunks_mut::<3>().0.iter_mut().for_each(|corners| corners.swap(1, 2));
        }
        if !self.tangents.is_empty() {
            shaped.tangents = deformed.iter().map(|vertex| vertex.tangent).collect();
        }
        shaped
    }
}
