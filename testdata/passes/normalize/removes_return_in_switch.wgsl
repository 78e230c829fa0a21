@group(0) @binding(0) var<uniform> view: u32;

@fragment
fn fs_main(@location(0) n: vec3f) -> @location(0) vec4f {
    switch view {
        case 1u: {
            return vec4f(n * 0.5, 1.0);
        }
        case 2u: {
            if n.x > 0.0 {
                return vec4f(1.0);
            }
        }
        default: {
        }
    }
    return vec4f(normalize(n), 1.0);
}
