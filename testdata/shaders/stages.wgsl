// A vertex stage with functions, state and early returns; flat, linear and centroid varyings; arguments mixed with structs.
struct Frame {
    view_proj: mat4x4f,
    model: mat4x4f,
}

@group(0) @binding(0) var<uniform> frame: Frame;
var<private> stage: u32 = 3u;


struct ToFragment {
    @location(3) colour: vec3f,
    @builtin(position) @invariant clip: vec4f,
    @location(0) @interpolate(flat) id: u32,
    @location(1) @interpolate(linear, center) screen: vec2f,
    @location(2) @interpolate(perspective, centroid) uv: vec2f,
    @location(6) @interpolate(flat, either) tag: vec2i,
}

fn displaced(p: vec3f, wave: f32) -> vec3f {
    stage += 1u;
    if wave < 0.0 {
        return p;
    }
    return p * (1.0 + 0.05 * sin(wave * 9.0));
}

@vertex
fn vs_main(
    @builtin(vertex_index) index: u32,
    @builtin(instance_index) instance: u32,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
) -> ToFragment {
    var out: ToFragment;
    let world = frame.model * vec4f(displaced(position, normal.x), 1.0);
    out.clip = frame.view_proj * world;
    out.id = (index / 3u) * 7u + instance + stage;
    out.uv = uv;
    out.colour = normal * 0.5 + 0.5;
    out.tag = vec2i(i32(index), -i32(stage));
    if index % 2u == 0u {
        out.screen = out.clip.xy / out.clip.w;
        return out;
    }
    out.screen = out.clip.xy / out.clip.w * 0.9;
    return out;
}

@fragment
fn fs_main(in: ToFragment, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    stage *= 2u;
    let facet = f32((in.id * 2654435761u) >> 24u) / 255.0;
    let tagged = f32((in.tag.x & 7) + in.tag.y) * 0.02;
    var colour = mix(in.colour, vec3f(facet, fract(in.screen * 4.0)), 0.4);
    if !front {
        colour = vec3f(1.0, 0.0, 1.0);
    }
    let depth = in.clip.z * 0.1 + fract(in.clip.x * 0.125);
    return vec4f(colour * 0.8 + tagged + depth * 0.1 + f32(stage) * 0.01, 1.0);
}
