// Snow that lies from one day to the next.
// stiff: nothing

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

struct Season {
    snow: f32,
}

@group(0) @binding(0) var<uniform> season: Season;

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let covered = select(0.0, 1.0, season.snow > 0.7);
    return vec4f(vec3f(0.2 + 0.7 * covered), 1.0);
}
