//! The structs that shaders read, each with a WGSL twin of the same name whose layout a test compares.
//!
//! `gpu_struct!` registers a struct's size and field offsets in its `LAYOUT`; [`crate::gpu_layouts`] lists them all.

use super::Shape;
use glam::{Mat4, Vec2, Vec3, Vec4, Vec4Swizzles};

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

/// [`Light::intensity`] of an emissive triangle that shines as its material says, and did so in the previous frame.
pub const FULL_POWER: Vec3 = Vec3::new(1.0, 1.0, 0.0);

/// No light, no texture, no hit.
pub const NONE: u32 = u32::MAX;

/// One node of a binary BVH: what is built, refitted and walked on the CPU. The two children of an inner node are adjacent.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
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

gpu_struct! {
/// One node of the BVH as shaders walk it: up to four children with boxes of 8 bits a plane, 64 bytes
/// (`crate::scene::bvh::wide`).
pub struct WideNode {
    /// Lower corner of the node's box (three f32), and the biased exponents of the steps of its grid along x, y, z (a byte
    /// each): a plane is at corner + step * byte.
    pub grid: [u32; 4],
    /// Bytes of the four children: lower planes along x, y and z, upper planes along x.
    pub planes_0: [u32; 4],
    /// Upper planes along y and z; the rest is unused.
    pub planes_1: [u32; 4],
    /// Inner child: its index. Leaf: `LEAF`, (items - 1) << 28, and the first triangle or instance.
    pub children: [u32; 4],
}
}

/// [`Triangle::flags`]: two bits from here on are the [`Shape`].
pub const SHAPE_SHIFT: u32 = 28;

impl Triangle {
    /// What the three points are.
    pub fn shape(&self) -> Shape {
        [Shape::Triangles, Shape::Rectangle, Shape::Disk, Shape::Sphere][(self.flags >> SHAPE_SHIFT & 3) as usize]
    }

    /// Low and high corner of the box round it.
    pub(crate) fn bounds(&self) -> [Vec3; 2] {
        let Triangle { p0, p1, p2, .. } = *self;
        let (e1, e2) = (p1 - p0, p2 - p0);
        // What arithmetic rounds must not stick out.
        let extended = |half: Vec3| {
            let half = half + 1e-6 * (half + p0.abs());
            [p0 - half, p0 + half]
        };
        match self.shape() {
            Shape::Triangles => [p0.min(p1).min(p2), p0.max(p1).max(p2)],
            Shape::Rectangle => {
                let p3 = p1 + e2;
                [p0.min(p1).min(p2).min(p3), p0.max(p1).max(p2).max(p3)]
            }
            Shape::Disk => extended((e1 * e1 + e2 * e2).map(f32::sqrt)),
            Shape::Sphere => extended(Vec3::splat(e1.length())),
        }
    }
}

impl TriangleAttributes {
    /// Texture coordinates of the corners in a UV set, 0 or 1.
    pub(crate) fn uvs(&self, set: usize) -> [Vec2; 3] {
        let TriangleAttributes { uv_a, uv_b, uv_c, .. } = self;
        if set == 0 { [uv_a.xy(), uv_a.zw(), uv_b.xy()] } else { [uv_b.zw(), uv_c.xy(), uv_c.zw()] }
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
    /// `TRIANGLE_*` bits, and the shape from bit [`SHAPE_SHIFT`] on.
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
/// How a material reads one texture: 32 bytes. [`TextureSlot::read`] says what is packed in `place` and `size`.
pub struct TextureSlot {
    /// First two rows of the UV transform: u' = dot(row_u.xyz, (u, v, 1)).
    pub row_u: Vec3,
    /// From the lowest bit: x / 8 and y / 8 (10 bits each), layer (8), array (2), UV set, 1 if there is a texture.
    pub place: u32,
    /// v' = dot(row_v.xyz, (u, v, 1)).
    pub row_v: Vec3,
    /// From the lowest bit: width - 1 and height - 1 (13 bits each), wrap u and wrap v (2 each: 0 repeat, 1 mirror,
    /// 2 clamp), sRGB, linear filter.
    pub size: u32,
}
}

/// What a [`TextureSlot`] says, unpacked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TextureRead {
    /// Which texture array, 0 to 3.
    pub array: u32,
    /// Layer of the array, 0 to 255.
    pub layer: u32,
    /// First texel in the layer: x and y, multiples of 8. In level k it is `origin >> k`.
    pub origin: [u32; 2],
    /// Width and height in texels, 1 to 8192. In level k `max(1, size >> k)`.
    pub size: [u32; 2],
    /// Which texture coordinates, 0 or 1.
    pub uv_set: u32,
    /// Whether RGB is encoded.
    pub srgb: bool,
    /// Whether level 0 is interpolated.
    pub linear_filter: bool,
    /// Along u and v: 0 repeat, 1 mirror, 2 clamp.
    pub wrap: [u32; 2],
}

impl TextureSlot {
    /// No texture: white.
    pub const NONE: Self = TextureSlot { row_u: Vec3::ZERO, place: 0, row_v: Vec3::ZERO, size: 0 };

    /// Packs a slot. Numbers that do not fit lose their high bits.
    pub fn new(row_u: Vec3, row_v: Vec3, read: &TextureRead) -> Self {
        let TextureRead { array, layer, origin: [x, y], size: [width, height], wrap: [wrap_u, wrap_v], .. } = *read;
        let place = ((x / 8) & 0x3ff)
            | ((y / 8) & 0x3ff) << 10
            | (layer & 0xff) << 20
            | (array & 3) << 28
            | (read.uv_set & 1) << 30
            | 1 << 31;
        let size = (width.wrapping_sub(1) & 0x1fff)
            | (height.wrapping_sub(1) & 0x1fff) << 13
            | (wrap_u & 3) << 26
            | (wrap_v & 3) << 28
            | u32::from(read.srgb) << 30
            | u32::from(read.linear_filter) << 31;
        TextureSlot { row_u, place, row_v, size }
    }

    /// Whether there is a texture.
    pub fn is_some(&self) -> bool {
        self.place >> 31 == 1
    }

    /// What the slot says, or nothing if there is no texture.
    pub fn read(&self) -> Option<TextureRead> {
        let bits = |word: u32, shift: u32, count: u32| (word >> shift) & ((1 << count) - 1);
        let TextureSlot { place, size, .. } = *self;
        self.is_some().then(|| TextureRead {
            array: bits(place, 28, 2),
            layer: bits(place, 20, 8),
            origin: [bits(place, 0, 10) * 8, bits(place, 10, 10) * 8],
            size: [bits(size, 0, 13) + 1, bits(size, 13, 13) + 1],
            uv_set: bits(place, 30, 1),
            srgb: bits(size, 30, 1) == 1,
            linear_filter: bits(size, 31, 1) == 1,
            wrap: [bits(size, 26, 2), bits(size, 28, 2)],
        })
    }
}

gpu_struct! {
/// glTF metallic-roughness material: 176 bytes, eleven texels of the data texture `materials`, read by
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

/// [`MaterialExtensions::flags`]: KHR_materials_unlit.
pub const MATERIAL_UNLIT: u32 = 1;
/// [`MaterialExtensions::flags`]: the surface bounds a medium (KHR_materials_volume).
pub const MATERIAL_VOLUME: u32 = 2;

gpu_struct! {
/// What glTF's extensions add to a [`Material`]: 464 bytes, 29 texels of the data texture `material_extensions`. A scene
/// that uses none has none.
pub struct MaterialExtensions {
    /// Multiplies the dielectric's reflectance at normal incidence.
    pub specular_color: Vec3,
    /// Strength of the dielectric's reflection.
    pub specular: f32,
    /// Absorption coefficient of the medium below, 1/m.
    pub absorption: Vec3,
    /// Share of light that passes through.
    pub transmission: f32,
    /// Sheen colour.
    pub sheen_color: Vec3,
    /// Sheen roughness.
    pub sheen_roughness: f32,
    /// Index of refraction; 0 for a perfect reflector.
    pub ior: f32,
    /// 20 over the Abbe number.
    pub dispersion: f32,
    /// Strength of the clearcoat.
    pub clearcoat: f32,
    /// Roughness of the clearcoat.
    pub clearcoat_roughness: f32,
    /// Cosine and sine of the anisotropy's rotation from the tangent.
    pub anisotropy_direction: Vec2,
    /// Strength of the anisotropy.
    pub anisotropy: f32,
    /// Normal-map scale of the clearcoat.
    pub clearcoat_normal_scale: f32,
    /// Strength of the thin film.
    pub iridescence: f32,
    /// Index of refraction of the film.
    pub film_ior: f32,
    /// Nanometres where the thickness texture is 0.
    pub film_thickness_minimum: f32,
    /// Nanometres where it is 1.
    pub film_thickness_maximum: f32,
    /// `MATERIAL_*` bits.
    pub flags: u32,
    /// Unused.
    pub padding_0: u32,
    /// Unused.
    pub padding_1: u32,
    /// Unused.
    pub padding_2: u32,
    /// Alpha: specular strength.
    pub specular_texture: TextureSlot,
    /// Specular colour, sRGB.
    pub specular_color_texture: TextureSlot,
    /// Red: transmission.
    pub transmission_texture: TextureSlot,
    /// Red: clearcoat.
    pub clearcoat_texture: TextureSlot,
    /// Green: clearcoat roughness.
    pub clearcoat_roughness_texture: TextureSlot,
    /// Tangent-space normals of the clearcoat.
    pub clearcoat_normal_texture: TextureSlot,
    /// Sheen colour, sRGB.
    pub sheen_color_texture: TextureSlot,
    /// Alpha: sheen roughness.
    pub sheen_roughness_texture: TextureSlot,
    /// Red and green a direction, blue the strength of the anisotropy.
    pub anisotropy_texture: TextureSlot,
    /// Red: strength of the film.
    pub iridescence_texture: TextureSlot,
    /// Green: thickness of the film.
    pub iridescence_thickness_texture: TextureSlot,
}
}

impl MaterialExtensions {
    /// Every texture slot, used or not.
    pub fn slots(&self) -> [&TextureSlot; 11] {
        [
            &self.specular_texture,
            &self.specular_color_texture,
            &self.transmission_texture,
            &self.clearcoat_texture,
            &self.clearcoat_roughness_texture,
            &self.clearcoat_normal_texture,
            &self.sheen_color_texture,
            &self.sheen_roughness_texture,
            &self.anisotropy_texture,
            &self.iridescence_texture,
            &self.iridescence_thickness_texture,
        ]
    }

    /// Every factor, for checks; the flags among them read as a number next to zero.
    pub fn factors(&self) -> &[f32] {
        bytemuck::cast_slice(&bytemuck::bytes_of(self)[..std::mem::offset_of!(MaterialExtensions, specular_texture)])
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
/// [`Light::kind`]: the sun.
pub const LIGHT_SUN: u32 = 5;

gpu_struct! {
/// One light with its entry in the alias table: 80 bytes. In a scene that moves each punctual light has a twin after all
/// lights: the same as it was in the previous frame.
pub struct Light {
    /// World position of a point or spot light.
    pub position: Vec3,
    /// `LIGHT_*`.
    pub kind: u32,
    /// Unit direction in which a spot, a directional light or the sun shines.
    pub direction: Vec3,
    /// Range in metres; 0 for unlimited.
    pub range: f32,
    /// Candela (point, spot), lux (directional) or radiance (sun), linear Rec. 709. Of an emissive triangle factors on its
    /// emission: x in this frame, y in the previous one.
    pub intensity: Vec3,
    /// cos of the spot's outer angle; 1 - cos of the sun's angular radius.
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
    /// Cumulative distribution, of 2^32: the probabilities of all lights before this one.
    pub cumulative: u32,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texture_slots_unpack_to_what_was_packed() {
        let least = TextureRead {
            array: 0,
            layer: 0,
            origin: [0, 0],
            size: [1, 1],
            uv_set: 0,
            srgb: false,
            linear_filter: false,
            wrap: [0, 0],
        };
        let most = TextureRead {
            array: 3,
            layer: 255,
            origin: [8184, 8184],
            size: [8192, 8192],
            uv_set: 1,
            srgb: true,
            linear_filter: true,
            wrap: [2, 2],
        };
        // Each field alone at its most, so that no two share a bit.
        let alone = [
            TextureRead { array: most.array, ..least },
            TextureRead { layer: most.layer, ..least },
            TextureRead { origin: [most.origin[0], 0], ..least },
            TextureRead { origin: [0, most.origin[1]], ..least },
            TextureRead { size: [most.size[0], 1], ..least },
            TextureRead { size: [1, most.size[1]], ..least },
            TextureRead { uv_set: 1, ..least },
            TextureRead { srgb: true, ..least },
            TextureRead { linear_filter: true, ..least },
            TextureRead { wrap: [2, 0], ..least },
            TextureRead { wrap: [0, 2], ..least },
        ];
        for read in alone.into_iter().chain([least, most]) {
            let slot = TextureSlot::new(Vec3::X, Vec3::Y, &read);
            assert_eq!(slot.read(), Some(read));
        }
        assert_eq!(TextureSlot::NONE.read(), None);
    }
}
