// Records that do not fit in the storage buffers of a stage, and on software adapters nodes and triangles, too: each lies in a
// data texture, texel after texel, row after row (src/gpu/data_texture.rs). A loader reads whole records; what a caller does not use, compilers leave out.
#include "scene/bindings.wgsl"

// Triangles in `triangles`; the others are in `triangles_rest`. As in src/gpu_scene/walked.rs.
const FIRST_TRIANGLES = 2796202u; // 128 MiB of them

const DATA_ROW_BITS = 13u; // texels of a row: 8192

fn data_texel(index: u32) -> vec2u {
    if !scene_has_data_rows {
        return vec2u(index, 0u);
    }
    return vec2u(index & ((1u << DATA_ROW_BITS) - 1u), index >> DATA_ROW_BITS);
}

// Where a node's boxes lie, and how they are written down; in software its children, too.
struct NodeRecord {
    grid: vec4u,
    planes_0: vec4u,
    planes_1: vec4u,
    children: vec4u,
}

// Four texels a node, which a row holds in full.
fn node_texel(node: u32, texel: u32) -> vec4u {
    let first = data_texel(node * 4u);
    return textureLoad(node_texels, first + vec2u(texel, 0u), 0);
}

fn load_node(node: u32) -> NodeRecord {
    if is_software {
        return NodeRecord(node_texel(node, 0u), node_texel(node, 1u), node_texel(node, 2u), node_texel(node, 3u));
    }
    return NodeRecord(nodes[node].grid, nodes[node].planes_0, nodes[node].planes_1, vec4u(0u));
}

// The reference to child `entry & 3` of node `entry >> 2`; not asked for in software, where a node brings its children.
fn load_child(entry: u32) -> u32 {
    return nodes[entry >> 2u].children[entry & 3u];
}

fn triangle_texel(triangle: u32, texel: u32) -> vec4u {
    return textureLoad(triangle_texels, data_texel(triangle * 3u + texel), 0);
}

fn load_triangle(index: u32) -> Triangle {
    if is_software {
        let a = triangle_texel(index, 0u);
        let b = triangle_texel(index, 1u);
        let c = triangle_texel(index, 2u);
        return Triangle(bitcast<vec3f>(a.xyz), a.w, bitcast<vec3f>(b.xyz), b.w, bitcast<vec3f>(c.xyz), c.w);
    }
    if scene_has_many_triangles && index >= FIRST_TRIANGLES {
        return triangles_rest[index - FIRST_TRIANGLES];
    }
    return triangles[index];
}

fn attribute_texel(triangle: u32, texel: u32) -> vec4u {
    return textureLoad(attributes, data_texel(triangle * 5u + texel), 0);
}

// The corners' normals, and in w their tangents_01.
fn load_normals(triangle: u32) -> vec4u {
    return attribute_texel(triangle, 3u);
}

// The corners' colours, and in w their tangent_2.
fn load_colors(triangle: u32) -> vec4u {
    return attribute_texel(triangle, 4u);
}

fn load_attributes(triangle: u32) -> TriangleAttributes {
    let normals = load_normals(triangle);
    let colors = load_colors(triangle);
    return TriangleAttributes(
        bitcast<vec4f>(attribute_texel(triangle, 0u)),
        bitcast<vec4f>(attribute_texel(triangle, 1u)),
        bitcast<vec4f>(attribute_texel(triangle, 2u)),
        normals.xyz, normals.w, colors.xyz, colors.w);
}

fn instance_texel(instance: u32, texel: u32) -> vec4u {
    return textureLoad(instances, data_texel(instance * 7u + texel), 0);
}

// `row` of the matrices of an instance: 0 to 2 world to object, 3 to 5 object to world.
fn instance_row(instance: u32, row: u32) -> vec4f {
    return bitcast<vec4f>(instance_texel(instance, row));
}

const TO_OBJECT = 0u;
const TO_WORLD = 3u;

// A point through one of the matrices.
fn instance_point(instance: u32, matrix: u32, p: vec3f) -> vec3f {
    let v = vec4f(p, 1.0);
    return vec3f(dot(instance_row(instance, matrix), v), dot(instance_row(instance, matrix + 1u), v),
        dot(instance_row(instance, matrix + 2u), v));
}

// A vector through one of the matrices.
fn instance_vector(instance: u32, matrix: u32, v: vec3f) -> vec3f {
    return vec3f(dot(instance_row(instance, matrix).xyz, v), dot(instance_row(instance, matrix + 1u).xyz, v),
        dot(instance_row(instance, matrix + 2u).xyz, v));
}

// A normal from object to world, not normalised: through the transpose of the inverse, so that a mirror keeps the front.
fn instance_normal(instance: u32, n: vec3f) -> vec3f {
    return instance_row(instance, TO_OBJECT).xyz * n.x + instance_row(instance, TO_OBJECT + 1u).xyz * n.y
        + instance_row(instance, TO_OBJECT + 2u).xyz * n.z;
}

fn instance_first_light(instance: u32) -> u32 {
    return instance_texel(instance, 6u).y;
}

// An instance of this frame as it was in the previous one.
fn previous_instance(instance: u32) -> u32 {
    return select(instance, instance + frame.instance_count, scene_has_motion);
}

// A triangle of an instance of this frame as it was in the previous one.
fn previous_triangle(instance: u32, triangle: u32) -> u32 {
    if !scene_has_motion {
        return triangle;
    }
    return triangle + instance_texel(instance, 6u).z;
}

fn material_texel(material: u32, texel: u32) -> vec4u {
    return textureLoad(materials, data_texel(material * 11u + texel), 0);
}

fn load_texture_slot(material: u32, texel: u32) -> TextureSlot {
    if !scene_has_textures {
        return TextureSlot();
    }
    let u = material_texel(material, texel);
    let v = material_texel(material, texel + 1u);
    return TextureSlot(bitcast<vec3f>(u.xyz), u.w, bitcast<vec3f>(v.xyz), v.w);
}

fn load_material(material: u32) -> Material {
    let factors = material_texel(material, 2u);
    return Material(
        bitcast<vec4f>(material_texel(material, 0u)),
        load_emissive_factor(material), bitcast<f32>(material_texel(material, 1u).w),
        bitcast<f32>(factors.x), bitcast<f32>(factors.y), bitcast<f32>(factors.z), factors.w,
        load_texture_slot(material, 3u), load_texture_slot(material, 5u), load_texture_slot(material, 7u),
        load_emissive_slot(material));
}

// Lights need no more of a material than these two.
fn load_emissive_factor(material: u32) -> vec3f {
    return bitcast<vec3f>(material_texel(material, 1u).xyz);
}

fn load_emissive_slot(material: u32) -> TextureSlot {
    return load_texture_slot(material, 9u);
}
