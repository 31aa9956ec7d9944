//! Tables as JSON lines and CSV. All records of a table have the same named fields in the same order.

use std::{fs::OpenOptions, io::Write as _, path::Path};

use serde::{Serialize, Serializer, ser::SerializeMap as _};

use crate::film::exr::{FileError, write_whole};

/// One line of a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct TableRow(Vec<(&'static str, Field)>);

/// The value of a field.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub(super) enum Field {
    Text(String),
    Whole(u64),
    Number(f64),
    /// The value is unknown or not finite.
    None,
}

impl From<&str> for Field {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<u64> for Field {
    fn from(number: u64) -> Self {
        Self::Whole(number)
    }
}

impl From<f64> for Field {
    fn from(x: f64) -> Self {
        if x.is_finite() { Self::Number(x) } else { Self::None }
    }
}

impl<T: Into<Self>> From<Option<T>> for Field {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::None, Into::into)
    }
}

impl Serialize for TableRow {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (name, field) in &self.0 {
            map.serialize_entry(name, field)?;
        }
        map.end()
    }
}

impl TableRow {
    /// Appends a field. Its name must be new to the row.
    pub(super) fn push(&mut self, name: &'static str, field: impl Into<Field>) {
        self.0.push((name, field.into()));
    }

    fn json(&self) -> String {
        serde_json::to_string(self).expect("a record is plain data") + "\n"
    }

    fn names(&self) -> impl Iterator<Item = &'static str> {
        self.0.iter().map(|(name, _)| *name)
    }

    fn texts(&self) -> impl Iterator<Item = String> {
        self.0.iter().map(|(_, field)| match field {
            Field::Text(text) => text.clone(),
            Field::Whole(number) => number.to_string(),
            // Formatted as in JSON, so that both files read back to the same bits.
            Field::Number(x) => serde_json::to_string(x).expect("a number is plain data"),
            Field::None => String::new(),
        })
    }
}

fn csv(lines: &[TableRow], with_names: bool) -> Vec<u8> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    if let (Some(first), true) = (lines.first(), with_names) {
        writer.write_record(first.names()).expect("writing to memory does not fail");
    }
    for line in lines {
        writer.write_record(line.texts()).expect("all lines have the same fields");
    }
    writer.into_inner().expect("writing to memory does not fail")
}

/// Writes a table as NAME.jsonl and NAME.csv, replacing existing files.
///
/// # Errors
/// If a file cannot be written.
pub(super) fn write(folder: &Path, name: &str, lines: &[TableRow]) -> Result<(), FileError> {
    let json: String = lines.iter().map(TableRow::json).collect();
    write_whole(&folder.join(format!("{name}.jsonl")), json.as_bytes())?;
    write_whole(&folder.join(format!("{name}.csv")), &csv(lines, true))
}

/// Appends a line to both files of a table, with one write per file.
///
/// # Errors
/// If a file cannot be written.
pub(super) fn append(folder: &Path, name: &str, line: &TableRow) -> Result<(), FileError> {
    let add = |extension: &str, bytes: &dyn Fn(bool) -> Vec<u8>| {
        let path = folder.join(format!("{name}.{extension}"));
        let fault = |error| FileError::new(&path, error);
        let mut file = OpenOptions::new().create(true).append(true).open(&path).map_err(fault)?;
        let is_new = file.metadata().map_err(fault)?.len() == 0;
        file.write_all(&bytes(is_new)).map_err(fault)
    };
    add("jsonl", &|_| line.json().into_bytes())?;
    add("csv", &|is_new| csv(std::slice::from_ref(line), is_new))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn line(x: f64) -> TableRow {
        let mut record = TableRow::default();
        record.push("name", "a, \"b\"");
        record.push("seed", 3_u64);
        record.push("x", x);
        record.push("ssim", None::<f64>);
        record
    }

    #[test]
    fn json_and_csv_hold_the_same_values() {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path(), "rows", &[line(0.1), line(f64::NAN)]).unwrap();
        let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
        let json = "{\"name\":\"a, \\\"b\\\"\",\"seed\":3,\"x\":0.1,\"ssim\":null}\n";
        assert_eq!(read("rows.jsonl"), json.to_owned() + &json.replace("0.1", "null"));
        assert_eq!(read("rows.csv"), "name,seed,x,ssim\n\"a, \"\"b\"\"\",3,0.1,\n\"a, \"\"b\"\"\",3,,\n");
        append(folder.path(), "rows", &line(1e-12)).unwrap();
        assert!(
            read("rows.jsonl").ends_with("\"x\":1e-12,\"ssim\":null}\n") && read("rows.csv").ends_with(",3,1e-12,\n")
        );
    }

    #[test]
    fn a_new_table_begins_with_column_names() {
        let folder = tempfile::tempdir().unwrap();
        append(folder.path(), "rows", &line(2.0)).unwrap();
        let text = fs::read_to_string(folder.path().join("rows.csv")).unwrap();
        assert_eq!(text, "name,seed,x,ssim\n\"a, \"\"b\"\"\",3,2.0,\n");
    }
}
