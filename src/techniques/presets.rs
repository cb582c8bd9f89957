//! Settings that go by a name: those of a paper, or of what this project recommends.

use super::{TechniqueInfo, find as find_technique};
use crate::error::{Error, Result};

/// A technique with settings other than its defaults.
#[derive(Debug)]
pub struct Preset {
    /// Its key everywhere.
    pub id: &'static str,
    /// Its name for people.
    pub title: &'static str,
    /// What it stands for, and what it leaves out.
    pub doc: &'static str,
    /// Id of the technique.
    pub technique: &'static str,
    /// (key, value), as [`crate::Renderer::set`] takes them; all others are at their defaults.
    pub settings: &'static [(&'static str, &'static str)],
}

impl Preset {
    /// The technique itself.
    ///
    /// # Errors
    /// `UNKNOWN_NAME` where there is none: a test sees to it that there is.
    pub fn technique(&self) -> Result<&'static TechniqueInfo> {
        find_technique(self.technique)
    }
}

/// Every preset, in the order of menus.
pub static ALL: &[Preset] = &[
    Preset {
        id: "bitterli-2020-unbiased",
        title: "Bitterli et al. 2020, unbiased",
        doc: "One round of three neighbours, weights 1/|Z| with shadow rays, reuse in every pixel and fed back. Unbiased. The \
              weights are put into the sum instead of on the chosen sample, which has less noise.",
        technique: "restir-di",
        settings: &[
            ("reuse_weights", "1/z"),
            ("spatial_neighbors", "3"),
            ("spatial_confidence_limit", "10000"),
            ("spatial_feedback", "true"),
        ],
    },
    Preset {
        id: "bitterli-2020-biased",
        title: "Bitterli et al. 2020, biased",
        doc: "Two rounds of five neighbours of alike depth and normal, constant confidence weights without rays, fed back. Biased: darker.",
        technique: "restir-di",
        settings: &[
            ("reuse_weights", "heuristics"),
            ("visibility_in_weights", "false"),
            ("spatial_iterations", "2"),
            ("spatial_neighbors", "5"),
            ("spatial_confidence_limit", "10000"),
            ("spatial_feedback", "true"),
        ],
    },
    Preset {
        id: "wyman-2021",
        title: "Wyman and Panteleev 2021",
        doc: "Decoupled shading with light tiles of 1024 lights, and one ray a pixel: what was known of the other samples is believed. \
              Biased little: see the technique's page.",
        technique: "restir-di-decoupled",
        settings: &[("visibility_reuse_radius", "256"), ("visibility_lifetime", "255")],
    },
    Preset {
        id: "wyman-2021-unbiased",
        title: "Wyman and Panteleev 2021, unbiased",
        doc: "The same pipeline with rays for all samples in weights of multiple importance sampling.",
        technique: "restir-di-decoupled",
        settings: &[("visibility", "mis")],
    },
    Preset {
        id: "lanz-2025",
        title: "Lanz 2025",
        doc: "Direct light of the thesis: three neighbours found by greedy search within 20 pixels, defensive pairwise weights with rays, \
              history cap 20, BSDF samples beside light samples, GGX with energy compensation. Unbiased.",
        technique: "restir-di",
        settings: &[
            ("bsdf_samples", "1"),
            ("spatial_neighbors", "3"),
            ("spatial_radius", "20"),
            ("spatial_retries", "3"),
            ("spatial_confidence_limit", "10000"),
            ("spatial_feedback", "true"),
            ("render.energy_compensation", "true"),
        ],
    },
    Preset {
        id: "report-a",
        title: "Report 2025, configuration A",
        doc: "One sample of each strategy, no reuse. Made for the scene cornell-64. Unbiased.",
        technique: "restir-report",
        settings: &[("configuration", "a-naive")],
    },
    Preset {
        id: "report-b",
        title: "Report 2025, configuration B",
        doc: "Eight proposals resampled for area lights and for points, no reuse. Made for the scene cornell-64. Unbiased.",
        technique: "restir-report",
        settings: &[("configuration", "b-ris")],
    },
    Preset {
        id: "report-c",
        title: "Report 2025, configuration C",
        doc: "As B, with temporal reuse. Made for the scene cornell-64. Unbiased.",
        technique: "restir-report",
        settings: &[("configuration", "c-temporal")],
    },
    Preset {
        id: "report-d",
        title: "Report 2025, configuration D",
        doc: "As B, with spatial reuse. Made for the scene cornell-64. Unbiased.",
        technique: "restir-report",
        settings: &[("configuration", "d-spatial")],
    },
    Preset {
        id: "report-e",
        title: "Report 2025, configuration E",
        doc: "As B, with temporal and spatial reuse: the defaults. Made for the scene cornell-64. Unbiased.",
        technique: "restir-report",
        settings: &[],
    },
];

/// The preset with this id.
///
/// # Errors
/// `UNKNOWN_NAME` listing the ids there are.
pub fn find(id: &str) -> Result<&'static Preset> {
    ALL.iter().find(|preset| preset.id == id).ok_or_else(|| Error::Unknown {
        kind: "preset",
        name: id.to_owned(),
        known: ALL.iter().map(|preset| preset.id).collect::<Vec<_>>().join(", "),
    })
}

/// The presets as JSON: id, title, doc, technique, settings as an object of texts.
pub fn describe_json() -> serde_json::Value {
    let describe = |Preset { id, title, doc, technique, settings }: &Preset| {
        let settings: serde_json::Map<_, _> = settings.iter().map(|(k, v)| ((*k).into(), (*v).into())).collect();
        serde_json::json!({ "id": id, "title": title, "doc": doc, "technique": technique, "settings": settings })
    };
    ALL.iter().map(describe).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_settings_that_differ_from_defaults_and_do_not_contradict_each_other() {
        for (i, preset) in ALL.iter().enumerate() {
            assert!(ALL[..i].iter().all(|other| other.id != preset.id), "{}", preset.id);
            let technique = preset.technique().expect(preset.id);
            for (key, value) in preset.settings {
                let spec = technique.spec(key).expect(preset.id);
                let bits = spec.parse(value).expect(preset.id);
                assert_ne!(bits, spec.default, "{}: {key}", preset.id);
            }
            (technique.check)(preset.settings).expect(preset.id);
        }
    }
}
