// A sum over lights, with a branch, a switch and a round that is left early.
struct Camera {
    view: mat4x4f,
    eye: vec3f,
}
struct Light {
    position: vec3f,
    range: f32,
    colour: vec3f,
    kind: u32,
}
struct Lights {
    ambient: vec3f,
    count: u32,
    all: array<Light, 40>,
}
@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> lights: Lights;

@fragment
fn fs_main(@location(0) normal: vec3f) -> @location(0) vec4f {
    let towards = normalize(camera.eye - lights.ambient);
    var radiance = lights.ambient;
    var hits = 0u;
    for (var i = 0u; i < min(lights.count, 40u); i++) {
        let light = lights.all[i];
        let away = light.position - camera.eye;
        let squared = dot(away, away);
        if squared > light.range * light.range {
            continue;
        }
        hits += 1u;
        switch light.kind {
            case 0u: {
                radiance += light.colour / (1.0 + squared);
            }
            case 1u, 2u: {
                if light.range < 0.5 {
                    break;
                }
                radiance += max(light.colour, vec3f(0.25)) * f32(light.kind);
            }
            default: {
                radiance = mix(radiance, light.colour, 0.5);
            }
        }
        if hits == 7u {
            break;
        }
    }
    let type_of_light = select(radiance, radiance.zyx, hits > 3u && radiance.x > radiance.z);
    let lambert = max(dot(normal, towards), 0.0);
    return vec4f(type_of_light * lambert, f32(hits) / 8.0);
}
