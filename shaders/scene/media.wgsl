// Media that surfaces bound (KHR_materials_volume): homogeneous, absorbing, not scattering.
//
// A path keeps the media that it is in, innermost first, as materials whose boundary it has entered and not left: at most
// four, the outermost forgotten first. Boundaries should not cross each other. Where they do, the medium that was entered
// last is the one that counts, and leaving another changes nothing (glTF has no priorities of media, as Schmidt and Budge
// 2002 use). A path starts in air.
#include "scene/surface.wgsl"

fn media_none() -> vec4u {
    return vec4u(NONE);
}

fn media_without(media: vec4u, medium: u32) -> vec4u {
    if media.x == medium {
        return vec4u(media.yzw, NONE);
    }
    if media.y == medium {
        return vec4u(media.x, media.zw, NONE);
    }
    if media.z == medium {
        return vec4u(media.xy, media.w, NONE);
    }
    return vec4u(media.xyz, select(media.w, NONE, media.w == medium));
}

// The media after a path has gone on from the surface along wi.
fn media_after(media: vec4u, surface: Surface, wi: vec3f) -> vec4u {
    if !scene_has_volumes || surface.boundary == NONE || above_surface(surface, wi) {
        return media;
    }
    if surface.is_front {
        return vec4u(surface.boundary, media.xyz);
    }
    return media_without(media, surface.boundary);
}

// Tells a surface which media meet at it. `channel` is the colour that the path carries, or ALL_CHANNELS.
fn surface_meets(surface: ptr<function, Surface>, media: vec4u, channel: u32) {
    if !scene_has_volumes {
        return;
    }
    let own = (*surface).boundary;
    let is_known = any(media == vec4u(own));
    // From inside a boundary that was never entered (a camera in a medium), that medium lies above.
    let above = select(media.x, own, !(*surface).is_front && own != NONE && !is_known);
    var below = above;
    if own != NONE {
        below = own;
        if !(*surface).is_front {
            below = media_without(media, own).x;
        }
    }
    surface_set_media(surface, above, below, channel);
}
