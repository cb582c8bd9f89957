// Automatic exposure: the EV that brings the picture's log-average luminance to middle grey.
// One workgroup in all; each invocation reads every 256th of at most 65,536 pixels of the accumulation. Writes one EV.
// Source: Reinhard et al. 2002, Eq. 1.
#include "film/film.wgsl"
#include "lib/math.wgsl"

@group(1) @binding(1) var<storage, read> accumulation: array<vec4f>;
@group(1) @binding(2) var<storage, read_write> exposure_state: array<f32>;

const LANES = 256u;
const MAXIMUM_PIXELS = 65536u;

var<workgroup> sums: array<vec2f, LANES>;

@compute @workgroup_size(256)
fn main(@builtin(local_invocation_index) lane: u32) {
    let count = film.size.x * film.size.y;
    let stride = max(1u, (count + MAXIMUM_PIXELS - 1u) / MAXIMUM_PIXELS);
    var sum = vec2f(0.0);
    for (var i = lane * stride; i < count; i += LANES * stride) {
        let pixel = accumulation[i];
        let value = luminance(pixel.rgb) / max(pixel.a, 1.0);
        // Black pixels say nothing of how bright the lit ones are.
        if value > 1e-6 {
            sum += vec2f(log2(value), 1.0);
        }
    }
    sums[lane] = sum;
    workgroupBarrier();
    for (var half_width = LANES / 2u; half_width > 0u; half_width /= 2u) {
        if lane < half_width {
            sums[lane] += sums[lane + half_width];
        }
        workgroupBarrier();
    }
    if lane == 0u {
        exposure_state[0] = select(0.0, log2(0.18) - sums[0].x / max(sums[0].y, 1.0), sums[0].y > 0.0);
    }
}
