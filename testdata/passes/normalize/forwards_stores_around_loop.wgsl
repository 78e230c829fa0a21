@group(0) @binding(0) var<uniform> count: i32;

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var scale = 2.0;
    scale = scale + 1.0;
    var i = 0;
    var sum = uv.x;
    loop {
        if i >= count { break; }
        if sum > 10.0 { i += 2; continue; }
        sum = sum + uv.y * scale;
        continuing {
            i += 1;
            break if sum > 20.0;
        }
    }
    return vec4f(sum * scale);
}
