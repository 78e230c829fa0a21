@group(0) @binding(0) var gbuffer_0: texture_2d<f32>;

@fragment
fn light(@builtin(position) position: vec4f) -> @location(0) vec4f {
    return textureLoad(gbuffer_0, vec2i(position.xy), 0);
}
