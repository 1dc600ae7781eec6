//! IDL text -> tokens. Pure.

/// Words, numbers, punctuation; comments, preprocessor lines, section marks and the contents of
/// strings are left out. What is searched for is gone over, so that the work grows as the text does.
pub(super) fn tokens(text: &str) -> Vec<&str> {
    let mut tokens = Vec::new();
    let mut rest = text;
    let mut line_start = true;
    while let Some(c) = rest.chars().next() {
        let skip = if c == '\n' {
            line_start = true;
            1
        } else if c.is_whitespace() {
            c.len_utf8()
        } else if line_start && (c == '#' || c == '=' || rest.starts_with("IDL:"))
            || rest.starts_with("//")
        {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if c == '"' || c == '\'' {
            quoted(rest, c)
        } else if c.is_ascii_alphanumeric() || c == '_' {
            let end = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
            end.unwrap_or(rest.len())
        } else if rest.starts_with("::") {
            2
        } else {
            c.len_utf8()
        };
        let token = rest.get(..skip).unwrap_or("");
        let first = token.chars().next().unwrap_or(' ');
        let is_token = first.is_ascii_alphanumeric() || "_{}[]<>();,:@=".contains(first);
        if is_token && !(line_start && (first == '=' || token.starts_with("IDL:"))) {
            tokens.push(token);
        }
        if c != '\n' && !c.is_whitespace() {
            line_start = false;
        }
        rest = rest.get(skip.max(1)..).unwrap_or("");
    }
    tokens
}

/// Bytes of a quoted text at the start of `rest`.
fn quoted(rest: &str, quote: char) -> usize {
    let mut escaped = false;
    for (at, c) in rest.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            _ if c == quote => return at + 1,
            _ => {}
        }
    }
    rest.len()
}
