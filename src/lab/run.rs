//! Carries an experiment out: references, measured points in turns, then the files.

use super::experiment::{Experiment, Motion, Place, Series, parse_size};
use super::measure::{Run, Task, keep};
use super::reference::{Reference, Subject, reference, scene_key};
use super::results::Point;
use super::settings::Value;
use super::strip::{self, Exposure, Tile};
use super::{key, report};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::output::write_png;
use crate::renderer::Renderer;
use crate::scene::{Camera, FlatScene};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// The seed of the first run; the others follow.
const FIRST_SEED: u32 = 1;

/// How an experiment is carried out.
pub struct Options<'a> {
    /// Folder for pages, tables, plots and strips, and for what was measured.
    pub out: &'a Path,
    /// Folder for references.
    pub references: &'a Path,
    /// Measure what was measured before again.
    pub fresh: bool,
    /// Said on the page: how to make it again.
    pub command: &'a str,
    /// Reads or makes a scene by its name.
    pub load: &'a dyn Fn(&str) -> Result<FlatScene>,
    /// Hears what is being done, how much of it is done and how much there is.
    pub progress: &'a dyn Fn(&str, u64, u64),
}

/// What came of it.
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Serialize)]
pub struct Outcome {
    /// Runs measured now.
    pub measured: usize,
    /// Runs that were kept from before.
    pub kept: usize,
    /// What was written, the page first.
    pub files: Vec<PathBuf>,
}

/// A scene, and what all points in it share.
pub(super) struct Site {
    /// Its name for people.
    pub name: String,
    /// The reference's noise, one a swept scene or size.
    pub noise: Vec<f64>,
    /// Pictures for the strip, in order: for each swept scene or size its reference, then what was measured.
    pub tiles: Vec<(String, PathBuf)>,
}

/// Everything a report is made of.
pub(super) struct Findings<'a> {
    pub name: &'a str,
    pub experiment: &'a Experiment,
    pub command: &'a str,
    pub adapter: String,
    pub software: bool,
    pub sites: Vec<Site>,
    pub points: Vec<Point>,
}

/// One thing to measure: where, what, with which value.
struct Item<'a> {
    series: &'a Series,
    value: Option<&'a Value>,
}

/// A scene and a size, and the values of the first sweep that share them: these are measured in turns.
struct Group<'a> {
    name: String,
    size: [u32; 2],
    values: Vec<Option<&'a Value>>,
}

/// A scene as it is measured.
struct Stand<'a> {
    place: &'a Place,
    key: &'a str,
    camera: Camera,
    reference: Reference,
    size: [u32; 2],
}

/// Carries `experiment`, called `name`, out.
///
/// # Errors
/// Those of loading, rendering and writing. What was measured until then is kept, and the next call goes on from there.
pub fn run(name: &str, experiment: &Experiment, gpu: &Gpu, options: &Options) -> Result<Outcome> {
    let points_folder = options.out.join("points");
    std::fs::create_dir_all(&points_folder)
        .map_err(|source| Error::Io { path: points_folder.display().to_string(), source })?;
    let mut lab = Lab { experiment, gpu, options, points_folder, outcome: Outcome::default(), points: Vec::new() };
    let mut sites = Vec::new();
    for (index, place) in experiment.scenes.iter().enumerate() {
        sites.push(lab.site(index, place)?);
    }
    let Lab { mut outcome, points, .. } = lab;
    let findings = Findings {
        name,
        experiment,
        command: options.command,
        adapter: gpu.adapter_name(),
        software: gpu.is_software(),
        sites,
        points,
    };
    outcome.files = report::write(&findings, options.out)?;
    Ok(outcome)
}

struct Lab<'a> {
    experiment: &'a Experiment,
    gpu: &'a Gpu,
    options: &'a Options<'a>,
    points_folder: PathBuf,
    outcome: Outcome,
    points: Vec<Point>,
}

impl Lab<'_> {
    /// Measures all points of one scene, or of all scenes of a sweep.
    fn site(&mut self, index: usize, place: &Place) -> Result<Site> {
        let experiment = self.experiment;
        let curves = experiment.curves();
        let sweep = experiment.sweeps.first();
        let mut site = Site { name: place.name.clone(), noise: Vec::new(), tiles: Vec::new() };
        let group = |name: &str, size, values| Group { name: name.to_owned(), size, values };
        let groups: Vec<Group> = match sweep.map(|sweep| (sweep.key.as_str(), &sweep.values)) {
            Some(("scene", values)) => {
                let of = |v| group(&place.name.replace('*', &Value::to_string(v)), experiment.size, vec![Some(v)]);
                values.iter().map(of).collect()
            }
            Some(("size", values)) => {
                let of = |v| Ok(group(&place.name, parse_size(&place.name, v)?, vec![Some(v)]));
                values.iter().map(of).collect::<Result<_>>()?
            }
            Some((_, values)) => vec![group(&place.name, experiment.size, values.iter().map(Some).collect())],
            None => vec![group(&place.name, experiment.size, vec![None])],
        };
        for Group { name: scene, size, values } in groups {
            (self.options.progress)(&format!("{scene}: scene"), 0, 0);
            let flat = (self.options.load)(&scene)?;
            let key = scene_key(&flat);
            let camera = place.camera.camera(&flat.cameras)?;
            let mut renderer = Renderer::new(self.gpu.clone(), flat, size.into())?;
            let subject = Subject {
                scene: &key,
                camera: &camera,
                time: experiment.motion.as_ref().map_or(0.0, |motion: &Motion| motion.time),
                size,
                settings: &experiment.reference.settings,
                frames: experiment.reference.frames,
            };
            let progress = self.options.progress;
            let what = format!("{scene}: reference");
            let reference = reference(&mut renderer, &subject, self.options.references, &mut |done, of| {
                progress(&what, done, of);
            })?;
            site.noise.push(reference.noise);
            let items: Vec<Item> =
                curves.iter().flat_map(|series| values.iter().map(move |&value| Item { series, value })).collect();
            let stand = Stand { place, key: &key, camera, reference, size };
            self.group(index, &scene, &mut renderer, &stand, &items, &mut site)?;
        }
        Ok(site)
    }

    /// Measures points of one scene and size, run by run, so that what changes on the machine meanwhile meets all alike.
    fn group(
        &mut self,
        index: usize,
        scene: &str,
        renderer: &mut Renderer,
        stand: &Stand,
        items: &[Item],
        site: &mut Site,
    ) -> Result<()> {
        let experiment = self.experiment;
        let adapter = self.gpu.adapter_name();
        let exposure = Exposure::of(&stand.reference.image);
        let reference_tile = self.points_folder.join(format!("{}.png", stand.reference.key));
        write_tile(&reference_tile, &strip::tile(&stand.reference.image, exposure))?;
        let reference_label =
            if site.tiles.is_empty() { "reference".to_owned() } else { format!("{scene}: reference") };
        site.tiles.push((reference_label, reference_tile));
        let mut found: Vec<Point> = Vec::new();
        let mut warm = HashSet::new();
        let total = (experiment.runs as usize * items.len()) as u64;
        let mut done = 0;
        for number in 0..experiment.runs {
            for (i, item) in items.iter().enumerate() {
                let (accumulate, frames) = (experiment.accumulates(item.series), experiment.frames(item.series));
                let technique = experiment.technique(item.series);
                let task = Task {
                    scene: stand.key,
                    camera: &stand.camera,
                    motion: experiment.motion.as_ref(),
                    size: stand.size,
                    technique,
                    settings: experiment.settings_of(stand.place, item.series, item.value),
                    accumulate,
                    frames,
                    seed: FIRST_SEED + number,
                };
                let identity = task.identity(&stand.reference.key, &adapter);
                let name = key::of(&identity);
                let view = experiment.view.as_deref();
                let numbers = self.points_folder.join(format!("{name}.json"));
                let tile = self.points_folder.join(format!("{name}{}.png", view.unwrap_or_default().replace(' ', "-")));
                // The strip shows the first run.
                let kept = if self.options.fresh || (number == 0 && !strip::is_whole(&tile)) {
                    None
                } else {
                    Run::read(&numbers)
                };
                let run = match kept {
                    Some(run) => {
                        self.outcome.kept += 1;
                        run
                    }
                    None => {
                        // A processor has no clock to wait for, and only the first run of each compiles.
                        if warm.insert(i) || !self.gpu.is_software() {
                            task.warm_up(renderer)?;
                        }
                        let (run, picture) = task.measure(renderer, &stand.reference.image)?;
                        match view {
                            _ if number > 0 => {}
                            None => write_tile(&tile, &strip::tile(&picture, exposure))?,
                            Some(view) => {
                                let seen = task.look(renderer, view)?;
                                write_tile(&tile, &strip::tile_of_display(renderer.size(), &seen))?;
                            }
                        }
                        self.outcome.measured += 1;
                        keep(&numbers, &identity, run)?
                    }
                };
                if number == 0 {
                    found.push(Point {
                        scene: index,
                        series: item.series.name.clone(),
                        value: item.value.map(|value| value.0.clone()),
                        accumulate,
                        frames: frames.to_vec(),
                        runs: Vec::new(),
                    });
                    site.tiles.push((found[i].label(experiment), tile));
                }
                found[i].runs.push(run);
                done += 1;
                (self.options.progress)(&format!("{scene}: runs"), done, total);
            }
        }
        debug_assert_eq!(stand.size, [stand.reference.image.width, stand.reference.image.height]);
        self.points.append(&mut found);
        Ok(())
    }
}

/// Writes the middle of a picture, for people.
fn write_tile(path: &Path, tile: &Tile) -> Result<()> {
    write_png(path, tile.width, tile.height, &tile.rgba)
}
