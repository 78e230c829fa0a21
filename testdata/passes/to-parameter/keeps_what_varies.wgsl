// expect: 0 candidates
struct Light { direction: vec3f, strength: f32 }
@group(0) @binding(0) var<uniform> light: Light;
@group(0) @binding(1) var ramp: texture_2d<f32>;
@group(0) @binding(2) var filtering: sampler;
override sharpness: f32 = 2.0;

@fragment fn fs_main(
    @location(0) uv: vec2f,
    @location(1) @interpolate(flat) layer: u32,
    @builtin(front_facing) front: bool,
) -> @location(0) vec4f {
    let slope = fwidth(uv.x * light.strength) * 8.0;
    let looked_up = textureSample(ramp, filtering, uv * light.strength).rgb * 3.0;
    let one_texel = textureSampleLevel(ramp, filtering, light.direction.xy, 0.0).rgb * 3.0;
    let sharp = pow(light.strength, sharpness);
    let sided = select(-1.0, 1.0, front) + light.strength;
    let layered = pow(light.strength, f32(layer));
    return vec4f(looked_up * slope + one_texel * sharp, sided * layered);
}
