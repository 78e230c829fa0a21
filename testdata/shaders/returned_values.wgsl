// Functions that return structs, arrays and vectors, called inside one another and used in parts.
struct Hit {
    at: f32,
    normal: vec3f,
    found: bool,
}

fn no_hit() -> Hit {
    return Hit();
}

fn sphere(from_x: f32, radius: f32) -> Hit {
    if abs(from_x) > radius {
        return no_hit();
    }
    let z = sqrt(radius * radius - from_x * from_x);
    return Hit(z, normalize(vec3f(from_x, 0.1, z)), true);
}

fn nearer(a: Hit, b: Hit) -> Hit {
    if !a.found {
        return b;
    }
    if !b.found || a.at > b.at {
        return a;
    }
    return b;
}

fn ladder(x: f32) -> array<f32, 3> {
    if x < 0.3 {
        return array<f32, 3>();
    }
    return array(x, x * x, x * x * x);
}

fn pair(x: f32) -> vec2f {
    var p = vec2f(x);
    if x > 0.5 {
        p.y = 0.0;
        return p;
    }
    p.x = 1.0;
    return p;
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let hit = nearer(nearer(sphere(uv.x - 0.3, 0.25), sphere(uv.x - 0.6, 0.3)), sphere(uv.y - 0.5, 0.2));
    let steps = ladder(ladder(uv.y)[1] + 0.2);
    let c = pair(pair(uv.x).y).x + sphere(0.1, uv.x).normal.z;
    var result = hit.normal * 0.5 + 0.5;
    result.g = steps[2] + steps[i32(uv.x * 2.9)] * 0.3;
    return vec4f(result * 0.7 + c * 0.15, select(0.5, 1.0, hit.found));
}
