struct Light { position: vec3f, power: f32 }

@group(0) @binding(0) var<uniform> lights: array<Light, 4>;
@group(0) @binding(1) var<uniform> first: u32;

fn falloff(light: Light, p: vec3f) -> f32 {
    let d = distance(light.position, p);
    return light.power / (d * d);
}

@fragment
fn fs_main(@location(0) p: vec3f) -> @location(0) vec4f {
    let a = falloff(lights[first], p) * normalize(p).x;
    let b = falloff(lights[first], p) * normalize(p).y;
    return vec4f(a, b, lights[first].position.x, lights[first].position.y);
}
