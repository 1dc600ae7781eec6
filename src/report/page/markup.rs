//! Text -> HTML that cannot break the page. Pure.

use std::fmt::Write as _;

/// Longest text taken from a log that is shown whole, characters.
const LONGEST: usize = 2000;

/// Fit for HTML text and attributes; what would steer a terminal or the direction of the text is shown,
/// not obeyed; long text is cut.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for (count, c) in text.chars().enumerate() {
        if count == LONGEST {
            out.push_str("...");
            break;
        }
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c if c.is_control()
                || matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}') =>
            {
                out.extend(c.escape_unicode());
            }
            c => out.push(c),
        }
    }
    out
}

/// The same with a capital first.
pub(super) fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string());
    first.unwrap_or_default() + letters.as_str()
}

/// A table of names and what they are.
#[derive(Debug, Default)]
pub(super) struct Rows(String);

impl Rows {
    pub(super) fn add(&mut self, name: &str, what: &str) {
        let _ = writeln!(
            self.0,
            "<tr><th>{}</th><td>{}</td></tr>",
            escaped(name),
            escaped(what)
        );
    }

    pub(super) fn add_code(&mut self, name: &str, what: &str) {
        let _ = writeln!(
            self.0,
            "<tr><th>{}</th><td><code>{}</code></td></tr>",
            escaped(name),
            escaped(what)
        );
    }

    pub(super) fn html(&self) -> String {
        // A row that goes on from the one above has no name.
        let rows = self.0.replace("<th></th>", "<td></td>");
        format!("<table class=\"facts\">\n{rows}</table>\n")
    }
}

/// A table with a head, in a box of its own that scrolls where the screen is narrow.
pub(super) fn table(class: &str, head: &[&str], rows: &[Vec<String>]) -> String {
    let cells = |tag: &str, cells: &mut dyn Iterator<Item = String>| {
        cells.fold(String::new(), |all, cell| {
            all + &format!("<{tag}>{cell}</{tag}>")
        })
    };
    let head =
        cells("th", &mut head.iter().map(|cell| escaped(cell))).replace("<th></th>", "<td></td>");
    let mut out =
        format!("<div class=\"wide\" tabindex=\"0\"><table class=\"{class}\">\n<tr>{head}</tr>\n");
    for row in rows {
        let row = cells("td", &mut row.iter().map(|cell| escaped(cell)));
        let _ = writeln!(out, "<tr>{row}</tr>");
    }
    out + "</table></div>\n"
}

/// A part that is folded until somebody opens it; on paper it is open.
pub(super) fn folded(summary: &str, html: &str) -> String {
    format!(
        "<details><summary>{}</summary>\n{html}</details>\n",
        escaped(summary)
    )
}

/// A chart, or why there is none. Where the screen is narrow it scrolls, by keys too.
pub(super) fn figure(id: &str, svg: Result<String, String>) -> String {
    match svg {
        Ok(svg) => format!(
            "<figure id=\"{}\" tabindex=\"0\">{}</figure>\n",
            escaped(id),
            svg.trim()
        ),
        Err(why) => format!("<p class=\"small\">{}</p>\n", escaped(&why)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_log_says_can_not_become_markup() {
        let text = escaped("</script><b a='\"'>&\u{1b}[31m\u{0}");
        assert!(
            !text.contains(['<', '>', '"', '\'', '\u{1b}', '\u{0}']),
            "{text}"
        );
        assert!(
            text.starts_with("&lt;/script&gt;&lt;b a=&#39;&quot;"),
            "{text}"
        );
        assert!(escaped(&"x".repeat(10_000)).len() < 2100);
    }
}
