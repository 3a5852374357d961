//! `parquet`: tables of runs and studies in columns, for programs that read them so (pandas, polars, DuckDB,
//! MATLAB).
//!
//! Source: Apache Parquet format 2.10. Each table is a file of its own with the table's names of columns;
//! what a cell leaves empty is null. A column is of integers, of numbers, of truth values or of text, by all
//! its rows; the printed digits of a number are the ones that its bits had, so nothing is rounded. Rows are
//! read twice and written in groups, so memory does not grow with the table. Limits: a column without any
//! value is one of numbers, whatever it has elsewhere; integers have 64 bits.

use std::fs::{self, File};
use std::io::{Cursor, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use csv::{ByteRecord, Reader};
use parquet::basic::{Compression, ConvertedType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;

use crate::cli::args;
use crate::cli::error::CliError;
use crate::cli::scenario;
use crate::cli::staging::Staging;

/// Rows that are in memory at a time.
const ROWS: usize = 1 << 16;
/// Directories of a study that hold no tables of results.
const OTHERS: [&str; 2] = ["shards", "inputs"];

/// Writes the tables that are named, and those in directories that are, beside themselves.
pub fn execute(arguments: &args::Parquet) -> Result<(), CliError> {
    let mut tables = Vec::new();
    for path in &arguments.paths {
        let about = fs::metadata(path).map_err(|error| CliError::read(path.display(), &error))?;
        let before = tables.len();
        if about.is_dir() {
            collect(path, &mut tables)?;
        } else {
            tables.push(path.clone());
        }
        if tables.len() == before {
            return Err(CliError::input(format!("{}: expected tables (.csv) in it", path.display())));
        }
    }
    let mut report = String::new();
    for table in &tables {
        let target = table.with_extension("parquet");
        if target == *table {
            return Err(CliError::usage(format!("{}: expected a table, a .csv", table.display())));
        }
        let rows = write_file(table, &target)?;
        report.push_str(&format!("{} ({rows} rows)\n", target.display()));
    }
    scenario::print(&report)
}

/// Tables of a directory and of those in it, by name.
fn collect(directory: &Path, tables: &mut Vec<PathBuf>) -> Result<(), CliError> {
    let error = |error: std::io::Error| CliError::read(directory.display(), &error);
    let entries = fs::read_dir(directory).map_err(error)?.collect::<Result<Vec<_>, _>>().map_err(error)?;
    let mut paths: Vec<PathBuf> = entries.into_iter().map(|entry| entry.path()).collect();
    paths.sort();
    for path in paths {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if name.starts_with('.') || OTHERS.contains(&name.as_str()) {
            continue;
        }
        if path.is_dir() {
            collect(&path, tables)?;
        } else if path.extension().is_some_and(|extension| extension == "csv") {
            tables.push(path);
        }
    }
    Ok(())
}

fn write_file(table: &Path, target: &Path) -> Result<usize, CliError> {
    write(&table.display().to_string(), || File::open(table), target)
}

/// Writes a table that is in memory.
pub fn write_bytes(bytes: &[u8], target: &Path) -> Result<usize, CliError> {
    write(&target.display().to_string(), || Ok(Cursor::new(bytes)), target)
}

/// Writes what can be opened twice.
fn write<R: Read>(name: &str, open: impl Fn() -> std::io::Result<R>, target: &Path) -> Result<usize, CliError> {
    let reader = || open().map(Reader::from_reader).map_err(|error| CliError::read(name, &error));
    let columns = columns(name, &mut reader()?)?;
    let staging = Staging::file(target)?;
    let error = |error: ParquetError| failed(target, error);
    let fields: Result<Vec<_>, ParquetError> = columns.iter().map(Column::field).collect();
    let schema = Type::group_type_builder("table").with_fields(fields.map_err(error)?).build().map_err(error)?;
    let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
    let file = staging.handle().map_err(|error| CliError::output(target.display(), &error))?;
    let mut file = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties)).map_err(error)?;
    let mut reader = reader()?;
    let (mut group, mut count) = (Vec::new(), 0);
    for record in reader.byte_records() {
        group.push(record.map_err(|error| malformed(name, &error))?);
        if group.len() == ROWS {
            count += write_group(&mut file, &columns, &mut group).map_err(error)?;
        }
    }
    count += write_group(&mut file, &columns, &mut group).map_err(error)?;
    file.close().map_err(error)?;
    staging.commit()?;
    Ok(count)
}

/// Writes these rows, if there are any, and forgets them.
fn write_group(
    file: &mut SerializedFileWriter<File>,
    columns: &[Column],
    rows: &mut Vec<ByteRecord>,
) -> Result<usize, ParquetError> {
    let count = rows.len();
    if count > 0 {
        let mut group = file.next_row_group()?;
        for (place, column) in columns.iter().enumerate() {
            let cells = rows.iter().map(|row| row.get(place).unwrap_or_default());
            column.write(cells, &mut group)?;
        }
        group.close()?;
    }
    rows.clear();
    Ok(count)
}

/// Type of a column: the first one that fits all its cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Empty,
    Truth,
    Integer,
    Number,
    Text,
}

impl Kind {
    /// Type of a column of this type after one more cell.
    fn with(self, cell: &[u8]) -> Self {
        let own = match cell {
            [] => return self,
            _ if parse::<bool>(cell).is_some() => Self::Truth,
            _ if parse::<i64>(cell).is_some() => Self::Integer,
            _ if parse::<f64>(cell).is_some() => Self::Number,
            _ => Self::Text,
        };
        match (self, own) {
            (Self::Empty, own) => own,
            (before, own) if before == own => own,
            (Self::Integer | Self::Number, Self::Integer | Self::Number) => Self::Number,
            _ => Self::Text,
        }
    }
}

struct Column {
    name: String,
    kind: Kind,
}

/// The columns of a table, by all its rows.
fn columns<R: Read>(name: &str, reader: &mut Reader<R>) -> Result<Vec<Column>, CliError> {
    let header = reader.headers().map_err(|error| malformed(name, &error))?;
    let column = |name: &str| Column { name: name.to_owned(), kind: Kind::Empty };
    let mut columns: Vec<Column> = header.iter().map(column).collect();
    let mut row = ByteRecord::new();
    while reader.read_byte_record(&mut row).map_err(|error| malformed(name, &error))? {
        for (column, cell) in columns.iter_mut().zip(&row) {
            column.kind = column.kind.with(cell);
        }
    }
    Ok(columns)
}

impl Column {
    fn field(&self) -> Result<Arc<Type>, ParquetError> {
        let (physical, converted) = match self.kind {
            Kind::Truth => (Physical::BOOLEAN, ConvertedType::NONE),
            Kind::Integer => (Physical::INT64, ConvertedType::NONE),
            Kind::Number | Kind::Empty => (Physical::DOUBLE, ConvertedType::NONE),
            Kind::Text => (Physical::BYTE_ARRAY, ConvertedType::UTF8),
        };
        let field = Type::primitive_type_builder(&self.name, physical)
            .with_repetition(Repetition::OPTIONAL)
            .with_converted_type(converted);
        field.build().map(Arc::new)
    }

    fn write<'a>(
        &self,
        cells: impl Iterator<Item = &'a [u8]>,
        group: &mut SerializedRowGroupWriter<'_, File>,
    ) -> Result<(), ParquetError> {
        match self.kind {
            Kind::Truth => write_column::<BoolType>(cells, parse, group),
            Kind::Integer => write_column::<Int64Type>(cells, parse, group),
            Kind::Number | Kind::Empty => write_column::<DoubleType>(cells, parse, group),
            Kind::Text => write_column::<ByteArrayType>(cells, |cell| Some(ByteArray::from(cell.to_vec())), group),
        }
    }
}

/// Values where cells have some, and for each cell whether it has.
fn write_column<'a, T: DataType>(
    cells: impl Iterator<Item = &'a [u8]>,
    value: impl Fn(&[u8]) -> Option<T::T>,
    group: &mut SerializedRowGroupWriter<'_, File>,
) -> Result<(), ParquetError> {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    for cell in cells {
        let own = if cell.is_empty() { None } else { value(cell) };
        levels.push(i16::from(own.is_some()));
        values.extend(own);
    }
    if let Some(mut column) = group.next_column()? {
        column.typed::<T>().write_batch(&values, Some(&levels), None)?;
        column.close()?;
    }
    Ok(())
}

fn parse<T: std::str::FromStr>(cell: &[u8]) -> Option<T> {
    std::str::from_utf8(cell).ok()?.parse().ok()
}

fn malformed(name: &str, error: &csv::Error) -> CliError {
    CliError::input(format!("{name}: {error}: expected a table with as many cells in each row as in the first"))
}

fn failed(target: &Path, error: ParquetError) -> CliError {
    let io = match error {
        ParquetError::External(inner) => match inner.downcast::<std::io::Error>() {
            Ok(io) => *io,
            Err(other) => std::io::Error::other(other),
        },
        other => std::io::Error::other(other),
    };
    CliError::output(target.display(), &io)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::parquet::file::reader::SerializedFileReader;

    #[test]
    fn a_column_is_the_narrowest_that_holds_all_its_cells() {
        let kind = |cells: &[&str]| cells.iter().fold(Kind::Empty, |kind, cell| kind.with(cell.as_bytes()));
        for (cells, expected) in [
            (&["", ""][..], Kind::Empty),
            (&["true", "", "false"], Kind::Truth),
            (&["3", "-9223372036854775808"], Kind::Integer),
            (&["3", "0.5"], Kind::Number),
            (&["NaN", "inf", "1e-300"], Kind::Number),
            (&["9223372036854775808"], Kind::Number),
            (&["true", "1"], Kind::Text),
            (&["G07", "4"], Kind::Text),
        ] {
            assert_eq!(kind(cells), expected, "{cells:?}");
        }
    }

    #[test]
    fn what_is_written_is_read_back_with_its_types_and_its_gaps() {
        let directory = tempfile::tempdir().unwrap();
        let table = directory.path().join("a.csv");
        fs::write(&table, "time_s,sv,lock,count\n0.1,G07,true,3\n,\"a,b\",,-4\n").unwrap();
        execute(&args::Parquet { paths: vec![directory.path().to_owned()] }).unwrap();
        let file = SerializedFileReader::new(File::open(directory.path().join("a.parquet")).unwrap()).unwrap();
        let rows: Vec<String> = file.into_iter().map(|row| row.unwrap().to_string()).collect();
        assert_eq!(
            rows,
            ["{time_s: 0.1, sv: \"G07\", lock: true, count: 3}", "{time_s: null, sv: \"a,b\", lock: null, count: -4}",]
        );
    }

    #[test]
    fn what_is_no_table_is_refused_and_leaves_nothing() {
        let directory = tempfile::tempdir().unwrap();
        let refused = |paths: Vec<PathBuf>| format!("{:?}", execute(&args::Parquet { paths }).unwrap_err());
        assert!(refused(vec![directory.path().to_owned()]).contains("expected tables (.csv) in it"));
        let table = directory.path().join("a.csv");
        fs::write(&table, "a,b\n1,2\n3\n").unwrap();
        assert!(refused(vec![table]).contains("expected a table with as many cells in each row"));
        assert!(refused(vec![directory.path().join("b.parquet")]).contains("b.parquet"));
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
    }
}
