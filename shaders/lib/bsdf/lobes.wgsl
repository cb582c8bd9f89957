// The lobes a surface scatters by, and which of them a scene has. Lobes are bits, so that a set of them is a mask: every
// function of a BSDF takes the mask it is asked about (dissertation 004, chapter 6: paths are shifted lobe by lobe).

const LOBE_DIFFUSE = 1u;
const LOBE_SPECULAR = 2u; // GGX reflection of the base, dielectric and metal
const LOBE_TRANSMISSION = 4u; // GGX transmission, thin-walled or refractive
const LOBE_SHEEN = 8u;
const LOBE_CLEARCOAT = 16u;
const LOBE_ALL = 31u;

// Fixed when a pipeline is made, like all `scene_has_` overrides (scene/bindings.wgsl).
override scene_has_transmission: bool = true;
override scene_has_sheen: bool = true;
override scene_has_clearcoat: bool = true;
override scene_has_iridescence: bool = true;

// Settings rather than properties of a scene (`render.energy_compensation`, `render.conserving_mix`), but fixed with the
// pipeline for the same reason.
override energy_compensation: bool = false;
override conserving_mix: bool = false;
