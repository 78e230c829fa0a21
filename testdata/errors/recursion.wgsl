fn even(n: i32) -> bool {
    if n == 0 {
        return true;
    }
    return odd(n - 1);
}

fn odd(n: i32) -> bool {
    if n == 0 {
        return false;
    }
    return even(n - 1);
}

@fragment
fn fs_main(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return select(vec4f(0.0), vec4f(1.0), even(i32(at.x)));
}
