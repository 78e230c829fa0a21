// Read-only storage: a struct with a runtime-sized array of structs, and an array alone.
struct Light {
    position: vec3f,
    strength: f32,
}

struct Lights {
    ambient: vec3f,
    items: array<Light>,
}

@group(0) @binding(0) var<storage, read> lights: Lights;
@group(0) @binding(1) var<storage, read> palette: array<vec4f>;

fn strongest() -> u32 {
    var best = 0u;
    for (var i = 1u; i < arrayLength(&lights.items); i++) {
        if lights.items[i].strength > lights.items[best].strength {
            best = i;
        }
    }
    return best;
}

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) normal: vec3f, @location(2) position: vec3f) -> @location(0) vec4f {
    var sum = lights.ambient;
    let n = normalize(normal);
    for (var i = 0u; i < arrayLength(&lights.items); i++) {
        let light = lights.items[i];
        let d = light.position - position;
        sum += saturate(dot(n, normalize(d))) * light.strength / (1.0 + dot(d, d));
    }
    let colour = palette[u32(uv.x * f32(arrayLength(&palette)) * 0.999)];
    return vec4f(sum * colour.rgb + f32(strongest()) * 0.05, 1.0);
}
