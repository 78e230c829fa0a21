// A variable is changed on the way to one side, and memory that may be written is read for the other: both are computed where
// they are. A derivative stays before a branch of which compilers do not see that it is the same for all fragments.
// expect: 0 candidates
struct Material { sheen: f32, coats: array<vec4f, 4> }
@group(0) @binding(0) var<uniform> material: Material;
@group(0) @binding(1) var<storage, read_write> seen: array<atomic<u32>>;
@fragment
fn fs_main(@location(0) cosine: f32, @location(1) uv: vec2f) -> @location(0) vec4f {
    var rim = cosine;
    for (var i = 0; i < 8; i += 1) { rim = sin(rim) + exp(rim); }
    let sheen = material.sheen * rim;
    let count = material.sheen * f32(atomicAdd(&seen[0], 1u));
    var edges = 0.0;
    for (var i = 0; i < 4; i += 1) {
        edges += material.coats[i].x * fwidth(uv.x * f32(i)) * fwidth(uv.y);
    }
    return vec4f(sheen, count, edges, 1.0);
}
