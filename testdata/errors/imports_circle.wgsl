#import lib::left
@fragment fn fs() -> @location(0) vec4f { return vec4f(left::left()); }
