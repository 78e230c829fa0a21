struct Surface { colour: vec3f, rough: f32 }

fn wet(surface: ptr<function, Surface>, amount: f32) {
    (*surface).rough *= 1.0 - amount;
    darken(&(*surface).colour, amount);
}

fn darken(colour: ptr<function, vec3f>, amount: f32) {
    (*colour).y = (*colour).y * amount;
    *colour *= 0.5;
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var surface = Surface(vec3f(uv, 1.0), 0.5);
    wet(&surface, uv.x);
    return vec4f(surface.colour, surface.rough);
}
