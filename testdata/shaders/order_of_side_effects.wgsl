// Arguments and operands are evaluated from left to right, each with what the ones before it did.
var<private> counter: i32 = 1;

fn tick() -> i32 {
    counter = counter * 3 % 17;
    return counter;
}

fn weigh(a: i32, b: i32, c: i32) -> i32 {
    return a * 100 + b * 10 + c;
}

fn bump(i: ptr<function, i32>) -> i32 {
    *i += 1;
    return *i;
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    counter += i32(uv.x * 9.0);
    let a = weigh(tick(), counter, tick());
    let b = tick() - tick() * counter;
    var items: array<i32, 5>;
    items[tick() % 5] = tick();
    items[tick() % 5] += tick();
    var i = 0;
    items[bump(&i)] = bump(&i) + items[0];
    items[i] += bump(&i);
    _ = tick();
    let sum = items[0] + items[1] * 2 + items[2] * 3 + items[3] * 5 + items[4] * 7;
    return vec4f(fract(vec3f(vec3i(a, b, sum + counter + i)) * 0.0137), 1.0);
}
