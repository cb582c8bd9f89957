// What surrounds the scene may turn about +Y, counter-clockwise as seen from above. `turn` is (cosine, sine).
#include "scene/bindings.wgsl"

fn turn_to_world(v: vec3f, turn: vec2f) -> vec3f {
    return vec3f(turn.x * v.x + turn.y * v.z, v.y, turn.x * v.z - turn.y * v.x);
}

fn turn_to_map(v: vec3f, turn: vec2f) -> vec3f {
    return turn_to_world(v, vec2f(turn.x, -turn.y));
}

fn environment_turn(previous: bool) -> vec2f {
    return select(frame.environment_turn, frame.previous_environment_turn, previous);
}
