//! Readers of the data after the header, number by number, for each encoding.

use super::header::{Integer, Scalar, syntax};
use crate::shape::mesh::data::{MeshFault, quoted};

/// The reason why an element cannot be read.
pub(super) enum ReadError {
    /// The file ends early.
    End,
    /// The data is wrong.
    Mesh(MeshFault),
}

impl From<MeshFault> for ReadError {
    fn from(fault: MeshFault) -> Self {
        Self::Mesh(fault)
    }
}

/// A reader of the data after the header, number by number.
pub(super) trait DataReader {
    /// The least number of bytes of a number of this type.
    fn min_size(scalar: Scalar) -> usize;
    /// The number of bytes that are left.
    fn left(&self) -> usize;
    /// Reads the next number, of any type.
    fn real(&mut self, scalar: Scalar) -> Result<f32, ReadError>;
    /// Reads the next integer. Unsigned integers above `i64::MAX` are clamped to it.
    fn whole(&mut self, integer: Integer) -> Result<i64, ReadError>;
    /// Skips `times` numbers.
    fn skip(&mut self, scalar: Scalar, times: usize) -> Result<(), ReadError>;
    /// Checks that no data is left.
    fn finish(self) -> Result<(), MeshFault>;
}

pub(super) struct Binary<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) at: usize,
    /// Whether the most significant byte comes first.
    pub(super) swap: bool,
}

impl Binary<'_> {
    /// Reads the next bytes and returns the least significant one first.
    fn take<const N: usize>(&mut self) -> Result<[u8; N], ReadError> {
        let mut taken = *self.bytes[self.at..].first_chunk::<N>().ok_or(ReadError::End)?;
        self.at += N;
        if self.swap {
            taken.reverse();
        }
        Ok(taken)
    }
}

impl DataReader for Binary<'_> {
    fn min_size(scalar: Scalar) -> usize {
        scalar.size()
    }

    fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    fn real(&mut self, scalar: Scalar) -> Result<f32, ReadError> {
        Ok(match scalar {
            Scalar::F32 => f32::from_le_bytes(self.take()?),
            Scalar::F64 => f64::from_le_bytes(self.take()?) as f32,
            Scalar::Integer(integer) => self.whole(integer)? as f32,
        })
    }

    fn whole(&mut self, integer: Integer) -> Result<i64, ReadError> {
        Ok(match integer {
            Integer::I8 => i64::from(i8::from_le_bytes(self.take()?)),
            Integer::U8 => i64::from(u8::from_le_bytes(self.take()?)),
            Integer::I16 => i64::from(i16::from_le_bytes(self.take()?)),
            Integer::U16 => i64::from(u16::from_le_bytes(self.take()?)),
            Integer::I32 => i64::from(i32::from_le_bytes(self.take()?)),
            Integer::U32 => i64::from(u32::from_le_bytes(self.take()?)),
            Integer::I64 => i64::from_le_bytes(self.take()?),
            Integer::U64 => i64::try_from(u64::from_le_bytes(self.take()?)).unwrap_or(i64::MAX),
        })
    }

    fn skip(&mut self, scalar: Scalar, times: usize) -> Result<(), ReadError> {
        // A list is skipped only if the file has room for it, so that the product does not overflow.
        let size = scalar.size() * times;
        if size > self.left() {
            return Err(ReadError::End);
        }
        self.at += size;
        Ok(())
    }

    fn finish(self) -> Result<(), MeshFault> {
        if self.left() == 0 {
            return Ok(());
        }
        Err(MeshFault::Trailing { end: self.at, size: self.bytes.len() })
    }
}

pub(super) struct Ascii<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) at: usize,
}

impl<'a> Ascii<'a> {
    fn word(&mut self) -> Result<&'a [u8], ReadError> {
        let rest = &self.bytes[self.at..];
        let start = rest.iter().position(|byte| !byte.is_ascii_whitespace()).ok_or(ReadError::End)?;
        let length = rest[start..].iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len() - start);
        self.at += start + length;
        Ok(&rest[start..start + length])
    }

    /// A fault in the word that was just read, with its line.
    fn fault(&self, word: &[u8], what: &str) -> MeshFault {
        let line = 1 + self.bytes[..self.at].iter().filter(|&&byte| byte == b'\n').count();
        syntax(line, &format!("{} {what}", quoted(word)))
    }

    /// Reads the next word as a number.
    fn number<T: std::str::FromStr>(&mut self, what: &str) -> Result<T, ReadError> {
        let word = self.word()?;
        let number = std::str::from_utf8(word).ok().and_then(|text| text.parse().ok());
        number.ok_or_else(|| self.fault(word, what).into())
    }
}

impl DataReader for Ascii<'_> {
    /// A blank and a digit. The first number after the header has no blank before it, but this makes no difference:
    /// `check_room` takes lists as empty, and every valid mesh has a list that is not empty.
    fn min_size(_: Scalar) -> usize {
        2
    }

    fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    fn real(&mut self, scalar: Scalar) -> Result<f32, ReadError> {
        match scalar {
            Scalar::F32 => self.number("is not a number"),
            // Rounded twice, as in the binary encodings.
            Scalar::F64 => Ok(self.number::<f64>("is not a number")? as f32),
            Scalar::Integer(integer) => Ok(self.whole(integer)? as f32),
        }
    }

    fn whole(&mut self, integer: Integer) -> Result<i64, ReadError> {
        match integer {
            Integer::I8 => Ok(i64::from(self.number::<i8>("is not an integer from -128 to 127")?)),
            Integer::U8 => Ok(i64::from(self.number::<u8>("is not an integer from 0 to 255")?)),
            Integer::I16 => Ok(i64::from(self.number::<i16>("is not an integer of 16 bits")?)),
            Integer::U16 => Ok(i64::from(self.number::<u16>("is not an integer of 16 bits from 0")?)),
            Integer::I32 => Ok(i64::from(self.number::<i32>("is not an integer of 32 bits")?)),
            Integer::U32 => Ok(i64::from(self.number::<u32>("is not an integer of 32 bits from 0")?)),
            Integer::I64 => self.number("is not an integer of 64 bits"),
            Integer::U64 => {
                Ok(i64::try_from(self.number::<u64>("is not an integer of 64 bits from 0")?).unwrap_or(i64::MAX))
            }
        }
    }

    fn skip(&mut self, _: Scalar, times: usize) -> Result<(), ReadError> {
        (0..times).try_for_each(|_| self.word().map(drop))
    }

    fn finish(mut self) -> Result<(), MeshFault> {
        match self.word() {
            Ok(word) => Err(self.fault(word, "follows the last element that the header declares")),
            Err(_) => Ok(()),
        }
    }
}
