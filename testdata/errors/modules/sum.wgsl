#define_import_path lib::sum

#import lib::lights::{Light, lambert}

fn all(n: vec3f, lights: array<Light, #{COUNT}>) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < #{COUNT}u; i++) { sum += lambert(n, lights[i]); }
    return sum;
}
