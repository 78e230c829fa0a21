// The metallic-roughness material of glTF 2.0: five textures, each with its factor, under one sun and a sky.
// Every name says its role, so that a scene needs to say nothing about a model.

const PI = 3.14159265;

struct Camera {
    view_proj: mat4x4f,
    position: vec3f,
}

struct Sun {
    direction: vec3f,
    colour: vec3f,
}

struct Object {
    model: mat4x4f,
    normal_matrix: mat3x3f,
}

struct Material {
    base_color_factor: vec4f,
    emissive_factor: vec3f,
    metallic_factor: f32,
    roughness_factor: f32,
    normal_scale: f32,
    occlusion_strength: f32,
    alpha_cutoff: f32,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> sun: Sun;
@group(1) @binding(0) var<uniform> object: Object;
@group(2) @binding(0) var<uniform> material: Material;
@group(2) @binding(1) var base_color_sampler: sampler;
@group(2) @binding(2) var base_color_texture: texture_2d<f32>;
@group(2) @binding(3) var metallic_roughness_texture: texture_2d<f32>;
@group(2) @binding(4) var normal_texture: texture_2d<f32>;
@group(2) @binding(5) var occlusion_texture: texture_2d<f32>;
@group(2) @binding(6) var emissive_texture: texture_2d<f32>;

struct VertexInput {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) tangent: vec4f,
    @location(3) uv: vec2f,
    @location(4) color: vec4f,
}

struct VertexOutput {
    @builtin(position) clip_position: vec4f,
    @location(0) world_position: vec3f,
    @location(1) normal: vec3f,
    @location(2) tangent: vec4f,
    @location(3) uv: vec2f,
    @location(4) color: vec4f,
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
    out.color = in.color;
    return out;
}

fn shading_normal(in: VertexOutput) -> vec3f {
    let sampled = textureSample(normal_texture, base_color_sampler, in.uv).xyz * 2.0 - 1.0;
    let scaled = sampled * vec3f(material.normal_scale, material.normal_scale, 1.0);
    let n = normalize(in.normal);
    let t = normalize(in.tangent.xyz - n * dot(n, in.tangent.xyz));
    let b = cross(n, t) * in.tangent.w;
    return normalize(t * scaled.x + b * scaled.y + n * scaled.z);
}

// Trowbridge-Reitz distribution times Smith's height-correlated shadowing, over 4 (n.l) (n.v).
fn microfacets(n_dot_l: f32, n_dot_v: f32, n_dot_h: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let d = n_dot_h * n_dot_h * (a2 - 1.0) + 1.0;
    let towards_light = n_dot_v * sqrt(n_dot_l * n_dot_l * (1.0 - a2) + a2);
    let towards_eye = n_dot_l * sqrt(n_dot_v * n_dot_v * (1.0 - a2) + a2);
    return a2 / (PI * d * d) * 0.5 / max(towards_light + towards_eye, 1e-5);
}

fn sky(direction: vec3f, blur: f32) -> vec3f {
    let horizon = smoothstep(-blur - 0.05, blur + 0.05, direction.y);
    return mix(vec3f(0.22, 0.19, 0.16), vec3f(0.55, 0.66, 0.82), horizon);
}

@fragment
fn fs_main(in: VertexOutput) -> @location(0) vec4f {
    let base = textureSample(base_color_texture, base_color_sampler, in.uv) * material.base_color_factor * in.color;
    let packed = textureSample(metallic_roughness_texture, base_color_sampler, in.uv);
    let metallic = packed.b * material.metallic_factor;
    let roughness = clamp(packed.g * material.roughness_factor, 0.05, 1.0);
    let alpha = roughness * roughness;
    let occlusion = mix(1.0, textureSample(occlusion_texture, base_color_sampler, in.uv).r, material.occlusion_strength);
    let emission = textureSample(emissive_texture, base_color_sampler, in.uv).rgb * material.emissive_factor;
    let n = shading_normal(in);
    if base.a < material.alpha_cutoff {
        discard;
    }

    let v = normalize(camera.position - in.world_position);
    let l = normalize(sun.direction);
    let h = normalize(l + v);
    let n_dot_v = clamp(dot(n, v), 1e-3, 1.0);
    let n_dot_l = saturate(dot(n, l));

    let f0 = mix(vec3f(0.04), base.rgb, metallic);
    let f90 = pow(1.0 - saturate(dot(v, h)), 5.0);
    let fresnel = f0 + (1.0 - f0) * f90;
    let diffuse = (1.0 - fresnel) * (1.0 - metallic) * base.rgb / PI;
    let specular = fresnel * microfacets(n_dot_l, n_dot_v, saturate(dot(n, h)), alpha);
    let direct = (diffuse + specular) * sun.colour * (PI * n_dot_l);

    let edge = f0 + (max(vec3f(1.0 - alpha), f0) - f0) * pow(1.0 - n_dot_v, 5.0);
    let around = (1.0 - metallic) * base.rgb * sky(n, 1.0) + edge * sky(reflect(-v, n), alpha);

    let light = direct + around * occlusion + emission;
    return vec4f(light / (1.0 + 0.25 * light), base.a);
}
