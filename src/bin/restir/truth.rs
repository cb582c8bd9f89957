//! `restir truth`: whether techniques keep what they claim.

use crate::failure::{Failure, Result};
use crate::{lab, progress, report};
use pollster::block_on;
use restir::lab::truth::{self, Finding, Proof, Step, Trial, Verdict};
use restir::{Error, Gpu, GpuOptions};

/// Prove what techniques claim: settings said to be unbiased have the path tracer's expectation, biased ones have their
/// bias measured, and faults planted in the shaders are caught. Exit code 1 where a claim fails or a fault goes unnoticed.
#[derive(clap::Args)]
pub struct Args {
    /// Technique id; all that make claims where none is given.
    #[arg(value_name = "TECHNIQUE")]
    technique: Option<String>,
    /// A quarter of the runs, and twice the margin.
    #[arg(long)]
    quick: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> Result<()> {
    let trials: Vec<Trial> = match &args.technique {
        Some(id) => vec![Trial::find(id).map_err(Failure::from_option)?],
        None => Trial::techniques().map(Trial::find).collect::<restir::Result<_>>()?,
    };
    let proof = if args.quick { Proof::Quick } else { Proof::Whole };
    let mut findings = Vec::new();
    for trial in &trials {
        let scene = lab::load(&trial.scene)?;
        let device = || block_on(Gpu::headless(&GpuOptions { default_limits: false }));
        let bar = progress::bar(0);
        let found = truth::check(trial, proof, &scene, &device, &|what, done, of| {
            bar.set_length(of as u64);
            bar.set_position(done as u64);
            bar.set_message(what.to_owned());
        })?;
        bar.finish_and_clear();
        if !args.json {
            report::text(&found.iter().map(line).collect::<Vec<_>>().join("\n"))?;
        }
        findings.extend(found);
    }
    if args.json {
        report::json(&findings)?;
    }
    let failed = findings.iter().filter(|finding| !finding.passed).count();
    match failed {
        0 => Ok(()),
        _ => Err(Failure::Failed(Error::bad_value("truth", format!("{failed} of {} did not hold", findings.len())))),
    }
}

fn line(finding: &Finding) -> String {
    let mark = if finding.passed { "holds" } else { "FAILS" };
    let (step, verdict) = match (finding.step, finding.verdict) {
        (Step::Unbiased, Verdict::Equivalent) => ("unbiased", "equivalent"),
        (Step::Unbiased, Verdict::Biased) => ("unbiased", "biased"),
        (Step::Unbiased, Verdict::Undecided) => ("unbiased", "undecided"),
        (Step::Biased, Verdict::Biased) => ("biased", "seen"),
        (Step::Biased, _) => ("biased", "not seen"),
        (Step::Plant, Verdict::Biased) => ("planted", "caught"),
        (Step::Plant, _) => ("planted", "unnoticed"),
    };
    let (bias, error) = (100.0 * finding.bias, 100.0 * finding.standard_error);
    let left_out = match finding.not_finite {
        0 => String::new(),
        samples => format!("; samples not finite: {samples}"),
    };
    let Finding { technique, what, .. } = finding;
    format!("{mark} {technique:12} {step:8} {bias:+8.3} ± {error:.3} %  {verdict:10} {what}{left_out}")
}
