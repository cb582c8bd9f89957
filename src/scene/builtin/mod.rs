//! Procedural, seeded scenes.

mod arcade;
mod area_lights;
mod city;
mod cornell;
mod furnace;
mod glossy_spheres;
mod hall;
mod many_lights;
mod materials;
mod motion;
mod switching;
mod torches;
mod veach_mis;

use super::{Instance, Material, Mesh, Scene, shapes};
use crate::error::{Error, Result};
use glam::{Mat4, Vec3};
use std::ops::RangeInclusive;

/// One built-in scene, for menus and `restir scenes`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuiltinInfo {
    /// What to pass to [`make`], before any `:`.
    pub name: &'static str,
    /// For menus.
    pub title: &'static str,
    /// One sentence.
    pub doc: &'static str,
    /// A whole name that [`make`] accepts.
    pub example: &'static str,
}

impl BuiltinInfo {
    /// The name, with `:N` where it takes a number.
    fn form(&self) -> String {
        if self.example == self.name { self.name.to_owned() } else { format!("{}:N", self.name) }
    }
}

/// Every built-in scene.
pub const ALL: &[BuiltinInfo] = &[
    BuiltinInfo {
        name: "cornell",
        title: "Cornell box",
        doc: "The classic box, a metre a side, with one parallelogram light under the ceiling.",
        example: "cornell",
    },
    BuiltinInfo {
        name: "cornell-64",
        title: "Cornell box, 64 revolving lights",
        doc: "The Cornell box with 64 coloured point lights that revolve round its vertical axis.",
        example: "cornell-64",
    },
    BuiltinInfo {
        name: "furnace",
        title: "White furnace",
        doc: "A white sphere in an even sky of radiance 1: a renderer that loses no light hardly shows it.",
        example: "furnace",
    },
    BuiltinInfo {
        name: "veach-mis",
        title: "Veach's plates",
        doc: "Four steel plates of growing roughness under four spherical lights of equal power.",
        example: "veach-mis",
    },
    BuiltinInfo {
        name: "many-lights",
        title: "Hall of many lights",
        doc: "A closed hall with columns, lit by N coloured triangles (1 to 1,000,000) that together always give the same light.",
        example: "many-lights:10000",
    },
    BuiltinInfo {
        name: "hall",
        title: "Crowded hall",
        doc: "A closed hall full of displaced spheres and boxes under square lamps, of about N triangles (10,000 to 8,000,000).",
        example: "hall:50000",
    },
    BuiltinInfo {
        name: "arcade",
        title: "Arcade with strings of lamps",
        doc: "Two rows of arches and stalls at night under N small lamps on strings (10 to 200,000) that together always give about the same light.",
        example: "arcade:400",
    },
    BuiltinInfo {
        name: "city",
        title: "City at night",
        doc: "Blocks of houses with N lit windows (10 to 5,000), and street lamps.",
        example: "city:800",
    },
    BuiltinInfo {
        name: "torches",
        title: "Maze of torches",
        doc: "A maze of rooms, N torches (9 to 40,000), one a room, each seen by few others.",
        example: "torches:300",
    },
    BuiltinInfo {
        name: "glossy-spheres",
        title: "Glossy spheres",
        doc: "Spheres from smooth to rough and from plastic to metal, under three panels and a dim sky.",
        example: "glossy-spheres",
    },
    BuiltinInfo {
        name: "materials",
        title: "Materials",
        doc: "A row of spheres for each lobe: anisotropy, iridescence, sheen, clearcoat, thin walls, glass, index of refraction.",
        example: "materials",
    },
    BuiltinInfo {
        name: "area-lights",
        title: "Area lights",
        doc: "A few things on a floor under a sphere, a rectangle and a disk of light.",
        example: "area-lights",
    },
    BuiltinInfo {
        name: "motion",
        title: "Everything that moves",
        doc: "A column bent by its skin, a ball that morphs, a box, a lamp, a light and a camera that move, in a loop of 4 seconds.",
        example: "motion",
    },
    BuiltinInfo {
        name: "switching",
        title: "Lamps that go on and off",
        doc: "A room with 36 coloured lamps (meshes, spheres and points) round its walls that are switched on and off or fade in turn, in a loop of 6 seconds.",
        example: "switching",
    },
];

/// Makes a built-in scene; the same name gives the same scene.
///
/// # Errors
/// [`Error::Unknown`] for a name that is not in [`ALL`]; [`Error::BadValue`] for a bad number after the `:`.
pub fn make(name: &str) -> Result<Scene> {
    match name.split_once(':') {
        Some(("many-lights", count)) => return many_lights::many_lights(count),
        Some(("hall", count)) => return hall::hall(count),
        Some(("arcade", count)) => return arcade::arcade(count),
        Some(("city", count)) => return city::city(count),
        Some(("torches", count)) => return torches::torches(count),
        _ => {}
    }
    match name {
        "cornell" => Ok(cornell::cornell()),
        "cornell-64" => Ok(cornell::cornell_64()),
        "furnace" => Ok(furnace::furnace()),
        "veach-mis" => Ok(veach_mis::veach_mis()),
        "area-lights" => Ok(area_lights::area_lights()),
        "glossy-spheres" => Ok(glossy_spheres::glossy_spheres()),
        "materials" => Ok(materials::materials()),
        "motion" => Ok(motion::motion()),
        "switching" => Ok(switching::switching()),
        _ => match ALL.iter().find(|scene| scene.name == name) {
            Some(scene) => {
                Err(Error::bad_value(scene.form(), format!("its number is missing, as in {}", scene.example)))
            }
            None => Err(unknown(name)),
        },
    }
}

/// Whether there is a scene of this name, whatever number may follow its `:`.
///
/// # Errors
/// [`Error::Unknown`].
pub fn check_name(name: &str) -> Result<()> {
    let stem = name.split(':').next().unwrap_or_default();
    if ALL.iter().any(|scene| scene.name == stem) { Ok(()) } else { Err(unknown(name)) }
}

fn unknown(name: &str) -> Error {
    Error::Unknown {
        kind: "built-in scene",
        name: name.to_owned(),
        known: ALL.iter().map(BuiltinInfo::form).collect::<Vec<_>>().join(", "),
    }
}

/// A whole number of a scene's name, within what the scene takes.
fn count(form: &str, text: &str, range: RangeInclusive<u32>) -> Result<u32> {
    text.parse().ok().filter(|n| range.contains(n)).ok_or_else(|| {
        let [low, high] = [range.start(), range.end()];
        Error::bad_value(form, format!("'{text}' is not a whole number from {low} to {high}"))
    })
}

/// The list as JSON: name, title, doc, example.
pub fn describe_json() -> serde_json::Value {
    ALL.iter()
        .map(|scene| {
            serde_json::json!({
                "name": scene.name, "title": scene.title, "doc": scene.doc, "example": scene.example,
            })
        })
        .collect()
}

/// Cells along a side of a checkered floor, and the side of one in metres.
const CELLS: i32 = 32;
const CELL: f32 = 0.625;

/// A rough dielectric.
fn matte(name: &str, color: Vec3) -> Material {
    Material { name: name.to_owned(), base_color: color.extend(1.0), metallic: 0.0, ..Material::default() }
}

/// Adds a mesh and one placement of it.
fn place(scene: &mut Scene, mesh: Mesh, transform: Mat4) {
    scene.instances.push(Instance { mesh: scene.meshes.len() as u32, transform });
    scene.meshes.push(mesh);
}

/// Every other cell of a checkered floor.
fn checkers(parity: i32, material: u32) -> Mesh {
    let mut mesh = Mesh { material, ..Mesh::default() };
    for i in 0..CELLS {
        for k in (0..CELLS).filter(|k| (i + k) % 2 == parity) {
            let corner = Vec3::new((i - CELLS / 2) as f32, 0.0, (k - CELLS / 2) as f32) * CELL;
            shapes::append(&mut mesh, &shapes::parallelogram(corner, Vec3::Z * CELL, Vec3::X * CELL, material));
        }
    }
    mesh
}

/// A bright saturated colour round the colour wheel (one turn is 1), its mean about 1/2 whatever the hue.
fn hue(turn: f32) -> Vec3 {
    let wave = |shift: f32| 0.5 + 0.45 * ((turn + shift) * std::f32::consts::TAU).cos();
    Vec3::new(wave(0.0), wave(-1.0 / 3.0), wave(1.0 / 3.0))
}
