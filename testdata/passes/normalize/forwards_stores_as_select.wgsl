@fragment
fn fs_main(@location(0) n: vec3f, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    var normal = normalize(n);
    if !front {
        normal = -n;
    }
    var rough = 0.2;
    if normal.y > 0.5 {
        rough = 0.8;
    } else if normal.y > 0.2 {
        rough = n.x;
    }
    return vec4f(normal, rough);
}
