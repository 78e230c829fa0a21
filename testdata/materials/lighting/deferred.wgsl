// Lights what gbuffer.wgsl wrote: one directional lamp, GGX, world positions out of the depth.

struct Camera {
    inverse_view_projection: mat4x4f,
    position: vec3f,
}

struct Lamp {
    direction: vec3f,
    colour: vec3f,
    ambient: vec3f,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> lamp: Lamp;
@group(1) @binding(0) var gbuffer_albedo: texture_2d<f32>;
@group(1) @binding(1) var gbuffer_normal: texture_2d<f32>;
@group(1) @binding(2) var materials: texture_2d<f32>;
@group(1) @binding(3) var gbuffer_depth: texture_depth_2d;

fn from_octahedral(packed: vec2f) -> vec3f {
    let z = 1.0 - abs(packed.x) - abs(packed.y);
    let fold = max(-z, 0.0);
    let xy = packed - select(vec2f(-fold), vec2f(fold), packed >= vec2f(0.0));
    return normalize(vec3f(xy, z));
}

@fragment
fn light(@builtin(position) position: vec4f, @location(0) uv: vec2f) -> @location(0) vec4f {
    let at = vec2i(position.xy);
    let albedo = textureLoad(gbuffer_albedo, at, 0);
    let n = from_octahedral(textureLoad(gbuffer_normal, at, 0).xy);
    let surface = textureLoad(materials, at, 0);
    let depth = textureLoad(gbuffer_depth, at, 0);

    let clip = vec4f(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, depth, 1.0);
    let world = camera.inverse_view_projection * clip;
    let v = normalize(camera.position - world.xyz / world.w);

    let roughness = surface.x * surface.x;
    let f0 = mix(vec3f(0.04), albedo.rgb, surface.y);
    let l = lamp.direction;
    let h = normalize(l + v);
    let n_dot_l = max(dot(n, l), 0.0);
    let n_dot_v = max(dot(n, v), 0.001);
    let n_dot_h = max(dot(n, h), 0.0);
    let a2 = roughness * roughness;
    let bottom = n_dot_h * n_dot_h * (a2 - 1.0) + 1.0;
    let d = a2 / (3.14159265 * bottom * bottom + 0.0001);
    let visible = 0.5 / (mix(2.0 * n_dot_l * n_dot_v, n_dot_l + n_dot_v, roughness) + 0.0001);
    let f = f0 + (1.0 - f0) * pow(1.0 - max(dot(v, h), 0.0), 5.0);

    let diffuse = albedo.rgb * (1.0 - surface.y) / 3.14159265;
    let direct = (diffuse + f * d * visible) * lamp.colour * n_dot_l;
    let ambient = lamp.ambient * mix(albedo.rgb, f0, surface.y) * albedo.a;
    return vec4f(direct + ambient + surface.z * vec3f(0.9, 0.4, 0.1), 1.0);
}
