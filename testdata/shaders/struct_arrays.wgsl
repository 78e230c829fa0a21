// Arrays of structs with arrays in them, written and read at varying places; copies are copies.
struct Leaf {
    colour: vec3f,
    weights: array<f32, 3>,
}

struct Tree {
    leaves: array<Leaf, 3>,
    count: u32,
}

fn grown(x: f32) -> Tree {
    var tree: Tree;
    for (var i = 0u; i < 3u; i++) {
        if x * 3.0 < f32(i) {
            break;
        }
        tree.leaves[i].colour = vec3f(x, f32(i) * 0.3, 1.0 - x);
        tree.leaves[i].weights[i] = x + 0.1;
        tree.leaves[i].weights[(i + 1u) % 3u] += 0.2;
        tree.count += 1u;
    }
    return tree;
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var tree = grown(uv.x);
    let before = tree;
    let at = u32(uv.y * 2.99);
    tree.leaves[at] = Leaf(vec3f(0.5), array<f32, 3>(0.1, 0.2, 0.3));
    tree.leaves[at].weights[2u - at] *= 3.0;
    var moved = tree.leaves;
    tree.leaves[1].colour.g = 0.9;
    moved[0].colour = moved[at].colour;

    var sum = vec3f(0.0);
    for (var i = 0u; i < tree.count; i++) {
        for (var j = 0u; j < 3u; j++) {
            sum += tree.leaves[i].colour * tree.leaves[i].weights[j] + before.leaves[i].colour * 0.05;
        }
    }
    sum += moved[0].colour * 0.1 + moved[1].colour * 0.1;
    return vec4f(sum * 0.4, 1.0);
}
