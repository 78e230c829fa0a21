#import lib::lights
@fragment fn fs() -> @location(0) vec4f { return vec4f(lights::lamberts(vec3f(1.0)), 1.0); }
