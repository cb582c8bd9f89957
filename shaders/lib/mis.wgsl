// Multiple importance sampling of two strategies with one sample each (Veach and Guibas 1995).

const MIS_BALANCE = 0u;
const MIS_POWER = 1u;

// The weight of a sample drawn with density `pdf` that the other strategy would have drawn with `other_pdf`.
// Both heuristics sum to 1 over the strategies; the power heuristic has exponent 2.
fn mis_weight(heuristic: u32, pdf: f32, other_pdf: f32) -> f32 {
    if pdf <= 0.0 {
        return 0.0;
    }
    // As a ratio, so that squares of large densities cannot overflow.
    let ratio = other_pdf / pdf;
    return 1.0 / (1.0 + select(ratio, ratio * ratio, heuristic == MIS_POWER));
}
