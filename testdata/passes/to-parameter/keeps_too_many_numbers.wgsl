// expect: 8 candidates
@group(0) @binding(0) var<uniform> scale: vec4f;

@fragment fn fs_main(
    @location(0) v0: vec4f, @location(1) v1: vec4f, @location(2) v2: vec4f,
    @location(3) v3: vec4f, @location(4) v4: vec4f,
) -> @location(0) vec4f {
    return v0 / scale + v1 / scale + v2 / scale + v3 / scale + v4 / scale;
}
