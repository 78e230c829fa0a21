//! Damaged inputs: bytes of every material, scene and lock changed by chance never panic, and what is refused says
//! something. No randomness from outside: a failure names the file and the round, and comes again.
#![cfg(feature = "search")]

mod fixtures;

use lodc::emit::Lock;
use lodc::front::Source;
use lodc::scene::Scene;
use std::panic::catch_unwind;

const LOCK: &str = r#"format = 1
source = { file = "a.wgsl", normal_form = "00112233445566778899aabbccddeeff", fragment = "fs_main" }
scene = { file = "a.toml", hash = "blake3:00" }
output = { form = "override", target = "wgsl" }
seed = 1
rho0 = 308.0

[[level]]
autolod = 1.69
distance = 4.229
error = 0.05538
floor = 0.05427
bound = 0.01211
cost = 0.8397
says = "noise replaced by its mean"
recipe = [
  { pass = "op-removal", site = "fs_main.noise#d4cd8696391417a9", choice = "mean", value = [0.321073], hex = ["3ea463ae"] },
]
"#;

/// Damaged copies of a text: bytes replaced, taken out, repeated.
fn damaged(text: &str, rounds: u64) -> impl Iterator<Item = (u64, String)> {
    let bytes = text.as_bytes().to_vec();
    (0..rounds).map(move |round| {
        let mut state = round.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mut below = |end: usize| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) as usize % end.max(1)
        };
        let mut damaged = bytes.clone();
        for _ in 0..=below(4) {
            let at = below(damaged.len());
            let end = (at + 1 + below(12)).min(damaged.len());
            match below(4) {
                0 => damaged[at] = b" {}()[]<>;:,.=\"'-+*/0189_azAZ\n"[below(30)],
                1 => drop(damaged.drain(at..end)),
                2 => {
                    let part = damaged[at..end].to_vec();
                    damaged.splice(at..at, part);
                }
                _ => damaged[at] = damaged[at].wrapping_add(1 + below(255) as u8),
            }
        }
        (round, String::from_utf8_lossy(&damaged).into_owned())
    })
}

/// Runs something that may refuse its input, but not panic and not be silent.
fn survives<T>(
    name: &str,
    round: u64,
    run: impl FnOnce() -> lodc::Result<T> + std::panic::UnwindSafe,
) {
    match catch_unwind(run) {
        Ok(Ok(_)) => {}
        Ok(Err(error)) => assert!(!error.message.is_empty(), "{name}, round {round}"),
        Err(_) => panic!("{name} panics in round {round}"),
    }
}

#[test]
fn damaged_shaders_scenes_and_locks_are_refused_or_read() {
    for path in fixtures::shaders("testdata/materials") {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(&path).expect("a shader is text");
        for (round, text) in damaged(&text, 100) {
            survives(&name, round, || Source::parse(&name, text));
        }
        let source = Source::read(&path).unwrap_or_else(|e| panic!("{e}"));
        let file = path.with_extension("toml");
        let Ok(text) = std::fs::read_to_string(&file) else {
            continue;
        };
        let name = file.display().to_string();
        for (round, text) in damaged(&text, 40) {
            survives(&name, round, || {
                Scene::resolve(&source, Some((&file, &text)))
            });
        }
    }
    assert!(Lock::parse("lock", LOCK).is_ok());
    for (round, text) in damaged(LOCK, 400) {
        survives("lock", round, || Lock::parse("lock", &text));
    }
}
