// expect: 1 candidates
@group(0) @binding(0) var<uniform> sun: vec3f;

@vertex fn vs_main(@location(0) position: vec4f) -> @builtin(position) vec4f {
    return position;
}

@fragment fn fs_main(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let direction = normalize(sun);
    return vec4f(direction * fract(at.x), 1.0);
}
