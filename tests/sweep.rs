//! No setting that a panel allows makes a number that is none, hangs, or loses the device: random sets of parameters over all
//! techniques that resample, on three tiny scenes, from a seed; 300 of them in full, the first 75 else.

mod support;

use glam::Vec3;
use restir::params::{ParamKind, ParamSpec};
use restir::techniques;
use std::time::{Duration, Instant};
use support::*;

const SETS: u32 = 300;
/// Two workgroups, and pixels beyond the picture in both directions.
const SIZE: [u32; 2] = [13, 7];
const FRAMES: u32 = 3;
/// One frame of the slowest set takes a second or two on two quiet cores.
const LONGEST: Duration = Duration::from_secs(60);

/// Xorshift (Marsaglia 2003).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A value of a parameter: its ends now and then, else even in the logarithm for what counts up from 0 or 1, so that a
    /// thousand samples a pixel are rare.
    fn value(&mut self, spec: &ParamSpec) -> String {
        let (choice, u) = (self.unit(), self.unit());
        let logarithmic = |min: f64, max: f64| (min + 1.0) * ((max + 1.0) / (min + 1.0)).powf(u) - 1.0;
        match spec.kind {
            ParamKind::Uint { min, .. } if choice < 0.1 => min.to_string(),
            ParamKind::Uint { max, .. } if choice < 0.12 => max.to_string(),
            ParamKind::Uint { min, max } => (logarithmic(min.into(), max.into()).round() as u32).to_string(),
            ParamKind::Float { min, .. } if choice < 0.1 => min.to_string(),
            ParamKind::Float { max, .. } if choice < 0.2 => max.to_string(),
            ParamKind::Float { min, max } if min >= 0.0 => (logarithmic(min.into(), max.into()) as f32).to_string(),
            ParamKind::Float { min, max } => (min + (max - min) * u as f32).to_string(),
            ParamKind::Flag => (u < 0.5).to_string(),
            ParamKind::Choice(names) => names[(u * names.len() as f64) as usize].to_owned(),
        }
    }
}

#[test]
fn random_settings_render() {
    let gpu = fresh_gpu();
    let techniques: Vec<_> = techniques::ALL.iter().filter(|t| !["path-tracer", "normals"].contains(&t.id)).collect();
    let scenes = ["cornell-64", "glossy-spheres", "many-lights:20"].map(builtin);
    let mut random = Random(0x5eed_0004);
    let mut slowest = (Duration::ZERO, String::new());
    for i in 0..proof().effort(SETS) as usize {
        let technique = techniques[i % techniques.len()];
        let scene = &scenes[(i / techniques.len()) % scenes.len()];
        let mut renderer = renderer(&gpu, scene.clone(), SIZE, technique.id, &[]);
        let mut settings = Vec::new();
        // A fault that makes NaNs on purpose, to be looked at.
        for spec in technique.params.iter().filter(|spec| spec.name != "fault_unguarded_pdf") {
            let value = random.value(spec);
            // What contradicts another setting is refused, and then the old value stays.
            if renderer.set(spec.name, &value).is_ok() {
                settings.push(format!("{}={value}", spec.name));
            }
        }
        let what = format!("set {i}: {} of {} with {}", technique.id, scene.name, settings.join(" "));
        renderer.set_accumulate(false);
        let start = Instant::now();
        let mut worst = (0, 0);
        for frame in 0..FRAMES {
            let mut camera = scene.cameras[0].clone();
            camera.position += 0.05 * frame as f32 * Vec3::X;
            renderer.set_camera(&camera);
            match renderer.render_frame() {
                // Buffers that the device cannot hold are refused, with both numbers.
                Err(error) if error.code() == "LIMIT" => break,
                rendered => rendered.unwrap_or_else(|e| panic!("{what}: {e}")),
            }
            let counters = pollster::block_on(renderer.counters()).unwrap_or_else(|e| panic!("{what}: {e}"));
            worst = (worst.0 + counters.nan, worst.1 + counters.inf);
        }
        renderer.gpu().check().unwrap_or_else(|e| panic!("{what}: {e}"));
        assert_eq!(worst, (0, 0), "{what}: not numbers, infinite");
        let time = start.elapsed();
        assert!(time < LONGEST, "{what}: {time:?}");
        if time > slowest.0 {
            slowest = (time, what);
        }
    }
    println!("slowest: {:.1} s, {}", slowest.0.as_secs_f64(), slowest.1);
}
