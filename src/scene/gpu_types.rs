//! The structs that shaders read, each with a WGSL twin of the same name whose layout a test compares.
//!
//! `gpu_struct!` registers a struct's size and field offsets in its `LAYOUT`; [`crate::gpu_layouts`] lists them all.

use glam::{Mat4, Vec3, Vec4};

/// Size and field offsets of one Rust struct with a WGSL twin.
#[derive(Debug, Clone, Copy)]
pub struct Layout {
    /// The name of both structs.
    pub name: &'static str,
    /// Size in bytes.
    pub size: usize,
    /// (field, byte offset), in order.
    pub fields: &'static [(&'static str, usize)],
}

/// Declares a `repr(C)` Pod struct together with its [`Layout`].
#[macro_export]
macro_rules! gpu_struct {
    ($(#[$meta:meta])* pub struct $name:ident { $($(#[$field_meta:meta])* pub $field:ident : $ty:ty,)* }) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        pub struct $name { $($(#[$field_meta])* pub $field: $ty,)* }
        impl $name {
            /// Size and offsets, compared with the WGSL twin by a test.
            pub const LAYOUT: $crate::scene::gpu_types::Layout = $crate::scene::gpu_types::Layout {
                name: stringify!($name),
                size: std::mem::size_of::<$name>(),
                fields: &[$((stringify!($field), std::mem::offset_of!($name, $field)),)*],
            };
        }
    };
}

/// No light, no texture, no hit.
pub const NONE: u32 = u32::MAX;

gpu_struct! {
/// One node of the flattened binary BVH: 32 bytes. The two children of an inner node are adjacent.
pub struct BvhNode {
    /// Lower corner of the box.
    pub min: Vec3,
    /// Inner node: index of the left child (the right one follows). Leaf: first triangle.
    pub first: u32,
    /// Upper corner of the box.
    pub max: Vec3,
    /// Number of triangles; 0 for an inner node.
    pub count: u32,
}
}

/// [`Triangle::flags`]: the back is a surface too.
pub const TRIANGLE_DOUBLE_SIDED: u32 = 1;
/// [`Triangle::flags`]: alpha has to be tested.
pub const TRIANGLE_ALPHA_MASK: u32 = 2;
/// [`Triangle::flags`]: the corners have tangents.
pub const TRIANGLE_TANGENTS: u32 = 4;

gpu_struct! {
/// What traversal reads of one triangle: 48 bytes, in the space of its bottom-level mesh. Wound so that
/// `cross(p1 - p0, p2 - p0)` points out of the front.
pub struct Triangle {
    /// First corner.
    pub p0: Vec3,
    /// `TRIANGLE_*` bits.
    pub flags: u32,
    /// Second corner.
    pub p1: Vec3,
    /// Index of the material.
    pub material: u32,
    /// Third corner.
    pub p2: Vec3,
    /// Which of its instance's lights this triangle is ([`Instance::first_light`] is number 0), or [`NONE`].
    pub light: u32,
}
}

/// [`TriangleAttributes::tangent_2`]: the bitangent of corner i is negative if bit `BITANGENT_SHIFT + i` is set.
pub const BITANGENT_SHIFT: u32 = 16;

gpu_struct! {
/// What shading reads of one triangle besides its [`Triangle`]: 80 bytes, five texels of the data texture `attributes`.
pub struct TriangleAttributes {
    /// UV set 0 of the corners 0 (xy) and 1 (zw).
    pub uv_a: Vec4,
    /// UV set 0 of corner 2 (xy), UV set 1 of corner 0 (zw).
    pub uv_b: Vec4,
    /// UV set 1 of the corners 1 (xy) and 2 (zw).
    pub uv_c: Vec4,
    /// Shading normals of the corners, octahedral, 2 x 16 bit snorm.
    pub normals: [u32; 3],
    /// Tangent angles of the corners 0 (low half) and 1 (high half): 65536 steps a turn, in the frame that
    /// `orthonormal_basis` builds round the corner's decoded normal.
    pub tangents_01: u32,
    /// Linear vertex colours of the corners, RGBA8 unorm; white is `0xffffffff`.
    pub colors: [u32; 3],
    /// Low half: tangent angle of corner 2. From bit `BITANGENT_SHIFT` on: signs of the bitangents.
    pub tangent_2: u32,
}
}

gpu_struct! {
/// A bottom-level mesh placed in the world: 112 bytes, seven texels of the data texture `instances`. In a scene that moves
/// each has a twin, as many places after it as there are instances: the same as it was in the previous frame.
///
/// The rows of a matrix M are such that component i of `M p` is `dot(row_i, (p, 1))`.
pub struct Instance {
    /// World to object.
    pub to_object: [Vec4; 3],
    /// Object to world.
    pub to_world: [Vec4; 3],
    /// Index of the bottom level's root in `nodes`.
    pub root: u32,
    /// Index in `lights` of the first of its emissive triangles.
    pub first_light: u32,
    /// What to add, modulo 2^32, to a triangle's index for the triangle as it was in the previous frame; 0 where the mesh
    /// does not change its shape.
    pub previous_triangles: u32,
    /// Unused.
    pub padding: u32,
}
}

gpu_struct! {
/// How a material reads one texture: 48 bytes. `width == 0` means no texture.
pub struct TextureSlot {
    /// First two rows of the UV transform: u' = dot(row_u.xyz, (u, v, 1)).
    pub row_u: Vec3,
    /// Packed: bit 0 UV set, bit 1 sRGB, bit 2 linear filter, bits 4-5 wrap u, bits 6-7 wrap v (0 repeat, 1 mirror, 2 clamp).
    pub flags: u32,
    /// v' = dot(row_v.xyz, (u, v, 1)).
    pub row_v: Vec3,
    /// Layer of the atlas.
    pub layer: u32,
    /// First texel in the layer: x.
    pub x: u32,
    /// First texel in the layer: y.
    pub y: u32,
    /// Width in texels; 0 for no texture.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
}
}

gpu_struct! {
/// glTF metallic-roughness material: 240 bytes, fifteen texels of the data texture `materials`, read by
/// `load_material`.
pub struct Material {
    /// Linear base colour and alpha.
    pub base_color: Vec4,
    /// Emitted radiance, strength included.
    pub emissive: Vec3,
    /// Metallic factor.
    pub metallic: f32,
    /// Roughness factor.
    pub roughness: f32,
    /// Normal-map scale.
    pub normal_scale: f32,
    /// Alpha cutoff (only read for masked triangles).
    pub alpha_cutoff: f32,
    /// 1 if double-sided.
    pub double_sided: u32,
    /// Base colour, sRGB.
    pub base_color_texture: TextureSlot,
    /// Green roughness, blue metallic.
    pub metallic_roughness_texture: TextureSlot,
    /// Tangent-space normals.
    pub normal_texture: TextureSlot,
    /// Emission, sRGB.
    pub emissive_texture: TextureSlot,
}
}

/// [`Light::kind`]: an emissive triangle.
pub const LIGHT_TRIANGLE: u32 = 0;
/// [`Light::kind`]: a point light.
pub const LIGHT_POINT: u32 = 1;
/// [`Light::kind`]: a spot light.
pub const LIGHT_SPOT: u32 = 2;
/// [`Light::kind`]: a directional light.
pub const LIGHT_DIRECTIONAL: u32 = 3;
/// [`Light::kind`]: the environment.
pub const LIGHT_ENVIRONMENT: u32 = 4;

gpu_struct! {
/// One light with its entry in the alias table: 80 bytes. In a scene that moves each punctual light has a twin after all
/// lights: the same as it was in the previous frame.
pub struct Light {
    /// World position of a point or spot light.
    pub position: Vec3,
    /// `LIGHT_*`.
    pub kind: u32,
    /// Unit direction in which a spot or directional light shines.
    pub direction: Vec3,
    /// Range in metres; 0 for unlimited.
    pub range: f32,
    /// Candela (point, spot) or lux (directional), linear Rec. 709.
    pub intensity: Vec3,
    /// cos of the spot's outer angle.
    pub cos_outer: f32,
    /// cos of the spot's inner angle.
    pub cos_inner: f32,
    /// Probability of choosing this light, p(light).
    pub pmf: f32,
    /// Alias table: keep this bucket's own light below this threshold.
    pub alias_threshold: f32,
    /// Alias table: the other light of this bucket.
    pub alias_light: u32,
    /// Index of the triangle of an emissive triangle.
    pub triangle: u32,
    /// Index of the instance of an emissive triangle.
    pub instance: u32,
    /// Index of this light as it was in the previous frame: its twin, or itself. Not read of emissive triangles.
    pub previous: u32,
    /// Unused.
    pub padding: u32,
}
}

/// One texel of the environment's alias table: `[threshold bits, alias, pdf bits, 0]` in an `Rgba32Uint` texture.
/// `pdf` is per solid angle.
pub type EnvironmentTexel = [u32; 4];

gpu_struct! {
/// A camera as the shaders need it: 128 bytes.
pub struct CameraView {
    /// World to clip, for reprojection: x, y and w, for z is not used.
    pub world_to_clip: Mat4,
    /// Eye (perspective) or centre of the image plane (orthographic).
    pub position: Vec3,
    /// 0 perspective, 1 orthographic.
    pub orthographic: u32,
    /// Half the picture's width along its right axis: tan(fov_y / 2) x aspect, or half width.
    pub right: Vec3,
    /// Unused.
    pub padding_0: f32,
    /// Half the picture's height along its up axis.
    pub up: Vec3,
    /// Unused.
    pub padding_1: f32,
    /// Unit direction of view.
    pub forward: Vec3,
    /// Unused.
    pub padding_2: f32,
}
}
