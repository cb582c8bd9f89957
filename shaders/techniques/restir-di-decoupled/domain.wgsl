// A domain: the surface that a pixel saw in a frame, as the target function needs it. Each frame packs its own for the next one,
// so that a look at a neighbour is 32 bytes in a row, not a triangle, its normals, a material and textures.
//
// MIS weights are right whatever functions they weigh domains by, as long as those are zero just where a domain could not have
// made a sample. So rounding costs no bias, and two flags tell surfaces apart whose supports differ.
// Source: Wyman and Panteleev 2021, section 9 (simplified materials).
#include "scene/surface.wgsl"
#include "scene/camera.wgsl"

struct DomainRecord {
    position: vec3f,
    normal: u32, // of shading
    geometric_normal: u32,
    metallic_alpha: u32,
    f0_f90: u32, // the lowest bit of each half is a flag: `transmits`, `is_black`
    albedo: f32, // below 0 where the pixel saw no surface
}

struct Domain {
    position: vec3f,
    normal: vec3f,
    geometric_normal: vec3f,
    wo: vec3f,
    albedo: f32, // luminance of the base colour
    metallic: f32,
    alpha: f32,
    f0: f32, // luminance
    f90: f32,
    transmits: bool, // scatters light from below, too
    is_black: bool, // scatters nothing
}

const NO_SURFACE = -1.0;

fn domain_of(surface: Surface) -> Domain {
    let bsdf = surface.bsdf;
    let lobes = max(max_component(bsdf.base_color), max_component(bsdf.f0));
    let others = max(max(bsdf.f90, bsdf.clearcoat), max_component(bsdf.sheen_color));
    return Domain(surface.position, surface.basis.normal, surface.geometric_normal, surface.wo, luminance(bsdf.base_color),
        bsdf.metallic, bsdf.alpha.x, luminance(bsdf.f0), bsdf.f90, bsdf.transmission > 0.0 && bsdf.metallic < 1.0,
        max(lobes, others) <= 0.0);
}

const FLAG_TRANSMITS = 0x1u;
const FLAG_BLACK = 0x10000u;

fn pack_domain_normal(normal: vec3f) -> u32 {
    return pack2x16snorm(octahedral_encode(normal));
}

fn pack_domain_record(domain: Domain) -> DomainRecord {
    let f0_f90 = pack2x16unorm(vec2f(domain.f0, domain.f90)) & ~(FLAG_TRANSMITS | FLAG_BLACK);
    let flags = select(0u, FLAG_TRANSMITS, domain.transmits) | select(0u, FLAG_BLACK, domain.is_black);
    return DomainRecord(domain.position, pack_domain_normal(domain.normal), pack_domain_normal(domain.geometric_normal),
        pack2x16unorm(vec2f(domain.metallic, domain.alpha)), f0_f90 | flags, domain.albedo);
}

fn record_without_surface() -> DomainRecord {
    return DomainRecord(vec3f(0.0), 0u, 0u, 0u, 0u, NO_SURFACE);
}

fn record_has_surface(record: DomainRecord) -> bool {
    return record.albedo >= 0.0;
}

// The domain of a pixel that has a surface, seen by the camera of its frame.
fn unpack_domain_record(record: DomainRecord, camera: CameraView) -> Domain {
    let metallic_alpha = unpack2x16unorm(record.metallic_alpha);
    let f0_f90 = unpack2x16unorm(record.f0_f90);
    return Domain(record.position, decode_normal(record.normal), decode_normal(record.geometric_normal),
        direction_to_camera(camera, record.position), record.albedo, metallic_alpha.x, metallic_alpha.y, f0_f90.x, f0_f90.y,
        (record.f0_f90 & FLAG_TRANSMITS) != 0u, (record.f0_f90 & FLAG_BLACK) != 0u);
}
