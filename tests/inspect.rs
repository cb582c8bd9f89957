//! The pixel inspector and the dissected frame: what they say is what the passes did, and looking on changes nothing.

mod support;

use glam::UVec2;
use restir::Renderer;
use restir::gpu::dissection::Dissection;
use restir::inspect::{Inspection, Note};
use support::{cases, gpu};

const SIZE: UVec2 = UVec2::new(32, 24);

fn renderer(scene: &str, technique: &str, settings: &[(&str, &str)]) -> Renderer {
    support::renderer(&gpu(), support::builtin(scene), SIZE.to_array(), technique, settings)
}

fn inspect(renderer: &mut Renderer, pixel: UVec2, frames: u32) -> Inspection {
    renderer.inspect(Some(pixel)).unwrap();
    for _ in 0..frames {
        renderer.render_frame().unwrap();
    }
    pollster::block_on(renderer.inspection()).unwrap()
}

fn of<'a>(inspection: &'a Inspection, kind: &'a str, stage: &'a str) -> impl Iterator<Item = &'a Note> {
    inspection.notes.iter().filter(move |note| note.kind == kind && note.stage == stage)
}

fn close(a: f32, b: f32, what: &str) {
    assert!((a - b).abs() <= 1e-4 * a.abs().max(b.abs()).max(1e-6), "{what}: {a} and {b}");
}

/// W = sum w / p-hat(y) (dissertation 004, Eq. 6.22): of candidates, and of every combination of domains.
fn assert_weights_are_those_of_resampling(inspection: &Inspection, stage: &str, slot: u32) {
    let of = |kind, stage| of(inspection, kind, stage).filter(move |note| note.slot == slot);
    let result = of("result", stage).next().unwrap_or_else(|| panic!("no {stage}: {inspection:#?}"));
    let offers: Vec<&Note> = match stage {
        "initial" => of("candidate", stage).collect(),
        _ => of("domain", stage).collect(),
    };
    assert!(!offers.is_empty() || !result.reason.is_empty(), "{stage}: nothing was offered, and no word why");
    let Some(sample) = result.sample.as_ref().filter(|_| result.unbiased_contribution_weight > 0.0) else { return };
    if offers.is_empty() {
        return;
    }
    let sum: f32 = offers.iter().map(|offer| offer.resampling_weight).sum();
    close(result.unbiased_contribution_weight, sum / sample.target_value, stage);
    let chosen =
        |offer: &&Note| offer.sample.as_ref().is_some_and(|s| (s.light, s.point) == (sample.light, sample.point));
    assert!(offers.iter().any(chosen), "{stage}: what was selected was offered");
    if stage != "initial" {
        let confidence: f32 = offers.iter().map(|offer| offer.confidence_weight).sum();
        close(result.confidence_weight, confidence, "confidence weights add up");
    }
}

#[test]
fn notes_add_up_to_the_reservoirs() {
    // The default first: others are other kernels, a minute each on a software adapter.
    for weights in cases(&["defensive", "heuristics", "1/z", "balance", "pairwise"]) {
        let settings = [("reuse_weights", *weights), ("spatial_iterations", "2"), ("spatial_confidence_limit", "1000")];
        let mut renderer = renderer("cornell", "restir-di", &settings);
        for pixel in [UVec2::new(16, 20), UVec2::new(5, 12), UVec2::new(16, 5)] {
            let seen = inspect(&mut renderer, pixel, 3);
            assert_eq!(seen.dropped, 0);
            assert_eq!(of(&seen, "candidate", "initial").count(), 32, "M of them");
            for stage in ["initial", "temporal", "spatial 1", "spatial 2"] {
                assert_weights_are_those_of_resampling(&seen, stage, 0);
            }
            let own = of(&seen, "domain", "spatial 1").next().and_then(|note| note.pixel);
            assert!(own.is_none_or(|own| own == pixel.to_array()), "the first domain is the pixel itself");
        }
    }
}

/// Techniques whose reservoirs are not those of restir-di: one a strategy, or three samples met at once.
#[test]
fn notes_of_other_reservoirs_add_up() {
    for (technique, stages, slots) in [
        ("restir-report", &["initial", "temporal", "spatial 1"][..], 2),
        ("restir-di-decoupled", &["initial", "temporal"][..], 1),
    ] {
        let mut renderer = renderer("cornell-64", technique, &[]);
        let mut chosen = 0;
        for pixel in [UVec2::new(16, 20), UVec2::new(5, 12), UVec2::new(16, 5), UVec2::new(24, 22)] {
            let seen = inspect(&mut renderer, pixel, 4);
            assert_eq!(seen.dropped, 0);
            for stage in stages {
                for slot in 0..slots {
                    assert_weights_are_those_of_resampling(&seen, stage, slot);
                }
                let results = of(&seen, "result", stage);
                chosen += results.filter(|note| note.unbiased_contribution_weight > 0.0).count();
            }
            let (first, second) = {
                let mut domains = of(&seen, "domain", "temporal").map(|note| note.pixel);
                (domains.next().flatten(), domains.next())
            };
            assert_eq!(first, Some(pixel.to_array()), "the first domain is the pixel itself");
            assert!(second.is_some(), "{technique}: history joins");
        }
        println!("{technique}: {chosen} reservoirs hold a sample");
        assert!(chosen >= 6);
    }
}

/// With one path vertex and nothing that emits, the last reservoir is the radiance: f L G V W has the luminance p-hat W V.
#[test]
fn the_last_reservoir_is_what_the_pixel_shows() {
    for (technique, settings) in [("restir-di", &[("indirect", "no")][..]), ("ris", &[][..])] {
        let mut renderer = renderer("cornell", technique, settings);
        let mut lit = 0;
        for pixel in [UVec2::new(16, 20), UVec2::new(5, 12), UVec2::new(24, 22), UVec2::new(10, 21)] {
            let seen = inspect(&mut renderer, pixel, 2);
            let last = seen.notes.iter().rfind(|note| note.kind == "result").unwrap();
            let [r, g, b] = seen.radiance;
            let luminance = 0.2126 * r + 0.7152 * g + 0.0722 * b;
            let target = last.sample.as_ref().map_or(0.0, |sample| sample.target_value);
            let estimate = if last.is_visible { target * last.unbiased_contribution_weight } else { 0.0 };
            assert!(
                (luminance - estimate).abs() <= 2e-3 * luminance.max(1e-3),
                "{technique} {pixel}: {luminance} {estimate}"
            );
            lit += u32::from(luminance > 0.0);
        }
        assert!(lit > 0, "{technique}: not all are dark");
    }
}

#[test]
fn surface_and_mean_are_those_of_the_pictures() {
    let mut renderer = renderer("cornell", "path-tracer", &[]);
    let pixel = UVec2::new(7, 15);
    let seen = inspect(&mut renderer, pixel, 4);
    let at = (pixel.y * SIZE.x + pixel.x) as usize;
    let auxiliary = pollster::block_on(renderer.read_auxiliary()).unwrap();
    let image = pollster::block_on(renderer.read_image()).unwrap();
    let surface = seen.surface.expect("a wall");
    assert_eq!(surface.base_color, auxiliary.albedo[at]);
    assert_eq!(surface.normal, auxiliary.normal[at]);
    assert_eq!(surface.depth, auxiliary.depth[at]);
    assert_eq!(seen.mean, image.pixels[at]);
    assert_eq!(seen.samples, 4.0);
}

fn dissected_frame(renderer: &mut Renderer) -> Dissection {
    renderer.begin_dissected_frame().unwrap();
    renderer.finish_frame().unwrap().expect("it was begun so")
}

#[test]
fn looking_on_changes_no_picture() {
    let picture = |inspected: bool, dissected: bool| {
        let mut renderer = renderer("cornell", "restir-di", &[("spatial_confidence_limit", "1000")]);
        renderer.inspect(inspected.then_some(UVec2::new(16, 20))).unwrap();
        for frame in 0..3 {
            if dissected && frame == 1 {
                dissected_frame(&mut renderer);
            } else {
                renderer.render_frame().unwrap();
            }
        }
        let rays = pollster::block_on(renderer.counters()).unwrap().rays;
        (pollster::block_on(renderer.read_image()).unwrap().pixels, rays)
    };
    let plain = picture(false, false);
    assert_eq!(picture(true, false), plain, "inspected");
    assert_eq!(picture(false, true), plain, "dissected");
}

#[test]
fn a_dissected_frame_shows_what_each_pass_wrote() {
    let mut renderer =
        renderer("cornell", "restir-di", &[("spatial_confidence_limit", "1000"), ("film.exposure", "1")]);
    renderer.render_frame().unwrap();
    let frame = dissected_frame(&mut renderer);
    let ids: Vec<_> = frame.stages.iter().map(|stage| stage.shader.id).collect();
    let expected = [
        "scene/visibility",
        "restir-di/initial",
        "restir-di/temporal",
        "restir-di/spatial",
        "common/indirect",
        "restir-di/shade",
        "film/accumulate",
        "film/display",
    ];
    assert_eq!(ids, expected);
    let picture = |stage: usize| pollster::block_on(frame.read(renderer.gpu(), stage)).unwrap();
    let pictures: Vec<_> = (0..ids.len()).map(picture).collect();
    for (id, picture) in ids.iter().zip(&pictures) {
        let has = frame.stages.iter().find(|stage| stage.shader.id == *id).unwrap().has_picture();
        assert_eq!(picture.len(), if has { 4 * (SIZE.x * SIZE.y) as usize } else { 0 }, "{id}");
        assert_eq!(has, *id != "film/accumulate", "{id}");
        let lit = picture.chunks(4).filter(|rgba| rgba[..3] != [0, 0, 0]).count();
        assert!(!has || lit > 100, "{id} is not black: {lit}");
    }
    for pair in pictures.windows(2) {
        assert!(pair[0] != pair[1], "no two passes in turn show the same");
    }
    let display = pollster::block_on(renderer.read_display()).unwrap();
    assert_eq!(*pictures.last().unwrap(), display, "the last picture is what is displayed");
    // No pass of the dissection's own is timed.
    let times = pollster::block_on(renderer.pass_times()).unwrap();
    assert!(times.iter().all(|time| time.name != "film/snapshot" && time.name != "scene/seen"), "{times:?}");
}

#[test]
fn nobody_looks_outside() {
    let mut renderer = renderer("cornell", "normals", &[]);
    assert_eq!(pollster::block_on(renderer.inspection()).unwrap_err().code(), "BAD_VALUE");
    assert_eq!(renderer.inspect(Some(SIZE)).unwrap_err().code(), "BAD_VALUE");
    // A picture that shrinks under the inspector leaves the pixel outside.
    renderer.inspect(Some(UVec2::new(31, 23))).unwrap();
    assert_eq!(pollster::block_on(renderer.inspection()).unwrap_err().code(), "BAD_VALUE", "nothing was seen yet");
    renderer.resize(UVec2::new(4, 4)).unwrap();
    renderer.render_frame().unwrap();
    assert!(pollster::block_on(renderer.inspection()).unwrap().surface.is_none());
}

#[test]
fn more_candidates_than_notes_leave_room_for_what_became_of_them() {
    let settings =
        [("light_samples", "1024"), ("reservoir_size", "4"), ("stratified", "yes"), ("temporal_reuse", "no")];
    let mut renderer = renderer("cornell", "restir-di", &settings);
    let seen = inspect(&mut renderer, UVec2::new(16, 20), 1);
    assert_eq!(of(&seen, "result", "initial").count(), 4);
    assert_eq!(of(&seen, "candidate", "initial").count() as u32 + seen.dropped, 4 * 1024);
}
