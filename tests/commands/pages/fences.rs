//! A page in Markdown -> its fenced blocks -> their commands. Pure.

/// Block between two fences.
#[derive(Debug)]
pub(super) struct Block {
    /// The line of the opening fence, from 1.
    pub(super) line: usize,
    /// The word behind it.
    pub(super) language: String,
    pub(super) text: String,
    /// Commands that are not run, by their number in the block from 1, and why: what a comment of HTML, which no reader
    /// sees, says before the fence, `<!-- untested 2, 3: needs a board -->`.
    pub(super) untested: Vec<(usize, String)>,
}

/// A command of a block: a line, or several that belong together.
#[derive(Debug)]
pub(super) struct Command {
    /// First line in the page, from 1.
    pub(super) line: usize,
    /// Text without its comment.
    pub(super) text: String,
    /// The exit code that its comment names.
    pub(super) code: i32,
    /// Why it is not run.
    pub(super) untested: Option<String>,
}

/// The fenced blocks of a page.
pub(super) fn blocks(page: &str) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let mut is_open = false;
    let mut before = Vec::new();
    for (n, line) in page.lines().enumerate() {
        if let (false, Some(said)) = (is_open, line.strip_prefix("<!-- untested ")) {
            let said = said.strip_suffix(" -->").and_then(|s| s.split_once(": "));
            let (numbers, why) = said.unwrap_or_else(|| panic!("line {}: {line}", n + 1));
            let numbers = numbers.split(", ").map(|n| n.parse().unwrap());
            before.extend(numbers.map(|n: usize| (n, why.to_owned())));
            continue;
        }
        if let Some(language) = line.strip_prefix("```") {
            is_open = !is_open;
            if is_open {
                blocks.push(Block {
                    line: n + 1,
                    language: language.to_owned(),
                    text: String::new(),
                    untested: std::mem::take(&mut before),
                });
            }
        } else if is_open && let Some(block) = blocks.last_mut() {
            block.text.push_str(line);
            block.text.push('\n');
        }
    }
    assert!(!is_open, "a fence is left open");
    assert_eq!(before, [], "of no fence");
    blocks
}

/// The commands of a block. A line that ends in `\` goes on in the next, and `for` as far as `done`.
pub(super) fn commands(block: &Block) -> Vec<Command> {
    let mut commands: Vec<Command> = Vec::new();
    let mut is_whole = true;
    for (n, line) in block.text.lines().enumerate() {
        let (text, comment) = match line.find("# ") {
            Some(at) if line[..at].trim().is_empty() || line[..at].ends_with(' ') => {
                (line[..at].trim_end(), &line[at + 2..])
            }
            _ => (line.trim_end(), ""),
        };
        if text.is_empty() {
            continue;
        }
        let code = comment
            .split_once("exit code ")
            .and_then(|(_, rest)| rest.chars().next()?.to_digit(10))
            .map_or(0, |code| i32::try_from(code).unwrap());
        if is_whole {
            let number = commands.len() + 1;
            let mut untested = block.untested.iter();
            let untested = untested.find(|(of, _)| *of == number);
            commands.push(Command {
                line: block.line + n + 1,
                text: String::new(),
                code: 0,
                untested: untested.map(|(_, why)| why.clone()),
            });
        }
        let command = commands.last_mut().unwrap();
        if !command.text.is_empty() {
            command.text.push('\n');
        }
        command.text.push_str(text);
        command.code = command.code.max(code);
        let mut words = command.text.split(|c: char| c.is_whitespace() || c == ';');
        is_whole = !text.ends_with('\\')
            && (!command.text.starts_with("for ") || words.any(|word| word == "done"));
    }
    let most = block.untested.iter().map(|(number, _)| *number).max();
    assert!(most <= Some(commands.len()), "{block:?}: no such command");
    commands
}

impl Command {
    /// The files that it names as its outputs.
    pub(super) fn outputs(&self) -> Vec<String> {
        let words: Vec<&str> = self.text.split_whitespace().collect();
        words
            .windows(2)
            .filter(|pair| {
                matches!(
                    pair[0],
                    "-o" | "--plot" | "--save-calibration" | "--out-dir" | ">"
                )
            })
            .map(|pair| pair[1].trim_matches('\'').to_owned())
            .filter(|name| !name.ends_with('/'))
            .filter(|name| name != "-" && name != "null:" && !name.contains("://"))
            .collect()
    }
}

#[test]
fn a_block_is_cut_into_its_commands_with_what_their_comments_say() {
    let page = "text\n<!-- untested 2: no b here -->\n<!-- untested 3: the rest -->\n```sh\na -o x.csv   # plain; exit code 3: why\nb \\\n  --c > y\n\n# the rest\nfor i in 1; do\n  d '#1'\ndone\n```\n```json\n{}\n```\n";
    let all = blocks(page);
    assert_eq!(
        all.iter().map(|b| &*b.language).collect::<Vec<_>>(),
        ["sh", "json"]
    );
    let found = commands(&all[0]);
    let texts: Vec<&str> = found.iter().map(|c| &*c.text).collect();
    assert_eq!(
        texts,
        [
            "a -o x.csv",
            "b \\\n  --c > y",
            "for i in 1; do\n  d '#1'\ndone"
        ]
    );
    assert_eq!([found[0].line, found[1].line, found[2].line], [5, 6, 10]);
    assert_eq!(found.iter().map(|c| c.code).collect::<Vec<_>>(), [3, 0, 0]);
    let reasons: Vec<Option<&str>> = found.iter().map(|c| c.untested.as_deref()).collect();
    assert_eq!(reasons, [None, Some("no b here"), Some("the rest")]);
    assert_eq!(found[0].outputs(), ["x.csv"]);
    assert_eq!(found[1].outputs(), ["y"]);
}
