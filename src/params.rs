//! Parameters, each declared once: the uniform's layout, the page's panel, URL keys, command-line keys, the docs table
//! and the sweep tests all derive from the declaration.

use crate::error::{Error, Result};

/// What values a parameter takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParamKind {
    /// A whole number in a range.
    Uint {
        /// Smallest value.
        min: u32,
        /// Largest value.
        max: u32,
    },
    /// A real number in a range.
    Float {
        /// Smallest value.
        min: f32,
        /// Largest value.
        max: f32,
    },
    /// `true` or `false` (also `yes`/`no`, `on`/`off`, `1`/`0`).
    Flag,
    /// One of these names.
    Choice(&'static [&'static str]),
}

/// One declared parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParamSpec {
    /// Its key everywhere.
    pub name: &'static str,
    /// What it does, what a higher and a lower value do, whether it adds bias.
    pub doc: &'static str,
    /// What values it takes.
    pub kind: ParamKind,
    /// The default's bits.
    pub default: u32,
    /// Unit for people; may be empty.
    pub unit: &'static str,
}

impl ParamSpec {
    /// Parses a value; the result is the 32 bits the uniform holds.
    ///
    /// # Errors
    /// `BAD_VALUE` naming the parameter and what it takes.
    pub fn parse(&self, value: &str) -> Result<u32> {
        let bad = |what: String| Error::bad_value(self.name, format!("'{value}' is not {what}"));
        match self.kind {
            ParamKind::Uint { min, max } => value
                .parse()
                .ok()
                .filter(|v| (min..=max).contains(v))
                .ok_or_else(|| bad(format!("a whole number from {min} to {max}"))),
            ParamKind::Float { min, max } => value
                .parse::<f32>()
                .ok()
                .filter(|v| (min..=max).contains(v))
                .map(f32::to_bits)
                .ok_or_else(|| bad(format!("a number from {min} to {max}"))),
            ParamKind::Flag => match value {
                "true" | "yes" | "on" | "1" => Ok(1),
                "false" | "no" | "off" | "0" => Ok(0),
                _ => Err(bad("true or false".into())),
            },
            ParamKind::Choice(names) => names
                .iter()
                .position(|n| *n == value)
                .map(|i| i as u32)
                .ok_or_else(|| bad(format!("one of {}", names.join(", ")))),
        }
    }

    /// The JSON form of a value's bits.
    pub fn value_json(&self, bits: u32) -> serde_json::Value {
        match self.kind {
            ParamKind::Uint { .. } => bits.into(),
            ParamKind::Float { .. } => short(f32::from_bits(bits)),
            ParamKind::Flag => (bits != 0).into(),
            ParamKind::Choice(names) => names.get(bits as usize).copied().unwrap_or_default().into(),
        }
    }

    /// The declaration as JSON: name, doc, kind, default, min, max, unit, choices.
    pub fn describe(&self) -> serde_json::Value {
        let mut out = serde_json::json!({
            "name": self.name, "doc": self.doc, "unit": self.unit, "default": self.value_json(self.default),
        });
        match self.kind {
            ParamKind::Uint { min, max } => {
                out["kind"] = "u32".into();
                out["min"] = min.into();
                out["max"] = max.into();
            }
            ParamKind::Float { min, max } => {
                out["kind"] = "f32".into();
                out["min"] = short(min);
                out["max"] = short(max);
            }
            ParamKind::Flag => out["kind"] = "bool".into(),
            ParamKind::Choice(names) => {
                out["kind"] = "choice".into();
                out["choices"] = names.to_vec().into();
            }
        }
        out
    }
}

/// An f32 as the shortest decimal that reads back as it (0.1, not 0.10000000149).
fn short(value: f32) -> serde_json::Value {
    value.to_string().parse::<f64>().map_or(serde_json::Value::Null, Into::into)
}

/// A set of parameters that is also a uniform: every field is 32 bits.
pub trait Params: bytemuck::Pod + Default {
    /// The declarations, in the uniform's order.
    const SPECS: &'static [ParamSpec];

    /// Sets one by name. Whether the name was known.
    ///
    /// # Errors
    /// `BAD_VALUE` for a value it does not take.
    fn set(&mut self, name: &str, value: &str) -> Result<bool> {
        let Some(index) = Self::SPECS.iter().position(|s| s.name == name) else { return Ok(false) };
        let bits = Self::SPECS[index].parse(value)?;
        bytemuck::cast_slice_mut::<Self, u32>(std::slice::from_mut(self))[index] = bits;
        Ok(true)
    }

    /// All values as a JSON object.
    fn values(&self) -> serde_json::Value {
        let words = bytemuck::cast_slice::<Self, u32>(std::slice::from_ref(self));
        let pairs = Self::SPECS.iter().zip(words).map(|(spec, bits)| (spec.name.to_owned(), spec.value_json(*bits)));
        serde_json::Value::Object(pairs.collect())
    }
}

/// The field type of a parameter kind.
#[macro_export]
#[doc(hidden)]
macro_rules! param_type {
    (uint) => {
        u32
    };
    (float) => {
        f32
    };
    (flag) => {
        u32
    };
    (choice) => {
        u32
    };
}

/// The [`ParamKind`](crate::params::ParamKind), default bits and unit of one declaration.
#[macro_export]
#[doc(hidden)]
macro_rules! param_parts {
    (uint, $default:expr, $min:literal ..= $max:literal, $unit:literal) => {
        ($crate::params::ParamKind::Uint { min: $min, max: $max }, $default, $unit)
    };
    (float, $default:expr, $min:literal ..= $max:literal, $unit:literal) => {
        ($crate::params::ParamKind::Float { min: $min, max: $max }, f32::to_bits($default), $unit)
    };
    (flag, $default:expr) => {
        ($crate::params::ParamKind::Flag, $default as u32, "")
    };
    (choice, $default:expr, $names:expr) => {
        ($crate::params::ParamKind::Choice(&$names), $default, "")
    };
}

/// Declares parameters: a Pod uniform struct with `Default`, [`Params`] and a registered layout.
///
/// Each field is `name: uint(default, min..=max, "unit")`, `float(default, min..=max, "unit")`, `flag(default)` or
/// `choice(default index, ["name", ...])`; its doc comment is what people read everywhere.
#[macro_export]
macro_rules! params {
    ($(#[$meta:meta])* pub struct $name:ident {
        $($(#[doc = $doc:literal])* $field:ident : $kind:ident ( $($parts:tt)* ),)*
    }) => {
        $crate::gpu_struct! {
            $(#[$meta])*
            pub struct $name { $($(#[doc = $doc])* pub $field: $crate::param_type!($kind),)* }
        }
        impl $crate::params::Params for $name {
            const SPECS: &'static [$crate::params::ParamSpec] = &[$({
                let (kind, default, unit) = $crate::param_parts!($kind, $($parts)*);
                $crate::params::ParamSpec {
                    name: stringify!($field),
                    doc: concat!($($doc),*).trim_ascii(),
                    kind,
                    default,
                    unit,
                }
            },)*];
        }
        impl Default for $name {
            fn default() -> Self {
                let mut words = [0u32; <$name as $crate::params::Params>::SPECS.len()];
                for (word, spec) in words.iter_mut().zip(<$name as $crate::params::Params>::SPECS) {
                    *word = spec.default;
                }
                bytemuck::cast(words)
            }
        }
    };
}

/// Of `max_depth`: what is longer than that nobody sees.
const MOST_DEPTH: u32 = 1024;

params! {
    /// Parameters of every technique that traces paths.
    pub struct RenderParams {
        /// Longest path in scattering events: 1 is direct light only. Higher: more of the indirect light, more time. Lower: darker, for longer paths are cut off (biased towards black).
        max_depth: uint(8, 1..=1024, "events"),
        /// How light sampling and BRDF sampling are joined. Both are unbiased; the power heuristic (exponent 2) has less noise where one is far better.
        mis_heuristic: choice(1, ["balance", "power"]),
        /// Scattering events before Russian roulette may end a path. Higher: less noise and more time. Unbiased at any value.
        roulette_start: uint(3, 1..=1024, "events"),
        /// Smallest probability of going on, q_min of thesis 000 Eq. 24. Higher: fewer bright outliers, more time. Unbiased at any value above 0.
        roulette_minimum: float(0.05, 0.001..=1.0, ""),
        /// Throughput at which a path always goes on, T_threshold of thesis 000 Eq. 24. Higher: paths end sooner, more noise. Unbiased at any value.
        roulette_threshold: float(1.0, 0.001..=100.0, ""),
        /// Where in its pixel a primary ray goes: `box` anywhere in the square, which averages to a smooth picture; `center` through the middle, which keeps edges out of error measurements but aliases (biased against the box filter).
        pixel_filter: choice(0, ["box", "center"]),
        /// Which mip level textures are read at: `cone` takes the one whose texels are as large as the ray is wide there, so that distant textures neither shimmer nor cost more than near ones (biased: what a pixel sees of a texture is blurred by up to about a pixel more); `finest` always reads level 0, for comparison with renderers that do so.
        texture_levels: choice(0, ["cone", "finest"]),
        /// Whether light that scatters more than once between microfacets is given back to the GGX reflection (Turquin 2019, thesis 000 2.1.3). On: rough metals are as bright as smooth ones. Off: as glTF's formula has it, which is darker.
        energy_compensation: flag(false),
        /// Whether the diffuse lobe gets only the light that the specular layer leaves over. On: energy is conserved. Off: as glTF's formula has it, which gains light at grazing angles.
        conserving_mix: flag(false),
        /// How directions of the environment are drawn: from an `alias` table made when the scene is loaded, in constant time, or by descent of a `pyramid` made on the GPU every frame (002, section 5.3), which suits maps that change. The same density, so the same expected picture.
        environment_sampling: choice(0, ["alias", "pyramid"]),
        /// Turn of environment and sun about +Y, counter-clockwise as seen from above.
        environment_rotation: float(0.0, -360.0..=360.0, "degrees"),
        /// How fast they turn while frames are not accumulated.
        environment_rotation_rate: float(0.0, -360.0..=360.0, "degrees a second"),
    }
}

impl RenderParams {
    /// Which settings, as they are now, bias the picture of every technique. Materials' options are no bias: they say what the truth is.
    pub fn biases(&self) -> Vec<crate::techniques::Bias> {
        crate::techniques::biases_that_hold(&[
            (
                self.max_depth < MOST_DEPTH,
                crate::techniques::MAX_DEPTH,
                "longer paths are left out: darker, the less the more events there are",
            ),
            (self.pixel_filter == 1, "render.pixel_filter", "edges are not smoothed"),
            (
                self.texture_levels == 0,
                "render.texture_levels",
                "textures are blurred by up to about a pixel more than the pixel's filter",
            ),
        ])
    }

    /// Puts in what changes the code of kernels.
    pub fn specialise(&self, features: &mut crate::gpu::shader::SceneFeatures) {
        features.energy_compensation = self.energy_compensation != 0;
        features.conserving_mix = self.conserving_mix != 0;
    }
}

params! {
    /// How the picture is shown; none of these changes the radiance.
    pub struct FilmParams {
        /// Exposure. Higher: brighter, one EV doubles. Added to the automatic exposure where that is on.
        exposure: float(0.0, -20.0..=20.0, "EV"),
        /// Whether exposure is `fixed` or follows the picture's log-average luminance (`automatic`).
        exposure_mode: choice(0, ["fixed", "automatic"]),
        /// Curve from linear radiance to the screen: `linear` clips, `aces` and `agx` are filmic, `neutral` (Khronos PBR Neutral) keeps base colours true.
        tone_map: choice(3, ["linear", "aces", "agx", "neutral"]),
        /// Colours of views that show a number: `viridis` and `magma` grow evenly brighter, `turbo` tells more steps apart.
        color_map: choice(0, crate::view::COLOR_MAPS),
        /// What views of a number show in the first colour; theirs alone where it is not below `range_high`.
        range_low: float(0.0, -1000000000.0..=1000000000.0, ""),
        /// What views of a number show in the last colour. Higher: more of the large numbers can be told apart.
        range_high: float(0.0, -1000000000.0..=1000000000.0, ""),
    }
}
