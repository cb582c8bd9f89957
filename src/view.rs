//! Debug views: what they show, and in which colours.

use crate::error::{Error, Result};
use serde_json::{Value, json};

/// A picture other than the light that reaches the camera.
#[derive(Debug)]
pub struct View {
    /// Its name everywhere.
    pub name: &'static str,
    /// What it shows, for people.
    pub meaning: &'static str,
    /// How it is shown.
    pub scale: Scale,
    /// Who makes it.
    pub source: Source,
}

/// Who makes a view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The technique's passes.
    Technique,
    /// `film/view`, of the first surface that each pixel sees; no technique has to run.
    Surface,
    /// `film/view`, of what all passes count by the pixel, which costs them a little.
    Counts,
    /// The same, of the neighbours that a technique rejects: a view of its own.
    Rejected,
    /// `film/accumulate`, which finds what is not finite.
    Film,
}

/// How the values of a view become colours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// Linear radiance: exposed and tone-mapped as the picture is.
    Radiance,
    /// Linear colours from 0 to 1 that mean what the view says: shown as they are.
    Colors,
    /// One number, in each of the three channels: shown in a colour map, from `low` to `high`.
    Number {
        /// What is counted or measured, in the plural.
        unit: &'static str,
        /// What gets the first colour.
        low: f32,
        /// What gets the last one.
        high: f32,
        /// Whether equal ratios, rather than equal differences, are equally far apart. `low` is above 0 then.
        is_logarithmic: bool,
    },
}

impl View {
    /// One that shows radiance.
    pub const fn radiance(name: &'static str, meaning: &'static str) -> Self {
        View { name, meaning, scale: Scale::Radiance, source: Source::Technique }
    }

    /// One that shows colours with a meaning of their own.
    pub const fn colors(name: &'static str, meaning: &'static str) -> Self {
        View { name, meaning, scale: Scale::Colors, source: Source::Technique }
    }

    /// One of a number.
    pub const fn number(name: &'static str, meaning: &'static str, unit: &'static str, range: [f32; 2]) -> Self {
        let [low, high] = range;
        View {
            name,
            meaning,
            scale: Scale::Number { unit, low, high, is_logarithmic: false },
            source: Source::Technique,
        }
    }

    /// One of a number that spans orders of magnitude.
    pub const fn magnitude(name: &'static str, meaning: &'static str, unit: &'static str, range: [f32; 2]) -> Self {
        let [low, high] = range;
        View {
            name,
            meaning,
            scale: Scale::Number { unit, low, high, is_logarithmic: true },
            source: Source::Technique,
        }
    }

    /// The same view, made by `source`.
    pub const fn by(self, source: Source) -> Self {
        View { source, ..self }
    }

    /// Whether the technique has to run for it.
    pub fn runs_technique(&self) -> bool {
        self.source != Source::Surface
    }

    /// Whether `film/view` draws it.
    pub fn is_drawn_by_film(&self) -> bool {
        matches!(self.source, Source::Surface | Source::Counts | Source::Rejected)
    }

    /// Whether its range is how far the scene goes.
    pub fn is_depth(&self) -> bool {
        self.name == DEPTH.name
    }

    /// Whether passes have to count by the pixel for it.
    pub fn counts(&self) -> bool {
        matches!(self.source, Source::Counts | Source::Rejected)
    }
}

/// How far the first surface is; its range is the scene's.
const DEPTH: View =
    View::number("depth", "Distance along the view axis; 0 where there is no surface.", "metres", [0.0, 1.0])
        .by(Source::Surface);

/// Debug views that every technique has; the first is the picture itself. `shaders/film/film.wgsl` numbers them.
pub const COMMON_VIEWS: &[View] = &[
    View::radiance("radiance", "The picture itself."),
    View::colors("albedo", "Base colour of the surface, linear.").by(Source::Surface),
    View::colors("normal", "Shading normal in world space: x, y and z from −1 to 1 as red, green and blue.").by(Source::Surface),
    DEPTH,
    View::colors(
        "motion",
        "How far what is seen has moved in the picture: grey at rest, redder to the right, greener down; full at 16 pixels.",
    )
    .by(Source::Surface),
    View::number("rays", "Rays traced for the pixel in a frame, the camera's among them.", "rays", [0.0, 32.0]).by(Source::Counts),
    View::magnitude("BVH steps", "Nodes of the BVH, of four boxes each, that these rays visit.", "nodes", [1.0, 1024.0])
        .by(Source::Counts),
    View::number("not finite", "The share of frames in which the pixel is no number, or infinite.", "of frames", [0.0, 1.0])
        .by(Source::Film),
];

/// The view of rejected neighbours, in the film's numbers.
const REJECTED_NEIGHBORS: u32 = COMMON_VIEWS.len() as u32;

/// Which view is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shown {
    /// An index into [`COMMON_VIEWS`].
    Common(usize),
    /// An index into the technique's own.
    Own(usize),
}

impl Shown {
    /// The picture itself.
    pub const PICTURE: Self = Shown::Common(0);

    /// The view of this name among the common ones and a technique's `own`.
    ///
    /// # Errors
    /// `UNKNOWN_NAME` listing the views there are.
    pub fn find(name: &str, own: &[View]) -> Result<Self> {
        let place = |views: &[View]| views.iter().position(|view| view.name == name);
        place(COMMON_VIEWS).map(Shown::Common).or_else(|| place(own).map(Shown::Own)).ok_or_else(|| Error::Unknown {
            kind: "view",
            name: name.to_owned(),
            known: COMMON_VIEWS.iter().chain(own).map(|view| view.name).collect::<Vec<_>>().join(", "),
        })
    }

    /// What it is.
    pub fn view(self, own: &'static [View]) -> &'static View {
        match self {
            Shown::Common(index) => &COMMON_VIEWS[index],
            Shown::Own(index) => &own[index],
        }
    }

    /// `Frame::view`: 0, or the technique's own view from 1 on.
    pub fn of_technique(self) -> u32 {
        match self {
            Shown::Common(_) => 0,
            Shown::Own(index) => index as u32 + 1,
        }
    }

    /// `FilmUniforms::view`: 0, or what the film makes.
    pub fn of_film(self, own: &'static [View]) -> u32 {
        match self {
            Shown::Common(index) => index as u32,
            Shown::Own(_) if self.view(own).source == Source::Rejected => REJECTED_NEIGHBORS,
            Shown::Own(_) => 0,
        }
    }
}

/// Names of colour maps, in the order of [`color_map`].
pub const COLOR_MAPS: [&str; 4] = ["viridis", "magma", "turbo", "gray"];

/// Colours of a map, evenly spaced.
pub const COLOR_STEPS: usize = 17;

/// Colours of a map, sRGB as 0xRRGGBB. Those of matplotlib (viridis and magma: CC0; turbo: Mikhailov 2019) at even steps; between
/// them, straight lines are within 9/255.
#[rustfmt::skip]
pub fn color_map(index: u32) -> [u32; COLOR_STEPS] {
    match index {
        0 => [
            0x440154, 0x481769, 0x472c7a, 0x423f85, 0x3b518b, 0x33628d, 0x2c718e, 0x26818e, 0x21908d, 0x1f9f88, 0x27ad81,
            0x3dbc74, 0x5cc863, 0x81d34d, 0xaadc32, 0xd5e21a, 0xfde725,
        ],
        1 => [
            0x000004, 0x090720, 0x1c1044, 0x341069, 0x4f127b, 0x681c81, 0x812581, 0x9b2e7f, 0xb5367a, 0xcf4070, 0xe55064,
            0xf4695c, 0xfb8761, 0xfea571, 0xfec287, 0xfde0a1, 0xfcfdbf,
        ],
        2 => [
            0x30123b, 0x3f3e9c, 0x4669e0, 0x4391fe, 0x2ab9ee, 0x18dbc5, 0x2ff19b, 0x69fd66, 0xa1fd3d, 0xcbed34, 0xecd13a,
            0xfdae35, 0xfb8122, 0xec530f, 0xd23105, 0xac1701, 0x7a0403,
        ],
        _ => std::array::from_fn(|step| (step as u32 * 255 / (COLOR_STEPS as u32 - 1)) * 0x010101),
    }
}

/// What the page draws beside a view: `name`, `meaning`, and of a number `unit`, `low`, `high`, `logarithmic` and `colors`, #rrggbb at
/// even steps. `scale` is the one in force.
pub fn legend_json(view: &View, scale: Scale, map: u32) -> Value {
    let mut legend = json!({ "name": view.name, "meaning": view.meaning });
    if let Scale::Number { unit, low, high, is_logarithmic } = scale {
        legend["unit"] = unit.into();
        legend["low"] = low.into();
        legend["high"] = high.into();
        legend["logarithmic"] = is_logarithmic.into();
        legend["colors"] = color_map(map).iter().map(|color| format!("#{color:06x}")).collect();
    }
    legend
}
