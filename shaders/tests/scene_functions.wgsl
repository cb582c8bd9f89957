// Functions that read the scene: textures, lights, the environment and the camera, for tests against Rust twins.
// One invocation: one evaluation of the operation asked for. Reads one input and the scene. Writes one output.
#include "tests/harness.wgsl"
#include "scene/lights.wgsl"
#include "scene/camera.wgsl"

// As numbered in tests/support/mod.rs.
const TEXTURE_READ = 0u;
const LIGHT_SAMPLE = 1u;
const LIGHT_CONTRIBUTION = 2u;
const LIGHT_PDFS = 3u;
const ENVIRONMENT = 4u;
const ENVIRONMENT_SAMPLE = 5u;
const CAMERA = 6u;
const SHADING_NORMAL = 8u;
const SHADOW_RAY = 9u;
const FOOTPRINT = 20u;
const PYRAMID_SAMPLE = 10u;

fn evaluate(operation: u32, input: TestInput) -> TestOutput {
    let a = float(input.a);
    let b = float(input.b);
    switch operation {
        case TEXTURE_READ: {
            return TestOutput(bits(texture_read(load_material(input.b.x).base_color_texture,
                TextureCoordinates(a, b.yz))), vec4u(0u));
        }
        case LIGHT_SAMPLE: {
            var rng = rng_new(input.a.xy, 0u, input.a.z, 0u);
            let sample = light_sample(b.xyz, &rng);
            return TestOutput(vec4u(sample.light, sample.point, bitcast<u32>(light_sample_pdf(b.xyz, sample)),
                bitcast<u32>(lights[sample.light].pmf)), vec4u(0u));
        }
        case LIGHT_CONTRIBUTION: {
            let light = light_contribution(LightSample(input.b.x, input.b.y), a.xyz, false);
            return TestOutput(bits_3(light.value, light.distance), bits_3(light.direction, light.solid_angle_jacobian));
        }
        // The density of a sample on a triangle, converted to solid angle, beside the density of the ray that hits it.
        case LIGHT_PDFS: {
            let sample = LightSample(input.b.x, input.b.y);
            let light = light_contribution(sample, a.xyz, false);
            let triangle = lights[sample.light].triangle;
            let instance = lights[sample.light].instance;
            let distance = length(triangle_point(instance, triangle, light_sample_barycentrics(sample)) - a.xyz);
            return TestOutput(bits(vec4f(light_sample_pdf(a.xyz, sample) * light.solid_angle_jacobian,
                light_hit_pdf(sample.light, instance, triangle, a.xyz, light.direction, distance), 0.0, 0.0)), vec4u(0u));
        }
        case ENVIRONMENT: {
            return TestOutput(bits_3(environment_evaluate(a.xyz), environment_pdf(a.xyz)),
                bits(vec4f(environment_uv(a.xyz), 0.0, 0.0)));
        }
        case ENVIRONMENT_SAMPLE: {
            let point = environment_cell(environment_texel_by_alias(input.b.xy, a.x), a.yz);
            return TestOutput(bits_3(environment_direction(unpack_point(point)), environment_point_pdf(point)),
                vec4u(point, 0u, 0u, 0u));
        }
        case PYRAMID_SAMPLE: {
            var rng = rng_new(input.a.xy, 0u, input.a.z, 0u);
            let texel = environment_texel_by_pyramid(&rng);
            return TestOutput(vec4u(texel, bitcast<u32>(environment_texel_pdf(texel)), 0u), vec4u(0u));
        }
        // Out along the ray of a film point, and back to the film.
        case CAMERA: {
            let ray = camera_ray(frame.camera, a.xy);
            return TestOutput(bits(vec4f(project(frame.camera, ray.origin + a.z * ray.direction), 0.0, 0.0)),
                bits_3(ray.direction, 0.0));
        }
        // At the point b.xy of the triangle input.a.x.
        case SHADING_NORMAL: {
            return TestOutput(bits_3(shading_normal(input.a.x, b.xy, texture_finest(triangle_uvs(input.a.x, b.xy))), 0.0), vec4u(0u));
        }
        // Whether a surface at a, normal b, sees the light sample c.xy, and what that sends there.
        case SHADOW_RAY: {
            var surface: Surface;
            surface.position = a.xyz;
            surface.geometric_normal = b.xyz;
            surface.position_error = 5e-7 * (abs(a.x) + abs(a.y) + abs(a.z));
            let light = light_contribution(LightSample(input.c.x, input.c.y), a.xyz, false);
            let is_lit = is_visible(surface, light.direction, light.distance);
            return TestOutput(bits_3(light.value, light.distance), vec4u(u32(is_lit), 0u, 0u, 0u));
        }
        // Of a cone a.w wide that meets the triangle b.x from a.xyz: what it covers of a texture, and how wide it goes on.
        case FOOTPRINT: {
            let areas = texture_coordinates(0u, input.b.x, vec2f(0.3), a.xyz, a.w).areas;
            return TestOutput(bits(vec4f(areas, scattered_spread(0u, input.b.x, b.y, a.w, b.z), 0.0)), vec4u(0u));
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
