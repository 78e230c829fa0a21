// expect: 1 candidates
struct Wind { direction: vec2f, time: f32 }
@group(0) @binding(0) var<uniform> wind: Wind;

struct Surface { @builtin(position) clip: vec4f, @location(0) height: f32 }

@vertex fn vs_main(@location(0) position: vec3f) -> Surface {
    let sway = normalize(wind.direction) * sin(wind.time);
    return Surface(vec4f(position.xy + sway * position.y, position.z, 1.0), position.y);
}

@fragment fn fs_main(in: Surface) -> @location(0) vec4f {
    return vec4f(in.height);
}
