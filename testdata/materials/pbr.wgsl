// Metallic-roughness material after Cook and Torrance: five textures, and four lights in a loop.
// Worn, painted panels with bare metal at the edges and a few lamps.

const PI = 3.14159265;
const MAX_LIGHTS = 4;

struct Camera {
    view_proj: mat4x4f,
    eye: vec3f,
    exposure: f32,
}

struct Object {
    model: mat4x4f,
    normal_matrix: mat3x3f,
}

struct Material {
    tint: vec4f,
    emission: vec3f,
    normal_scale: f32,
    roughness: f32,
    metallic: f32,
    occlusion: f32,
}

// A point light; beyond `reach` it gives nothing.
struct Light {
    position: vec3f,
    reach: f32,
    colour: vec3f,
    intensity: f32,
}

struct Lighting {
    sky: vec3f,
    count: u32,
    ground: vec3f,
    lights: array<Light, MAX_LIGHTS>,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> lighting: Lighting;
@group(1) @binding(0) var<uniform> object: Object;
@group(2) @binding(0) var<uniform> material: Material;
@group(2) @binding(1) var surface_sampler: sampler;
@group(2) @binding(2) var albedo_texture: texture_2d<f32>;
@group(2) @binding(3) var normal_texture: texture_2d<f32>;
@group(2) @binding(4) var metallic_roughness_texture: texture_2d<f32>;
@group(2) @binding(5) var occlusion_texture: texture_2d<f32>;
@group(2) @binding(6) var emissive_texture: texture_2d<f32>;

struct VertexInput {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) tangent: vec4f,
}

struct VertexOutput {
    @builtin(position) clip_position: vec4f,
    @location(0) world_position: vec3f,
    @location(1) normal: vec3f,
    @location(2) tangent: vec4f,
    @location(3) uv: vec2f,
}

@vertex
fn vs_main(in: VertexInput) -> VertexOutput {
    let world = object.model * vec4f(in.position, 1.0);
    var out: VertexOutput;
    out.clip_position = camera.view_proj * world;
    out.world_position = world.xyz;
    out.normal = object.normal_matrix * in.normal;
    out.tangent = vec4f((object.model * vec4f(in.tangent.xyz, 0.0)).xyz, in.tangent.w);
    out.uv = in.uv;
    return out;
}

// What the textures say about the point that is shaded.
struct Surface {
    albedo: vec3f,
    normal: vec3f,
    f0: vec3f,
    emission: vec3f,
    alpha: f32,
    occlusion: f32,
}

fn read_normal(in: VertexOutput) -> vec3f {
    let sampled = textureSample(normal_texture, surface_sampler, in.uv).xyz * 2.0 - 1.0;
    let n = normalize(in.normal);
    // Gram-Schmidt: interpolation leaves the tangent neither unit nor perpendicular.
    let t = normalize(in.tangent.xyz - n * dot(n, in.tangent.xyz));
    let b = cross(n, t) * in.tangent.w;
    return normalize(t * sampled.x * material.normal_scale + b * sampled.y * material.normal_scale + n * sampled.z);
}

fn read_surface(in: VertexOutput) -> Surface {
    var surface: Surface;
    let base = textureSample(albedo_texture, surface_sampler, in.uv) * material.tint;
    let packed = textureSample(metallic_roughness_texture, surface_sampler, in.uv);
    let metallic = packed.b * material.metallic;
    let roughness = clamp(packed.g * material.roughness, 0.045, 1.0);

    surface.albedo = base.rgb * (1.0 - metallic);
    surface.f0 = mix(vec3f(0.04), base.rgb, metallic);
    surface.alpha = roughness * roughness;
    surface.normal = read_normal(in);
    surface.occlusion = mix(1.0, textureSample(occlusion_texture, surface_sampler, in.uv).r, material.occlusion);
    surface.emission = textureSample(emissive_texture, surface_sampler, in.uv).rgb * material.emission;
    return surface;
}

// Trowbridge-Reitz distribution of microfacet normals.
fn distribution(n_dot_h: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let d = n_dot_h * n_dot_h * (a2 - 1.0) + 1.0;
    return a2 / (PI * d * d);
}

// Height-correlated Smith shadowing, with the 4 (n.l) (n.v) of the denominator already divided out.
fn visibility(n_dot_l: f32, n_dot_v: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let towards_light = n_dot_v * sqrt(n_dot_l * n_dot_l * (1.0 - a2) + a2);
    let towards_eye = n_dot_l * sqrt(n_dot_v * n_dot_v * (1.0 - a2) + a2);
    return 0.5 / max(towards_light + towards_eye, 1e-5);
}

fn fresnel(f0: vec3f, cosine: f32) -> vec3f {
    return f0 + (1.0 - f0) * pow(1.0 - cosine, 5.0);
}

fn falloff(distance: f32, reach: f32) -> f32 {
    let x = distance / reach;
    let window = saturate(1.0 - x * x * x * x);
    return window * window / (distance * distance + 0.01);
}

fn direct_light(surface: Surface, light: Light, position: vec3f, v: vec3f, n_dot_v: f32) -> vec3f {
    let to_light = light.position - position;
    let distance = length(to_light);
    if distance > light.reach {
        return vec3f(0.0);
    }
    let l = to_light / distance;
    let n_dot_l = dot(surface.normal, l);
    if n_dot_l <= 0.0 {
        return vec3f(0.0);
    }

    let h = normalize(l + v);
    let f = fresnel(surface.f0, saturate(dot(v, h)));
    let specular = f * distribution(saturate(dot(surface.normal, h)), surface.alpha)
        * visibility(n_dot_l, n_dot_v, surface.alpha);
    let diffuse = (1.0 - f) * surface.albedo / PI;
    return (diffuse + specular) * light.colour * (light.intensity * falloff(distance, light.reach) * n_dot_l);
}

// Light of a sky over a ground, diffuse and mirrored, without an environment map.
fn ambient_light(surface: Surface, v: vec3f, n_dot_v: f32) -> vec3f {
    let r = reflect(-v, surface.normal);
    let irradiance = mix(lighting.ground, lighting.sky, surface.normal.y * 0.5 + 0.5);
    // A rough surface mirrors a blurred horizon.
    let horizon = smoothstep(-surface.alpha - 0.05, surface.alpha + 0.05, r.y);
    let mirrored = mix(lighting.ground, lighting.sky, horizon);
    let f = surface.f0 + (max(vec3f(1.0 - surface.alpha), surface.f0) - surface.f0) * pow(1.0 - n_dot_v, 5.0);
    return (surface.albedo * irradiance + f * mirrored) * surface.occlusion;
}

// Reinhard's curve on luminance; what is as bright as `white` becomes 1.
fn tone_map(colour: vec3f, white: f32) -> vec3f {
    let luminance = dot(colour, vec3f(0.2126, 0.7152, 0.0722));
    let mapped = luminance * (1.0 + luminance / (white * white)) / (1.0 + luminance);
    return colour * (mapped / max(luminance, 1e-4));
}

@fragment
fn fs_main(in: VertexOutput) -> @location(0) vec4f {
    let surface = read_surface(in);
    let v = normalize(camera.eye - in.world_position);
    let n_dot_v = clamp(dot(surface.normal, v), 1e-3, 1.0);

    var colour = ambient_light(surface, v, n_dot_v) + surface.emission;
    for (var i = 0u; i < min(lighting.count, u32(MAX_LIGHTS)); i++) {
        colour += direct_light(surface, lighting.lights[i], in.world_position, v, n_dot_v);
    }
    return vec4f(tone_map(colour * camera.exposure, 4.0), 1.0);
}
