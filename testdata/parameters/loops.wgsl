// Sums that loops share, carry, leave early and do not share.
struct Given {
    points: array<vec4f, 8>,
    count: u32,
    other: u32,
    kind: u32,
    gain: f32,
}
@group(0) @binding(0) var<uniform> given: Given;

@fragment
fn fs_main(@location(0) normal: vec4f) -> @location(0) vec4f {
    // One loop with a loop and a switch in it.
    var wide = vec4f();
    var narrow = 0.0;
    if given.kind != 3u {
        for (var i = 0u; i < min(given.count, 8u); i++) {
            var inner = 0.0;
            for (var j = 0u; j <= i; j++) {
                inner += dot(given.points[j], given.points[i]);
            }
            switch given.kind + i {
                case 1u: {
                    inner *= 2.0;
                }
                case 2u, 3u, 4u: {
                    inner = sqrt(inner);
                    if inner > 2.0 {
                        break;
                    }
                    inner += 1.0;
                }
                default: {
                    inner *= 0.5;
                }
            }
            wide += given.points[i] * inner;
            narrow = max(narrow, inner - given.points[i].w);
        }
    }
    // What is left of light goes from round to round, and ends them.
    var seen = vec3f();
    var left = 1.0;
    for (var i = 0u; i < 8u; i++) {
        let thick = 1.0 / (1.0 + abs(given.points[i].w));
        seen += given.points[i].xyz * (left * thick);
        left *= 1.0 - thick;
        if left < 0.125 {
            break;
        }
    }
    // Two loops of one range: one counts before it ends, one behind.
    var before = 0.0;
    for (var i = 0u; i < 8u; i++) {
        before += given.gain;
        if given.points[i].x > 1.0 {
            break;
        }
    }
    var behind = 0.0;
    for (var i = 0u; i < 8u; i++) {
        if given.points[i].x > 1.0 {
            break;
        }
        behind += given.gain;
    }
    // A loop of another range, and one that ends by its own sum.
    var others = 0.0;
    for (var i = 0u; i < min(given.other, 8u); i++) {
        others += given.points[i].y;
    }
    var enough = 0.0;
    for (var i = 0u; i < min(given.count, 8u); i++) {
        enough += given.points[i].y;
        if enough > 2.0 {
            continue;
        }
        enough *= 1.5;
    }
    // As many rounds as the first results in.
    var more = 0.0;
    for (var i = 0u; i < min(u32(clamp(enough, 0.0, 8.0)), 8u); i++) {
        more -= given.points[i].z;
    }
    let sums = wide * normal + vec4f(seen, narrow) * normal.yzwx;
    return sums * (normal.x * left + normal.y * before + normal.z * behind)
        + normal * (normal.x * others + normal.y * enough + normal.z * more);
}
