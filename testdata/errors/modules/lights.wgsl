#define_import_path lib::lights

struct Light {
    direction: vec3f,
    colour: vec3f,
}

// How much of a light a surface gets.
fn lambert(n: vec3f, light: Light) -> vec3f {
    return light.colour * max(dot(n, light.direction), 0.0);
}
