//! Every technique that makes claims (`lab/truth`) keeps them: unbiased settings have the path tracer's expectation by two
//! one-sided tests, biased ones are seen to be biased, and planted faults are caught. `npm run prove` goes through all of them;
//! else it is the first of each kind.

mod support;

use restir::Gpu;
use restir::lab::truth::{self, Proof, Step, Trial, Verdict};
use restir::techniques;
use support::*;

/// Techniques that make no claim: the reference itself, and what is no estimate of light.
const WITHOUT: [&str; 2] = ["path-tracer", "normals"];

/// Puts the claims of one technique to the proof.
fn prove(technique: &str) {
    let mut trial = Trial::find(technique).expect("a trial");
    if proof() == Proof::Quick {
        trial = trial.abridged();
    }
    let scene = builtin(trial.scene.strip_prefix("builtin:").expect("a built-in scene"));
    let device = || pollster::block_on(Gpu::headless(&restir::GpuOptions { default_limits: true }));
    let findings = truth::check(&trial, proof(), &scene, &device, &|_, _, _| ()).expect("it can be carried out");
    for finding in &findings {
        println!("{:?} {}: {:?}, {}", finding.step, finding.what, finding.verdict, finding.regions);
    }
    let broken: Vec<_> = findings.iter().filter(|finding| !finding.passed).map(|finding| &finding.what).collect();
    assert!(broken.is_empty(), "{technique} does not keep: {broken:?}");
    assert!(findings.iter().any(|finding| finding.step == Step::Plant && finding.verdict == Verdict::Biased));
}

#[test]
fn restir_di_keeps_its_claims() {
    prove("restir-di");
}

#[test]
fn restir_di_decoupled_keeps_its_claims() {
    prove("restir-di-decoupled");
}

#[test]
#[ignore = "minutes, for cornell-64 is noisy: npm run prove; tests/report.rs proves the same of a quieter scene"]
fn restir_report_keeps_its_claims() {
    prove("restir-report");
}

#[test]
fn ris_keeps_its_claims() {
    prove("ris");
}

#[test]
fn every_technique_makes_claims_and_every_claim_has_a_test() {
    let source = include_str!("truth.rs");
    let mut claiming: Vec<&str> = Trial::techniques().collect();
    claiming.extend(WITHOUT);
    for info in techniques::ALL {
        assert!(claiming.contains(&info.id), "{} has no file lab/truth/{}.toml", info.id, info.id);
    }
    for technique in Trial::techniques() {
        assert!(source.contains(&format!("prove(\"{technique}\")")), "no test proves what {technique} claims");
        let trial = Trial::find(technique).expect("a sound file");
        assert!(trial.claims.iter().any(|claim| claim.unbiased), "{technique} claims nothing");
        assert!(!trial.plants.is_empty(), "{technique}: a proof that cannot fail is none");
    }
}

#[test]
fn plants_that_have_lost_their_place_are_errors() {
    let gpu = fresh_gpu();
    let refusal = |old: &str, new: &str| gpu.plant(old, new).expect_err("refused").to_string();
    assert!(refusal("no shader says this", "").contains("stands nowhere"));
    assert!(refusal("fn main", "fn other").contains("main"), "a pass without its entry point");
    assert!(refusal("u32", "f32").contains("times"));
}
