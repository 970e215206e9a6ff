//! Expressions of `--until`: comparisons of values of a run's `summary.json`.
//!
//! ```text
//! either     = both { ("||" | "or") both }
//! both       = single { ("&&" | "and") single }
//! single     = ("!" | "not") single | "(" either ")" | comparison
//! comparison = operand ("<" | "<=" | ">" | ">=" | "==" | "!=") operand
//! operand    = path | number | "text" | 'text' | true | false | null
//! path       = key { "." (key | index | "text" | 'text') }
//! ```
//!
//! In:  a text, and the summary of a run.
//! Out: whether it is known to hold. Only numbers and texts have an order; null is equal to itself alone, and of an
//! order with null neither it nor its opposite holds.

use std::{cmp::Ordering, fmt, str::FromStr};

use serde_json::{Number, Value};

/// Parentheses and negations within each other: more than a person writes.
const DEPTH_MAX: usize = 64;
const UNENDED: &str = "a text that ends with the quote it began with";
const NO_PATH: &str = "a value of the summary such as packets.heard, a number or a \"text\"";
/// Below this similarity (Jaro-Winkler, 0 to 1) a key of the summary is not what the user meant.
const SIMILAR: f64 = 0.7;

/// A question about a summary.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Expression {
    text: String,
    root: Node,
}

#[derive(Clone, Debug, PartialEq)]
enum Node {
    Either(Box<Node>, Box<Node>),
    Both(Box<Node>, Box<Node>),
    Not(Box<Node>),
    Compare(Operand, Operator, Operand),
}

#[derive(Clone, Debug, PartialEq)]
enum Operand {
    Literal(Value),
    Path(Path),
}

/// Keys and indices that lead to a value of the summary.
#[derive(Clone, Debug, PartialEq)]
struct Path(Vec<String>);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Operator {
    Less,
    AtMost,
    More,
    AtLeast,
    Equal,
    Unequal,
}

/// Why a text is no expression.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("column {column}: expected {expected}, found {found}")]
pub(crate) struct SyntaxError {
    column: usize,
    expected: &'static str,
    found: String,
}

/// Why an expression cannot be asked of a summary.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum MeaningError {
    /// The summary has no such value.
    #[error("the summary has no `{path}`{guess}")]
    Path { path: String, guess: String },
    /// Two values have no order.
    #[error("`{comparison}` compares {left} with {right}; only two numbers or two texts have an order")]
    Order { comparison: String, left: &'static str, right: &'static str },
}

impl Expression {
    /// Whether `summary` has what the expression asks about, and what it compares can be compared.
    pub(crate) fn check(&self, summary: &Value) -> Result<(), MeaningError> {
        let mut outcome = Ok(());
        self.root.comparisons(&mut |left, operator, right| {
            if outcome.is_ok() {
                outcome = checked(left, operator, right, summary);
            }
        });
        outcome
    }

    /// Whether it is known to hold. A value that the summary does not have counts as null.
    pub(crate) fn holds(&self, summary: &Value) -> bool {
        self.root.holds(summary) == Some(true)
    }

    /// The values it asks about, as the summary has them: `mean_error_m is 0.02, ended is "finished"`.
    pub(crate) fn findings(&self, summary: &Value) -> String {
        let mut findings: Vec<String> = Vec::new();
        self.root.comparisons(&mut |left, _, right| {
            for operand in [left, right] {
                if let Operand::Path(path) = operand {
                    let finding = format!("{path} is {}", operand.value(summary));
                    if !findings.contains(&finding) {
                        findings.push(finding);
                    }
                }
            }
        });
        findings.join(", ")
    }
}

impl fmt::Display for Expression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl FromStr for Expression {
    type Err = SyntaxError;

    fn from_str(text: &str) -> Result<Self, SyntaxError> {
        let mut parser = Parser { tokens: tokens(text)?, next: 0 };
        let root = parser.either(0)?;
        match parser.peek() {
            Token::End => Ok(Self { text: text.trim().into(), root }),
            _ => Err(parser.expected("`&&`, `||` or the end")),
        }
    }
}

impl Node {
    /// Whether it holds; `None` if that depends on how null compares with something that has an order (Kleene's logic:
    /// of what is not known, neither it nor its opposite holds).
    fn holds(&self, summary: &Value) -> Option<bool> {
        match self {
            Self::Either(left, right) => match (left.holds(summary), right.holds(summary)) {
                (Some(true), _) | (_, Some(true)) => Some(true),
                (left, right) => Some(left? || right?),
            },
            Self::Both(left, right) => match (left.holds(summary), right.holds(summary)) {
                (Some(false), _) | (_, Some(false)) => Some(false),
                (left, right) => Some(left? && right?),
            },
            Self::Not(node) => node.holds(summary).map(|holds| !holds),
            Self::Compare(left, operator, right) => operator.holds(left.value(summary), right.value(summary)),
        }
    }

    fn comparisons<'a>(&'a self, visit: &mut impl FnMut(&'a Operand, Operator, &'a Operand)) {
        match self {
            Self::Either(left, right) | Self::Both(left, right) => {
                left.comparisons(visit);
                right.comparisons(visit);
            }
            Self::Not(node) => node.comparisons(visit),
            Self::Compare(left, operator, right) => visit(left, *operator, right),
        }
    }
}

fn checked(left: &Operand, operator: Operator, right: &Operand, summary: &Value) -> Result<(), MeaningError> {
    for operand in [left, right] {
        if let Operand::Path(path) = operand {
            path.value(summary).ok_or_else(|| missing(path, summary))?;
        }
    }
    let (a, b) = (left.value(summary), right.value(summary));
    let comparable = matches!(
        (a, b),
        (Value::Number(_), Value::Number(_))
            | (Value::String(_), Value::String(_))
            | (Value::Null, _)
            | (_, Value::Null)
    );
    if comparable || matches!(operator, Operator::Equal | Operator::Unequal) {
        return Ok(());
    }
    let comparison = format!("{left} {operator} {right}");
    Err(MeaningError::Order { comparison, left: kind(a), right: kind(b) })
}

impl Operand {
    fn value<'a>(&'a self, summary: &'a Value) -> &'a Value {
        match self {
            Self::Literal(value) => value,
            Self::Path(path) => path.value(summary).unwrap_or(&Value::Null),
        }
    }
}

impl fmt::Display for Operand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Literal(value) => write!(f, "{value}"),
            Self::Path(path) => path.fmt(f),
        }
    }
}

impl Operator {
    const ALL: [(&'static str, Self); 6] = [
        ("<=", Self::AtMost),
        (">=", Self::AtLeast),
        ("==", Self::Equal),
        ("!=", Self::Unequal),
        ("<", Self::Less),
        (">", Self::More),
    ];

    /// Whether it holds; `None` for an order in which one is null.
    fn holds(self, left: &Value, right: &Value) -> Option<bool> {
        let order = match (left, right) {
            (Value::Number(left), Value::Number(right)) => order(left, right),
            (Value::String(left), Value::String(right)) => Some(left.cmp(right)),
            _ => (left == right).then_some(Ordering::Equal),
        };
        let is_equal = order == Some(Ordering::Equal);
        match self {
            Self::Equal => Some(is_equal),
            Self::Unequal => Some(!is_equal),
            _ if left.is_null() || right.is_null() => None,
            // Other things that are equal have no order.
            _ if !matches!(left, Value::Number(_) | Value::String(_)) => Some(false),
            Self::Less => Some(order == Some(Ordering::Less)),
            Self::More => Some(order == Some(Ordering::Greater)),
            Self::AtMost => Some(order.is_some_and(Ordering::is_le)),
            Self::AtLeast => Some(order.is_some_and(Ordering::is_ge)),
        }
    }
}

impl fmt::Display for Operator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (symbol, _) = Self::ALL.iter().find(|(_, operator)| operator == self).expect("all are listed");
        f.write_str(symbol)
    }
}

/// Whole numbers exactly, as a seed needs; others as floating point has them.
fn order(left: &Number, right: &Number) -> Option<Ordering> {
    match (left.as_i128(), right.as_i128()) {
        (Some(left), Some(right)) => Some(left.cmp(&right)),
        _ => left.as_f64()?.partial_cmp(&right.as_f64()?),
    }
}

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "true or false",
        Value::Number(_) => "a number",
        Value::String(_) => "a text",
        Value::Array(_) => "a list",
        Value::Object(_) => "an object",
    }
}

impl Path {
    /// The value in `summary` that it leads to.
    fn value<'a>(&self, summary: &'a Value) -> Option<&'a Value> {
        self.0.iter().try_fold(summary, |value, step| match value {
            Value::Array(entries) => entries.get(step.parse::<usize>().ok()?),
            _ => value.get(step),
        })
    }

    /// The longest part of it that leads somewhere, and where.
    fn deepest<'a>(&self, summary: &'a Value) -> (Self, &'a Value) {
        let parts = (0..=self.0.len()).rev().map(|steps| Self(self.0[..steps].to_vec()));
        let mut places = parts.filter_map(|part| part.value(summary).map(|value| (part, value)));
        places.next().expect("no steps lead to the summary itself")
    }

    /// It with one more step.
    fn and(&self, step: &str) -> Self {
        Self(self.0.iter().cloned().chain([step.to_owned()]).collect())
    }

    /// Reads the path that `rest` begins with, and its length in bytes.
    fn read(rest: &str) -> Result<(Self, usize), &'static str> {
        let (mut steps, mut at) = (Vec::new(), 0);
        loop {
            let (step, length) = match rest[at..].chars().next() {
                Some(quote @ ('"' | '\'')) if at > 0 => {
                    let (text, _) = rest[at + 1..].split_once(quote).ok_or(UNENDED)?;
                    (text, text.len() + 2)
                }
                _ => {
                    let is_over = |c: char| !(c.is_ascii_alphanumeric() || c == '_');
                    let end = rest[at..].find(is_over).unwrap_or(rest.len() - at);
                    (&rest[at..at + end], end)
                }
            };
            if length == 0 || (at == 0 && step.starts_with(|c: char| c.is_ascii_digit())) {
                return Err(NO_PATH);
            }
            steps.push(step.to_owned());
            at += length;
            match rest[at..].strip_prefix('.') {
                Some(_) => at += 1,
                None => return Ok((Self(steps), at)),
            }
        }
    }
}

impl fmt::Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, step) in self.0.iter().enumerate() {
            let dot = if at > 0 { "." } else { "" };
            let is_plain = step.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
            let quote = if is_plain { "" } else { "\"" };
            write!(f, "{dot}{quote}{step}{quote}")?;
        }
        Ok(())
    }
}

/// The path of a value, as an [`Expression`] has it.
pub(crate) fn path(steps: &[&str]) -> String {
    Path(steps.iter().map(|&step| step.to_owned()).collect()).to_string()
}

/// Error about a missing path, with what may have been meant.
fn missing(path: &Path, summary: &Value) -> MeaningError {
    let mut paths = Vec::new();
    collect_paths(summary, &mut Vec::new(), &mut paths);
    let (known, path) = (path, path.to_string());
    let similarity = |known: &String| strsim::jaro_winkler(&path, known);
    let best = paths.iter().max_by(|a, b| similarity(a).total_cmp(&similarity(b)));
    let guess = match best.filter(|best| similarity(best) >= SIMILAR) {
        Some(best) => format!("; did you mean `{best}`?"),
        None => {
            let (known, place) = known.deepest(summary);
            let keys = place.as_object().into_iter().flatten();
            let keys: Vec<String> = keys.map(|(key, _)| known.and(key).to_string()).collect();
            match keys.is_empty() {
                true => format!("\nhint: `{known}` has nothing in it"),
                false => format!("\nhint: it has `{}`", keys.join("`, `")),
            }
        }
    };
    MeaningError::Path { path, guess }
}

fn collect_paths<'a>(value: &'a Value, steps: &mut Vec<String>, paths: &mut Vec<String>) {
    let mut inside = |step: &str, value: &'a Value| {
        steps.push(step.to_owned());
        collect_paths(value, steps, paths);
        steps.pop();
    };
    match value {
        Value::Object(entries) => entries.iter().for_each(|(key, value)| inside(key, value)),
        Value::Array(entries) => {
            entries.iter().enumerate().for_each(|(index, value)| inside(&index.to_string(), value));
        }
        _ => paths.push(Path(steps.clone()).to_string()),
    }
}

#[derive(Clone, Debug, PartialEq)]
enum Token {
    Open,
    Close,
    And,
    Or,
    Not,
    Compare(Operator),
    Value(Operand),
    End,
}

/// A token, where it begins and how it is written.
type Placed = (Token, usize, String);

struct Parser {
    /// The last one is [`Token::End`].
    tokens: Vec<Placed>,
    next: usize,
}

impl Parser {
    fn either(&mut self, depth: usize) -> Result<Node, SyntaxError> {
        let mut node = self.both(depth)?;
        while self.takes(&Token::Or) {
            node = Node::Either(Box::new(node), Box::new(self.both(depth)?));
        }
        Ok(node)
    }

    fn both(&mut self, depth: usize) -> Result<Node, SyntaxError> {
        let mut node = self.single(depth)?;
        while self.takes(&Token::And) {
            node = Node::Both(Box::new(node), Box::new(self.single(depth)?));
        }
        Ok(node)
    }

    fn single(&mut self, depth: usize) -> Result<Node, SyntaxError> {
        if depth > DEPTH_MAX {
            return Err(self.expected("fewer parentheses and negations within each other"));
        }
        if self.takes(&Token::Not) {
            return Ok(Node::Not(Box::new(self.single(depth + 1)?)));
        }
        if self.takes(&Token::Open) {
            let node = self.either(depth + 1)?;
            return if self.takes(&Token::Close) { Ok(node) } else { Err(self.expected("`)`")) };
        }
        let left = self.operand("a value of the summary, a number or a \"text\"")?;
        let Token::Compare(operator) = *self.peek() else {
            return Err(self.expected("one of < <= > >= == !="));
        };
        self.next += 1;
        let right = self.operand("a number, a \"text\", true, false, null or a value of the summary")?;
        Ok(Node::Compare(left, operator, right))
    }

    fn operand(&mut self, expected: &'static str) -> Result<Operand, SyntaxError> {
        match self.peek().clone() {
            Token::Value(operand) => {
                self.next += 1;
                Ok(operand)
            }
            _ => Err(self.expected(expected)),
        }
    }

    fn takes(&mut self, token: &Token) -> bool {
        let taken = self.peek() == token;
        self.next += usize::from(taken);
        taken
    }

    fn peek(&self) -> &Token {
        &self.tokens[self.next].0
    }

    fn expected(&self, expected: &'static str) -> SyntaxError {
        let (_, column, spelling) = &self.tokens[self.next];
        SyntaxError { column: *column, expected, found: spelling.clone() }
    }
}

/// Cuts `text` into tokens; columns count characters from 1.
fn tokens(text: &str) -> Result<Vec<Placed>, SyntaxError> {
    let mut tokens = Vec::new();
    let mut at = 0;
    while let Some(first) = text[at..].chars().next() {
        if first.is_whitespace() {
            at += first.len_utf8();
            continue;
        }
        let (rest, column) = (&text[at..], text[..at].chars().count() + 1);
        let (token, length) = token(rest, first).map_err(|expected| {
            let found = if matches!(first, '"' | '\'') { rest } else { word(rest, first) };
            SyntaxError { column, expected, found: format!("`{found}`") }
        })?;
        tokens.push((token, column, format!("`{}`", &rest[..length])));
        at += length;
    }
    tokens.push((Token::End, text.chars().count() + 1, "the end".into()));
    Ok(tokens)
}

/// The token that `rest` begins with and its length in bytes, or what was expected in its place.
fn token(rest: &str, first: char) -> Result<(Token, usize), &'static str> {
    let symbols = [("(", Token::Open), (")", Token::Close), ("&&", Token::And), ("||", Token::Or)];
    let comparisons = Operator::ALL.map(|(symbol, operator)| (symbol, Token::Compare(operator)));
    let known = symbols.into_iter().chain(comparisons).chain([("!", Token::Not)]);
    if let Some((symbol, token)) = { known }.find(|(symbol, _)| rest.starts_with(symbol)) {
        return Ok((token, symbol.len()));
    }
    match first {
        '=' => Err("`==`"),
        '&' => Err("`&&`"),
        '|' => Err("`||`"),
        '"' | '\'' => {
            let text = rest[1..].split_once(first).ok_or(UNENDED)?.0;
            Ok((Token::Value(Operand::Literal(text.into())), text.len() + 2))
        }
        '0'..='9' | '-' | '+' | '.' => {
            let word = word(rest, first);
            let number = word.parse::<i64>().map(Number::from).ok().or_else(|| {
                let value = word.parse::<f64>().ok()?;
                Number::from_f64(value)
            });
            let number = number.ok_or("a number such as 600, 0.05 or 1e-7")?;
            Ok((Token::Value(Operand::Literal(Value::Number(number))), word.len()))
        }
        _ => {
            let word = word(rest, first);
            let token = match word {
                "and" => Token::And,
                "or" => Token::Or,
                "not" => Token::Not,
                "null" => Token::Value(Operand::Literal(Value::Null)),
                "true" => Token::Value(Operand::Literal(true.into())),
                "false" => Token::Value(Operand::Literal(false.into())),
                _ => {
                    let (path, length) = Path::read(rest)?;
                    return Ok((Token::Value(Operand::Path(path)), length));
                }
            };
            Ok((token, word.len()))
        }
    }
}

/// The letters, digits and dots at the start of `rest`, with the signs of a number's exponent; one character
/// at least.
fn word(rest: &str, first: char) -> &str {
    let number = first.is_ascii_digit() || matches!(first, '-' | '+' | '.');
    let mut before = first;
    let end = rest.char_indices().skip(1).find(|&(_, c)| {
        let exponent = number && matches!(c, '-' | '+') && matches!(before, 'e' | 'E');
        before = c;
        !(c.is_alphanumeric() || matches!(c, '_' | '.') || exponent)
    });
    &rest[..end.map_or(rest.len(), |(at, _)| at)]
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn summary() -> Value {
        json!({
            "ended": "finished",
            "mean_error_m": 0.02,
            "robots_alive": 50,
            "converged_at_s": null,
            "seed": 9_007_199_254_740_993_u64,
            "packets": { "heard": 90, "sent": 100 },
            "faults": [{ "kind": "kill", "fired_tick": 600 }, { "kind": "loss", "fired_tick": null }],
            "always": { "all agree, 5.0": { "broken_by": 2 } },
        })
    }

    fn holds(text: &str) -> bool {
        let expression: Expression = text.parse().unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!(expression.check(&summary()), Ok(()), "{text}");
        expression.holds(&summary())
    }

    fn syntax(text: &str) -> String {
        text.parse::<Expression>().expect_err(text).to_string()
    }

    fn meaning(text: &str) -> String {
        text.parse::<Expression>().unwrap().check(&summary()).expect_err(text).to_string()
    }

    #[test]
    fn comparisons_find_values_by_their_paths() {
        for text in [
            "mean_error_m > 0.01",
            "mean_error_m<=2e-2",
            "0.02 == mean_error_m",
            "packets.heard < 100 && robots_alive == 50",
            "packets.heard < packets.sent",
            "converged_at_s == null",
            "ended != \"failed\"",
            "ended == 'finished'",
            "faults.0.fired_tick >= 600",
            "faults.1.kind == 'loss'",
            "robots_alive > -3",
            "mean_error_m > 1e-3 and mean_error_m < 1E+1",
            "seed == 9007199254740993",
            "robots_alive == 50.0",
            "true != false",
            "always.\"all agree, 5.0\".broken_by > 1",
            "always.'all agree, 5.0'.\"broken_by\" > 1",
        ] {
            assert!(holds(text), "{text}");
        }
        for text in [
            "mean_error_m > 0.02",
            "seed == 9007199254740992",
            "ended == \"failed\"",
            "packets.heard == '90'",
        ] {
            assert!(!holds(text), "{text}");
        }
    }

    #[test]
    fn and_binds_closer_than_or_and_not_closest() {
        assert!(holds("1 == 1 || 1 == 2 && 1 == 2"));
        assert!(!holds("(1 == 1 || 1 == 2) && 1 == 2"));
        assert!(holds("not 1 == 2 and 1 == 1"));
        assert!(!holds("!(1 == 2 or 1 == 1)"));
        assert!(holds("!!1 == 1"));
    }

    #[test]
    fn null_has_no_order() {
        for operator in ["<", "<=", ">", ">=", "=="] {
            assert!(!holds(&format!("converged_at_s {operator} 5")), "{operator}");
            assert!(!holds(&format!("5 {operator} converged_at_s")), "{operator}");
        }
        assert!(holds("converged_at_s != 5"));
        assert!(holds("converged_at_s == faults.1.fired_tick"));
        assert!(!holds("converged_at_s <= null"));
    }

    #[test]
    fn neither_an_order_with_null_nor_its_opposite_holds() {
        let unknown = "converged_at_s < 5";
        for doubtful in
            [format!("not {unknown}"), format!("not not {unknown}"), format!("{unknown} or {unknown}")]
        {
            assert!(!holds(&doubtful), "{doubtful}");
        }
        assert!(holds(&format!("{unknown} or converged_at_s == null")), "what is known suffices");
        assert!(holds(&format!("not ({unknown} and converged_at_s != null)")));
        assert!(holds("not converged_at_s == 5"));
    }

    #[test]
    fn what_a_summary_lacks_is_an_error_once_and_null_later() {
        let expression: Expression = "faults.5.fired_tick == null".parse().unwrap();
        assert!(expression.check(&summary()).is_err());
        assert!(expression.holds(&summary()));
    }

    #[test]
    fn a_misspelled_path_gets_a_suggestion() {
        assert_eq!(
            meaning("mean_eror_m > 1"),
            "the summary has no `mean_eror_m`; did you mean `mean_error_m`?"
        );
        assert_eq!(
            meaning("packets.herd < 1"),
            "the summary has no `packets.herd`; did you mean `packets.heard`?"
        );
        assert_eq!(
            meaning("faults.0.fired < 1"),
            "the summary has no `faults.0.fired`; did you mean `faults.0.fired_tick`?"
        );
        assert_eq!(
            meaning("always.'all agree'.broken_by > 1"),
            "the summary has no `always.\"all agree\".broken_by`; did you mean `always.\"all agree, 5.0\".broken_by`?"
        );
        assert!(
            meaning("1 == 1 || zzz == 1")
                .starts_with("the summary has no `zzz`\nhint: it has `always`, `converged_at_s`, ")
        );
    }

    #[test]
    fn what_has_no_order_is_not_compared() {
        assert_eq!(
            meaning("mean_error_m > '0.05'"),
            "`mean_error_m > \"0.05\"` compares a number with a text; only two numbers or two texts have an order"
        );
        assert!(meaning("packets < 1").contains("compares an object with a number"));
    }

    #[test]
    fn errors_name_the_column_and_what_was_expected() {
        let cases = [
            ("", "column 1: expected a value of the summary, a number or a \"text\", found the end"),
            ("mean_error_m", "column 13: expected one of < <= > >= == !=, found the end"),
            ("mean_error_m = 1", "column 14: expected `==`, found `=`"),
            ("a > 1 & b > 1", "column 7: expected `&&`, found `&`"),
            ("a > 1 b", "column 7: expected `&&`, `||` or the end, found `b`"),
            ("(a > 1", "column 7: expected `)`, found the end"),
            (
                "é > 1",
                "column 1: expected a value of the summary such as packets.heard, a number or a \"text\", found `é`",
            ),
            (
                "a == 'é' && b == \"x",
                "column 18: expected a text that ends with the quote it began with, found `\"x`",
            ),
            ("a > 1.2.3", "column 5: expected a number such as 600, 0.05 or 1e-7, found `1.2.3`"),
            ("a > 1e999", "column 5: expected a number such as 600, 0.05 or 1e-7, found `1e999`"),
            ("a > 5 m", "column 7: expected `&&`, `||` or the end, found `m`"),
            (
                "a..b > 1",
                "column 1: expected a value of the summary such as packets.heard, a number or a \"text\", found `a..b`",
            ),
            ("a.\"b > 1", "column 1: expected a text that ends with the quote it began with, found `a.`"),
            ("> 1", "column 1: expected a value of the summary, a number or a \"text\", found `>`"),
        ];
        for (text, message) in cases {
            assert_eq!(syntax(text), message, "{text}");
        }
        assert!(syntax("a >").contains("column 4: expected a number, a \"text\", true, false, null"));
        assert!(syntax("a # 1").contains("column 3"));
    }

    #[test]
    fn nesting_has_a_bound() {
        let nested = |depth| format!("{}1 == 1{}", "(".repeat(depth), ")".repeat(depth));
        assert!(holds(&nested(DEPTH_MAX)));
        assert!(syntax(&nested(100_000)).contains("expected fewer parentheses and negations"));
    }

    #[test]
    fn findings_list_each_value_once() {
        let expression: Expression = "mean_error_m > 1 || ended == 'x' || mean_error_m < 0".parse().unwrap();
        assert_eq!(expression.findings(&summary()), "mean_error_m is 0.02, ended is \"finished\"");
    }
}
