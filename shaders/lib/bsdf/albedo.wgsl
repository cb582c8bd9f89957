// Directional albedos, from a table over cosine and roughness that build.rs integrates (build/albedo.rs).

// 32 x 32: red the albedo E of a GGX reflection with F = 1, green the part of it that Schlick's weight of F90 makes,
// blue the albedo of the sheen up to 1, alpha a quarter of what it has beyond. Columns: square root of the cosine, 0 to 1;
// rows: roughness, 0 to 1.
@group(0) @binding(20) var albedo_table: texture_2d<f32>;

const ALBEDO_TABLE_SIZE = 32u;

fn albedo_read(cosine: f32, roughness: f32) -> vec4f {
    let last = f32(ALBEDO_TABLE_SIZE - 1u);
    let p = clamp(vec2f(sqrt(max(cosine, 0.0)), roughness), vec2f(0.0), vec2f(1.0)) * last;
    let base = min(floor(p), vec2f(last - 1.0));
    let f = p - base;
    let i = vec2u(base);
    let top = mix(textureLoad(albedo_table, i, 0), textureLoad(albedo_table, i + vec2u(1u, 0u), 0), f.x);
    let bottom = mix(textureLoad(albedo_table, i + vec2u(0u, 1u), 0), textureLoad(albedo_table, i + vec2u(1u), 0), f.x);
    return mix(top, bottom, f.y);
}
