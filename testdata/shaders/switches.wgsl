// Several selectors, a default in the middle, breaks, continues and returns inside cases, switches in loops.
fn pick(kind: i32, x: f32) -> f32 {
    var y = x;
    switch kind {
        case -2, -1: {
            y = y * 2.0;
            if y > 1.0 {
                break;
            }
            y += 0.1;
        }
        case 3, default, 7: {
            y = 1.0 - y;
        }
        case 0: {
            return x * x;
        }
        case 1: {
            switch u32(x * 3.0) {
                case 0u: {
                    return 0.1;
                }
                case 1u: {
                    y = 0.7;
                }
                default: {
                    break;
                }
            }
            y *= 0.9;
        }
        case 2: {}
    }
    return y;
}

fn walk(x: f32) -> f32 {
    var sum = 0.0;
    for (var i = -3; i < 9; i++) {
        switch i {
            case 0: {
                continue;
            }
            case 4: {
                if x > 0.6 {
                    return sum;
                }
                break;
            }
            case 5, 6: {
                sum += 0.05;
                continue;
            }
            default: {
                sum += 0.01 * f32(i);
            }
        }
        sum += pick(i, x) * 0.1;
    }
    return sum;
}

fn only_default(x: f32) -> f32 {
    switch i32(x) {
        default: {
            return x + 0.5;
        }
    }
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let kind = i32(floor(uv.x * 10.0)) - 2;
    return vec4f(pick(kind, uv.y), walk(uv.y), only_default(uv.x * 0.5), 1.0);
}
