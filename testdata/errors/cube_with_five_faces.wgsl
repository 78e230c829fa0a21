@group(0) @binding(0) var sky: texture_cube<f32>;
@group(0) @binding(1) var sky_sampler: sampler;

@fragment
fn fs_main(@location(0) normal: vec3f) -> @location(0) vec4f {
    return textureSample(sky, sky_sampler, normal);
}
