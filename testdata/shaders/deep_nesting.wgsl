// Conditions, switches and loops inside one another, with a way out at each level.
fn maze(x: f32, y: f32) -> f32 {
    var a = x;
    if x < 0.9 {
        for (var i = 0; i < 3; i++) {
            switch i32(a * 4.0) {
                case 0, 1: {
                    a += 0.3;
                    if y > 0.8 {
                        continue;
                    }
                    var k = 0;
                    loop {
                        k++;
                        if k > 3 {
                            break;
                        }
                        if a * y > 0.3 {
                            if k == 2 {
                                return a + 0.05;
                            }
                            a -= 0.02;
                        } else {
                            a += 0.03;
                            continue;
                        }
                        a *= 0.98;
                    }
                }
                case 2: {
                    if y < 0.2 {
                        break;
                    } else if y < 0.4 {
                        a *= 0.5;
                    } else if y < 0.6 {
                        return a * y;
                    }
                    a += 0.01;
                }
                default: {
                    a = fract(a + y);
                }
            }
            a += 0.04;
            if a > 1.0 {
                a -= 0.9;
                break;
            }
        }
    } else {
        if y > 0.5 {
            return 0.3;
        }
        a = y;
    }
    return a;
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    if uv.y > 0.97 {
        return vec4f(0.0, 0.0, 1.0, 1.0);
    }
    let outer = maze(uv.x, uv.y);
    return vec4f(outer, maze(outer, uv.x), maze(maze(uv.y, outer), 0.45), 1.0);
}
