//! From a SCENE argument to a flat scene and one of its cameras.

use crate::failure::{Failure, Result};
use crate::progress;
use restir::Error;
use restir::scene::{Camera, FlatScene, Scene, builtin, environment, gltf};
use std::path::{Path, PathBuf};

/// What lights a scene beyond its own lights.
#[derive(clap::Args)]
pub struct Lighting {
    /// Environment map (equirectangular OpenEXR or Radiance .hdr, linear Rec. 709), instead of the scene's own.
    #[arg(long, value_name = "FILE")]
    pub environment: Option<PathBuf>,
    /// Point lights to scatter in a scene that has no light at all; without this it gets an even white sky.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub lights: Option<u32>,
}

/// Reads a file or makes a built-in scene.
pub fn load(name: &str) -> Result<Scene> {
    if let Some(builtin) = name.strip_prefix("builtin:") {
        return builtin::make(builtin).map_err(Failure::from_option);
    }
    let path = Path::new(name);
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "glb" | "gltf" => Ok(gltf::load_file(path)?),
        _ => Err(Failure::usage("SCENE", format!("'{name}' is neither a .glb or .gltf file nor builtin:NAME"))),
    }
}

/// Adds the environment given, or, where there is no light at all, scattered lights or a sky.
pub fn light(scene: &mut Scene, lighting: &Lighting, seed: u32) -> Result<()> {
    if let Some(file) = &lighting.environment {
        let (environment, clamped) = environment::load_file(file)?;
        scene.environment = Some(environment);
        if clamped > 0 {
            let (file, most) = (file.display(), environment::MAX_RADIANCE);
            scene.warnings.push(format!("{file}: {clamped} values were not within 0 and {most:e} and were clamped"));
        }
    }
    let own = scene.lights.len();
    scene.ensure_light(lighting.lights.unwrap_or(0), seed.into());
    if lighting.lights.is_some() && scene.lights.len() == own {
        scene.warnings.push("--lights does nothing here: the scene has light of its own".into());
    }
    Ok(())
}

/// Flattens a scene, with progress on stderr.
pub fn flatten(scene: &Scene) -> Result<FlatScene> {
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
