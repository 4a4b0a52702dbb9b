//! Columns of frames, handed over by Arrow's C stream interface: structs of pointers that any producer fills.

use crate::errors::refused;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyCapsule;
use std::ffi::{CStr, c_char, c_int, c_void};

/// A type: its format, its name, and the types of its columns.
#[repr(C)]
struct Schema {
    format: *const c_char,
    name: *const c_char,
    metadata: *const c_char,
    flags: i64,
    n_children: i64,
    children: *mut *mut Schema,
    dictionary: *mut Schema,
    release: Option<unsafe extern "C" fn(*mut Schema)>,
    private_data: *mut c_void,
}

/// Values of a type, in its buffers: validity as bits, then the values.
#[repr(C)]
struct Array {
    length: i64,
    null_count: i64,
    offset: i64,
    n_buffers: i64,
    n_children: i64,
    buffers: *mut *const c_void,
    children: *mut *mut Array,
    dictionary: *mut Array,
    release: Option<unsafe extern "C" fn(*mut Array)>,
    private_data: *mut c_void,
}

/// Arrays of one type, one after the other.
#[repr(C)]
struct Stream {
    get_schema: Option<unsafe extern "C" fn(*mut Stream, *mut Schema) -> c_int>,
    get_next: Option<unsafe extern "C" fn(*mut Stream, *mut Array) -> c_int>,
    get_last_error: Option<unsafe extern "C" fn(*mut Stream) -> *const c_char>,
    release: Option<unsafe extern "C" fn(*mut Stream)>,
    private_data: *mut c_void,
}

/// What producers fill and consumers let go of.
trait Filled {
    /// Lets go of what it holds.
    fn release(&mut self);
}

macro_rules! filled {
    ($($type:ident),*) => {
        $(impl Filled for $type {
            fn release(&mut self) {
                if let Some(release) = self.release {
                    // SAFETY: the producer's own function, called once: it takes itself out.
                    unsafe { release(self) };
                }
            }
        })*
    };
}

filled!(Schema, Array);

/// Something filled, which is let go of in the end.
struct Held<T: Filled>(T);

impl<T: Filled> Drop for Held<T> {
    fn drop(&mut self) {
        self.0.release();
    }
}

type Fill<T> = Option<unsafe extern "C" fn(*mut Stream, *mut T) -> c_int>;

/// What the stream fills in; its own words if it cannot.
///
/// # Safety
/// The stream must be one of Arrow's, and `fill` its function.
unsafe fn next<T: Filled>(stream: *mut Stream, fill: Fill<T>) -> Result<Held<T>, String> {
    let fill = fill.ok_or("a stream that was read before")?;
    // SAFETY: null pointers, zeros and no function are what consumers hand over to be filled; the rest is as the caller promises.
    unsafe {
        let mut held = Held(std::mem::zeroed::<T>());
        if fill(stream, &mut held.0) == 0 {
            return Ok(held);
        }
        let said = (*stream).get_last_error.map(|said| said(stream));
        let said = said.filter(|text| !text.is_null());
        Err(said.map_or("a stream that fails".to_owned(), |text| in_words(text)))
    }
}

/// # Safety
/// The text must be one of C, or null.
unsafe fn in_words(text: *const c_char) -> String {
    if text.is_null() {
        return String::new();
    }
    // SAFETY: as the caller promises.
    unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
}

/// How wide a value is in its buffer, and how it is read.
type Reader = (usize, fn(&[u8]) -> f64);

/// The reader of numbers of a format.
fn reader(format: &str) -> Option<Reader> {
    macro_rules! of {
        ($type:ty) => {
            (size_of::<$type>(), |bytes| {
                bytes
                    .try_into()
                    .map_or(f64::NAN, |bytes| <$type>::from_ne_bytes(bytes) as f64)
            })
        };
    }
    Some(match format {
        "c" => of!(i8),
        "C" => of!(u8),
        "s" => of!(i16),
        "S" => of!(u16),
        "i" => of!(i32),
        "I" => of!(u32),
        "l" => of!(i64),
        "L" => of!(u64),
        "f" => of!(f32),
        "g" => of!(f64),
        _ => return None,
    })
}

/// Appends `count` values from `from` on; a missing one is not a number.
///
/// # Safety
/// The array must hold as many values of a type that `reader` reads, or booleans.
unsafe fn append(array: &Array, from: usize, count: usize, format: &str, into: &mut Vec<f64>) {
    // SAFETY: a primitive array has two buffers, of which only the first may be null, and it holds what the caller says.
    unsafe {
        let validity = (*array.buffers).cast::<u8>();
        let values = (*array.buffers.add(1)).cast::<u8>();
        let bit = |bits: *const u8, at: usize| *bits.add(at / 8) >> (at % 8) & 1 == 1;
        for at in from..from + count {
            into.push(if !validity.is_null() && !bit(validity, at) {
                f64::NAN
            } else if let Some((width, read)) = reader(format) {
                read(std::slice::from_raw_parts(values.add(at * width), width))
            } else {
                f64::from(u8::from(bit(values, at)))
            });
        }
    }
}

/// A column: its name, its format, and its values if they are numbers.
struct Column {
    name: String,
    format: String,
    values: Option<Vec<f64>>,
}

/// All columns of a stream.
///
/// # Safety
/// The stream must be one of Arrow's.
unsafe fn read(stream: *mut Stream) -> Result<Vec<Column>, String> {
    // SAFETY: the producer promises what the interface says: a batch has as many children as its type, each with an array as
    // long as the batch beyond its offset. Both are held while they are read.
    unsafe {
        let schema = next(stream, (*stream).get_schema)?;
        if in_words(schema.0.format) != "+s" {
            return Err("a stream of one column without a name".to_owned());
        }
        let width = usize::try_from(schema.0.n_children).unwrap_or_default();
        let mut columns = Vec::with_capacity(width);
        for k in 0..width {
            let of = &**schema.0.children.add(k);
            let format = in_words(of.format);
            let numbers = of.dictionary.is_null() && (format == "b" || reader(&format).is_some());
            columns.push(Column {
                name: in_words(of.name),
                format,
                values: numbers.then(Vec::new),
            });
        }
        loop {
            let batch = next(stream, (*stream).get_next)?;
            if batch.0.release.is_none() {
                return Ok(columns);
            }
            let number = |n: i64| usize::try_from(n).unwrap_or_default();
            let count = number(batch.0.length);
            for (k, column) in columns.iter_mut().enumerate() {
                let array = &**batch.0.children.add(k);
                let from = number(batch.0.offset) + number(array.offset);
                if let Some(values) = column.values.as_mut().filter(|_| count > 0) {
                    append(array, from, count, &column.format, values);
                }
            }
        }
    }
}

/// The columns behind an Arrow C stream, in their order: names with arrays of shape (n,), or with the format of what is no number.
#[pyfunction]
pub fn arrow_columns<'py>(
    py: Python<'py>,
    capsule: &Bound<'py, PyCapsule>,
    frame: &str,
) -> PyResult<Vec<(String, Bound<'py, PyAny>)>> {
    let stream = capsule.pointer_checked(Some(c"arrow_array_stream"))?;
    // SAFETY: a capsule of this name holds such a stream, and lets go of it when it goes itself.
    let columns = unsafe { read(stream.as_ptr().cast()) };
    let columns = columns.map_err(|said| refused(py, frame, "frame", said, "a table with named columns"))?;
    let given = |column: Column| {
        let values = match column.values {
            Some(values) => PyArray1::from_vec(py, values).into_any(),
            None => column.format.into_pyobject(py)?.into_any(),
        };
        Ok((column.name, values))
    };
    columns.into_iter().map(given).collect()
}
