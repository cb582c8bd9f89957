// Functions without bindings, for tests against their Rust twins and of samplers against their densities.
// One invocation: one evaluation of the operation asked for. Reads one input. Writes one output.
#include "tests/harness.wgsl"
#include "lib/rng.wgsl"
#include "lib/sampling.wgsl"
#include "lib/color.wgsl"
#include "lib/mis.wgsl"
#include "lib/reservoir.wgsl"

// As numbered in tests/support/mod.rs.
const PCG4D = 0u;
const RANDOM = 1u;
const OCTAHEDRAL = 2u;
const BASIS = 3u;
const WARPS = 4u;
const SRGB = 9u;
const TONE_MAP = 10u;
const MIS_WEIGHT = 11u;
const STREAM_OF_FOUR = 12u;
const STREAM_MERGED = 13u;
const POINTS = 14u;
const CLASSIFY = 15u;
const BITS_BELOW = 16u;
const UNWARPED = 17u;
const PACKED = 18u;

// Streams the four weights of `weights` under the index they have there, from `first` on.
fn stream_of(weights: vec4f, first: u32, count: u32, rng: ptr<function, Rng>) -> Stream {
    var stream = stream_empty();
    for (var i = first; i < first + count; i += 1u) {
        stream_update(&stream, LightSample(i, 10u * i), weights[i], random_1(rng));
    }
    return stream;
}

fn evaluate(operation: u32, input: TestInput) -> TestOutput {
    let a = float(input.a);
    let b = float(input.b);
    switch operation {
        case PCG4D: { return TestOutput(pcg4d(input.a), vec4u(0u)); }
        case RANDOM: {
            var rng = rng_new(input.a.xy, input.a.z, input.a.w, input.b.x);
            let first = random_4(&rng);
            return TestOutput(bits(first), bits(random_4(&rng)));
        }
        case OCTAHEDRAL: {
            let p = octahedral_encode(a.xyz);
            return TestOutput(bits(vec4f(p, 0.0, 0.0)), bits_3(octahedral_decode(p), 0.0));
        }
        case BASIS: {
            let basis = orthonormal_basis(a.xyz);
            return TestOutput(bits_3(basis.tangent, 0.0), bits_3(basis.bitangent, 0.0));
        }
        case WARPS: {
            return TestOutput(bits(vec4f(sample_disk(a.xy), sample_triangle(a.xy))),
                bits_3(sample_cosine_hemisphere(a.xy), 0.0));
        }
        case SRGB: { return TestOutput(bits_3(srgb_encode(a.xyz), 0.0), bits_3(srgb_decode(a.xyz), 0.0)); }
        case TONE_MAP: { return TestOutput(bits_3(tone_map(input.a.w, a.xyz), 0.0), vec4u(0u)); }
        case MIS_WEIGHT: { return TestOutput(bits(vec4f(mis_weight(input.a.z, a.x, a.y))), vec4u(0u)); }
        case STREAM_OF_FOUR: {
            var rng = rng_new(input.b.xy, 0u, input.b.z, 0u);
            let stream = stream_of(a, 0u, 4u, &rng);
            return TestOutput(vec4u(stream.selected.light, stream.selected.point, bitcast<u32>(stream.weight_sum), 0u),
                vec4u(0u));
        }
        // Two halves streamed apart, then each half's choice offered with the half's weight sum.
        case STREAM_MERGED: {
            var rng = rng_new(input.b.xy, 0u, input.b.z, 0u);
            let left = stream_of(a, 0u, 2u, &rng);
            let right = stream_of(a, 2u, 2u, &rng);
            var merged = stream_empty();
            stream_update(&merged, left.selected, left.weight_sum, random_1(&rng));
            stream_update(&merged, right.selected, right.weight_sum, random_1(&rng));
            return TestOutput(vec4u(merged.selected.light, merged.selected.point, bitcast<u32>(merged.weight_sum), 0u),
                vec4u(0u));
        }
        case POINTS: {
            let point = pack_point(a.xy);
            return TestOutput(vec4u(point, 0u, 0u, 0u), bits(vec4f(unpack_point(point), 0.0, 0.0)));
        }
        case BITS_BELOW: { return TestOutput(vec4u(bits_below(input.a.x, input.a.y), 0u, 0u, 0u), vec4u(0u)); }
        case UNWARPED: {
            return TestOutput(bits(vec4f(unsample_disk(sample_disk(a.xy)), unsample_triangle(sample_triangle(a.xy)))),
                vec4u(0u));
        }
        case PACKED: {
            let packed = unpack_reservoir(vec3u(1u, 2u, pack_weights(Reservoir(1u, 2u, a.x, a.y))));
            return TestOutput(
                bits(vec4f(packed.unbiased_contribution_weight, packed.confidence_weight, 0.0, 0.0)), vec4u(0u));
        }
        case CLASSIFY: {
            return TestOutput(vec4u(u32(is_nan(a.x)), u32(is_infinite(a.x)), 0u, 0u), vec4u(0u));
        }
        default: { return TestOutput(vec4u(0u), vec4u(0u)); }
    }
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x < test_run.count {
        test_outputs[id.x] = evaluate(test_run.operation, test_inputs[id.x]);
    }
}
