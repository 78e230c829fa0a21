// Riveted metal panels for a deferred renderer: what a surface is goes to four targets, and a full-screen shader
// (lighting/deferred.wgsl) lights it. Nothing there reads the velocity: it is for a later pass.

struct View {
    view_proj: mat4x4f,
    camera_position: vec3f,
}

struct Model {
    model: mat4x4f,
    normal_matrix: mat4x4f,
}

struct Panel {
    paint: vec3f,
    tiling: f32,
    // Metal shows where the paint is worn off.
    metal: vec3f,
    wear: f32,
    rivet_depth: f32,
    grime: f32,
    glow: f32,
    speed: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(1) @binding(0) var<uniform> object: Model;
@group(1) @binding(1) var<uniform> panel: Panel;
@group(1) @binding(2) var panel_sampler: sampler;
@group(1) @binding(3) var panel_albedo: texture_2d<f32>;
@group(1) @binding(4) var panel_normal: texture_2d<f32>;
@group(1) @binding(5) var panel_metallic_roughness: texture_2d<f32>;
@group(1) @binding(6) var grime_mask: texture_2d<f32>;

struct Varyings {
    @builtin(position) clip_position: vec4f,
    @location(0) world_position: vec3f,
    @location(1) world_normal: vec3f,
    @location(2) world_tangent: vec4f,
    @location(3) uv: vec2f,
}

struct Targets {
    // Occlusion in alpha.
    @location(0) albedo: vec4f,
    // Octahedral.
    @location(1) normal: vec2f,
    // Roughness, metalness, glow.
    @location(2) surface: vec4f,
    @location(3) velocity: vec2f,
}

@vertex
fn vs_main(
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) tangent: vec4f,
    @location(3) uv: vec2f,
) -> Varyings {
    let world = object.model * vec4f(position, 1.0);
    let world_normal = (object.normal_matrix * vec4f(normal, 0.0)).xyz;
    let world_tangent = (object.model * vec4f(tangent.xyz, 0.0)).xyz;
    return Varyings(view.view_proj * world, world.xyz, world_normal, vec4f(world_tangent, tangent.w), uv * panel.tiling);
}

fn octahedral(n: vec3f) -> vec2f {
    let flat_n = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    let folded = (1.0 - abs(flat_n.yx)) * select(vec2f(-1.0), vec2f(1.0), flat_n >= vec2f(0.0));
    return select(folded, flat_n, n.z >= 0.0);
}

// A rivet in each corner of a panel: its height falls off smoothly.
fn rivet_slope(uv: vec2f) -> vec2f {
    let cell = fract(uv * 4.0) - 0.5;
    let inside = smoothstep(0.3, 0.1, length(cell));
    return cell * inside * panel.rivet_depth;
}

fn bumped_normal(in: Varyings) -> vec3f {
    let n = normalize(in.world_normal);
    let t = normalize(in.world_tangent.xyz - n * dot(n, in.world_tangent.xyz));
    let b = cross(n, t) * in.world_tangent.w;
    let sampled = textureSample(panel_normal, panel_sampler, in.uv).xy * 2.0 - 1.0;
    let tilt = sampled + rivet_slope(in.uv);
    let up = sqrt(max(1.0 - dot(tilt, tilt), 0.05));
    return normalize(t * tilt.x + b * tilt.y + n * up);
}

@fragment
fn fs_main(in: Varyings) -> Targets {
    let base = textureSample(panel_albedo, panel_sampler, in.uv).rgb;
    let grime = textureSample(grime_mask, panel_sampler, in.uv * 0.5).r * panel.grime;
    let packed = textureSample(panel_metallic_roughness, panel_sampler, in.uv);

    let worn = smoothstep(0.55, 0.75, packed.b + panel.wear - 0.5 * grime);
    let painted = mix(base * panel.paint, panel.metal, worn);
    let dirty = mix(painted, vec3f(0.05, 0.045, 0.04), grime);
    let occlusion = 1.0 - 0.5 * grime;

    let roughness = clamp(packed.g + 0.3 * grime - 0.2 * worn, 0.08, 1.0);
    let metalness = worn * (1.0 - grime);
    let glow = panel.glow * smoothstep(0.9, 1.0, sin(in.uv.x * 6.2831853));

    // Where it was a frame ago, in pixels: the panels slide along their tangents.
    let along = (view.view_proj * vec4f(in.world_tangent.xyz * panel.speed, 0.0)).xy;
    let distance = length(view.camera_position - in.world_position);
    let velocity = along / max(distance, 0.1);

    return Targets(
        vec4f(dirty, occlusion),
        octahedral(bumped_normal(in)),
        vec4f(roughness, metalness, glow, 0.0),
        velocity,
    );
}
