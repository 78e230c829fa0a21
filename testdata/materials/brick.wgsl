// A brick wall with its mortar drawn by arithmetic and filtered by its own derivatives.
// Only a fragment stage: whoever uses it brings the vertices.

struct Wall {
    bricks: vec2f,
    mortar_width: f32,
    bevel: f32,
    brick_colour: vec3f,
    variation: f32,
    mortar_colour: vec3f,
    grime: f32,
}

struct Lamp {
    position: vec3f,
    colour: vec3f,
    ambient: vec3f,
}

@group(0) @binding(0) var<uniform> camera_position: vec3f;
@group(0) @binding(1) var<uniform> lamp: Lamp;
@group(1) @binding(0) var<uniform> wall: Wall;
@group(1) @binding(1) var grime_texture: texture_2d<f32>;
@group(1) @binding(2) var grime_sampler: sampler;

fn random(cell: vec2i) -> f32 {
    var h = (u32(cell.x) * 0x9e3779b9u) ^ (u32(cell.y) * 0x85ebca6bu);
    h = (h ^ (h >> 15u)) * 0x2c1b3c6du;
    h = (h ^ (h >> 12u)) * 0x297a2d39u;
    return f32((h ^ (h >> 15u)) >> 8u) * (1.0 / 16777216.0);
}

// Integral of a comb of mortar joints, `width` wide at each whole number, from 0 to `x`.
fn joints_up_to(x: vec2f, width: f32) -> vec2f {
    return floor(x) * width + min(fract(x), vec2f(width));
}

// The share of mortar in a pixel around `x`: the comb, box-filtered over `footprint`.
fn mortar_share(x: vec2f, footprint: vec2f, width: f32) -> f32 {
    let size = max(footprint, vec2f(1e-4));
    let joints = (joints_up_to(x + size * 0.5, width) - joints_up_to(x - size * 0.5, width)) / size;
    // Either joint is enough.
    return 1.0 - (1.0 - joints.x) * (1.0 - joints.y);
}

struct Brick {
    cell: vec2i,
    // Where in the brick, 0..1.
    local: vec2f,
}

fn brick_at(p: vec2f) -> Brick {
    var shifted = p;
    let row = i32(floor(p.y));
    if (row & 1) == 1 {
        shifted.x += 0.5;
    }
    return Brick(vec2i(floor(shifted)), fract(shifted));
}

@fragment
fn fs_wall(
    @location(0) world_position: vec3f,
    @location(1) world_normal: vec3f,
    @location(2) uv: vec2f,
) -> @location(0) vec4f {
    let p = uv * wall.bricks;
    let footprint = fwidth(p);
    let brick = brick_at(p);
    let grime = textureSample(grime_texture, grime_sampler, uv * 2.0);

    let mortar = mortar_share(vec2f(brick.cell) + brick.local, footprint, wall.mortar_width);
    let tone = 1.0 + wall.variation * (random(brick.cell) - 0.5);
    let burnt = step(0.85, random(brick.cell + vec2i(17, 5)));
    var colour = wall.brick_colour * tone * (1.0 - 0.45 * burnt);
    colour *= 0.8 + 0.4 * grime.g;
    colour = mix(colour, wall.mortar_colour * (0.85 + 0.3 * grime.b), mortar);
    colour *= 1.0 - wall.grime * grime.r;

    // Rounded edges, fading out as soon as a pixel is wider than they are.
    let from_middle = brick.local - vec2f(0.5 + wall.mortar_width * 0.5);
    let edge = smoothstep(vec2f(0.5 - wall.bevel), vec2f(0.5), abs(from_middle)) * sign(from_middle);
    let visible = saturate(1.0 - max(footprint.x, footprint.y) / wall.bevel);
    let geometric = normalize(world_normal);
    var up = vec3f(0.0, 1.0, 0.0);
    if abs(geometric.y) > 0.99 {
        up = vec3f(0.0, 0.0, 1.0);
    }
    let t = normalize(cross(up, geometric));
    let b = cross(geometric, t);
    let n = normalize(geometric + (t * edge.x - b * edge.y) * visible * (1.0 - mortar));

    let to_lamp = lamp.position - world_position;
    let l = normalize(to_lamp);
    let h = normalize(l + normalize(camera_position - world_position));
    let diffuse = saturate(dot(n, l));
    var specular = 0.0;
    if diffuse > 0.0 {
        specular = 0.12 * (1.0 - mortar) * pow(saturate(dot(n, h)), 18.0);
    }
    let lit = colour * (lamp.ambient + lamp.colour * diffuse) + lamp.colour * specular;
    return vec4f(saturate(lit), 1.0);
}
