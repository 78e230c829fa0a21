// The first ends in its first round, the second after it, the third may go on.
@fragment
fn fs_main(@location(0) a: f32, @location(1) b: f32) -> @location(0) vec4f {
    var x = a;
    for (var i = 3; i < 3; i++) { x *= b; }
    for (var i = 0; i < 2; i += 2) { if x > 1.0 { x -= sin(x); } x += f32(i); }
    loop { x = x * x + b; continuing { break if true; } }
    for (var i = 0; i < 1; i++) { if x > 8.0 { continue; } x = x * 3.0; }
    var n = 0;
    for (var i = 0; i < 1; i++) { if x > 9.0 { n = -1; } i += n; x += 1.0; }
    return vec4f(x);
}
