@group(0) @binding(0) var trace: texture_storage_2d<rgba8unorm, write>;

@fragment
fn fs_main(@builtin(position) at: vec4f) -> @location(0) vec4f {
    textureStore(trace, vec2i(at.xy), vec4f(1.0));
    return vec4f(1.0);
}
