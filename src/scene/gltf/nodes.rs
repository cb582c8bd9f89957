//! The node hierarchy: where meshes, lights and cameras stand.

use super::buffers::Buffers;
use super::container::Document;
use super::material::UvSets;
use super::mesh::{self, Budget};
use super::{MAX_INSTANCES, area_lights, camera, instancing, lights};
use crate::error::Result;
use crate::scene::{Camera, Instance, MAX_TRIANGLES, Scene};
use glam::{Mat4, Quat, Vec3, Vec4};
use gltf::json::Node;

/// Walks the chosen scene's nodes in file order and loads the meshes, lights and cameras they place into `scene`.
/// `uv_sets` are those of each material.
pub(super) fn load(document: &Document, buffers: &Buffers, uv_sets: &[UvSets], scene: &mut Scene) -> Result<()> {
    let roots = check_hierarchy(document)?;
    let mut loader = Loader {
        document,
        buffers,
        uv_sets,
        scene,
        budget: Budget::default(),
        meshes: vec![None; document.root.meshes.len()],
        triangles: 0,
        cameras: Vec::new(),
    };
    // Depth first with an explicit stack: a chain may be as deep as the file is long.
    let mut stack: Vec<(usize, Mat4)> = roots.into_iter().rev().map(|root| (root, Mat4::IDENTITY)).collect();
    while let Some((index, parent)) = stack.pop() {
        let Some(node) = document.root.nodes.get(index) else { continue };
        let to_world = loader.node(node, index, parent)?;
        let children = node.children.iter().flatten().rev();
        stack.extend(children.map(|child| (child.value(), to_world)));
    }
    // The file's order of cameras, not that of the nodes that place them.
    let mut cameras = loader.cameras;
    cameras.sort_by_key(|(index, _)| *index);
    scene.cameras = cameras.into_iter().map(|(_, camera)| camera).collect();
    Ok(())
}

/// The roots of the chosen scene, once every node is known to have at most one parent and no cycle.
fn check_hierarchy(document: &Document) -> Result<Vec<usize>> {
    let nodes = &document.root.nodes;
    let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        for (position, child) in node.children.iter().flatten().enumerate() {
            let place = format!("nodes[{index}].children[{position}]");
            document.at(nodes, child.value(), "nodes", &place)?;
            let Some(parent) = parents.get_mut(child.value()) else { continue };
            if let Some(other) = parent {
                let what = format!("nodes[{}] is already a child of nodes[{other}]", child.value());
                return Err(document.bad(place, what));
            }
            *parent = Some(index);
        }
    }
    // With one parent each, a node that no root reaches is on a cycle or below one.
    let mut reached = vec![false; nodes.len()];
    let mut stack: Vec<usize> = (0..nodes.len()).filter(|&node| parents[node].is_none()).collect();
    while let Some(index) = stack.pop() {
        if let (Some(reached), Some(node)) = (reached.get_mut(index), nodes.get(index)) {
            *reached = true;
            stack.extend(node.children.iter().flatten().map(|child| child.value()));
        }
    }
    if let Some(cyclic) = reached.iter().position(|reached| !reached) {
        return Err(document.bad(format!("nodes[{cyclic}]"), "it is its own ancestor, or below a node that is"));
    }
    roots(document, &parents)
}

/// The nodes of the chosen scene (the default one if none is chosen, scene 0 if none is named; every root node if there
/// are no scenes).
fn roots(document: &Document, parents: &[Option<usize>]) -> Result<Vec<usize>> {
    let index = document.scene.unwrap_or_else(|| document.root.scene.map_or(0, |scene| scene.value()));
    if document.root.scenes.is_empty() && document.root.scene.is_none() {
        return Ok((0..parents.len()).filter(|&node| parents[node].is_none()).collect());
    }
    let scene = document.at(&document.root.scenes, index, "scenes", "scene")?;
    let mut listed = vec![false; parents.len()];
    let mut roots = Vec::with_capacity(scene.nodes.len());
    for (position, node) in scene.nodes.iter().enumerate() {
        let place = format!("scenes[{index}].nodes[{position}]");
        if document.at(parents, node.value(), "nodes", &place)?.is_some() {
            return Err(document.bad(place, format!("nodes[{}] is not a root node", node.value())));
        }
        if std::mem::replace(&mut listed[node.value()], true) {
            return Err(document.bad(place, format!("nodes[{}] is listed twice", node.value())));
        }
        roots.push(node.value());
    }
    Ok(roots)
}

/// What nodes share while they are walked.
struct Loader<'a> {
    document: &'a Document<'a>,
    buffers: &'a Buffers<'a>,
    uv_sets: &'a [UvSets],
    scene: &'a mut Scene,
    budget: Budget,
    /// For each glTF mesh loaded so far, the meshes its primitives became.
    meshes: Vec<Option<Vec<u32>>>,
    /// Triangles of all instances.
    triangles: u64,
    /// Cameras with their index in the file.
    cameras: Vec<(usize, Camera)>,
}

impl Loader<'_> {
    /// Loads what one node places; returns its transform to world space.
    fn node(&mut self, node: &Node, index: usize, parent: Mat4) -> Result<Mat4> {
        let place = format!("nodes[{index}]");
        let to_world = parent * local_transform(self.document, node, &place)?;
        self.document.finite(to_world.to_cols_array(), &format!("{place} (its transform to world space)"))?;
        if let Some(mesh) = node.mesh {
            match instancing::load(self.document, self.buffers, &mut self.budget, node, &place)? {
                Some(transforms) => {
                    for transform in transforms {
                        self.instances(mesh.value(), to_world * transform, &place)?;
                    }
                }
                None => self.instances(mesh.value(), to_world, &place)?,
            }
        }
        let light = node.extensions.as_ref().and_then(|extensions| extensions.khr_lights_punctual.as_ref());
        if let Some(light) = light {
            match lights::load(self.document, light.light.value(), &to_world, &place)? {
                Some(light) => self.scene.lights.push(light),
                None => self.scene.warnings.push(format!("{place}: its light is left out: its scale is zero")),
            }
        }
        if let Some(light) = area_lights::read(self.document, node, &place)?
            && let Err(error) = self.scene.add_area_light(&light, to_world)
        {
            self.scene.warnings.push(format!("{place}: its area light is left out: {error}"));
        }
        if let Some(camera) = node.camera {
            match camera::load(self.document, camera.value(), &to_world, node, &place)? {
                Some(loaded) => self.cameras.push((camera.value(), loaded)),
                None => self.scene.warnings.push(format!("{place}: its camera is left out: its scale is zero")),
            }
        }
        Ok(to_world)
    }

    /// Places every primitive of glTF mesh `index`, loaded at its first use.
    fn instances(&mut self, index: usize, transform: Mat4, place: &str) -> Result<()> {
        self.document.at(&self.document.root.meshes, index, "meshes", &format!("{place}.mesh"))?;
        let Some(slot) = self.meshes.get_mut(index) else { return Ok(()) };
        if slot.is_none() {
            *slot = Some(mesh::load(self.document, self.buffers, self.uv_sets, &mut self.budget, index, self.scene)?);
        }
        for &mesh in slot.iter().flatten() {
            let triangles = self.scene.meshes.get(mesh as usize).map_or(0, |mesh| mesh.indices.len() / 3);
            self.triangles += triangles as u64;
            self.document.within("the scene", self.triangles, MAX_TRIANGLES, "triangles")?;
            self.document.within("the scene", self.scene.instances.len() as u64 + 1, MAX_INSTANCES, "instances")?;
            self.scene.instances.push(Instance { mesh, transform });
        }
        Ok(())
    }
}

/// The transform of a node to its parent's space: its matrix, or T * R * S.
fn local_transform(document: &Document, node: &Node, place: &str) -> Result<Mat4> {
    if let Some(matrix) = node.matrix {
        let place = format!("{place}.matrix");
        let matrix = Mat4::from_cols_array(&document.finite(matrix, &place)?);
        if matrix.row(3) != Vec4::W {
            return Err(document.bad(place, "its last row is not 0 0 0 1"));
        }
        return Ok(matrix);
    }
    let translation = document.finite(node.translation.unwrap_or_default(), &format!("{place}.translation"))?;
    let scale = document.finite(node.scale.unwrap_or([1.0; 3]), &format!("{place}.scale"))?;
    let rotation_place = format!("{place}.rotation");
    let rotation = document.finite(node.rotation.unwrap_or_default().0, &rotation_place)?;
    // Exporters round; what is left of the length is removed.
    let rotation = Vec4::from(rotation).try_normalize();
    let rotation = rotation.ok_or_else(|| document.bad(rotation_place, "it has no length"))?;
    Ok(Mat4::from_scale_rotation_translation(Vec3::from(scale), Quat::from_vec4(rotation), Vec3::from(translation)))
}
