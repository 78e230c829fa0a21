#import lib::twice::twice
@fragment fn fs() -> @location(0) vec4f { return vec4f(twice(1.0)); }
