//! Animated power of lights: KHR_animation_pointer to the intensity of a punctual light and to the emissive strength of a
//! material. Channels with other pointers are not played, and a warning counts them.

use super::animations::{Keyframes, Reader};
use super::buffers::Buffers;
use super::container::{Document, Pointer};
use super::mesh::Budget;
use crate::error::Result;
use crate::scene::rig::{CUBIC_SPLINE, Dimmer};
use crate::scene::{Rig, Scene};
use glam::Vec3;
use gltf::json::animation::Property;
use gltf::json::extensions::scene::khr_lights_punctual::Light;
use std::collections::BTreeMap;

/// Keyframes of a factor on the power of lights.
pub(super) struct PowerChannel {
    /// Index of the animation.
    pub animation: usize,
    /// Index in [`Rig::powers`].
    pub power: u32,
    /// Its values.
    pub keyframes: Keyframes,
}

/// What is animated.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Target {
    /// `intensity` of a light of the file.
    Light(usize),
    /// `emissiveStrength` of a material of the file.
    Material(usize),
}

impl Target {
    /// What a JSON pointer points to, if it is one of these.
    fn of(pointer: &str) -> Option<Self> {
        let parts: Vec<&str> = pointer.split('/').collect();
        match parts[..] {
            ["", "extensions", "KHR_lights_punctual", "lights", index, "intensity"] => {
                index.parse().ok().map(Self::Light)
            }
            ["", "materials", index, "extensions", "KHR_materials_emissive_strength", "emissiveStrength"] => {
                index.parse().ok().map(Self::Material)
            }
            _ => None,
        }
    }
}

/// Reads the channels whose pointers are understood, in file order, and has the rig dim what they point to. `light_sources`
/// are the indices in the file of the scene's lights.
///
/// At full power a light is as bright as the file or any keyframe makes it, so that factors are at most 1 at keyframes, and a
/// light that the file begins with at 0 can still be switched on.
pub(super) fn load(
    document: &Document,
    buffers: &Buffers,
    budget: &mut Budget,
    light_sources: &[usize],
    scene: &mut Scene,
) -> Result<Vec<PowerChannel>> {
    let mut channels: Vec<(Target, PowerChannel)> = Vec::new();
    let mut unknown = 0;
    for pointer in &document.pointers {
        let Some(target) = Target::of(&pointer.path) else {
            unknown += 1;
            continue;
        };
        let keyframes = read(document, buffers, budget, pointer)?;
        channels.push((target, PowerChannel { animation: pointer.animation, power: 0, keyframes }));
    }
    if unknown > 0 {
        let warning = format!("{unknown} channel(s) of animations target no node (KHR_animation_pointer): not played");
        scene.warnings.push(warning);
    }
    let mut brightest: BTreeMap<Target, f32> = BTreeMap::new();
    for (target, channel) in &channels {
        let most = values(&channel.keyframes).fold(0.0, f32::max);
        brightest.entry(*target).and_modify(|other| *other = other.max(most)).or_insert(most);
    }
    let mut dimmed: BTreeMap<Target, Dimmed> = BTreeMap::new();
    for (target, brightest) in brightest {
        if let Some(full) = dim(document, target, brightest, &mut scene.rig)? {
            dimmed.insert(target, full);
        }
    }
    for ((light, source), target) in scene.lights.iter_mut().zip(light_sources).zip(0..) {
        if let Some(Dimmed { power, emission, .. }) = dimmed.get(&Target::Light(*source)) {
            light.intensity = *emission;
            scene.rig.dimmed_lights.push(Dimmer { target, power: *power });
        }
    }
    for (material, index) in scene.materials.iter_mut().zip(0..) {
        if let Some(Dimmed { emission, .. }) = dimmed.get(&Target::Material(index)) {
            material.emissive = *emission;
        }
    }
    for (instance, target) in scene.instances.iter().zip(0..) {
        let material = scene.meshes.get(instance.mesh as usize).map(|mesh| mesh.material as usize);
        if let Some(Dimmed { power, .. }) = material.and_then(|index| dimmed.get(&Target::Material(index))) {
            scene.rig.dimmed_instances.push(Dimmer { target, power: *power });
        }
    }
    let finished = channels.into_iter().filter_map(|(target, mut channel)| {
        let Dimmed { power, full, .. } = dimmed.get(&target)?;
        channel.power = *power;
        channel.keyframes.values.iter_mut().for_each(|value| *value /= full);
        Some(channel)
    });
    Ok(finished.collect())
}

/// A channel's keyframes, none of them negative.
fn read(document: &Document, buffers: &Buffers, budget: &mut Budget, pointer: &Pointer) -> Result<Keyframes> {
    let Pointer { animation, place, sampler, .. } = pointer;
    let animation_place = format!("animations[{animation}]");
    let animation = document.at(&document.root.animations, *animation, "animations", place)?;
    let sampler = sampler.ok_or_else(|| document.bad(place, "it has no sampler"))?;
    let reader = Reader {
        document,
        buffers,
        sampler: document.at(&animation.samplers, sampler, "samplers", &format!("{place}.sampler"))?,
        place: format!("{animation_place}.samplers[{sampler}]"),
    };
    // One number a keyframe, as the weight of a single morph target.
    let keyframes = reader.read(budget, Property::MorphTargetWeights, 1)?;
    if let Some(value) = values(&keyframes).find(|value| *value < 0.0) {
        return Err(document.bad(format!("{}.output", reader.place), format!("a power of {value}")));
    }
    Ok(keyframes)
}

/// The values at keyframes, without the tangents of splines.
fn values(keyframes: &Keyframes) -> impl Iterator<Item = f32> {
    let (first, step) = if keyframes.interpolation == CUBIC_SPLINE { (1, 3) } else { (0, 1) };
    keyframes.values.iter().skip(first).step_by(step).copied()
}

/// A target of full power.
struct Dimmed {
    /// Index of the factor.
    power: u32,
    /// What intensity or strength is then.
    full: f32,
    /// That times the colour.
    emission: Vec3,
}

/// A target at the power that it has in the file or at its brightest keyframe, whichever is more, with a factor that dims it to
/// the file's; none for what never shines.
fn dim(document: &Document, target: Target, brightest: f32, rig: &mut Rig) -> Result<Option<Dimmed>> {
    let (color, own, place) = match target {
        Target::Light(index) => {
            let place = "extensions.KHR_lights_punctual.lights";
            let lights: &[Light] = document.root.as_ref();
            let light = document.at(lights, index, place, "a pointer of KHR_animation_pointer")?;
            (light.color, light.intensity, format!("{place}[{index}]"))
        }
        Target::Material(index) => {
            let materials = &document.root.materials;
            let material = document.at(materials, index, "materials", "a pointer of KHR_animation_pointer")?;
            let strength = material.extensions.as_ref().and_then(|extensions| extensions.emissive_strength.as_ref());
            let strength = strength.map_or(1.0, |strength| strength.emissive_strength.0);
            (material.emissive_factor.0, strength, format!("materials[{index}].emissiveFactor"))
        }
    };
    let full = own.max(brightest);
    let emission = Vec3::from(document.finite(color.map(|channel| channel * full), &place)?);
    if emission == Vec3::ZERO {
        return Ok(None);
    }
    Ok(Some(Dimmed { power: rig.add_power((own / full).max(0.0)), full, emission }))
}
