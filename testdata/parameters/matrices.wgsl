// Matrices, arrays of vectors of three, lists whose length only the host knows, and names that Rust keeps.
struct Bone {
    turn: mat3x3f,
    at: vec3f,
}
struct Pose {
    count: i32,
    box: f32,
    dyn: vec2f,
    tilt: mat2x2f,
    edges: array<vec3f, 3>,
    bones: array<Bone>,
}
struct Object {
    model: mat4x4f,
    normal: mat3x3f,
    flat: mat4x3f,
    pairs: array<mat3x3f, 2>,
}
@group(0) @binding(0) var<uniform> object: Object;
@group(0) @binding(1) var<storage, read> pose: Pose;
@group(0) @binding(2) var<storage, read> weights: array<f32>;

const corners = array<vec2f, 4>(vec2f(-1.0, -1.0), vec2f(1.0, -1.0), vec2f(-1.0, 1.0), vec2f(1.0, 1.0));

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let at = pose.count;
    let bone = pose.bones[at];
    let spread = object.normal * bone.turn;
    let turned = spread * pose.edges[at + 1] + bone.at;
    let moved = object.model * vec4f(turned, 1.0);
    let flattened = object.flat * (moved * object.model);
    var columns = object.pairs[1];
    columns[at] += transpose(object.normal)[2] * determinant(bone.turn);
    let mixed = columns * flattened;
    var total = 0.0;
    for (var i = 0u; i < arrayLength(&weights); i++) {
        total += weights[i] * corners[i].x;
    }
    let tilted = pose.tilt * pose.dyn * total + corners[u32(at)] * pose.box;
    return vec4f(uv * tilted, dot(mixed, turned.yzx) * uv.x, moved.w * uv.y);
}
