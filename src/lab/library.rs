//! The experiments that come with the program: the files of the folder `lab/`, listed by `build.rs`.

use super::experiment::Experiment;
use crate::error::{Error, Result};

/// (name, text) of each file `lab/NAME.toml`, by name.
pub static FILES: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/experiments.rs"));

/// The experiment of this name.
///
/// # Errors
/// `UNKNOWN_NAME` listing the names there are; as [`Experiment::parse`].
pub fn find(name: &str) -> Result<Experiment> {
    let file = FILES.iter().find(|(known, _)| *known == name).ok_or_else(|| Error::Unknown {
        kind: "experiment",
        name: name.to_owned(),
        known: FILES.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", "),
    })?;
    Experiment::parse(&format!("lab/{}.toml", file.0), file.1)
}
