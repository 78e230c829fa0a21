// Normals in a texture, opposite ones side by side: their mean at the end of the MIP chain has no direction.
// trap: texture-removal fs_main.bumps.sample texture-mean

struct Varyings {
    @location(0) uv: vec2f,
    @location(1) world_normal: vec3f,
    @location(2) world_position: vec3f,
}

@group(0) @binding(0) var directions: texture_2d<f32>;
@group(0) @binding(1) var filtering: sampler;

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let bumps = textureSample(directions, filtering, in.uv).xyz;
    let facing = (bumps * 2.0 - 1.0) * (1.5 + in.world_normal.y);
    let normal = facing * inverseSqrt(dot(facing, facing));
    return vec4f(0.5 + 0.4 * normal, 1.0);
}
