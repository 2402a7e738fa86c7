//! `InputTable`: a CSV file in memory. Every error names file, line and column.

use super::error::TrialError;
use overfly_store::read_bounded;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Most rows of a file.
const MAX_ROWS: usize = 1_000_000;
/// Greatest size of a file, bytes.
const MAX_BYTES: u64 = 1 << 30;

/// A CSV file in memory.
pub struct InputTable {
    path: PathBuf,
    columns: HashMap<String, usize>,
    rows: Vec<InputRow>,
}

/// One row of the file.
pub struct InputRow {
    /// Line in the file; the header is line 1.
    pub line: u64,
    cells: csv::StringRecord,
}

impl InputTable {
    /// Reads a CSV file with at least the columns `needed` and one row.
    pub fn read(path: &Path, needed: &[&'static str]) -> Result<Self, TrialError> {
        let text =
            read_bounded(path, MAX_BYTES).map_err(|cause| TrialError::Unreadable { path: path.into(), cause })?;
        let not_a_table = |line, reason: String| TrialError::NotATable { path: path.into(), line, reason };
        let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&text);
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text);
        let header = reader.headers().map_err(|e| not_a_table(1, e.to_string()))?;
        let columns: HashMap<_, _> = header.iter().enumerate().map(|(i, name)| (name.to_owned(), i)).collect();
        if let Some(column) = needed.iter().find(|c| !columns.contains_key(**c)) {
            return Err(TrialError::MissingColumn { path: path.into(), column, needed: needed.join(", ") });
        }
        let mut rows = Vec::new();
        for record in reader.records() {
            let cells = record.map_err(|e| not_a_table(e.position().map_or(0, csv::Position::line), e.to_string()))?;
            let line = cells.position().map_or(0, csv::Position::line);
            if rows.len() == MAX_ROWS {
                return Err(not_a_table(line, format!("more than {MAX_ROWS} rows")));
            }
            rows.push(InputRow { line, cells });
        }
        if rows.is_empty() {
            return Err(TrialError::NoRows { path: path.into() });
        }
        Ok(Self { path: path.into(), columns, rows })
    }

    /// The rows.
    pub fn rows(&self) -> &[InputRow] {
        &self.rows
    }

    /// The text of a cell; empty if the table has no such column.
    pub fn text<'a>(&self, row: &'a InputRow, column: &'static str) -> &'a str {
        self.columns.get(column).and_then(|&i| row.cells.get(i)).unwrap_or("")
    }

    /// The finite number in a cell for which `accepts` holds.
    pub fn number(
        &self,
        row: &InputRow,
        column: &'static str,
        expected: &'static str,
        accepts: impl Fn(f64) -> bool,
    ) -> Result<f64, TrialError> {
        let found = self.text(row, column);
        match found.parse::<f64>() {
            Ok(value) if value.is_finite() && accepts(value) => Ok(value),
            _ => Err(self.bad_cell(row, column, expected)),
        }
    }

    /// Like [`InputTable::number`]; `None` for an empty cell.
    pub fn number_or_empty(
        &self,
        row: &InputRow,
        column: &'static str,
        expected: &'static str,
        accepts: impl Fn(f64) -> bool,
    ) -> Result<Option<f64>, TrialError> {
        if self.text(row, column).is_empty() {
            return Ok(None);
        }
        self.number(row, column, expected, accepts).map(Some)
    }

    /// The error about a cell.
    pub fn bad_cell(&self, row: &InputRow, column: &'static str, expected: &'static str) -> TrialError {
        let found = self.text(row, column).chars().take(80).collect();
        TrialError::BadCell { path: self.path.clone(), line: row.line, column, found, expected }
    }

    /// The path of the image that a cell names, relative to the table's folder. The image must exist.
    pub fn image(&self, row: &InputRow, column: &'static str) -> Result<PathBuf, TrialError> {
        let name = self.text(row, column);
        if name.is_empty() {
            return Err(self.bad_cell(row, column, "the path of an image, relative to this file"));
        }
        let image = self.path.parent().unwrap_or(Path::new("")).join(name);
        if image.is_file() {
            Ok(image)
        } else {
            Err(TrialError::MissingImage { path: self.path.clone(), line: row.line, image })
        }
    }
}
