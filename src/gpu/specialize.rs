//! Leaves out of a shader what a scene does not need, before a compiler sees it.
//!
//! Compilers know the values of `override` constants, but several fold them only after every call has been inlined: dead
//! code then costs most of the time that a pipeline takes. So conditions that the constants decide are decided here, on the
//! text: branches not taken go, and with them functions that nothing calls any more. Lines keep their numbers.

use std::collections::{HashMap, HashSet};

/// WGSL `source` with the `override` constants that `value` knows in their places, and without the code that they switch
/// off. Comments go, too.
///
/// Understood are conditions of `if` and values of `return` made of `!`, `&&`, `||` and parentheses. Expressions are taken to
/// have no side effects.
pub fn specialize(source: &str, value: &dyn Fn(&str) -> Option<bool>) -> String {
    let text: String =
        source.lines().flat_map(|line| [line.split("//").next().unwrap_or_default().trim_end(), "\n"]).collect();
    let mut folder = Folder { text: &text, at: 0, value };
    let mut out = String::with_capacity(text.len());
    folder.block(&mut out);
    without_unreached(&out)
}

/// What is known of a condition.
enum Condition {
    Known(bool),
    Unknown(String),
}

struct Folder<'a> {
    text: &'a str,
    at: usize,
    value: &'a dyn Fn(&str) -> Option<bool>,
}

impl<'a> Folder<'a> {
    /// Copies statements or declarations up to the closing brace, which is left, or the end. Whether the block's end is
    /// never reached.
    fn block(&mut self, out: &mut String) -> bool {
        while let Some(word) = self.next() {
            match word {
                "}" => {
                    self.at -= 1;
                    return false;
                }
                "{" => {
                    out.push('{');
                    self.block(out);
                    self.close(out);
                }
                "if" => {
                    if self.branches(out) {
                        self.skip_block(out);
                        return true;
                    }
                }
                "return" => {
                    let result = self.until(";");
                    match self.fold(result) {
                        Condition::Known(value) => {
                            out.push_str(&format!("return {value}"));
                            keep_lines(result, out);
                        }
                        Condition::Unknown(_) => out.extend(["return", result]),
                    }
                    return self.leave(out);
                }
                "break" | "continue" => {
                    out.extend([word, self.until(";")]);
                    return self.leave(out);
                }
                "override" => {
                    let declaration = self.until(";");
                    let name = declaration.split(':').next().unwrap_or_default().trim();
                    match (self.value)(name) {
                        Some(value) => out.push_str(&format!("const {name} = {value}")),
                        None => out.extend(["override", declaration]),
                    }
                }
                _ => out.push_str(word),
            }
        }
        false
    }

    /// The end of a statement after which the block does not go on.
    fn leave(&mut self, out: &mut String) -> bool {
        out.push(';');
        self.at += 1;
        self.skip_block(out);
        true
    }

    /// An `if` with all its branches. Whether the end of what is left of it is never reached.
    fn branches(&mut self, out: &mut String) -> bool {
        let mut is_first = true;
        let mut is_decided = false;
        let mut leaves = false;
        loop {
            let condition = self.until("{");
            self.at += 1;
            // After a bare `else` nothing is asked.
            let known = if condition.trim().is_empty() { Condition::Known(true) } else { self.fold(condition) };
            keep_lines(condition, out);
            match known {
                _ if is_decided => self.skip_block(out),
                Condition::Known(false) => self.skip_block(out),
                Condition::Known(true) => {
                    out.push_str(if is_first { "{" } else { " else {" });
                    let ends = self.block(out);
                    leaves = is_first && ends;
                    out.push('}');
                    is_decided = true;
                }
                Condition::Unknown(rest) => {
                    out.push_str(if is_first { "if " } else { " else if " });
                    out.extend([rest.trim(), " {"]);
                    self.block(out);
                    out.push('}');
                    is_first = false;
                }
            }
            self.close(&mut String::new());
            let here = self.at;
            let gap = self.space();
            if self.next() != Some("else") {
                self.at = here;
                return leaves;
            }
            keep_lines(gap, out);
            let gap = self.space();
            let before = self.at;
            if self.next() != Some("if") {
                self.at = before;
            }
            keep_lines(gap, out);
        }
    }

    fn space(&mut self) -> &'a str {
        let rest = &self.text[self.at..];
        let space = &rest[..rest.len() - rest.trim_start().len()];
        self.at += space.len();
        space
    }

    /// The next word, or character that is none.
    fn next(&mut self) -> Option<&'a str> {
        let rest = &self.text[self.at..];
        let end = match rest.find(|c: char| !is_of_word(c)) {
            Some(0) => rest.chars().next()?.len_utf8(),
            Some(end) => end,
            None => rest.len(),
        };
        self.at += end;
        (end > 0).then(|| &rest[..end])
    }

    /// Everything before the next `mark`, which is left.
    fn until(&mut self, mark: &str) -> &'a str {
        let rest = &self.text[self.at..];
        let part = &rest[..rest.find(mark).unwrap_or(rest.len())];
        self.at += part.len();
        part
    }

    /// Goes to the closing brace of the block, keeping its lines.
    fn skip_block(&mut self, out: &mut String) {
        let start = self.at;
        let mut depth = 0;
        while let Some(word) = self.next() {
            match word {
                "{" => depth += 1,
                "}" if depth == 0 => {
                    self.at -= 1;
                    break;
                }
                "}" => depth -= 1,
                _ => {}
            }
        }
        keep_lines(&self.text[start..self.at], out);
    }

    /// Takes the closing brace.
    fn close(&mut self, out: &mut String) {
        if self.next().is_some() {
            out.push('}');
        }
    }

    fn fold(&self, condition: &str) -> Condition {
        let condition = condition.trim();
        for (operator, decisive) in [("||", true), ("&&", false)] {
            let parts = split(condition, operator);
            if parts.len() > 1 {
                let mut left = Vec::new();
                for part in parts {
                    match self.fold(part) {
                        Condition::Known(value) if value == decisive => return Condition::Known(decisive),
                        Condition::Known(_) => {}
                        Condition::Unknown(rest) => left.push(rest),
                    }
                }
                if left.is_empty() {
                    return Condition::Known(!decisive);
                }
                return Condition::Unknown(left.join(&format!(" {operator} ")));
            }
        }
        if let Some(rest) = condition.strip_prefix('!').filter(|rest| !rest.starts_with('=')) {
            return match self.fold(rest) {
                Condition::Known(value) => Condition::Known(!value),
                Condition::Unknown(_) => Condition::Unknown(condition.to_owned()),
            };
        }
        if let Some(inner) = parenthesized(condition) {
            return match self.fold(inner) {
                Condition::Unknown(rest) => Condition::Unknown(format!("({rest})")),
                known => known,
            };
        }
        match condition.chars().all(is_of_word).then(|| (self.value)(condition)).flatten() {
            Some(value) => Condition::Known(value),
            None => Condition::Unknown(condition.to_owned()),
        }
    }
}

fn is_of_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

fn keep_lines(left_out: &str, out: &mut String) {
    out.extend(left_out.chars().filter(|c| *c == '\n'));
}

/// The operands of an operator, those within parentheses aside.
fn split<'a>(text: &'a str, operator: &str) -> Vec<&'a str> {
    let mut parts = Vec::new();
    let (mut depth, mut start, mut at) = (0, 0, 0);
    while let Some(c) = text[at..].chars().next() {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            _ if depth == 0 && text[at..].starts_with(operator) => {
                parts.push(&text[start..at]);
                start = at + operator.len();
                at = start;
                continue;
            }
            _ => {}
        }
        at += c.len_utf8();
    }
    parts.push(&text[start..]);
    parts
}

/// What one pair of parentheses round everything holds.
fn parenthesized(text: &str) -> Option<&str> {
    let inner = text.strip_prefix('(')?.strip_suffix(')')?;
    let mut depth = 0;
    for c in inner.chars() {
        match c {
            '(' => depth += 1,
            ')' if depth == 0 => return None,
            ')' => depth -= 1,
            _ => {}
        }
    }
    Some(inner)
}

/// `text` without functions that no entry point leads to. (Declarations outside of functions call none.)
fn without_unreached(text: &str) -> String {
    let functions = functions(text);
    let mut by_name = HashMap::new();
    let mut reached = HashSet::new();
    let mut to_do = Vec::new();
    for function in &functions {
        by_name.insert(function.name, function.text);
        // Only entry points carry attributes.
        if function.is_entry && reached.insert(function.name) {
            to_do.push(function.text);
        }
    }
    while let Some(text) = to_do.pop() {
        for word in text.split(|c| !is_of_word(c)) {
            if let Some(called) = by_name.get(word)
                && reached.insert(word)
            {
                to_do.push(called);
            }
        }
    }
    let mut out = String::with_capacity(text.len());
    let mut at = 0;
    for function in functions {
        let start = function.text.as_ptr() as usize - text.as_ptr() as usize;
        out.push_str(&text[at..start]);
        if reached.contains(function.name) {
            out.push_str(function.text);
        } else {
            keep_lines(function.text, &mut out);
        }
        at = start + function.text.len();
    }
    out.push_str(&text[at..]);
    out
}

/// Behind the first pair of braces.
fn end_of_braces(text: &str) -> usize {
    let mut depth = 0;
    for (at, c) in text.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 1 => return at + 1,
            '}' => depth -= 1,
            _ => {}
        }
    }
    text.len()
}

struct Function<'a> {
    name: &'a str,
    is_entry: bool,
    /// From `fn` to the closing brace.
    text: &'a str,
}

/// Functions, of which every one begins a line (WGSL has none within others).
fn functions(text: &str) -> Vec<Function<'_>> {
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(start) = text[at..].find("\nfn ").map(|offset| at + offset + 1) {
        let end = start + end_of_braces(&text[start..]);
        let name = text[start + 3..end].split(|c| !is_of_word(c)).next().unwrap_or_default();
        let before = text[..start].lines().next_back().unwrap_or_default();
        found.push(Function { name, is_entry: before.starts_with('@'), text: &text[start..end] });
        at = end;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With `on` true, `off` false, and nothing known of other names.
    fn with_known(source: &str) -> String {
        specialize(source, &|name| match name {
            "on" => Some(true),
            "off" => Some(false),
            _ => None,
        })
    }

    /// A statement within a function; what comes out, lines joined.
    fn statement(source: &str) -> String {
        let out = with_known(&format!("@compute\nfn main() {{{source}}}\n"));
        let inner = out.strip_prefix("@compute\nfn main() {").and_then(|rest| rest.strip_suffix("}\n"));
        inner.expect("the function").trim().to_owned()
    }

    #[test]
    fn conditions_that_are_known_are_decided() {
        assert_eq!(statement("if on { a(); } else { b(); }"), "{ a(); }");
        assert_eq!(statement("if off { a(); } else { b(); }"), "{ b(); }");
        assert_eq!(statement("if !(off || x && off) { a(); }"), "{ a(); }");
        assert_eq!(statement("if x && on { a(); } else if off { b(); } else { c(); }"), "if x { a(); } else { c(); }");
        assert_eq!(statement("if x { a(); } else if on { b(); } else { c(); }"), "if x { a(); } else { b(); }");
        assert_eq!(statement("if f(on && x) != 1u { a(); }"), "if f(on && x) != 1u { a(); }");
        assert_eq!(statement("if x && (y || off) { a(); }"), "if x && (y) { a(); }");
    }

    #[test]
    fn nothing_follows_a_statement_that_leaves() {
        assert_eq!(statement("if on { return 1; } b();"), "{ return 1;}");
        assert_eq!(statement("if off { return 1; } b();"), "b();");
        assert_eq!(statement("if x { return 1; } b();"), "if x { return 1;} b();");
        assert_eq!(statement("if off { c(); } else { return off && x; } b();"), "{ return false;}");
        assert_eq!(statement("loop { if on { break; } b(); } c();"), "loop { { break;}} c();");
    }

    #[test]
    fn functions_that_nothing_reaches_are_left_out_and_lines_stay() {
        let source = "override off: bool = true; // words\noverride other: bool = true;\nfn far() {\n    if x {\n}\n}\n\
                      fn near() {\n    if off {\n        far();\n    }\n}\n@compute\nfn main() {\n    near();\n}\n";
        let expected = "const off = false;\noverride other: bool = true;\n\n\n\n\n\
                        fn near() {\n    \n\n\n}\n@compute\nfn main() {\n    near();\n}\n";
        let lines = |text: &str| text.lines().map(|line| line.trim_end().to_owned()).collect::<Vec<_>>();
        assert_eq!(lines(&with_known(source)), lines(expected));
    }
}
