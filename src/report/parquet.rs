//! Tables as Apache Parquet, for those who read them with data frames.

use super::table::{Cells, Column, Table};
use crate::error::Result;
use crate::files::write_whole_by;
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use std::fs::File;
use std::io;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

/// Most rows of a row group. A group is encoded as a whole before it is written: of a long table only one stands in memory besides.
const ROWS_OF_A_GROUP: usize = 4096;

impl Table<'_> {
    /// Writes a Parquet file, whole or not at all: numbers as nullable doubles, null where not a number, texts as UTF-8, in row
    /// groups of 4,096 rows that go to the disk one by one. Columns have one length.
    ///
    /// # Errors
    /// [`crate::Error::Io`] if it cannot be written.
    pub fn write_parquet(&self, path: impl AsRef<Path>) -> Result<()> {
        let rows = self.columns.first().map_or(0, Column::len);
        write_whole_by(path, |file| {
            let write = || {
                let schema = Arc::new(schema_of(self)?);
                // The library's own name and version would make files of one sweep differ from build to build.
                let properties = WriterProperties::builder()
                    .set_created_by("lapswarm".to_owned())
                    .build();
                let mut writer = SerializedFileWriter::new(file, schema, Arc::new(properties))?;
                for from in (0..rows).step_by(ROWS_OF_A_GROUP) {
                    write_row_group(&mut writer, self, from..rows.min(from + ROWS_OF_A_GROUP))?;
                }
                writer.close().map(drop)
            };
            write().map_err(|error| match error {
                ParquetError::External(source) => match source.downcast::<io::Error>() {
                    Ok(source) => *source,
                    Err(other) => io::Error::other(other),
                },
                other => io::Error::other(other),
            })
        })
    }
}

fn schema_of(table: &Table<'_>) -> std::result::Result<Type, ParquetError> {
    let fields = table
        .columns
        .iter()
        .map(|column| {
            let field = match column.cells {
                Cells::Texts(_) => Type::primitive_type_builder(&column.name, Physical::BYTE_ARRAY)
                    .with_repetition(Repetition::REQUIRED)
                    .with_logical_type(Some(LogicalType::String)),
                Cells::Numbers(_) => Type::primitive_type_builder(&column.name, Physical::DOUBLE)
                    .with_repetition(Repetition::OPTIONAL),
            };
            field.build().map(Arc::new)
        })
        .collect::<std::result::Result<Vec<_>, _>>()?;
    Type::group_type_builder("table").with_fields(fields).build()
}

fn write_row_group(
    writer: &mut SerializedFileWriter<&mut File>,
    table: &Table<'_>,
    rows: Range<usize>,
) -> std::result::Result<(), ParquetError> {
    let mut group = writer.next_row_group()?;
    for column in &table.columns {
        let Some(mut next) = group.next_column()? else {
            break;
        };
        match &column.cells {
            Cells::Texts(texts) => {
                let texts: Vec<ByteArray> = texts[rows.clone()].iter().map(|t| t.as_str().into()).collect();
                next.typed::<ByteArrayType>().write_batch(&texts, None, None)?;
            }
            Cells::Numbers(numbers) => {
                let numbers = &numbers[rows.clone()];
                let defined: Vec<i16> = numbers.iter().map(|x| i16::from(!x.is_nan())).collect();
                let there: Vec<f64> = numbers.iter().copied().filter(|x| !x.is_nan()).collect();
                next.typed::<DoubleType>()
                    .write_batch(&there, Some(&defined), None)?;
            }
        }
        next.close()?;
    }
    group.close().map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;

    #[test]
    fn a_table_comes_back_as_it_was_with_nulls_for_what_is_not_a_number() {
        let names = ["a \"b\"".to_owned(), "ö, c".to_owned(), String::new()];
        let numbers = [0.1, f64::NAN, f64::NEG_INFINITY];
        let table = Table::new()
            .texts("name", &names)
            .numbers("lap time (s)", "", &numbers[..]);
        let file = tempfile::NamedTempFile::new().expect("a temporary file");
        table.write_parquet(file.path()).expect("it is written");
        let bytes = std::fs::read(file.path()).expect("the file");
        table.write_parquet(file.path()).expect("it is written again");
        let again = std::fs::read(file.path()).expect("the file");
        assert_eq!(bytes, again, "the same bytes each time");
        let file = std::fs::File::open(file.path()).expect("the file");
        let reader = SerializedFileReader::new(file).expect("a parquet file");
        let rows: Vec<_> = reader
            .get_row_iter(None)
            .expect("rows")
            .map(|r| r.expect("a row"))
            .collect();
        assert_eq!(rows.len(), 3);
        for (k, row) in rows.iter().enumerate() {
            assert_eq!(row.get_string(0).expect("a text"), &names[k]);
            assert_eq!(row.get_double(1).ok(), Some(numbers[k]).filter(|x| !x.is_nan()));
        }
    }

    #[test]
    fn a_long_table_is_written_a_row_group_at_a_time() {
        let numbers: Vec<f64> = (0..2 * ROWS_OF_A_GROUP + 7).map(|k| k as f64).collect();
        let names: Vec<String> = numbers.iter().map(|x| format!("run {x}")).collect();
        let table = Table::new().texts("name", &names).numbers("x", "", &numbers);
        let file = tempfile::NamedTempFile::new().expect("a temporary file");
        table.write_parquet(file.path()).expect("it is written");
        let reader =
            SerializedFileReader::new(File::open(file.path()).expect("the file")).expect("a parquet file");
        let groups = reader.metadata().row_groups();
        let counts: Vec<i64> = groups.iter().map(|group| group.num_rows()).collect();
        assert_eq!(counts, [4096, 4096, 7]);
        for (k, row) in reader.get_row_iter(None).expect("rows").enumerate() {
            let row = row.expect("a row");
            assert_eq!(row.get_string(0).expect("a text"), &names[k]);
            assert_eq!(row.get_double(1).expect("a number"), numbers[k]);
        }
    }
}
