//! Blocks of lines: loops, branches, and where variables are declared.

use crate::emit::tokens::words;

/// The lines with less structure, and the same meaning.
pub(super) fn simplified(mut lines: Vec<String>) -> Vec<String> {
    lines = without_empty_branches(lines);
    flatten(&mut lines);
    chain(&mut lines);
    lines = declared_where_assigned(lines);
    loops(&mut lines);
    lines
}

fn indent(line: &str) -> usize {
    line.len() - line.trim_start().len()
}

/// The line that closes the block that a line opens: the next one at its depth that starts with a brace.
fn closing(lines: &[String], open: usize) -> Option<usize> {
    let depth = indent(&lines[open]);
    (open + 1..lines.len())
        .find(|at| indent(&lines[*at]) == depth && lines[*at].trim_start().starts_with('}'))
}

fn dedent(lines: &mut [String]) {
    for line in lines {
        if line.starts_with("    ") {
            line.drain(..4);
        }
    }
}

/// A block for its own sake goes: names are unique within a function.
fn flatten(lines: &mut Vec<String>) {
    let mut at = 0;
    while at < lines.len() {
        match closing(lines, at).filter(|_| lines[at].trim_start() == "{") {
            Some(end) => {
                dedent(&mut lines[at..end]);
                lines.remove(end);
                lines.remove(at);
            }
            None => at += 1,
        }
    }
}

/// `else { if ... }` becomes `else if ...`.
fn chain(lines: &mut Vec<String>) {
    // From the last, so that inner chains are made first.
    for at in (0..lines.len()).rev() {
        if lines[at].trim_start() != "} else {" {
            continue;
        }
        let depth = indent(&lines[at]);
        let Some(end) = closing(lines, at) else {
            continue;
        };
        let inner = at + 1;
        if inner >= end || !lines[inner].trim_start().starts_with("if ") {
            continue;
        }
        let mut last = inner;
        while lines[last].trim_start() != "}" {
            match closing(lines, last) {
                Some(next) if next < end => last = next,
                _ => break,
            }
        }
        if last + 1 != end || lines[last].trim_start() != "}" {
            continue;
        }
        lines.remove(last);
        let condition = lines.remove(inner);
        lines[at] = format!("{}}} else {}", " ".repeat(depth), condition.trim_start());
        dedent(&mut lines[inner..last - 1]);
    }
}

/// A loop with a condition in front and one step behind becomes a `for`.
fn loops(lines: &mut Vec<String>) {
    for at in (0..lines.len()).rev() {
        // One that is no `for` stays as it is.
        let _ = as_for(lines, at);
    }
}

fn as_for(lines: &mut Vec<String>, at: usize) -> Option<()> {
    let content = |line: usize| lines.get(line).map(|line| line.trim_start());
    if content(at)? != "loop {" {
        return None;
    }
    let end = closing(lines, at)?;
    let condition = content(at + 1)?.strip_prefix("if ")?.strip_suffix(" {")?;
    if content(at + 2)? != "break;" || content(at + 3)? != "}" {
        return None;
    }
    let condition = negated(condition);
    let continuing = end.checked_sub(3)?;
    if content(continuing)? != "continuing {" || continuing < at + 4 {
        return None;
    }
    let step = content(continuing + 1)?.strip_suffix(';')?.to_owned();
    let (counter, operator) = step.split_once(' ')?;
    if !operator.contains("= ") || step.starts_with("let ") {
        return None;
    }
    let depth = indent(&lines[at]);
    let start = lines[..at]
        .iter()
        .rposition(|line| line.starts_with(&format!("    var {counter}: ")))
        // A nested loop would start anew each time.
        .filter(|_| depth == 4)
        .filter(|start| {
            let outside = (*start + 1..at).chain(end + 1..lines.len());
            outside
                .into_iter()
                .all(|line| !words(&lines[line]).contains(counter))
        })
        .and_then(|start| {
            let (_, value) = lines[start].split_once(" = ")?;
            let value = value.strip_suffix(';')?;
            Some((start, format!("var {counter} = {value}")))
        });
    let first = start.as_ref().map_or("", |(_, first)| first);
    let head = format!("{}for ({first}; {condition}; {step}) {{", " ".repeat(depth));
    lines.drain(continuing..end);
    lines.drain(at + 1..at + 4);
    lines[at] = head;
    if let Some((start, _)) = start {
        lines.remove(start);
        if lines.get(1).is_some_and(String::is_empty) {
            lines.remove(1);
        }
    }
    Some(())
}

/// `if c { } else { x }` becomes `if !c { x }`.
fn without_empty_branches(lines: Vec<String>) -> Vec<String> {
    let mut out: Vec<String> = Vec::with_capacity(lines.len());
    for line in lines {
        let opened = out
            .last()
            .filter(|_| line.trim_start() == "} else {")
            .and_then(|last| {
                let content = last.trim_start();
                let condition = content.strip_prefix("if ")?.strip_suffix(" {")?;
                let indent = &last[..last.len() - content.len()];
                Some(format!("{indent}if {} {{", negated(condition)))
            });
        match opened {
            Some(opened) => {
                out.pop();
                out.push(opened);
            }
            None => out.push(line),
        }
    }
    out
}

/// `var x: f32;` goes down to the first `x = ...;` that is its first mention, outside of any block.
fn declared_where_assigned(mut lines: Vec<String>) -> Vec<String> {
    let mut at = 0;
    while at < lines.len() {
        let variable = lines[at]
            .strip_prefix("    var ")
            .and_then(|rest| rest.strip_suffix(';'))
            .filter(|rest| !rest.contains(" = "))
            .and_then(|rest| rest.split_once(": "))
            .map(|(name, _)| name.to_owned());
        let Some(variable) = variable else {
            at += 1;
            continue;
        };
        let mentions = |line: &str| words(line).contains(variable.as_str());
        let first = (at + 1..lines.len()).find(|line| mentions(&lines[*line]));
        let value = first.and_then(|line| {
            let value = lines[line].strip_prefix(&format!("    {variable} = "))?;
            (!mentions(value)).then(|| (line, format!("    var {variable} = {value}")))
        });
        match value {
            Some((line, declared)) => {
                lines[line] = declared;
                lines.remove(at);
            }
            None => at += 1,
        }
    }
    // The writer's blank line behind the variables.
    if lines.get(1).is_some_and(String::is_empty) {
        lines.remove(1);
    }
    lines
}

/// The opposite of a condition. Comparisons are not turned round: with a NaN, `!(a < b)` is not `a >= b`.
fn negated(condition: &str) -> String {
    let is_name = condition
        .chars()
        .all(|c| c.is_alphanumeric() || matches!(c, '_' | '.'));
    if is_name {
        return format!("!{condition}");
    }
    if let Some(inner) = condition.strip_prefix('!') {
        if inner
            .chars()
            .all(|c| c.is_alphanumeric() || matches!(c, '_' | '.'))
        {
            return inner.to_owned();
        }
        if let Some(inner) = inner.strip_prefix('(').and_then(|i| i.strip_suffix(')')) {
            let mut depth = 0i32;
            let closes_early = inner.chars().any(|c| {
                depth += match c {
                    '(' => 1,
                    ')' => -1,
                    _ => 0,
                };
                depth < 0
            });
            if !closes_early {
                return inner.to_owned();
            }
        }
    }
    format!("!({condition})")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn becomes(before: &[&str], after: &[&str]) {
        let lines = before.iter().map(|line| (*line).to_owned()).collect();
        assert_eq!(simplified(lines), after);
    }

    #[test]
    fn comparisons_are_not_turned_round() {
        assert_eq!(negated("a < b"), "!(a < b)");
        assert_eq!(negated("!(a < b)"), "a < b");
        assert_eq!(negated("!(a) || (b)"), "!(!(a) || (b))");
        assert_eq!(negated("a.x"), "!a.x");
        assert_eq!(negated("!a"), "a");
        assert_eq!(negated("!a && b"), "!(!a && b)");
    }

    #[test]
    fn a_counting_loop_becomes_a_for() {
        becomes(
            &[
                "fn f() {",
                "    var i: u32 = 0u;",
                "",
                "    loop {",
                "        if i < n {",
                "        } else {",
                "            break;",
                "        }",
                "        {",
                "            g(i);",
                "        }",
                "        continuing {",
                "            i = i + 1u;",
                "        }",
                "    }",
                "}",
            ],
            &[
                "fn f() {",
                "    for (var i = 0u; i < n; i = i + 1u) {",
                "        g(i);",
                "    }",
                "}",
            ],
        );
    }

    #[test]
    fn a_counter_that_is_used_elsewhere_stays_outside() {
        let body = [
            "    loop {",
            "        if !(i < n) {",
            "            break;",
            "        }",
            "        g(i);",
            "        continuing {",
            "            i = i + 1u;",
            "        }",
            "    }",
        ];
        let before: Vec<&str> = ["fn f() {", "    var i: u32 = 0u;", ""]
            .into_iter()
            .chain(body)
            .chain(["    return i;", "}"])
            .collect();
        becomes(
            &before,
            &[
                "fn f() {",
                "    var i: u32 = 0u;",
                "",
                "    for (; i < n; i = i + 1u) {",
                "        g(i);",
                "    }",
                "    return i;",
                "}",
            ],
        );
    }

    #[test]
    fn other_loops_stay() {
        let lines = [
            "fn f() {",
            "    loop {",
            "        g(i);",
            "        continuing {",
            "            let a = i;",
            "            i = a + 1u;",
            "            break if a > 3u;",
            "        }",
            "    }",
            "}",
        ];
        becomes(&lines, &lines);
    }

    #[test]
    fn branches_chain() {
        becomes(
            &[
                "    if a {",
                "        x();",
                "    } else {",
                "        if b {",
                "            y();",
                "        } else {",
                "            if c {",
                "                z();",
                "            }",
                "        }",
                "    }",
            ],
            &[
                "    if a {",
                "        x();",
                "    } else if b {",
                "        y();",
                "    } else if c {",
                "        z();",
                "    }",
            ],
        );
        let lines = [
            "    if a {",
            "        x();",
            "    } else {",
            "        if b {",
            "            y();",
            "        }",
            "        z();",
            "    }",
        ];
        becomes(&lines, &lines);
    }
}
