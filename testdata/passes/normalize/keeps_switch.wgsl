@group(0) @binding(0) var<uniform> mode: i32;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var colour: vec3f = vec3f(0.0, 0.5, 1.0);

    switch mode {
        case 0, 2: {
            colour = vec3f(uv, sin(uv.x));
        }
        case 1: {
            colour = vec3f(cos(uv.y), uv);
        }
        default: {
        }
    }
    return vec4f(colour, 1.0);
}
