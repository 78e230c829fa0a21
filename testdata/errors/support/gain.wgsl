// What `plain.wgsl` does not have: a uniform of its own.
@group(0) @binding(0) var<uniform> gain: f32;

@fragment
fn fs_main(@location(0) normal: vec3f) -> @location(0) vec4f {
    return vec4f(normal * gain, 1.0);
}
