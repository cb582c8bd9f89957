//! What is rendered: meshes, instances, materials, lights, environment and cameras, knowing nothing of the GPU.
//!
//! A [`Scene`] comes from a glTF file ([`gltf`]) or is made by a procedure ([`builtin`]). [`FlatScene`] is the same
//! thing as plain arrays with a BVH, ready for upload.

pub mod alias;
pub mod area_light;
pub mod builtin;
pub mod bvh;
pub mod environment;
pub mod files;
pub mod flat;
pub mod gltf;
pub mod gpu_types;
pub mod intersect;
mod lights;
mod material;
pub mod obj;
pub mod octahedral;
pub mod random;
pub mod rig;
pub mod shapes;
pub mod sky;
pub mod stage;
pub mod tangents;

pub use flat::FlatScene;
pub use material::{Anisotropy, Clearcoat, Iridescence, Sheen, Specular, Transmission, Volume};
pub use rig::Rig;

use glam::{Mat4, Vec2, Vec3, Vec4};

/// Farther from the origin than this, in metres, products of three lengths no longer fit in f32: such positions are not
/// used.
const MAX_COORDINATE: f32 = 1e9;
/// Most triangles after instancing: 2 GiB of them, or 640 MiB where addresses are short.
pub const MAX_TRIANGLES: u64 = if cfg!(target_pointer_width = "32") { 5 << 20 } else { 1 << 24 };

/// A scene as a person thinks of it. Lengths in metres, Y up, right-handed; colours linear Rec. 709.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// A name for titles and reports.
    pub name: String,
    /// Triangle meshes in their own space.
    pub meshes: Vec<Mesh>,
    /// Placements of meshes in the world.
    pub instances: Vec<Instance>,
    /// Surface descriptions, referred to by [`Mesh::material`].
    pub materials: Vec<Material>,
    /// Images referred to by [`TextureRef::texture`].
    pub textures: Vec<Texture>,
    /// Point, spot and directional lights, in world space.
    pub lights: Vec<PunctualLight>,
    /// Light from infinitely far away, if any.
    pub environment: Option<Environment>,
    /// The sun, if any: seen in front of the environment, and turned with it.
    pub sun: Option<Sun>,
    /// Cameras of the file, in file order; may be empty.
    pub cameras: Vec<Camera>,
    /// What moves, and how; the default for a scene that stands still.
    pub rig: Rig,
    /// What was odd in the file: one line each, for a person. Never printed by this library.
    pub warnings: Vec<String>,
}

/// What three indices of a [`Mesh`] stand for. With the edges e1 and e2 from the first point to the others:
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shape {
    /// A triangle.
    #[default]
    Triangles,
    /// The parallelogram of the edges.
    Rectangle,
    /// The ellipse round the first point with the edges for half axes.
    Disk,
    /// The sphere round the first point through the second. It is seen from outside only.
    Sphere,
}

/// One indexed triangle list with one material.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    /// What the indices stand for. Only triangles take textures and alpha masks as one expects.
    pub shape: Shape,
    /// Object-space positions.
    pub positions: Vec<Vec3>,
    /// Object-space unit normals, one a position.
    pub normals: Vec<Vec3>,
    /// Tangents (xyz unit, w = +1 or -1 the bitangent's sign), one a position, or empty where no normal map needs them.
    pub tangents: Vec<Vec4>,
    /// Texture coordinates of each UV set (at most two), one a position each; may be empty.
    pub uvs: [Vec<Vec2>; 2],
    /// Linear RGBA vertex colours, one a position; empty means white.
    pub colors: Vec<Vec4>,
    /// Three indices a triangle.
    pub indices: Vec<u32>,
    /// Index into [`Scene::materials`].
    pub material: u32,
    /// How it changes its shape; the default for a mesh that never does.
    pub deformation: Deformation,
}

/// How a mesh changes its shape: by joints, by morph targets, or by both.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Deformation {
    /// What moves each position, one a position; empty for a mesh without a skin.
    pub influences: Vec<Influence>,
    /// Morph targets, each with one element a position.
    pub targets: Vec<Vec<rig::deform::Displacement>>,
    /// Whether the normals are those of the triangles, and so change with them.
    pub flat: bool,
}

/// The joints of a skin that move a vertex.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Influence {
    /// Indices of joints in their skin.
    pub joints: [u16; 4],
    /// How much each moves the vertex; they sum to 1.
    pub weights: [f32; 4],
}

/// One mesh placed in the world.
#[derive(Debug, Clone, Copy)]
pub struct Instance {
    /// Index into [`Scene::meshes`].
    pub mesh: u32,
    /// Object to world; any affine matrix (a negative determinant mirrors the mesh but keeps its front the front).
    pub transform: Mat4,
}

/// What to do with the alpha of the base colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored.
    Opaque,
    /// The surface exists where alpha is at least this cutoff.
    Mask(f32),
}

/// glTF 2.0 metallic-roughness material with its extensions (`docs/materials.md`).
#[derive(Debug, Clone)]
pub struct Material {
    /// For reports.
    pub name: String,
    /// Linear base colour and alpha.
    pub base_color: Vec4,
    /// 0 dielectric to 1 metal.
    pub metallic: f32,
    /// Perceptual roughness; GGX alpha is its square.
    pub roughness: f32,
    /// Emitted radiance (W / (sr m^2) in the file's units), already multiplied by the emissive strength.
    pub emissive: Vec3,
    /// Multiplies xy of the normal map.
    pub normal_scale: f32,
    /// Alpha handling.
    pub alpha: AlphaMode,
    /// Whether the back is a surface too (and emits, where emissive).
    pub double_sided: bool,
    /// sRGB base colour and linear alpha.
    pub base_color_texture: Option<TextureRef>,
    /// Linear: green roughness, blue metallic.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Linear tangent-space normals.
    pub normal_texture: Option<TextureRef>,
    /// sRGB emission.
    pub emissive_texture: Option<TextureRef>,
    /// KHR_materials_unlit: the base colour is shown as it is and nothing is reflected.
    pub unlit: bool,
    /// KHR_materials_ior: index of refraction of the dielectric, at least 1; or 0, which reflects everything at any angle.
    pub ior: f32,
    /// KHR_materials_dispersion: 20 over the Abbe number; 0 for none.
    pub dispersion: f32,
    /// KHR_materials_specular.
    pub specular: Specular,
    /// KHR_materials_transmission.
    pub transmission: Transmission,
    /// KHR_materials_volume; without it a transmissive surface is a thin wall.
    pub volume: Option<Volume>,
    /// KHR_materials_clearcoat.
    pub clearcoat: Clearcoat,
    /// KHR_materials_sheen.
    pub sheen: Sheen,
    /// KHR_materials_anisotropy.
    pub anisotropy: Anisotropy,
    /// KHR_materials_iridescence.
    pub iridescence: Iridescence,
}

impl Material {
    /// Emitted radiance, W/(m² sr), linear Rec. 709: an unlit surface shines by its base colour, and is no light.
    pub fn emitted(&self) -> Vec3 {
        if self.unlit { Vec3::ZERO } else { self.emissive }
    }

    /// Whether rays pass through the surface into a medium below it. Such a surface has two sides, whatever
    /// `double_sided` says.
    pub fn bounds_a_medium(&self) -> bool {
        self.volume.is_some() && self.transmission.factor > 0.0
    }

    /// Whether the back is a surface too.
    pub fn is_two_sided(&self) -> bool {
        self.double_sided || self.bounds_a_medium()
    }

    /// Every texture it reads.
    pub fn textures(&self) -> impl Iterator<Item = TextureRef> {
        [
            self.base_color_texture,
            self.metallic_roughness_texture,
            self.normal_texture,
            self.emissive_texture,
            self.specular.texture,
            self.specular.color_texture,
            self.transmission.texture,
            self.clearcoat.texture,
            self.clearcoat.roughness_texture,
            self.clearcoat.normal_texture,
            self.sheen.color_texture,
            self.sheen.roughness_texture,
            self.anisotropy.texture,
            self.iridescence.texture,
            self.iridescence.thickness_texture,
        ]
        .into_iter()
        .flatten()
    }

    /// The texture that a mesh's tangents are for: the first that lives in tangent space.
    pub fn tangent_texture(&self) -> Option<TextureRef> {
        self.normal_texture.or(self.clearcoat.normal_texture).or(self.anisotropy.texture)
    }
}

impl Default for Material {
    fn default() -> Self {
        Material {
            name: String::new(),
            base_color: Vec4::ONE,
            metallic: 1.0,
            roughness: 1.0,
            emissive: Vec3::ZERO,
            normal_scale: 1.0,
            alpha: AlphaMode::Opaque,
            double_sided: false,
            base_color_texture: None,
            metallic_roughness_texture: None,
            normal_texture: None,
            emissive_texture: None,
            unlit: false,
            ior: 1.5,
            dispersion: 0.0,
            specular: Specular::default(),
            transmission: Transmission::default(),
            volume: None,
            clearcoat: Clearcoat::default(),
            sheen: Sheen::default(),
            anisotropy: Anisotropy::default(),
            iridescence: Iridescence::default(),
        }
    }
}

/// How a material reads a texture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TextureRef {
    /// Index into [`Scene::textures`].
    pub texture: u32,
    /// Which UV set (0 or 1).
    pub uv_set: u32,
    /// KHR_texture_transform: translation in UV units.
    pub offset: Vec2,
    /// KHR_texture_transform: rotation in radians, counter-clockwise as the extension defines it.
    pub rotation: f32,
    /// KHR_texture_transform: scale.
    pub scale: Vec2,
}

/// How texture coordinates outside [0, 1] are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wrap {
    /// Tile.
    Repeat,
    /// Tile, every other tile mirrored.
    Mirror,
    /// Hold the edge.
    Clamp,
}

/// An image and its sampler.
#[derive(Debug, Clone)]
pub struct Texture {
    /// For reports.
    pub name: String,
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// RGBA8, row-major from the top, as stored in the file (not decoded from sRGB). Shared, for glTF textures may share an image.
    pub pixels: std::sync::Arc<Vec<u8>>,
    /// Wrapping along u and v.
    pub wrap: [Wrap; 2],
    /// Whether to interpolate (else nearest).
    pub linear_filter: bool,
}

/// A light without extent (KHR_lights_punctual).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PunctualLight {
    /// Point, spot or directional.
    pub kind: PunctualKind,
    /// World position (unused by directional lights).
    pub position: Vec3,
    /// World unit direction in which the light shines (unused by point lights).
    pub direction: Vec3,
    /// Linear colour times intensity: candela for point and spot, lux for directional.
    pub intensity: Vec3,
    /// Distance beyond which the light has no effect, in metres; infinite if none was given.
    pub range: f32,
}

/// The kinds of [`PunctualLight`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PunctualKind {
    /// Shines everywhere from a point.
    Point,
    /// Shines in a cone.
    Spot {
        /// Angle from the axis at which falloff begins, radians.
        inner: f32,
        /// Angle from the axis at which it ends, radians.
        outer: f32,
    },
    /// Shines from infinitely far away along one direction.
    Directional,
}

/// Light from infinitely far away: an equirectangular map (see `docs/conventions.md`).
#[derive(Debug, Clone)]
pub struct Environment {
    /// Width in texels; 1 for an even sky.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// Linear radiance RGB, row-major, the top row looks up (+Y).
    pub pixels: Vec<[f32; 3]>,
}

impl Environment {
    /// The same radiance from everywhere.
    pub fn even(radiance: Vec3) -> Self {
        Environment { width: 1, height: 1, pixels: vec![radiance.to_array()] }
    }
}

/// A disk of even radiance, infinitely far away.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sun {
    /// Unit direction towards its centre.
    pub direction: Vec3,
    /// Irradiance of a surface that faces it, linear Rec. 709.
    pub irradiance: Vec3,
    /// Half the angle under which it is seen, in radians, at most a right angle.
    pub angular_radius: f32,
}

impl Sun {
    /// 1 - cos(angular radius).
    pub(crate) fn height(&self) -> f64 {
        2.0 * (0.5 * f64::from(self.angular_radius)).sin().powi(2)
    }

    /// Its radiance: irradiance over projected solid angle, pi sin^2 of the angular radius.
    pub fn radiance(&self) -> Vec3 {
        let sin = f64::from(self.angular_radius).sin();
        (self.irradiance.as_dvec3() / (std::f64::consts::PI * sin * sin)).as_vec3()
    }
}

/// A camera in the world: looks along -Z of its node, Y up, as glTF cameras do.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// For menus and `--camera NAME`.
    pub name: String,
    /// World position of the eye.
    pub position: Vec3,
    /// Unit direction of view.
    pub forward: Vec3,
    /// Unit up direction, orthogonal to `forward`.
    pub up: Vec3,
    /// How it projects.
    pub projection: Projection,
}

/// How a [`Camera`] projects. The aspect ratio is always the picture's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// Vertical field of view in radians.
    Perspective {
        /// Full vertical angle.
        vertical_fov: f32,
    },
    /// Half the height of the view volume in metres.
    Orthographic {
        /// Half height.
        half_height: f32,
    },
}

impl Camera {
    /// A perspective camera at `position` that looks at `target` with +Y up (or +Z where it looks straight up or down).
    pub fn look_at(name: &str, position: Vec3, target: Vec3, vertical_fov: f32) -> Self {
        let forward = (target - position).try_normalize().unwrap_or(Vec3::NEG_Z);
        let reference = if forward.y.abs() > 0.9999 { Vec3::Z } else { Vec3::Y };
        let right = forward.cross(reference).normalize();
        Camera {
            name: name.to_owned(),
            position,
            forward,
            up: right.cross(forward),
            projection: Projection::Perspective { vertical_fov },
        }
    }

    /// This camera on a node: it looks along the node's -Z with +Y up, made orthonormal. None where the node's transform
    /// leaves no such pair.
    pub fn at(&self, to_world: &Mat4) -> Option<Self> {
        let forward = to_world.transform_vector3(Vec3::NEG_Z).try_normalize()?;
        let up = to_world.transform_vector3(Vec3::Y).try_normalize()?;
        let up = up.reject_from_normalized(forward).try_normalize()?;
        Some(Camera { position: to_world.w_axis.truncate(), forward, up, ..self.clone() })
    }
}

impl PunctualLight {
    /// This light on a node: it shines along the node's -Z. None where the node's transform leaves no direction and the
    /// light needs one. The node's scale changes neither intensity nor range.
    pub fn at(&self, to_world: &Mat4) -> Option<Self> {
        let direction = to_world.transform_vector3(Vec3::NEG_Z).try_normalize();
        let direction =
            if self.kind == PunctualKind::Point { Some(direction.unwrap_or(Vec3::NEG_Z)) } else { direction };
        Some(PunctualLight { position: to_world.w_axis.truncate(), direction: direction?, ..*self })
    }
}
