fn fresnel(cosine: f32, f0: vec3f) -> vec3f {
    let grazing = pow(1.0 - cosine, 5.0);
    return f0 + (vec3f(1.0) - f0) * grazing;
}

fn shade(n: vec3f, v: vec3f) -> vec3f {
    return fresnel(saturate(dot(n, v)), vec3f(0.04));
}

@fragment
fn fs_main(@location(0) n: vec3f, @location(1) v: vec3f) -> @location(0) vec4f {
    let front = shade(normalize(n), v);
    let back = shade(-normalize(n), v);
    return vec4f(front + back, 1.0);
}
