//! From a SCENE argument to a flat scene and one of its cameras.

use crate::failure::{Failure, Result};
use crate::progress;
use restir::Error;
use restir::scene::flat::cooked;
use restir::scene::{Camera, FlatScene, Scene, builtin, environment, gltf, obj};
use std::path::Path;

/// What lights a scene beyond its own lights.
#[derive(Default, clap::Args)]
pub struct Lighting {
    /// What surrounds the scene, instead of its own: an environment map (equirectangular OpenEXR or Radiance .hdr, linear
    /// Rec. 709); `sky` or sky:elevation=40,azimuth=135,turbidity=2.5,albedo=0.3,intensity=5; or `white`.
    #[arg(long, value_name = "FILE|sky|white")]
    pub environment: Option<String>,
    /// Point lights to scatter in a scene that has no light at all; without this it gets sun and sky.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub lights: Option<u32>,
}

/// What is loaded of a scene's file.
#[derive(Default, clap::Args)]
pub struct Choice {
    /// Index of the scene of a glTF file to load instead of its default (see `restir info`).
    #[arg(long, value_name = "N")]
    pub scene_index: Option<usize>,
    /// Material variant of a glTF file to show (KHR_materials_variants; see `restir info`).
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
}

impl Choice {
    /// Whether there is one.
    fn is_made(&self) -> bool {
        self.scene_index.is_some() || self.variant.is_some()
    }
}

/// Reads or makes the scene `name` and flattens it, with progress on stderr; with `lighting`, and its seed, it is lit
/// first. A cooked scene is read as it is.
pub fn open(name: &str, choice: &Choice, lighting: Option<(&Lighting, u32)>) -> Result<FlatScene> {
    let path = Path::new(name);
    if !name.starts_with("builtin:") && extension(path) == "restir" {
        let lit = lighting.is_some_and(|(lighting, _)| lighting.environment.is_some() || lighting.lights.is_some());
        if lit || choice.is_made() {
            return Err(Failure::usage(
                "SCENE",
                format!("'{name}' is cooked: light it and choose from it when cooking"),
            ));
        }
        return Ok(cooked::load_file(path)?);
    }
    let mut scene = load(name, choice)?;
    if let Some((lighting, seed)) = lighting {
        light(&mut scene, lighting, seed)?;
    }
    flatten(&scene)
}

/// Reads a file or makes a built-in scene.
fn load(name: &str, choice: &Choice) -> Result<Scene> {
    let only_gltf = |scene| match choice.is_made() {
        true => Err(Failure::usage(
            "SCENE",
            format!("'{name}' is no glTF file: --scene-index and --variant choose from one"),
        )),
        false => Ok(scene),
    };
    if let Some(builtin) = name.strip_prefix("builtin:") {
        return builtin::make(builtin).map_err(Failure::from_option).and_then(only_gltf);
    }
    let path = Path::new(name);
    let options = gltf::Options { scene: choice.scene_index, variant: choice.variant.as_deref() };
    match extension(path).as_str() {
        "glb" | "gltf" => gltf::load_file(path, &options).map_err(Failure::from_option),
        "obj" => obj::load_file(path).map_err(Failure::from).and_then(only_gltf),
        _ => Err(Failure::usage(
            "SCENE",
            format!("'{name}' is neither a .glb, .gltf, .obj or .restir file nor builtin:NAME"),
        )),
    }
}

/// What can be chosen in a glTF file; nothing in others.
pub fn contents(name: &str) -> Result<gltf::Contents> {
    let path = Path::new(name);
    if name.starts_with("builtin:") || !["glb", "gltf"].contains(&extension(path).as_str()) {
        return Ok(gltf::Contents::default());
    }
    Ok(gltf::contents_of_file(path)?)
}

/// In lower case.
fn extension(path: &Path) -> String {
    path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase()
}

/// Adds the environment given, or, where there is no light at all, scattered lights or a sky.
fn light(scene: &mut Scene, lighting: &Lighting, seed: u32) -> Result<()> {
    if let Some(name) = &lighting.environment
        && !scene.surround(name).map_err(Failure::from_option)?
    {
        environment::surround_by_file(scene, Path::new(name))?;
    }
    let own = scene.lights.len();
    scene.ensure_light(lighting.lights.unwrap_or(0), seed.into());
    if lighting.lights.is_some() && scene.lights.len() == own {
        scene.warnings.push("--lights does nothing here: the scene has light of its own".into());
    }
    Ok(())
}

/// Flattens a scene, with progress on stderr.
fn flatten(scene: &Scene) -> Result<FlatScene> {
    let spinner = progress::spinner();
    let flat = FlatScene::build(scene, &mut |fraction, doing| {
        spinner.set_message(format!("{doing} {:.0} %", 100.0 * fraction));
    });
    spinner.finish_and_clear();
    Ok(flat?)
}

/// The index of the camera of an index or a name; the first where none is asked for.
pub fn camera(cameras: &[Camera], wanted: Option<&str>) -> Result<usize> {
    let wanted = wanted.unwrap_or("0");
    let by_index = wanted.parse().ok().filter(|&index: &usize| index < cameras.len());
    by_index.or_else(|| cameras.iter().position(|camera| camera.name == wanted)).ok_or_else(|| {
        let known = cameras.iter().enumerate().map(|(index, camera)| format!("{index} ({})", camera.name));
        Failure::Usage(Error::Unknown {
            kind: "camera",
            name: wanted.to_owned(),
            known: known.collect::<Vec<_>>().join(", "),
        })
    })
}
