//! Tables as Apache Parquet, for those who read them with data frames.

use super::table::{Cells, Table};
use super::write_whole;
use crate::error::{Error, Result};
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use std::path::Path;
use std::sync::Arc;

impl Table<'_> {
    /// Writes a Parquet file, whole or not at all: numbers as nullable doubles, null where not a number, texts as UTF-8.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be written.
    pub fn write_parquet(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        let failed = |e: ParquetError| Error::io(path, "write", std::io::Error::other(e.to_string()));
        write_whole(path, &bytes_of(self).map_err(failed)?)
    }
}

fn bytes_of(table: &Table<'_>) -> std::result::Result<Vec<u8>, ParquetError> {
    let columns = &table.columns;
    let fields = columns
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
    let schema = Type::group_type_builder("table").with_fields(fields).build()?;
    // The library's own name and version would make files of one sweep differ from build to build.
    let properties = WriterProperties::builder()
        .set_created_by("lapswarm".to_owned())
        .build();
    let mut bytes = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut bytes, Arc::new(schema), Arc::new(properties))?;
    let mut rows = writer.next_row_group()?;
    for column in columns {
        let Some(mut next) = rows.next_column()? else {
            break;
        };
        match &column.cells {
            Cells::Texts(texts) => {
                let texts: Vec<ByteArray> = texts.iter().map(|t| t.as_str().into()).collect();
                next.typed::<ByteArrayType>().write_batch(&texts, None, None)?;
            }
            Cells::Numbers(numbers) => {
                let defined: Vec<i16> = numbers.iter().map(|x| i16::from(!x.is_nan())).collect();
                let there: Vec<f64> = numbers.iter().copied().filter(|x| !x.is_nan()).collect();
                next.typed::<DoubleType>()
                    .write_batch(&there, Some(&defined), None)?;
            }
        }
        next.close()?;
    }
    rows.close()?;
    writer.close()?;
    Ok(bytes)
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
        let bytes = bytes_of(&table).expect("a table");
        assert_eq!(
            bytes,
            bytes_of(&table).expect("a table"),
            "the same bytes each time"
        );
        let file = tempfile::NamedTempFile::new().expect("a temporary file");
        table.write_parquet(file.path()).expect("it is written");
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
}
