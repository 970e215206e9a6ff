//! A CSV file by the names of its columns.
//!
//! In:  a file that a run or a batch wrote, perhaps one that was killed while it wrote.
//! Out: columns of numbers or words. A broken last row is dropped and remembered; anything else that is
//!      wrong is an error with file and line.

use std::{fs, io::ErrorKind, path::Path};

use csv::StringRecord;

use crate::error::ReportError;

/// The rows of a file.
#[derive(Debug)]
pub struct Rows {
    file: String,
    header: Vec<String>,
    rows: Vec<(u64, StringRecord)>,
    broken: Option<u64>,
}

impl Rows {
    /// The rows of the file at `path`; `None` if there is no such file, or a full disk has left it empty.
    pub fn read_if_there(path: &Path) -> Result<Option<Self>, ReportError> {
        match fs::read(path) {
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
            Err(error) => Err(ReportError::io(path, error)),
            Ok(bytes) if bytes.is_empty() => Ok(None),
            Ok(bytes) => Self::parse(&path.display().to_string(), &bytes).map(Some),
        }
    }

    /// The rows of the file at `path`, which has to be there.
    pub fn read(path: &Path, hint: &'static str) -> Result<Self, ReportError> {
        Self::read_if_there(path)?
            .ok_or_else(|| ReportError::Missing { file: path.display().to_string(), hint })
    }

    fn parse(file: &str, bytes: &[u8]) -> Result<Self, ReportError> {
        let whole = bytes.last().is_none_or(|&last| last == b'\n');
        let mut reader = csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(bytes);
        let mut records = Vec::new();
        let mut unreadable = None;
        for record in reader.records() {
            match record {
                Ok(record) => records.push((record.position().map_or(0, csv::Position::line), record)),
                Err(error) => {
                    let line = error.position().map_or(0, csv::Position::line);
                    // A character cut in two at the very end is a row cut in two.
                    match whole {
                        false if unreadable.is_none() => unreadable = Some((line, error)),
                        _ => return Err(ReportError::bad(format!("{file}:{line}"), error.to_string())),
                    }
                }
            }
        }
        if records.is_empty() {
            return Err(ReportError::bad(file, "is empty, not even a header; the run wrote nothing"));
        }
        let header: Vec<String> = records.remove(0).1.iter().map(str::to_owned).collect();
        let mut broken = unreadable.as_ref().map(|(line, _)| *line);
        let cut = records.last().is_some_and(|(_, last)| !whole || last.len() != header.len());
        if broken.is_none() && cut {
            broken = records.pop().map(|(line, _)| line);
        }
        if let Some((line, row)) = records.iter().find(|(_, row)| row.len() != header.len()) {
            let message =
                format!("has {} cells, the header has {}; mend or remove the row", row.len(), header.len());
            return Err(ReportError::bad(format!("{file}:{line}"), message));
        }
        Ok(Self { file: file.to_owned(), header, rows: records, broken })
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Names of the columns.
    pub fn header(&self) -> &[String] {
        &self.header
    }

    /// Whether there is such a column.
    pub fn has(&self, column: &str) -> bool {
        self.header.iter().any(|name| name == column)
    }

    /// A note for the reader if the last row was broken.
    pub fn note(&self) -> Option<String> {
        let line = self.broken?;
        Some(format!(
            "The last row of {} (line {line}) is broken, as a killed writer leaves it. It was dropped.",
            name_of(&self.file)
        ))
    }

    /// A column of words.
    pub fn words(&self, column: &str) -> Result<Vec<&str>, ReportError> {
        let place = self.place(column)?;
        Ok(self.rows.iter().map(|(_, row)| &row[place]).collect())
    }

    /// A column of numbers; an empty cell is none.
    pub fn numbers(&self, column: &str) -> Result<Vec<Option<f64>>, ReportError> {
        let place = self.place(column)?;
        self.rows.iter().map(|(line, row)| self.number(*line, column, &row[place])).collect()
    }

    /// A column of numbers that may be missing, as if all its cells were empty.
    pub fn numbers_if_there(&self, column: &str) -> Result<Vec<Option<f64>>, ReportError> {
        if self.has(column) { self.numbers(column) } else { Ok(vec![None; self.len()]) }
    }

    /// A column of numbers without empty cells.
    pub fn full(&self, column: &str) -> Result<Vec<f64>, ReportError> {
        let numbers = self.numbers(column)?;
        numbers
            .into_iter()
            .zip(&self.rows)
            .map(|(number, (line, _))| {
                number.ok_or_else(|| {
                    ReportError::bad(format!("{}:{line}", self.file), format!("{column} is empty"))
                })
            })
            .collect()
    }

    /// A column of counts, without empty cells.
    pub fn counts(&self, column: &str) -> Result<Vec<u64>, ReportError> {
        let place = self.place(column)?;
        self.rows
            .iter()
            .map(|(line, row)| {
                row[place].parse().map_err(|_| {
                    let message = format!("{column} is {:?}, not a whole number", &row[place]);
                    ReportError::bad(format!("{}:{line}", self.file), message)
                })
            })
            .collect()
    }

    fn number(&self, line: u64, column: &str, text: &str) -> Result<Option<f64>, ReportError> {
        if text.is_empty() {
            return Ok(None);
        }
        text.parse().map(Some).map_err(|_| {
            let message = format!("{column} is {text:?}, not a number; mend or remove the row");
            ReportError::bad(format!("{}:{line}", self.file), message)
        })
    }

    fn place(&self, column: &str) -> Result<usize, ReportError> {
        self.header.iter().position(|name| name == column).ok_or_else(|| {
            let message = format!("has no column {column}; its columns are {}", self.header.join(", "));
            ReportError::bad(format!("{}:1", self.file), message)
        })
    }
}

fn name_of(file: &str) -> &str {
    file.rsplit('/').next().unwrap_or(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(text: &str) -> Result<Rows, String> {
        Rows::parse("dir/x.csv", text.as_bytes()).map_err(|error| error.to_string())
    }

    #[test]
    fn a_last_row_without_its_end_is_dropped_and_told_of() {
        for cut in ["a,b\n1,2\n3,4", "a,b\n1,2\n3", "a,b\n1,2\n3,", "a,b\n1,2\n3\n"] {
            let rows = rows(cut).unwrap();
            assert_eq!(rows.numbers("b").unwrap(), [Some(2.0)], "{cut:?}");
            assert!(rows.note().unwrap().contains("line 3"), "{cut:?}");
        }
    }

    #[test]
    fn a_character_cut_in_two_at_the_end_is_a_broken_last_row() {
        let mut bytes = b"a,b\n1,2\n3,\xc3".to_vec();
        assert_eq!(Rows::parse("x.csv", &bytes).unwrap().len(), 1);
        bytes.push(b'\n');
        assert!(Rows::parse("x.csv", &bytes).is_err());
    }

    #[test]
    fn a_broken_row_in_the_middle_is_an_error_with_its_line() {
        let error = rows("a,b\n1\n3,4\n").unwrap_err();
        assert_eq!(error, "dir/x.csv:2: has 1 cells, the header has 2; mend or remove the row");
    }

    #[test]
    fn a_whole_file_has_no_note_and_empty_cells_are_no_numbers() {
        let rows = rows("a,b\n1,\n3,4\n").unwrap();
        assert_eq!(rows.numbers("b").unwrap(), [None, Some(4.0)]);
        assert!(rows.note().is_none());
        assert_eq!(rows.full("b").unwrap_err().to_string(), "dir/x.csv:2: b is empty");
    }

    #[test]
    fn a_word_in_a_column_of_numbers_is_named_with_its_line() {
        let error = rows("a,b\n1,2\n3,oops\n").unwrap().numbers("b").unwrap_err().to_string();
        assert_eq!(error, "dir/x.csv:3: b is \"oops\", not a number; mend or remove the row");
    }

    #[test]
    fn a_missing_column_is_named_with_those_that_are_there() {
        let error = rows("a,b\n").unwrap().words("c").unwrap_err().to_string();
        assert_eq!(error, "dir/x.csv:1: has no column c; its columns are a, b");
    }

    #[test]
    fn an_empty_file_is_an_error() {
        assert!(rows("").is_err());
    }
}
