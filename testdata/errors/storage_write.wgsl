@group(0) @binding(0) var<storage, read_write> hits: array<atomic<u32>>;

@fragment
fn fs_main(@builtin(position) at: vec4f) -> @location(0) vec4f {
    atomicAdd(&hits[u32(at.x)], 1u);
    return vec4f(1.0);
}
