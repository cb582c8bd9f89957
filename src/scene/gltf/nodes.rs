//! The node hierarchy: where meshes, lights and cameras stand.

use super::buffers::Buffers;
use super::container::Document;
use super::material::UvSets;
use super::mesh::{self, Budget};
use super::{MAX_INSTANCES, animations, area_lights, camera, instancing, lights, pointers, skins};
use crate::error::Result;
use crate::scene::gpu_types::NONE;
use crate::scene::rig::{Attachment, Node as RigNode, Placement};
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
        light_sources: Vec::new(),
        cameras: Vec::new(),
        rig_nodes: vec![None; document.root.nodes.len()],
        is_rigged: is_rigged(document),
    };
    // Depth first with an explicit stack: a chain may be as deep as the file is long.
    let world = Parent { to_world: Mat4::IDENTITY, rig_node: NONE };
    let mut stack: Vec<(usize, Parent)> = roots.into_iter().rev().map(|root| (root, world)).collect();
    while let Some((index, parent)) = stack.pop() {
        let Some(node) = document.root.nodes.get(index) else { continue };
        let parent = loader.node(node, index, parent)?;
        let children = node.children.iter().flatten().rev();
        stack.extend(children.map(|child| (child.value(), parent)));
    }
    // The file's order of cameras, not that of the nodes that place them.
    loader.cameras.sort_by_key(|(index, _, _)| *index);
    for (_, camera, node) in std::mem::take(&mut loader.cameras) {
        loader.scene.rig.cameras.push(Attachment { target: loader.scene.cameras.len() as u32, node });
        loader.scene.cameras.push(camera);
    }
    loader.rig()
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
    /// For each light of the scene, its index in the file.
    light_sources: Vec<usize>,
    /// Cameras with their index in the file and their node in the rig.
    cameras: Vec<(usize, Camera, u32)>,
    /// For each node of the file, its index in the rig, once it has been walked.
    rig_nodes: Vec<Option<u32>>,
    /// Whether the file has anything that could move or shape an instance.
    is_rigged: bool,
}

/// What a node takes from its parent.
#[derive(Clone, Copy)]
struct Parent {
    to_world: Mat4,
    rig_node: u32,
}

impl Loader<'_> {
    /// Loads what one node places; returns what its children take from it.
    fn node(&mut self, node: &Node, index: usize, parent: Parent) -> Result<Parent> {
        let place = format!("nodes[{index}]");
        let local = RigNode { parent: parent.rig_node, ..local_transform(self.document, node, &place)? };
        let to_world = parent.to_world * local.local();
        self.document.finite(to_world.to_cols_array(), &format!("{place} (its transform to world space)"))?;
        let rig_node = self.scene.rig.add_node(local);
        if let Some(slot) = self.rig_nodes.get_mut(index) {
            *slot = Some(rig_node);
        }
        if let Some(mesh) = node.mesh {
            let copies = instancing::load(self.document, self.buffers, &mut self.budget, node, &place)?;
            let offsets = copies.unwrap_or_else(|| vec![Mat4::IDENTITY]);
            let first = self.scene.instances.len();
            for offset in &offsets {
                self.instances(mesh.value(), to_world * *offset, &place)?;
            }
            self.placements(node, mesh.value(), rig_node, first, &offsets, &place)?;
        }
        let light = node.extensions.as_ref().and_then(|extensions| extensions.khr_lights_punctual.as_ref());
        if let Some(light) = light {
            match lights::load(self.document, light.light.value(), &to_world, &place)? {
                Some(loaded) => {
                    let target = self.scene.lights.len() as u32;
                    self.scene.rig.lights.push(Attachment { target, node: rig_node });
                    self.scene.lights.push(loaded);
                    self.light_sources.push(light.light.value());
                }
                None => self.scene.warnings.push(format!("{place}: its light is left out: its scale is zero")),
            }
        }
        if let Some(light) = area_lights::read(self.document, node, &place)? {
            let instance = self.scene.instances.len() as u32;
            match self.scene.add_area_light(&light, to_world) {
                Ok(()) if self.is_rigged => self.scene.rig.instances.push(Placement::rigid(instance, rig_node)),
                Ok(()) => {}
                Err(error) => self.scene.warnings.push(format!("{place}: its area light is left out: {error}")),
            }
        }
        if let Some(camera) = node.camera {
            match camera::load(self.document, camera.value(), &to_world, node, &place)? {
                Some(loaded) => self.cameras.push((camera.value(), loaded, rig_node)),
                None => self.scene.warnings.push(format!("{place}: its camera is left out: its scale is zero")),
            }
        }
        Ok(Parent { to_world, rig_node })
    }

    /// Hangs the instances that a node has just placed on its node in the rig, with the weights of its morph targets.
    /// Skins are numbered as in the file until all nodes are known.
    fn placements(
        &mut self,
        node: &Node,
        mesh: usize,
        rig_node: u32,
        first: usize,
        offsets: &[Mat4],
        place: &str,
    ) -> Result<()> {
        if !self.is_rigged {
            return Ok(());
        }
        let weight_count = target_count(self.document, mesh);
        let given = node.weights.as_ref().or_else(|| self.document.root.meshes.get(mesh)?.weights.as_ref());
        if let Some(given) = given
            && given.len() != weight_count as usize
        {
            let what = format!("{} weights for {weight_count} morph targets", given.len());
            return Err(self.document.bad(format!("{place} (the weights of its mesh)"), what));
        }
        let rig = &mut self.scene.rig;
        let first_weight = rig.weights.len() as u32;
        for i in 0..weight_count as usize {
            let weight = given.and_then(|given| given.get(i)).copied().unwrap_or_default();
            let [weight] = self.document.finite([weight], &format!("{place}.weights"))?;
            rig.weights.push(weight);
        }
        let skin = node.skin.map_or(NONE, |skin| skin.value() as u32);
        let meshes = self.meshes.get(mesh).and_then(Option::as_ref).map_or(0, Vec::len);
        for (i, instance) in (first..self.scene.instances.len()).enumerate() {
            let instance = instance as u32;
            let placement = Placement {
                offset: offsets.get(i / meshes.max(1)).copied().unwrap_or_default(),
                instance,
                node: rig_node,
                skin,
                first_weight,
                weight_count,
                padding: [0; 3],
            };
            rig.instances.push(placement);
        }
        Ok(())
    }

    /// Loads the skins that are in use and the animations, and settles what they do not move.
    fn rig(self) -> Result<()> {
        let Loader { document, buffers, scene, mut budget, rig_nodes, light_sources, .. } = self;
        let mut skins = vec![None; document.root.skins.len()];
        for i in 0..scene.rig.instances.len() {
            let (file_skin, instance) = (scene.rig.instances[i].skin, scene.rig.instances[i].instance);
            if file_skin == NONE {
                continue;
            }
            let index = file_skin as usize;
            document.at(&skins, index, "skins", "a node's skin")?;
            if skins[index].is_none() {
                let (rig, warnings) = (&mut scene.rig, &mut scene.warnings);
                skins[index] = Some(skins::load(document, buffers, &mut budget, index, &rig_nodes, rig, warnings)?);
            }
            let skin = skins[index].flatten().unwrap_or(NONE);
            let mesh = scene.instances.get(instance as usize).and_then(|i| scene.meshes.get(i.mesh as usize));
            let influences = mesh.map_or(&[][..], |mesh| &mesh.deformation.influences);
            let joints = scene.rig.joints_of(skin).len();
            let used = influences.iter().flat_map(|i| i.joints.into_iter().zip(i.weights));
            let last = used.filter(|(_, weight)| *weight > 0.0).map(|(joint, _)| usize::from(joint)).max();
            if let Some(last) = last.filter(|&last| skin != NONE && last >= joints) {
                let what = format!("a vertex that it moves names joint {last}, but there are {joints}");
                return Err(document.bad(format!("skins[{index}]"), what));
            }
            // Without joints at its vertices a mesh has nothing that a skin could move.
            scene.rig.instances[i].skin = if influences.is_empty() { NONE } else { skin };
        }
        let mut weights = vec![0; document.root.nodes.len()];
        for (count, node) in weights.iter_mut().zip(&document.root.nodes) {
            *count = node.mesh.map_or(0, |mesh| target_count(document, mesh.value()));
        }
        let targets = animations::Targets { nodes: &rig_nodes, weights: &weights };
        let powers = pointers::load(document, buffers, &mut budget, &light_sources, scene)?;
        let (rig, warnings) = (&mut scene.rig, &mut scene.warnings);
        animations::load(document, buffers, &mut budget, &targets, &powers, rig, warnings)?;
        scene.settle();
        Ok(())
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

/// Whether the file has anything that could move or shape an instance.
fn is_rigged(document: &Document) -> bool {
    let root = &document.root;
    let morphs = || root.meshes.iter().flat_map(|mesh| &mesh.primitives).any(|p| p.targets.is_some());
    let skinned = || root.nodes.iter().any(|node| node.skin.is_some());
    !root.animations.is_empty() || !root.skins.is_empty() || morphs() || skinned()
}

/// Morph targets of glTF mesh `index`: as many in every primitive.
fn target_count(document: &Document, index: usize) -> u32 {
    let primitives = document.root.meshes.get(index).map_or(&[][..], |mesh| &mesh.primitives);
    primitives.iter().map(|p| p.targets.as_ref().map_or(0, Vec::len)).max().unwrap_or_default() as u32
}

/// The transform of a node to its parent's space: its matrix, or T * R * S.
fn local_transform(document: &Document, node: &Node, place: &str) -> Result<RigNode> {
    if let Some(matrix) = node.matrix {
        let place = format!("{place}.matrix");
        let matrix = Mat4::from_cols_array(&document.finite(matrix, &place)?);
        if matrix.row(3) != Vec4::W {
            return Err(document.bad(place, "its last row is not 0 0 0 1"));
        }
        return Ok(RigNode { matrix, ..RigNode::default() });
    }
    let translation = document.finite(node.translation.unwrap_or_default(), &format!("{place}.translation"))?;
    let scale = document.finite(node.scale.unwrap_or([1.0; 3]), &format!("{place}.scale"))?;
    let rotation_place = format!("{place}.rotation");
    let rotation = document.finite(node.rotation.unwrap_or_default().0, &rotation_place)?;
    // Exporters round; what is left of the length is removed.
    let rotation = Vec4::from(rotation).try_normalize();
    let rotation = rotation.ok_or_else(|| document.bad(rotation_place, "it has no length"))?;
    Ok(RigNode {
        translation: Vec3::from(translation),
        rotation: Quat::from_vec4(rotation),
        scale: Vec3::from(scale),
        ..RigNode::default()
    })
}
