// Candidates of resampled importance sampling and what is selected from them: samples of lights, and points of lights that
// rays drawn for the BSDF ran into.
// The including pass says by `observe_candidate` whether anybody looks on (observed.wgsl, unobserved.wgsl).
// Sources: Talbot et al. 2005; Bitterli et al. 2020, Algorithm 3; thesis 000, listing 3; Wyman and Panteleev 2021, Eq. 11
// to 13 (stratified: every stream has a set of candidates of its own; else all select from one).
#include "techniques/common/resampling.wgsl"

const MAXIMUM_STREAMS = 4u;

struct CandidateSettings {
    light_samples: u32, // of a set
    bsdf_samples: u32, // of a set
    streams: u32,
    stratified: u32, // 1: as many sets as streams
}

var<private> streams: array<Stream, MAXIMUM_STREAMS>;

fn draw_candidate(surface: Surface, is_bsdf_sample: bool, rng: ptr<function, Rng>) -> LightSample {
    if bsdf_candidates && is_bsdf_sample {
        let wi = surface_sample(surface, random_4(rng).xyz);
        return light_sample_of_hit(traverse(ray_origin(surface, wi), wi, 3.0e38, false), wi);
    }
    return light_sample(surface.position, rng);
}

// Fills the streams.
fn select_candidates(surface: Surface, settings: CandidateSettings, rng: ptr<function, Rng>) {
    for (var slot = 0u; slot < settings.streams; slot += 1u) {
        streams[slot] = stream_empty();
    }
    let count = settings.light_samples + settings.bsdf_samples;
    let sets = select(1u, settings.streams, settings.stratified == 1u);
    for (var i = 0u; i < sets * count; i += 1u) {
        let group = i / count;
        let sample = draw_candidate(surface, i - group * count >= settings.light_samples, rng);
        let weight = candidate_weight(surface, sample, settings.light_samples, settings.bsdf_samples);
        observe_candidate(group, sample, weight);
        let u = random_4(rng);
        for (var slot = 0u; slot < settings.streams; slot += 1u) {
            if settings.stratified == 1u && slot != group {
                continue;
            }
            // By way of a copy: naga cannot pass a pointer to a dynamically indexed element.
            var stream = streams[slot];
            stream_update(&stream, sample, weight, u[slot]);
            streams[slot] = stream;
        }
    }
}
