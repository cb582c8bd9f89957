// What test kernels share: one evaluation an invocation, words in and words out (bits, so that no driver canonicalises
// a NaN or flushes a denormal on the way). The Rust twins are in tests/support/mod.rs.

struct TestInput {
    a: vec4u,
    b: vec4u,
    c: vec4u,
    d: vec4u,
}

struct TestOutput {
    a: vec4u,
    b: vec4u,
}

struct TestRun {
    operation: u32,
    count: u32,
}

@group(1) @binding(0) var<uniform> test_run: TestRun;
@group(1) @binding(1) var<storage, read> test_inputs: array<TestInput>;
@group(1) @binding(2) var<storage, read_write> test_outputs: array<TestOutput>;

fn float(bits: vec4u) -> vec4f {
    return bitcast<vec4f>(bits);
}

fn bits(value: vec4f) -> vec4u {
    return bitcast<vec4u>(value);
}

fn bits_3(value: vec3f, w: f32) -> vec4u {
    return bitcast<vec4u>(vec4f(value, w));
}
