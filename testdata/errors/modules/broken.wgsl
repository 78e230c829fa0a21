#define_import_path lib::broken

#import lib::lights::{Light, lambert}

#ifdef DOUBLE
fn doubled(n: vec3f, light: Light) -> vec3f {
    return lib::lights::lambert(n, light) * 2.0 missing;
}
#endif

fn mixed(n: vec3f, light: Light) -> vec3f {
    return lambert(n, light) + vec2f(1.0);
}
