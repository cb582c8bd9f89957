// What is counted: rays are cleared every frame, what was left out when the film starts again. Rust twin: src/film/mod.rs.

struct Counters {
    rays: atomic<u32>,
    nan: atomic<u32>,
    infinite: atomic<u32>,
    padding: u32,
    // Of each pixel, in rows, where pixels are counted: rays, nodes of the BVH, rejected neighbours. Cleared every frame.
    pixel: array<vec4u>,
}
