//! Names in other people's sources: the words in them, and whole words in a text.

use std::ops::Range;

/// The words of a name in lower case: `worldPos`, `world_pos` and `WorldPos` are all `world`, `pos`;
/// digits are words of their own (`uv1` is `uv`, `1`).
pub(crate) fn words(name: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut last = None;
    let mut chars = name.chars().peekable();
    while let Some(c) = chars.next() {
        if !c.is_alphanumeric() {
            last = None;
            continue;
        }
        let starts = match last {
            None => true,
            Some(last) => {
                let last: char = last;
                let up = c.is_uppercase();
                // `viewProj`, but also `MVPMatrix`: the last capital before a small letter starts a word.
                (up && last.is_lowercase())
                    || (up && last.is_uppercase() && chars.peek().is_some_and(|n| n.is_lowercase()))
                    || (c.is_ascii_digit() != last.is_ascii_digit())
            }
        };
        if starts {
            words.push(String::new());
        }
        if let Some(word) = words.last_mut() {
            word.extend(c.to_lowercase());
        }
        last = Some(c);
    }
    words
}

/// Those of `names` that look most like `wanted`, at most `most`, the likest first.
pub(crate) fn nearest<'n>(
    wanted: &str,
    names: impl IntoIterator<Item = &'n str>,
    most: usize,
) -> Vec<&'n str> {
    let wanted = wanted.to_lowercase();
    let mut near: Vec<(usize, &str)> = names
        .into_iter()
        .filter_map(|name| {
            let lower = name.to_lowercase();
            let d = edit_distance(&wanted, &lower);
            let longest = wanted.chars().count().max(lower.chars().count());
            let contained = wanted.len() > 2 && lower.contains(&wanted);
            (contained || 5 * d <= 2 * longest).then_some((d, name))
        })
        .collect();
    near.sort();
    // The second best is no help when the best is much nearer.
    let enough = near.first().map_or(0, |(d, _)| d + 1);
    let near = near.into_iter().take_while(|(d, _)| *d <= enough);
    near.map(|(_, name)| name).take(most).collect()
}

/// How many characters must be put in, left out or changed to make one text of the other.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let change = diagonal + usize::from(ca != *cb);
            diagonal = row[j + 1];
            row[j + 1] = change.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

/// A list of names for a message: "`a`, `b` and `c`".
pub(crate) fn listed<'n>(names: impl IntoIterator<Item = &'n str>) -> String {
    let names: Vec<String> = names.into_iter().map(|n| format!("`{n}`")).collect();
    match names.split_last() {
        None => "none".to_owned(),
        Some((only, [])) => only.clone(),
        Some((last, rest)) => format!("{} and {last}", rest.join(", ")),
    }
}

/// The byte range of the first place in a part of a text where `word` stands as a whole word.
pub(crate) fn whole_word(text: &str, within: Range<usize>, word: &str) -> Option<Range<usize>> {
    if word.is_empty() {
        return None;
    }
    let part = text.get(within.clone())?;
    let joins = |c: char| c.is_alphanumeric() || c == '_';
    part.match_indices(word).find_map(|(at, _)| {
        let before = part[..at].chars().next_back();
        let after = part[at + word.len()..].chars().next();
        let alone = !before.is_some_and(joins) && !after.is_some_and(joins);
        alone.then(|| within.start + at..within.start + at + word.len())
    })
}

/// The byte range of a function's name where it is declared: behind `fn`, so that a mention in a comment
/// does not count.
pub(crate) fn function_name(text: &str, name: &str) -> Option<Range<usize>> {
    let mut from = 0;
    while let Some(keyword) = whole_word(text, from..text.len(), "fn") {
        let rest = &text[keyword.end..];
        let start = keyword.end + rest.len() - rest.trim_start().len();
        if whole_word(text, start..text.len(), name).is_some_and(|found| found.start == start) {
            return Some(start..start + name.len());
        }
        from = keyword.end;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_split_at_case_underscores_and_digits() {
        for (name, expected) in [
            ("worldPos", "world pos"),
            ("world_pos", "world pos"),
            ("WorldPos", "world pos"),
            ("MVPMatrix", "mvp matrix"),
            ("viewProj", "view proj"),
            ("uv1", "uv 1"),
            ("u_mvp", "u mvp"),
            ("__a__", "a"),
            ("", ""),
            ("größe", "größe"),
        ] {
            assert_eq!(words(name).join(" "), expected, "{name}");
        }
    }

    #[test]
    fn near_names_are_near() {
        let names = ["roughness", "metallic", "base_color", "camera.view_proj"];
        assert_eq!(nearest("roughnes", names, 2), ["roughness"]);
        assert_eq!(nearest("base_colour", names, 2), ["base_color"]);
        assert_eq!(nearest("view_proj", names, 2), ["camera.view_proj"]);
        let members = ["paint.gloss", "paint.mode", "paint.tint"];
        assert_eq!(nearest("paint.glos", members, 3), ["paint.gloss"]);
        assert!(nearest("xyz", names, 2).is_empty());
        assert_eq!(edit_distance("kitten", "sitting"), 3);
    }

    #[test]
    fn whole_words_only() {
        let text = "uv_x uv xuv";
        assert_eq!(whole_word(text, 0..text.len(), "uv"), Some(5..7));
        assert_eq!(whole_word(text, 6..text.len(), "uv"), None);
        assert_eq!(whole_word(text, 0..text.len(), ""), None);
        assert_eq!(whole_word(text, 9..99, "uv"), None);
    }

    #[test]
    fn functions_are_found_where_they_are_declared() {
        let text = "// fs is here\nfn fsx() {}\nfn  fs() { fs }";
        assert_eq!(function_name(text, "fs"), Some(30..32));
        assert_eq!(function_name(text, "gs"), None);
    }

    #[test]
    fn lists_read_like_sentences() {
        assert_eq!(listed([]), "none");
        assert_eq!(listed(["a"]), "`a`");
        assert_eq!(listed(["a", "b", "c"]), "`a`, `b` and `c`");
    }
}
