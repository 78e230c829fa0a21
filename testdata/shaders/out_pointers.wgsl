// Parameters that are pointers: written, read, passed on, returned from early, and two to the same kind.
struct Ray {
    origin: vec3f,
    direction: vec3f,
    length: f32,
}

fn add_to(sum: ptr<function, f32>, x: f32) {
    *sum += x;
}

fn advance(ray: ptr<function, Ray>, by: f32) -> bool {
    if by <= 0.1 {
        return false;
    }
    (*ray).origin += (*ray).direction * by;
    (*ray).length += by;
    return true;
}

fn swap(a: ptr<function, vec2f>, b: ptr<function, vec2f>) {
    let old = *a;
    *a = *b;
    *b = old;
}

fn fill(items: ptr<function, array<f32, 4>>, x: f32) {
    for (var i = 0; i < 4; i++) {
        (*items)[i] = x * f32(i);
        if x > 0.8 && i == 2 {
            return;
        }
    }
}

fn through(sum: ptr<function, f32>, x: f32) {
    add_to(sum, x);
    add_to(sum, *sum * 0.5);
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var total = 0.1;
    through(&total, uv.x);
    let seen = total;
    add_to(&total, uv.y);

    var ray = Ray(vec3f(0.0), vec3f(uv, 0.5), 0.0);
    if advance(&ray, uv.x) && advance(&ray, uv.y) {
        ray.direction = -ray.direction;
    }

    var a = uv;
    var b = vec2f(0.2, 0.7);
    if uv.x > uv.y {
        swap(&a, &b);
    }

    var items: array<f32, 4>;
    items[3] = 0.5;
    fill(&items, uv.y);
    let pointer = &items[2];
    *pointer += 0.125;
    return vec4f(seen + a.x * 0.1, total * 0.3 + b.y * 0.2, ray.length * 0.3 + items[2] * 0.2 + items[3] * 0.1, 1.0);
}
