//! Several logs, examined one after the other -> one page: a table that compares them, and what is said of each. Pure.
//!
//! What is drawn of a log is made as soon as it was examined, within its share of the page: no log waits in memory for
//! the last.

use super::markup::escaped;
use super::verdict::{Level, figures};
use super::{DRAWN, LARGEST, Page, STRETCHES, document};
use serde_json::{Value, json};
use std::fmt::Write as _;

/// Bytes of the page that are no log's: style, script, the words above.
const OWN: usize = 60_000;
/// Size of a log's row in the table.
const ROW: usize = 3_000;
/// Fewest stretches of time a chart has, beside those of other logs.
const COARSEST: usize = 24;

const HEAD: [&str; 9] = [
    "log",
    "verdict",
    "duration, s",
    "rate, Hz",
    "lost",
    "gaps",
    "turned, deg",
    "error of tilt / heading, deg",
    "gyro over 1 s, deg",
];

/// A page about several logs.
#[derive(Debug)]
pub struct Several {
    /// Bytes that are left, and logs that are to come.
    left: usize,
    to_come: usize,
    count: usize,
    rows: String,
    articles: String,
    json: Vec<Value>,
    levels: [usize; 3],
    unread: usize,
}

impl Several {
    /// Makes it for so many logs.
    #[must_use]
    pub fn of(count: usize) -> Several {
        Several {
            left: LARGEST.saturating_sub(OWN + ROW * count),
            to_come: count,
            count: 0,
            rows: String::new(),
            articles: String::new(),
            json: Vec::new(),
            levels: [0; 3],
            unread: 0,
        }
    }

    /// Takes the next log.
    pub fn add(&mut self, page: &Page<'_>) {
        self.count += 1;
        let verdict = page.verdict();
        self.levels[verdict.level as usize] += 1;
        let (name, json) = (page.name(), page.json());
        let room = self.left / self.to_come.max(1);
        self.to_come = self.to_come.saturating_sub(1);
        let numbers = json.to_string().len();
        let body = body(page, room.saturating_sub(numbers));
        let taken = body.as_ref().map_or(0, |body| body.len() + numbers);
        self.left = self.left.saturating_sub(taken);
        let link = match &body {
            Some(_) => format!("<a href=\"#log-{}\">{}</a>", self.count, escaped(name)),
            None => escaped(name),
        };
        let topics = figures(page.checked);
        let several = topics.len() > 1;
        for (topic, cells) in &topics {
            let topic = match several {
                true => format!("<br><small>{}</small>", escaped(topic)),
                false => String::new(),
            };
            self.row(&format!("{link}{topic}"), verdict.level, cells);
        }
        if topics.is_empty() {
            self.row(&link, verdict.level, &[const { String::new() }; 7]);
        }
        match body {
            Some(body) => {
                let _ = writeln!(
                    self.articles,
                    "<article id=\"log-{}\">\n{body}</article>",
                    self.count
                );
                self.json.push(json);
            }
            // All that a page with so many has room for.
            None => self.json.push(json!({
                "file": json["file"], "sha256": json["sha256"], "verdict": json["verdict"], "lossy": json["lossy"],
            })),
        }
    }

    /// Takes a log that cannot be read.
    pub fn add_unread(&mut self, file: &str, why: &str) {
        self.count += 1;
        self.unread += 1;
        self.to_come = self.to_come.saturating_sub(1);
        let _ = writeln!(
            self.rows,
            "<tr><td>{}</td><td class=\"bad\" colspan=\"{}\">{}</td></tr>",
            escaped(file),
            HEAD.len() - 1,
            escaped(why)
        );
        self.json.push(json!({ "file": file, "error": why }));
    }

    fn row(&mut self, log: &str, level: Level, cells: &[String; 7]) {
        let cells = cells.iter().fold(String::new(), |all, cell| {
            all + "<td>" + &escaped(cell) + "</td>"
        });
        let _ = writeln!(
            self.rows,
            "<tr><td>{log}</td><td class=\"{}\">{}</td>{cells}</tr>",
            level.name(),
            level.word()
        );
    }

    /// Sentence of how many are good, usable, wrong.
    #[must_use]
    pub fn sentence(&self) -> String {
        let [good, warning, bad] = self.levels;
        let counts = [
            (good, "good"),
            (warning, "usable with care"),
            (bad, "with something wrong"),
            (self.unread, "that cannot be read"),
        ];
        let said: Vec<String> = counts
            .into_iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| format!("{count} {what}"))
            .collect();
        format!("{}.", said.join(", "))
    }

    /// The page.
    #[must_use]
    pub fn html(&self) -> String {
        let level = match self.levels {
            [_, 0, 0] if self.unread == 0 => Level::Good,
            [_, _, 0] if self.unread == 0 => Level::Warning,
            _ => Level::Bad,
        };
        let sentence = self.sentence();
        let head = HEAD.iter().fold(String::new(), |all, cell| {
            all + "<th scope=\"col\">" + cell + "</th>"
        });
        let body = format!(
            "<h1>{} logs</h1>\n<p id=\"verdict\" class=\"{}\">{sentence}</p>\n\
             <section id=\"logs\"><h2>Side by side</h2>\n<div class=\"wide\" tabindex=\"0\"><table class=\"numbers\">\n<thead><tr>{head}</tr></thead>\n<tbody>\n{}</tbody></table></div>\n\
             <p class=\"small\">Error: of the attitude against the log's own reference, where it has one, rms over all of it, the worlds laid on each other as the log's part says; of the gyro alone over 1 s the median.</p></section>\n{}",
            self.count,
            level.name(),
            self.rows,
            self.articles
        );
        document(
            &format!("{} logs", self.count),
            &body,
            &Value::Array(self.json.clone()),
        )
    }
}

/// Body of a log in so many bytes: drawn more coarsely, or not at all, where it would be more.
fn body(page: &Page<'_>, room: usize) -> Option<String> {
    let mut stretches = STRETCHES / page.checked.topics.len().clamp(1, DRAWN);
    while stretches > COARSEST {
        let body = page.body(Some(stretches));
        if body.len() <= room {
            return Some(body);
        }
        stretches = stretches * 3 / 4;
    }
    Some(page.body(None)).filter(|body| body.len() <= room)
}
