// More than one target and a depth of its own.
struct Targets {
    @location(1) normal: vec4f,
    @location(0) colour: vec4f,
    @builtin(frag_depth) depth: f32,
}

fn empty() -> Targets {
    return Targets(vec4f(0.0), vec4f(0.0, 0.0, 0.0, 1.0), 1.0);
}

@fragment
fn fs_main(@builtin(position) at: vec4f, @location(0) uv: vec2f, @location(1) normal: vec3f) -> Targets {
    var out = empty();
    out.depth = at.z;
    if uv.x < 0.2 {
        out.colour.g = uv.y;
        return out;
    }
    out.normal = vec4f(normalize(normal), 0.0);
    out.colour = vec4f(out.normal.xyz * 0.5 + 0.5, 0.75);
    out.depth = at.z * (0.99 + 0.01 * uv.y);
    return out;
}
