//! Whether techniques keep what they claim: unbiased settings are compared with the path tracer, biased ones have their
//! bias measured, and faults planted in the shaders must be caught. docs/testing.md has the statistics.

pub mod equivalence;
mod trial;

pub use equivalence::{Comparison, Estimate, Margins, Proof};
pub use trial::{Claim, Finding, Plant, Step, Trial, Verdict, check};
