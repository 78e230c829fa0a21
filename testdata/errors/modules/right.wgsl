#define_import_path lib::right
#import lib::left
fn right() -> f32 { return left::left(); }
