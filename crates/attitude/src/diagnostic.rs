//! Why something cannot be done, and apart from it what helps. Pure.
//!
//! Two fields and not one text, because who is told differs: a terminal shows the help on a line of its own, a page
//! behind a semicolon, a program in Python reads it as `error.help`.
//!
//! ```
//! use strapd_attitude::diagnostic::Diagnostic;
//! use strapd_attitude::setting::GYRO_UNIT;
//!
//! let said = Diagnostic::new("the rates are too large").help(format!("{GYRO_UNIT} deg"));
//! assert_eq!(said.what(), "the rates are too large");
//! assert_eq!(said.to_string(), "the rates are too large\n  help: gyro_unit deg");
//! ```

use std::fmt;

/// Message: what cannot be done, where and why; and what helps. To make one is marked as what seldom happens, so that
/// the code around it is made for what does.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Diagnostic {
    what: String,
    help: String,
    code: Option<&'static str>,
}

impl Diagnostic {
    /// Makes one without help, until [`Diagnostic::help`] gives some.
    #[cold]
    #[inline(never)]
    #[must_use]
    pub fn new(what: impl Into<String>) -> Diagnostic {
        let what = what.into();
        // Another one's whole text: its help would be lost in it. `at` and `after` keep it.
        debug_assert!(!what.contains("\n  help: "), "{what}");
        Diagnostic {
            what,
            help: String::new(),
            code: None,
        }
    }

    /// Adds what helps: settings with their values, or what else can be done.
    #[cold]
    #[inline(never)]
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Diagnostic {
        self.help = help.into();
        self
    }

    /// The same by a stable name, under which it is listed among findings.
    #[must_use]
    pub fn coded(mut self, code: &'static str) -> Diagnostic {
        self.code = Some(code);
        self
    }

    /// Stable name, if it has one.
    #[must_use]
    pub fn code(&self) -> Option<&'static str> {
        self.code
    }

    /// Text of what cannot be done, and why.
    #[must_use]
    pub fn what(&self) -> &str {
        &self.what
    }

    /// Text of what helps; `None` where nothing is known to.
    #[must_use]
    pub fn helping(&self) -> Option<&str> {
        Some(self.help.as_str()).filter(|help| !help.is_empty())
    }

    /// The same, with the place before it: `place: what`.
    #[must_use]
    pub fn at(self, place: impl fmt::Display) -> Diagnostic {
        self.after(format_args!("{place}:"))
    }

    /// The same, with words before it.
    #[cold]
    #[inline(never)]
    #[must_use]
    pub fn after(mut self, words: impl fmt::Display) -> Diagnostic {
        self.what = format!("{words} {}", self.what);
        self
    }

    /// Both texts, to put other names into them.
    pub fn texts(&mut self) -> [&mut String; 2] {
        [&mut self.what, &mut self.help]
    }

    /// All of it in one line: `what; help`.
    #[must_use]
    pub fn line(&self) -> String {
        let what = self.what.replace('\n', " ");
        match self.helping() {
            Some(help) => format!("{what}; {}", help.replace('\n', " ")),
            None => what,
        }
    }
}

/// Two lines, the second for the help.
impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.what)?;
        match self.helping() {
            Some(help) => write!(f, "\n  help: {help}"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for Diagnostic {}

impl From<String> for Diagnostic {
    fn from(what: String) -> Diagnostic {
        Diagnostic::new(what)
    }
}

impl From<&str> for Diagnostic {
    fn from(what: &str) -> Diagnostic {
        Diagnostic::new(what)
    }
}
