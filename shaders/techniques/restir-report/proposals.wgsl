// The report's strategies of light sampling (report 003, section 4.2), each over its own part of the light table. Lights with
// an extent (emissive triangles and shapes, sun, environment) are the area strategy's, point masses (point, spot and
// directional lights) the point strategy's: together they are all lights, and none is in both.
//
// The table is in this order: emitters, point masses, sun, environment (src/scene/flat/lights.rs). Within a strategy the light
// is chosen uniformly, as one of 64 equal lights is; sun and environment get half of the area strategy's proposals beside
// emitters.
#include "techniques/restir-report/reservoir.wgsl"

struct Strategies {
    emitters: u32, // lights 0 to here
    points: u32, // from there on
    distant: u32, // the last ones
}

fn load_strategies() -> Strategies {
    let end = min(frame.light_count, min(frame.sun_light, frame.environment_light));
    // The first light that is no emitter, by bisection.
    var low = 0u;
    var high = end;
    while low < high {
        let middle = (low + high) / 2u;
        if lights[middle].kind == LIGHT_TRIANGLE {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return Strategies(low, end - low, frame.light_count - end);
}

struct Proposal {
    sample: LightSample,
    pdf: f32, // proposalPdf, in the sample's own measure; 0 where the strategy has no light
}

fn propose(strategy: u32, strategies: Strategies, position: vec3f, rng: ptr<function, Rng>) -> Proposal {
    var first = 0u;
    var count = strategies.emitters;
    var probability = 1.0;
    let bits = random_bits(rng);
    if strategy == STRATEGY_POINT {
        first = strategies.emitters;
        count = strategies.points;
    } else if strategies.distant > 0u {
        let is_distant = strategies.emitters == 0u || bits.y < 0x80000000u;
        probability = select(0.5, 1.0, strategies.emitters == 0u);
        if is_distant {
            first = frame.light_count - strategies.distant;
            count = strategies.distant;
        }
    }
    if count == 0u {
        return Proposal(LightSample(NONE, 0u), 0.0);
    }
    let light = first + bits_below(bits.x, count);
    let sample = light_sample_on(light, position, bits.zw, rng);
    // The density on the light alone; a light of probability 0 does not shine.
    let pmf = lights[light].pmf;
    if pmf <= 0.0 {
        return Proposal(sample, 0.0);
    }
    return Proposal(sample, light_sample_pdf(position, sample) / pmf * (probability / f32(count)));
}
