// The flags are 5: the coat is off, so that its texture goes too, and the emission is on.
// facts: fixed material.flags 5
// expect: 1 candidates
struct Material { flags: u32, tint: vec3f }
@group(0) @binding(0) var<uniform> material: Material;
@group(0) @binding(1) var coat_texture: texture_2d<f32>;
@group(0) @binding(2) var surface_sampler: sampler;
@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) glow: f32) -> @location(0) vec4f {
    let coat = textureSample(coat_texture, surface_sampler, uv).rgb;
    var colour = material.tint;
    if (material.flags & 2u) != 0u {
        colour *= coat;
    }
    if (material.flags & 4u) != 0u {
        colour += glow;
    }
    return vec4f(colour, 1.0);
}
