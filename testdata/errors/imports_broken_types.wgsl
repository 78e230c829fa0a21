#import lib::broken
@fragment fn fs() -> @location(0) vec4f { return vec4f(broken::mixed(vec3f(1.0), lib::lights::Light()), 1.0); }
