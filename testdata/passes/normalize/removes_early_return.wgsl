fn fogged(colour: vec3f, distance: f32) -> vec3f {
    if distance < 1.0 {
        return colour;
    }
    let amount = saturate(exp(-distance));
    return mix(vec3f(0.7), colour, amount);
}

@fragment
fn fs_main(@location(0) colour: vec3f, @location(1) distance: f32) -> @location(0) vec4f {
    if distance > 100.0 {
        return vec4f(0.0);
    }
    return vec4f(fogged(colour, distance), 1.0);
}
