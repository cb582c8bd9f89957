//! References, kept between runs by a hash of what determines them.

use super::key::{self, Hasher};
use super::metrics::mse;
use super::settings::{self, Settings};
use crate::error::{Error, Result};
use crate::output::{ExrPicture, Image, encode_exr, read_exr, write_atomic};
use crate::renderer::Renderer;
use crate::scene::Camera;
use pollster::block_on;
use std::path::{Path, PathBuf};

/// Seeds of the two chains, which no measured run has.
const SEEDS: [u32; 2] = [0x5245_4630, 0x5245_4631];

/// A picture to judge others by.
#[derive(Debug, Clone)]
pub struct Reference {
    /// The mean of two independent chains.
    pub image: Image,
    /// Its own mean squared error, from how far the chains differ.
    pub noise: f64,
    /// The hash it is kept under.
    pub key: String,
}

/// What a reference shows.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'a> {
    /// Hash of the flat scene.
    pub scene: &'a str,
    /// Where it is seen from.
    pub camera: &'a Camera,
    /// Moment in seconds.
    pub time: f64,
    /// Picture size in pixels.
    pub size: [u32; 2],
    /// Of the path tracer.
    pub settings: &'a Settings,
    /// Averaged in all.
    pub frames: u32,
}

impl Subject<'_> {
    /// The hash of all that determines the picture but the Rust code that records it.
    pub fn key(&self) -> String {
        let shaders = key::shaders(|folder| ["path-tracer", "scene", "film"].contains(&folder));
        let Subject { scene, camera, time, size, settings, frames } = self;
        let settings = settings::describe(settings);
        key::of(&format!("reference 1|{shaders}|{scene}|{camera:?}|{time}|{size:?}|{settings}|{frames}"))
    }
}

/// The hash of a scene's contents, its name apart.
pub fn scene_key(scene: &crate::FlatScene) -> String {
    Hasher::default().add(&scene.to_bytes()).hex()
}

/// Reads the reference from `folder`, or renders it with a renderer of its scene and keeps it there. `progress` hears of
/// every frame rendered and of how many there will be.
///
/// # Errors
/// Those of rendering, reading and writing.
pub fn reference(
    renderer: &mut Renderer,
    subject: &Subject,
    folder: &Path,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Reference> {
    let key = subject.key();
    let frames = (subject.frames / 2).max(1);
    let mut halves = Vec::new();
    for (half, seed) in SEEDS.into_iter().enumerate() {
        let path = folder.join(format!("{key}-{half}.exr"));
        let kept = if path.exists() { read_exr(&path).ok() } else { None };
        if let Some(image) = kept.filter(|image| [image.width, image.height] == subject.size) {
            halves.push(image);
            continue;
        }
        settings::apply(renderer, "path-tracer", subject.settings)?;
        renderer.resize(subject.size.into())?;
        renderer.set_accumulate(true);
        renderer.set_time(subject.time);
        renderer.set_camera(subject.camera);
        renderer.set_seed(seed);
        for frame in 0..frames {
            renderer.render_frame()?;
            // Now and then, so that a queue of thousands of frames does not pile up.
            if frame % 16 == 15 {
                block_on(renderer.wait())?;
            }
            progress(half as u64 * u64::from(frames) + u64::from(frame) + 1, 2 * u64::from(frames));
        }
        refuse_broken(block_on(renderer.counters())?.not_finite())?;
        let image = block_on(renderer.read_image())?;
        std::fs::create_dir_all(folder).map_err(|source| Error::Io { path: folder.display().to_string(), source })?;
        let parameters = renderer.parameters().to_string();
        let picture = ExrPicture {
            image: &image,
            albedo: None,
            normal: None,
            depth: None,
            motion: None,
            technique: "path-tracer",
            parameters: &parameters,
            seed,
            frames,
        };
        write_atomic(&path, &encode_exr(&picture)?)?;
        halves.push(image);
    }
    // Half the difference of two means of equal variance has the variance of their mean.
    let noise = 0.25 * mse(&halves[0], &halves[1])?;
    let pixels = halves[0].pixels.iter().zip(&halves[1].pixels).map(|(a, b)| [0, 1, 2].map(|c| 0.5 * (a[c] + b[c])));
    let image = Image { pixels: pixels.collect(), ..halves[0] };
    Ok(Reference { image, noise, key })
}

/// A reference that has lost samples is none.
///
/// # Errors
/// `BAD_VALUE` if a sample was not finite.
pub(super) fn refuse_broken(not_finite: u64) -> Result<()> {
    if not_finite > 0 {
        return Err(Error::bad_value("reference", format!("{not_finite} samples are not finite")));
    }
    Ok(())
}

/// Where references are kept unless another folder is named: `restir/references` in the user's cache folder.
pub fn default_folder() -> PathBuf {
    let folder = |variable| std::env::var_os(variable).filter(|v| !v.is_empty()).map(PathBuf::from);
    let cache = folder("XDG_CACHE_HOME").or_else(|| folder("HOME").map(|home| home.join(".cache")));
    cache.unwrap_or_else(std::env::temp_dir).join("restir").join("references")
}
