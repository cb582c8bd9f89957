// The BSDF, for tests against its Rust twin and of its samplers against their densities.
// One invocation: one evaluation or one sample of one material. Reads one input and its material. Writes one output.
#include "tests/harness.wgsl"
#include "lib/bsdf/bsdf.wgsl"

@group(1) @binding(3) var<storage, read> test_materials: array<Bsdf>;

// As numbered in tests/support/bsdf.rs.
const EVALUATE = 0u;
const SAMPLE = 1u;
const PROBABILITIES = 2u;
const IRIDESCENCE = 3u;

// a: wo and the material's index; b: wi, or the random numbers of a sample, and the mask of lobes.
fn evaluate(operation: u32, input: TestInput) -> TestOutput {
    let material = test_materials[input.a.w];
    let wo = float(input.a).xyz;
    let b = float(input.b).xyz;
    let lobes = input.b.w;
    switch operation {
        case EVALUATE: {
            return TestOutput(bits_3(bsdf_evaluate(material, lobes, wo, b), bsdf_pdf(material, lobes, wo, b)), vec4u(0u));
        }
        case SAMPLE: {
            let sample = bsdf_sample(material, lobes, wo, b);
            return TestOutput(bits_3(sample.wi, bitcast<f32>(sample.lobe)),
                bits_3(bsdf_evaluate(material, lobes, wo, sample.wi), bsdf_pdf(material, lobes, wo, sample.wi)));
        }
        case PROBABILITIES: {
            let p = lobe_probabilities(material, lobes, wo);
            return TestOutput(bits(vec4f(p.diffuse, p.specular, p.transmission, p.sheen)),
                bits(vec4f(p.clearcoat, 0.0, 0.0, 0.0)));
        }
        case IRIDESCENCE: {
            return TestOutput(
                bits_3(iridescent_reflectance(material.film_ior, material.film_thickness, material.f0, wo.z), 0.0),
                bits(albedo_read(b.x, b.y)));
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
