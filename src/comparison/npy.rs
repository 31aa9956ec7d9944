//! A reader for `NumPy` array files with 32-bit floats in C order.

/// An array of floats.
#[derive(Debug, PartialEq)]
pub(super) struct Array {
    /// The length of each dimension.
    pub(super) shape: Vec<usize>,
    /// All elements; the last index varies fastest.
    pub(super) values: Vec<f32>,
}

/// Reads an array from the bytes of its file.
pub(super) fn read(bytes: &[u8]) -> Result<Array, String> {
    let (header, data) = split(bytes).ok_or("is not a NumPy array file")?;
    for wanted in ["'descr': '<f4'", "'fortran_order': False"] {
        if !header.contains(wanted) {
            return Err(format!("its header lacks {wanted}: {}", header.trim_end()));
        }
    }
    let shape = shape(header).ok_or_else(|| format!("its header has no shape: {}", header.trim_end()))?;
    let size = shape.iter().try_fold(size_of::<f32>(), |size, length| size.checked_mul(*length));
    if size != Some(data.len()) {
        return Err(format!("has {} bytes of data, which do not match the shape {shape:?}", data.len()));
    }
    Ok(Array { shape, values: data.as_chunks().0.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect() })
}

/// Splits the file into its header, a Python dictionary, and its data. `numpy.lib.format` describes the versions 1 to
/// 3.
fn split(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let ([version, _], rest) = bytes.strip_prefix(b"\x93NUMPY")?.split_first_chunk()?;
    let (length, rest) = if *version == 1 {
        let (length, rest) = rest.split_first_chunk()?;
        (u16::from_le_bytes(*length).into(), rest)
    } else {
        let (length, rest) = rest.split_first_chunk()?;
        (u32::from_le_bytes(*length), rest)
    };
    let (header, data) = rest.split_at_checked(length as usize)?;
    Some((str::from_utf8(header).ok()?, data))
}

fn shape(header: &str) -> Option<Vec<usize>> {
    let (lengths, _) = header.split_once("'shape': (")?.1.split_once(')')?;
    lengths.split(',').map(str::trim).filter(|length| !length.is_empty()).map(|length| length.parse().ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes as `numpy.save` of numpy 2.4 writes them, except for the padding.
    fn file(version: u8, header: &str, values: &[f32]) -> Vec<u8> {
        let mut bytes = [b"\x93NUMPY".as_slice(), &[version, 0]].concat();
        match version {
            1 => bytes.extend((header.len() as u16).to_le_bytes()),
            _ => bytes.extend((header.len() as u32).to_le_bytes()),
        }
        bytes.extend(header.as_bytes());
        bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        bytes
    }

    #[test]
    fn reads_each_version_and_shape() {
        for version in [1, 2, 3] {
            for (written, shape) in [("(2, 3)", vec![2, 3]), ("(6,)", vec![6]), ("(1, 2, 3, 1)", vec![1, 2, 3, 1])] {
                let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {written}, }}   \n");
                let values: Vec<f32> = (0..6).map(|i| i as f32 / 7.0).collect();
                assert_eq!(read(&file(version, &header, &values)), Ok(Array { shape, values }));
            }
        }
        let scalar = file(1, "{'descr': '<f4', 'fortran_order': False, 'shape': (), }\n", &[0.5]);
        assert_eq!(read(&scalar), Ok(Array { shape: Vec::new(), values: vec![0.5] }));
    }

    #[test]
    fn rejects_files_that_are_not_float_arrays() {
        let fault = |bytes: &[u8]| read(bytes).expect_err("not a float array");
        let good = file(1, "{'descr': '<f4', 'fortran_order': False, 'shape': (2,), }\n", &[1.0, 2.0]);
        for length in [0, 5, 8, 9, 10, 40] {
            assert_eq!(fault(&good[..length]), "is not a NumPy array file", "{length}");
        }
        assert!(fault(&good[..good.len() - 1]).starts_with("has 7 bytes of data"));
        for (header, expected) in [
            ("{'descr': '<f8', 'fortran_order': False, 'shape': (2,), }", "its header lacks 'descr': '<f4'"),
            ("{'descr': '<f4', 'fortran_order': True, 'shape': (2,), }", "its header lacks 'fortran_order': False"),
            ("{'descr': '<f4', 'fortran_order': False, }", "its header has no shape"),
            ("{'descr': '<f4', 'fortran_order': False, 'shape': (-2,), }", "its header has no shape"),
            (
                "{'descr': '<f4', 'fortran_order': False, 'shape': (99999999999999999999, 9), }",
                "its header has no shape",
            ),
            (
                "{'descr': '<f4', 'fortran_order': False, 'shape': (999999999999, 999999999999), }",
                "has 8 bytes of data",
            ),
        ] {
            let fault = fault(&file(1, header, &[1.0, 2.0]));
            assert!(fault.starts_with(expected), "{fault}");
        }
    }
}
